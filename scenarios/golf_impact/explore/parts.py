"""What all components share: the scripts and styles beside this file, and what goes with them."""

from pathlib import Path
from typing import Any

from bokeh.models import CustomJS
from bokeh.themes import Theme

_HERE = Path(__file__).parent

#: The page's layout: a template, in which `roots` are the document's.
LAYOUT = (_HERE / "page.html").read_text("utf-8")

#: How figures look.
THEME = Theme(filename=str(_HERE / "figures.yaml"))

#: Options of a component in the page's style, and of one that is as wide as its place.
STYLED: dict[str, Any] = {"stylesheets": [(_HERE / "shadow.css").read_text("utf-8")]}
WIDE: dict[str, Any] = {**STYLED, "sizing_mode": "stretch_width"}


def aria(label: str, **more: str) -> dict[str, Any]:
    """The option that gives a component its name for screen readers, and perhaps its role."""
    return {"html_attributes": {"aria-label": label, **more}}


def script(name: str, **models: Any) -> CustomJS:
    """One of the scripts, with the models that it uses by their names there."""
    return CustomJS(args=models, code=(_HERE / f"{name}.js").read_text("utf-8"))
