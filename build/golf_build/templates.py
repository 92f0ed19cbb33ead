"""Files made of jinja templates: descriptions, documentation, systems, reports."""

from functools import cache
from pathlib import Path
from typing import Any


@cache
def _environment(folder: Path) -> Any:
    """Jinja's, which keeps templates compiled."""
    import jinja2

    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def render(template: Path, **values: Any) -> bytes:
    """Render a jinja template (UTF-8)."""
    text: str = _environment(template.parent).get_template(template.name).render(values)
    return text.encode()
