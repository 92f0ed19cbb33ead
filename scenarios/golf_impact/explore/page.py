"""The page of `golf-impact explore` as one file: markup, style, scripts, data and the physics."""

import base64
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import jinja2

import golf_impact
from golf_build import BY_NAME, LAWS, VERSION
from golf_impact import document
from golf_impact.ball import BALLS, Ball
from golf_impact.errors import UserError
from golf_impact.files import write
from golf_impact.measured import ROH_LEE_FIGURES
from golf_impact.quantities import QUANTITIES, Quantity, format_shortest, format_unit
from golf_impact.runs import METRICS, PATH
from golf_impact.toml import read_toml
from golf_impact.units import REMARKABLE, SYMBOLS

_HERE = Path(__file__).parent
_DATA = read_toml(_HERE / "page.toml")
_UNITS = QUANTITIES | {name: Quantity(*row) for name, row in _DATA["units"].items()}
_START = {row.name: float(row.start) for row in BY_NAME.values() if row.start is not None}

#: The variables that define a ball, if its file doesn't have more.
_CONTACT = (
    "law", "k", "b", "exponent", "reference_compression", "restitution_at_rest", "restitution_slope",
)  # fmt: skip

#: In the file, so that no other one is replaced.
GENERATOR = "golf-impact explore"


def write_page(path: Path, values: Mapping[str, float], own: Ball | None = None) -> Path:
    """Write the page into a file.

    Args:
        path: an .html file; its folder is made if necessary.
        values: inputs and parameters of the case with which it opens (SI units; start values for
            the others); empty: that of its first level.
        own: a ball beside the presets.

    Raises:
        UserError: the file can't be written, or is another one than such a page.
    """
    if path.is_file() and f'content="{GENERATOR}"' not in path.read_text("utf-8", "replace"):
        raise UserError(f"{path} isn't a page of {GENERATOR}: it stays; choose another name")
    return write(path, page(values, own))


def page(values: Mapping[str, float], own: Ball | None = None) -> str:
    """The text of the page; see `write_page`."""
    facts = _facts(values, own)
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    scripts = (_read(f"{name}.js") for name in ("physics", "charts", "page"))
    return environment.from_string(_read("page.html")).render(
        facts=facts,
        tasks=[_task(row) for row in _DATA["tasks"]],
        start=_in_words(_START | _DATA["opening"]["simple"]),
        generator=GENERATOR,
        notices=_read("physics.txt"),
        style=_read("page.css"),
        script="\n".join(scripts),
        # Nothing in a script element may end it.
        data=json.dumps(facts, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c"),
        wasm=base64.b64encode((_HERE / "physics.wasm").read_bytes()).decode(),
    )


def _read(name: str) -> str:
    return (_HERE / name).read_text("utf-8")


def _facts(values: Mapping[str, float], own: Ball | None) -> dict[str, Any]:
    """What the scripts take from the project's tables."""
    contact = {name: _START[name] for name in _CONTACT}
    balls = {**BALLS, own.name: own} if own else BALLS
    quantities = [
        {**row, "si": format_unit(BY_NAME[row["name"]].unit), "description": BY_NAME[row["name"]].description}
        for row in _DATA["quantities"]
    ]  # fmt: skip
    return {
        "version": VERSION,
        "inputs": {name: {"reference": BY_NAME[name].reference, "start": x} for name, x in _START.items()},
        "outputs": {row.name: row.reference for row in BY_NAME.values() if row.start is None},
        "metrics": METRICS,
        "path": PATH,
        "units": {row.name: row.unit for row in BY_NAME.values() if row.unit},
        "symbols": {symbol: [format_unit(si), size] for symbol, (si, size) in SYMBOLS.items()},
        "speeds": ["m/s", "mph", "km/h"],
        "remarkable": {name: [low, min(high, 1e300), *units] for name, (low, high, units) in REMARKABLE.items()},
        "laws": [(number, name) for number, (name, _) in LAWS.items()],
        "quantities": quantities,
        "readouts": [_readout(*row) for row in _DATA["readouts"]],
        "balls": [
            {**{key: vars(ball)[key] for key in ("name", "title", "source", "speeds", "limits")}, "values": contact | ball.values}
            for ball in balls.values()
        ],
        "examples": [_example(row) for row in _DATA["examples"]],
        "tasks": [row["name"] for row in _DATA["tasks"]],
        "opening": {level: _opening(row) for level, row in _DATA["opening"].items()},
        "case": _START | values if values else None,
        **{name: _DATA[name] for name in ("sweeps", "equations", "simple")},
    }  # fmt: skip


def _opening(row: Mapping[str, Any]) -> dict[str, float]:
    """Inputs and parameters of a row of page.toml, which may name a ball."""
    given = {name: x for name, x in row.items() if name in _START}
    return _START | (BALLS[row["ball"]].values if "ball" in row else {}) | given


def _readout(metric: str, label: str, meaning: str) -> dict[str, Any]:
    unit = _UNITS[metric]
    return {"metric": metric, "label": label, "meaning": meaning, **unit._asdict()}


def _example(row: Mapping[str, Any]) -> dict[str, Any]:
    """A case with a button, with what is published of it as text by metric, in SI units."""
    published = (
        {name: one.text for name, one in document.CASES[row["case"]].printed.items()}
        if "case" in row
        else {}
    )
    if "ball" in row:
        published = {name: QUANTITIES[name].format_value(x) for name, x in ROH_LEE_FIGURES.items()}
    return {
        "name": row["name"],
        "hint": row["hint"],
        "values": _opening(row | row.get("values", {})),
        "beside": _opening(row["beside"]) if "beside" in row else None,
        "published": published,
        "source": "Roh & Lee" if "ball" in row else "document",
    }  # fmt: skip


def _task(row: Mapping[str, Any]) -> dict[str, Any]:
    """A task, with the address of its case and the rows of its table, answers filled in."""
    start = _DATA["opening"]["simple"]
    found = [golf_impact.run_impact(**start, **values) if not values.keys() & start.keys()
             else golf_impact.run_impact(**(start | values)) for values in row["cases"].values()]  # fmt: skip
    rows = [
        {"label": _UNITS[name].label, "answers": [_UNITS[name].format_value(one[name]) for one in found]}
        for name in row["results"]
    ]  # fmt: skip
    query = urlencode(
        {**{name: format_shortest(x) for name, x in start.items()}, "level": "simple"}
    )
    return {**row, "rows": rows, "query": query}


def _in_words(values: Mapping[str, float]) -> str:
    """The values of the simple level, in the page's units."""
    rows = (row for row in _DATA["quantities"] if "group" not in row)
    return ", ".join(
        f"{row['label']} {values[row['name']] / SYMBOLS[row['unit'].replace('·', '')][1]:g} {row['unit']}"
        for row in rows
    )
