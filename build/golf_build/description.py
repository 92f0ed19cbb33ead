"""modelDescription.xml, and what is made of other templates."""

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


def model_description(context: dict[str, Any]) -> bytes:
    """The model description from a builder's context with token, tool and sources."""
    # In FMI 2.0 an index is the position from 1 on, not the value reference.
    places = enumerate(context["rows"], 1)
    known = {row.name: n if context["fmi"] == 2 else row.reference for n, row in places}
    listed = {
        name: " ".join(str(known[other]) for other in others if other in known)
        for name, others in context.get("dependencies", {}).items()
    }
    template = Path(__file__).with_name("modelDescription.xml.jinja")
    description = render(template, **context | {"known": known, "dependencies": listed})
    # All attributes are in double quotes, so apostrophes need no escape.
    return description.replace(b"&#39;", b"'")
