"""modelDescription.xml, from tables of variables.

The files of pythonfmu 0.7.0 and pythonfmu3 0.3.4 lack units, ranges, initial unknowns and
derivatives that are also states, and have 16 digits of a start value.
"""

import importlib.metadata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from golf_physics import __version__
from golf_physics.variables import Variable

from golf_build.archive import EPOCH_TEXT

HERE = Path(__file__).resolve().parent

#: The packages that make FMUs, by version of FMI; the FMU contains their runtime.
RUNTIMES = {2: "pythonfmu", 3: "pythonfmu3"}

_ELEMENTS = {
    2: {"Real": "Real", "Enumeration": "Integer", "Boolean": "Boolean"},
    3: {"Real": "Float64", "Enumeration": "Enumeration", "Boolean": "Boolean"},
}


def render(template: Path, **values: Any) -> bytes:
    """Render a jinja template (UTF-8)."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template.name).render(values).encode()


def write_description(
    fmi: int, rows: Sequence[Variable], derivatives: Mapping[str, str] | None = None, **more: Any
) -> bytes:
    """Write modelDescription.xml, in UTF-8.

    Args:
        fmi: version of FMI, 2 or 3.
        rows: the variables; the value reference of each is its index.
        derivatives: names of derivatives by the names of their states.
        more: `name` of the model, `token` (the GUID), `description`, and `units` by name; `laws` of
            ClubBallImpact; `constant` (outputs whose initial values depend on no variable); in FMI
            3.0 `unsolved` (outputs that are NaN in Model Exchange) and `structure` (names of
            variables by the elements of ModelStructure).
    """
    runtime, references = RUNTIMES[fmi], {row.name: n for n, row in enumerate(rows)}
    variables = []
    for row in rows:
        state = (derivatives or {}).get(row.name)
        own = _of_type(row) | {"derivative": references[state] if state else None}
        variables.append((row, _ELEMENTS[fmi][row.type], own))
    text = render(
        HERE / "modelDescription.xml.jinja",
        fmi=fmi,
        variables=variables,
        references=references,
        tool=f"{runtime.replace('pythonfmu', 'PythonFMU')} {importlib.metadata.version(runtime)}",
        time=EPOCH_TEXT,
        version=__version__,
        author="The golf-impact developers",
        **more,
    )
    # All attributes are in double quotes, so apostrophes need no escape.
    return text.replace(b"&#39;", b"'")


def _of_type(row: Variable) -> dict[str, Any]:
    """Attributes of some types only; those that are None are omitted."""
    law = row.type == "Enumeration"
    # Bounds are inclusive in FMI: "> 0" is min="0" here, and the FMU rejects 0.
    least = row.low if row.low >= 1.0 else 0.0
    return {
        "start": None if row.start is None else str(row.start).lower(),
        "declaredType": "ContactLaw" if law else None,
        "unit": row.unit or None,
        "displayUnit": row.display,
        "min": None if row.allowed in ("", "finite") else least,
        "max": row.high if law or ".." in row.allowed else None,
        # FMI 3.0 allows an independent variable few attributes.
        "nominal": None if row.causality == "independent" else row.nominal,
    }
