"""The page as files for any web server: a standalone Bokeh document and the page's own script."""

import json
from pathlib import Path

import jinja2
from bokeh.embed import components
from bokeh.util.paths import bokehjs_path

from golf_impact.explore.evaluator import Evaluator
from golf_impact.explore.pictures import THEME, Pictures


def page_files(evaluator: Evaluator, exported: bool = False) -> dict[str, bytes]:
    """Files of the page by name.

    Args:
        evaluator: computes the numbers that are in the pictures when the page opens.
        exported: numbers come from worker.js, instead of POST /impact.
    """
    facts = evaluator.facts
    opening = evaluator({"values": facts["opening"]})
    carried = {**facts, "result": opening, "exported": exported}
    script, figures = components(Pictures(opening).figures, wrap_script=False, theme=THEME)
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    page, worksheet = (
        environment.from_string(Path(__file__).with_name(name).read_text("utf-8"))
        for name in ("page.html", "worksheet.html")
    )
    # Nothing in a script element may end it.
    data = json.dumps(carried, allow_nan=False).replace("<", "\\u003c")
    shown = page.render(facts=facts, data=data, script=script, figures=figures)
    return {
        "index.html": shown.encode(),
        "worksheet.html": worksheet.render(facts=facts).encode(),
        **{
            name: Path(__file__).with_name(name).read_bytes()
            for name in ("page.js", "page.css", "worker.js")
        },
        "bokeh.min.js": Path(bokehjs_path(), "js", "bokeh.min.js").read_bytes(),
    }
