"""modelDescription.xml, from the tables that say what an FMU shows.

What pythonfmu 0.7.0 and pythonfmu3 0.3.4 write has no units, ranges, initial unknowns or
derivatives that are states as well, and 16 digits of a start value.
"""

import importlib.metadata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from golf_physics import __version__
from golf_physics.variables import Variable

from golf_build.archive import EPOCH_TEXT

HERE = Path(__file__).resolve().parent

#: What packs an FMU, by the version of FMI; its runtime travels along.
RUNTIMES = {2: "pythonfmu", 3: "pythonfmu3"}

_ELEMENTS = {
    2: {"Real": "Real", "Enumeration": "Integer", "Boolean": "Boolean"},
    3: {"Real": "Float64", "Enumeration": "Enumeration", "Boolean": "Boolean"},
}


def rendered(template: Path, **values: Any) -> bytes:
    """What jinja makes of a template (UTF-8)."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template.name).render(values).encode()


def described(
    fmi: int, rows: Sequence[Variable], derivatives: Mapping[str, str] | None = None, **more: Any
) -> bytes:
    """The text of the file.

    Args:
        fmi: version of FMI, 2 or 3.
        rows: the variables; the value reference of each is its place.
        derivatives: the variables that some are the derivatives of.
        more: `name` of the model, `token` (the GUID), `description`, and `units` by name; `laws` of
            ClubBallImpact, `constant` (outputs whose initial values depend on nothing), `unsolved`
            (outputs that Model Exchange hasn't got) and `structure` (names of variables by the
            elements of ModelStructure) in FMI 3.0.
    """
    runtime, references = RUNTIMES[fmi], {row.name: n for n, row in enumerate(rows)}
    variables = []
    for row in rows:
        state = (derivatives or {}).get(row.name)
        own = _of_type(row) | {"derivative": references[state] if state else None}
        variables.append((row, _ELEMENTS[fmi][row.type], own))
    text = rendered(
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
    # All attributes are in double quotes: whoever looks for a text finds it as it is.
    return text.replace(b"&#39;", b"'")


def _of_type(row: Variable) -> dict[str, Any]:
    """The attributes that only some types have; None is left out."""
    law = row.type == "Enumeration"
    # FMI's bounds are inclusive: "> 0" is min="0" here, and the FMU refuses 0 itself.
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
