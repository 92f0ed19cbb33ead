"""The page as files for any web server: a standalone Bokeh document and the page's own script."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2
from bokeh.embed import components
from bokeh.util.paths import bokehjs_path

from golf_impact.errors import UserError
from golf_impact.explore.answers import Answers
from golf_impact.explore.cases import facts_of
from golf_impact.explore.pictures import THEME, Pictures
from golf_impact.fmu.impact_fmu import ImpactFmu

_HERE = Path(__file__).parent


def page_files(fmu: ImpactFmu, worker: Mapping[str, Any] | None = None) -> dict[str, bytes]:
    """Files of the page by name.

    Args:
        fmu: an instance in use, whose numbers are in the pictures when the page opens.
        worker: what an exported page gives its worker; None where numbers come by POST /impact.
    """
    facts = facts_of(fmu)
    opening = Answers(fmu, UserError, facts)({"values": facts["opening"]})
    carried = {**facts, "answer": opening, "worker": worker}
    script, figures = components(Pictures(opening["path"]).figures, wrap_script=False, theme=THEME)
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    template = environment.from_string((_HERE / "page.html").read_text("utf-8"))
    # Nothing in a script element may end it.
    data = json.dumps(carried, allow_nan=False).replace("<", "\\u003c")
    page = template.render(facts=facts, data=data, script=script, figures=figures)
    own = ("page.js", "page.css") if worker is None else ("page.js", "page.css", "worker.js")
    return {
        "index.html": page.encode(),
        **{name: (_HERE / name).read_bytes() for name in own},
        "bokeh.min.js": Path(bokehjs_path(), "js", "bokeh.min.js").read_bytes(),
    }
