"""What isn't Python: the scripts and the style beside this file."""

from pathlib import Path
from typing import Any

from bokeh.models import CustomJS

_HERE = Path(__file__).parent

#: The style inside Bokeh's components.
STYLE = (_HERE / "shadow.css").read_text("utf-8")

#: The page's layout: a template, in which `roots` are the document's.
LAYOUT = (_HERE / "page.html").read_text("utf-8")


def script(name: str, **models: Any) -> CustomJS:
    """One of the scripts, with the models that it uses by their names there."""
    return CustomJS(args=models, code=(_HERE / f"{name}.js").read_text("utf-8"))
