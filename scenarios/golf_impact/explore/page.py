"""The page of `golf-impact explore` as one file: markup, style, scripts, data and the physics."""

import base64
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import jinja2
from golf_physics.variables import BY_NAME
from markupsafe import Markup, escape

from golf_build import VERSION
from golf_build.native_header import NATIVE_LAWS
from golf_impact.api import run_impact_anywhere
from golf_impact.data import document
from golf_impact.data.balls import BALLS, Ball
from golf_impact.data.errors import UserError
from golf_impact.data.files import read_toml, write
from golf_impact.data.measured import ROH_LEE_FIGURES
from golf_impact.data.quantities import (
    QUANTITIES,
    START,
    Quantity,
    format_shortest,
    format_unit,
    undefined_results,
)
from golf_impact.data.runs import METRICS, PATH
from golf_impact.data.units import REMARKABLE, SYMBOLS, symbol_of

_HERE = Path(__file__).parent
_DATA = read_toml(_HERE / "page.toml")
_UNITS = QUANTITIES | {name: Quantity(*row) for name, row in _DATA["units"].items()}

#: The variables that define a ball, if its file doesn't have more.
_CONTACT = (
    "law", "k", "b", "exponent", "reference_compression",
    "restitution_at_rest", "restitution_slope",
)  # fmt: skip

#: One module of all, in this order.
_SCRIPTS = "physics", "charts", "values", "pins", "page"

#: In the file, so that no other one is replaced.
GENERATOR = "golf-impact explore"


def write_page(
    path: Path, values: Mapping[str, float], own: Ball | None = None, answers: bool = True
) -> Path:
    """Write the page into a file.

    Args:
        path: an .html file; its folder is made if necessary.
        values: inputs and parameters of the case with which it opens (SI units; start values for
            the others); empty: that of its first level.
        own: a ball beside the presets.
        answers: with the answer key of the worksheet.

    Raises:
        UserError: the file can't be written, or is another one than such a page.
    """
    if path.is_file() and f'content="{GENERATOR}"' not in path.read_text("utf-8", "replace"):
        raise UserError(f"{path} isn't a page of {GENERATOR}: it stays; choose another name")
    facts = _facts(values, own)
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    environment.filters["subscripts"] = _subscripts
    # In the order of the tables; what JSON doesn't have is an error here.
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False}
    text = environment.from_string(_read("page.html")).render(
        facts=facts,
        answers=answers,
        controls=[facts["inputs"][name] for name in _DATA["controls"]],
        sweeps=_DATA["sweeps"],
        tasks=[_task(**row) for row in _DATA["tasks"]],
        start=_in_words(START | _DATA["opening"]["simple"]),
        generator=GENERATOR,
        notices=_read("physics.txt"),
        style=_read("page.css"),
        script="\n".join(_read(f"{name}.js") for name in _SCRIPTS),
        wasm=base64.b64encode((_HERE / "physics.wasm").read_bytes()).decode(),
    )
    return write(path, text)


def _subscripts(text: str) -> Markup:
    """Symbols such as m_C with their index as a subscript."""
    return Markup(re.sub(r"\b([A-Za-z])_([A-Za-z])\b", r"\1<sub>\2</sub>", str(escape(text))))


def _read(name: str) -> str:
    return (_HERE / name).read_text("utf-8")


def _facts(values: Mapping[str, float], own: Ball | None) -> dict[str, Any]:
    """What the scripts take from the project's tables."""
    if own:
        # A page is passed on: it doesn't tell in which folder its author's ball is.
        own = replace(own, name=Path(own.name).stem)
    balls = {**BALLS, own.name: own} if own else BALLS
    return {
        "version": VERSION,
        "inputs": {name: _input(name, start) for name, start in START.items()},
        "outputs": {r.name: r.reference for r in BY_NAME.values() if r.causality == "output"},
        "metrics": METRICS,
        "path": PATH,
        "undefined": {
            "touched": [*undefined_results(True, False)],
            "apart": [*undefined_results(False, False)],
        },
        "units": {row.name: row.unit for row in BY_NAME.values()},
        "symbols": {symbol: [format_unit(si), size] for symbol, (si, size) in SYMBOLS.items()},
        "speeds": ["m/s", "mph", "km/h"],
        "remarkable": {
            name: [low, min(high, 1e300), *units] for name, (low, high, units) in REMARKABLE.items()
        },
        "laws": [(number, name) for number, (name, _) in NATIVE_LAWS.items()],
        "readouts": [_readout(*row) for row in _DATA["readouts"]],
        "balls": [_ball(one) for one in balls.values()],
        "examples": [_example(**row) for row in _DATA["examples"]],
        "opening": {level: _case(**row) for level, row in _DATA["opening"].items()},
        "case": {**START, **values} if values else None,
        "equations": _DATA["equations"],
    }


def _input(name: str, start: float) -> dict[str, Any]:
    """An input or parameter, with its control if it has one."""
    row, control = BY_NAME[name], _DATA["controls"].get(name, {})
    texts = {"si": format_unit(row.unit), "description": row.description}
    return {"name": name, "start": start, **texts, **control}


def _readout(metric: str, label: str, meaning: str, level: str = "") -> dict[str, Any]:
    texts = {"metric": metric, "label": label, "meaning": meaning, "level": level}
    return {**texts, **_UNITS[metric]._asdict()}


def _ball(ball: Ball) -> dict[str, Any]:
    shown = {key: vars(ball)[key] for key in ("name", "title", "source", "speeds", "limits")}
    if ball.undetermined:
        words = "k is undetermined: force, contact time and compression don't follow"
        shown["limits"] = "; ".join(filter(None, (shown["limits"], words)))
    return {**shown, "values": {**{name: START[name] for name in _CONTACT}, **ball.values}}


def _case(ball: str = "", **values: float) -> dict[str, float]:
    """All inputs and parameters of a case of page.toml."""
    return {**START, **(BALLS[ball].values if ball else {}), **values}


def _example(
    name: str, hint: str, case: str = "", ball: str = "", beside: Any = None, **own: Any
) -> dict[str, Any]:
    """A case with a button, with what is published of it: texts by metric, in its unit."""
    values, published = own.get("values", {}), {}
    if case:
        values, printed = document.CASES[case]
        published = {metric: one.text for metric, one in printed.items()}
    if ball:
        published = {of: _UNITS[of].format_value(x) for of, x in ROH_LEE_FIGURES.items()}
    return {
        "name": name,
        "hint": hint,
        "values": _case(ball, **values),
        "beside": beside and _case(**beside),
        "published": published,
        "source": "Roh & Lee" if ball else "document",
    }


def _task(cases: Mapping[str, Any], results: list[str], **row: Any) -> dict[str, Any]:
    """A task, with the address of its case and the rows of its table, answers filled in."""
    start = _DATA["opening"]["simple"]
    found = [run_impact_anywhere(**(start | values)) for values in cases.values()]
    rows = [
        {
            "label": (one := _UNITS[name]).label,
            "answers": [one.format_value(x[name]) for x in found],
        }
        for name in results
    ]
    texts = {name: format_shortest(x) for name, x in start.items()}
    return {**row, "cases": [*cases], "rows": rows, "query": urlencode(texts | {"level": "simple"})}


def _in_words(values: Mapping[str, float]) -> str:
    """The values of the simple level, in the page's units."""
    return ", ".join(
        f"{row['label']} {values[name] / SYMBOLS[symbol_of(row['unit'])][1]:g} {row['unit']}"
        for name, row in _DATA["controls"].items()
        if "group" not in row
    )
