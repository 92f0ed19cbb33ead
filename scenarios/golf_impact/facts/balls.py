"""Balls: a table of presets, each with its source, and TOML files."""

import json
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from golf_impact.errors import UserError
from golf_impact.facts.measured import PENNER, PENNER_AT_REST, PENNER_SLOPE, ROH, TRACKMAN, USGA

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@dataclass(frozen=True)
class Ball:
    """A preset ball.

    Attributes:
        name: as in `--ball NAME`; of a file, its path.
        title: a description in one line.
        values: inputs and parameters of the FMU by name (SI units); the others keep their start
            values.
        source: where the values come from.
        uncertain: names of the values that have a covariance, (p,).
        covariance: theirs, rows of (p, p), SI units.
    """

    name: str
    title: str
    values: Mapping[str, Any]
    source: str
    uncertain: tuple[str, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = ()


#: The load of the PGA compression rating: 200 lbf, N.
_RATING_LOAD = 200.0 * 4.4482216152605

#: A thousandth of an inch, m.
_MIL = 25.4e-6


def rating_stiffness(rating: float) -> float:
    """Contact stiffness k of a ball with this compression rating, N/m; indicative only.

    The PGA rating is 160 minus the deflection in mil under 200 lbf between two plates; half of the
    deflection is on each side. The compression is slow, its force a fifth of an impact's or less,
    and there is no industry standard.
    """
    return 2.0 * _RATING_LOAD / ((160.0 - rating) * _MIL)


_DOCUMENT = "Doing Physics with Python, golfSpring.py"
_FITTED = f"{ROH}, as the document quotes them; fitted by golf-impact calibrate"
_LINE = {"restitution_at_rest": PENNER_AT_REST, "restitution_slope": PENNER_SLOPE}

#: Law, stiffness and exponent of the finite-element ball, fitted with a free exponent.
_ROH_LEE = {"law": 2, "k": 769684.1103947455, "exponent": 1.6165131732807367}


def _rated(name: str, rating: float, band: str) -> Ball:
    return Ball(
        name,
        f"compression rating {rating:g} ({band})",
        {"law": 2, "k": rating_stiffness(rating), **_LINE},
        "indicative: PGA rating = 160 - mil of deflection at 200 lbf; bands: document; COR: "
        + PENNER,
    )


_PRESETS = (
    Ball(
        "document",
        "the document's fit by trial and error (law 1)",
        {"law": 1, "k": 1e6, "b": 9.0},
        _DOCUMENT,
    ),
    Ball(
        "document-old",
        "the document's old ball: softer, more damped (law 1)",
        {"law": 1, "k": 0.5e6, "b": 12.0},
        _DOCUMENT,
    ),
    Ball(
        "roh-lee",
        "the finite-element ball at 35 m/s (law 2, n free)",
        {**_ROH_LEE, "b": 39.20569001063178},
        _FITTED,
    ),
    Ball(
        "roh-lee-tsuji",
        "the same with n = 1.5",
        {"law": 2, "k": 823261.7897934683, "b": 37.075005685987676, "exponent": 1.5},
        _FITTED,
    ),
    Ball(
        "roh-lee-linear",
        "the same with n = 1 (Kelvin–Voigt), a poor fit",
        {"law": 2, "k": 1038092.3101883758, "b": 26.169288181247552},
        _FITTED,
    ),
    Ball(
        "penner",
        "stiffness of the finite-element ball, COR decreasing with speed as measured",
        {**_ROH_LEE, **_LINE},
        f"k, n: {ROH}; COR 0.86 - 0.0029 v: {PENNER}",
    ),
    Ball(
        "tour",
        "ball and flexible face of a tour driver together: 113 mph, S 1.478, 475 µs",
        {"law": 2, "k": 1241578.1199332434, "b": 35.73150805888275, "exponent": 1.5},
        f"{TRACKMAN}; contact 450-500 µs: {USGA}; fitted by golf-impact calibrate",
    ),
    _rated("rating-low", 45.0, "low, 30-60"),
    _rated("rating-mid", 73.0, "mid, 61-85"),
    _rated("rating-high", 98.0, "high, 86-110+"),
)

BALLS: dict[str, Ball] = {ball.name: ball for ball in _PRESETS}


def ball(name: str) -> Ball:
    """The preset ball of this name, or the ball of a TOML file.

    Raises:
        UserError: there is no such preset, or the file is no ball.
    """
    if name.lower().endswith(".toml"):
        return read_ball(name)
    if name not in BALLS:
        raise UserError(
            f"there is no ball {name!r}: choose from {', '.join(BALLS)}, or give a file .toml"
        )
    return BALLS[name]


# Files

#: What a ball's file may set, and what of it may have a covariance.
_UNCERTAIN = ("k", "b", "exponent", "restitution_at_rest", "restitution_slope")
_SETTABLE = ("law", *_UNCERTAIN, "reference_compression", "m_ball", "ball_diameter")


def read_ball(path: Path | str) -> Ball:
    """The ball of a TOML file: variables of the FMU by name, and optionally title and source.

    A table `uncertainty` with `parameters` and `covariance` gives predictions their intervals.

    Raises:
        UserError: the file can't be read, or something in it isn't a ball's.
    """
    try:
        table = tomllib.loads(Path(path).read_text("utf-8-sig"))
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path} is no TOML file: {error}") from error
    title, source = str(table.pop("title", f"of {path}")), str(table.pop("source", path))
    uncertainty = table.pop("uncertainty", {"parameters": [], "covariance": []})
    for name, value in table.items():
        if name not in _SETTABLE:
            raise UserError(
                f"{path}: a ball has no {name}: choose from {', '.join(_SETTABLE)}, title, source"
            )
        if not _is_number(value):
            raise UserError(f"{path}: {name} = {value!r} is refused: it must be a finite number")
    if not table:
        raise UserError(f"{path} is no ball: give it lines such as law = 2, k = 8e5, b = 30")
    try:
        names = tuple(uncertainty["parameters"])
        rows = tuple(map(tuple, uncertainty["covariance"]))
        square = len(rows) == len(names) and all(len(row) == len(names) for row in rows)
        known = all(name in _UNCERTAIN and name in table for name in names)
        numbers = all(_is_number(cell) for row in rows for cell in row)
        right = square and known and numbers and all(row[n] >= 0.0 for n, row in enumerate(rows))
    except (KeyError, TypeError):
        right = False
    if not right:
        raise UserError(
            f"{path}: uncertainty is refused: it needs parameters, p names of values above it, and "
            "covariance, p rows of p finite numbers with none on its diagonal below 0"
        )
    return Ball(str(path), title, table, source, names, rows)


def _is_number(value: Any) -> bool:
    # A Boolean is an integer to Python.
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and math.isfinite(value) and abs(value) < 2.0**63


def ball_toml(ball: Ball) -> str:
    """A ball as the text of a TOML file."""
    # A JSON text is a TOML text.
    title, source = (json.dumps(text, ensure_ascii=False) for text in (ball.title, ball.source))
    lines = [f"title = {title}", f"source = {source}", ""]
    errors = {name: ball.covariance[n][n] ** 0.5 for n, name in enumerate(ball.uncertain)}
    for name, value in ball.values.items():
        error = f"  # standard error {errors[name]:.2g}" if name in errors else ""
        lines.append(f"{name} = {value!r}{error}")
    if ball.uncertain:
        rows = ",\n".join(f"    {list(row)!r}" for row in ball.covariance)
        names = json.dumps(list(ball.uncertain))
        lines += ["", "[uncertainty]", f"parameters = {names}", f"covariance = [\n{rows},\n]"]
    return "\n".join(lines) + "\n"
