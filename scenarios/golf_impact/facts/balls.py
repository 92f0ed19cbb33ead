"""Preset balls by name, each with its source."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from golf_impact.errors import UserError
from golf_impact.facts.measured import PENNER, PENNER_AT_REST, PENNER_SLOPE, ROH, TRACKMAN, USGA


@dataclass(frozen=True)
class Ball:
    """A preset ball.

    Attributes:
        name: as in `--ball NAME`.
        title: a description in one line.
        values: inputs and parameters of the FMU by name (SI units); the others keep their start
            values.
        source: where the values come from.
    """

    name: str
    title: str
    values: Mapping[str, Any]
    source: str


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


def _power(exponent: float) -> dict[str, float]:
    return {"exponent": exponent, "reference_compression": 0.005}


_DOCUMENT = "Doing Physics with Python, golfSpring.py"
_LINE = {"restitution_at_rest": PENNER_AT_REST, "restitution_slope": PENNER_SLOPE}
_FITTED = f"{ROH}, as the document quotes them; fitted by golf-impact calibrate"
_RATING_SOURCE = (
    f"indicative: PGA rating = 160 - mil of deflection at 200 lbf; bands: document; COR: {PENNER}"
)

#: Law, stiffness and exponent of the finite-element ball, fitted with a free exponent.
_ROH_LEE = {"law": 2, "k": 769684.1103947455, **_power(1.6165131732807367)}


def _ball(name: str, title: str, source: str, values: dict[str, float]) -> Ball:
    return Ball(name, title, MappingProxyType(values), source)


def _rated(name: str, rating: float, band: str) -> Ball:
    title = f"compression rating {rating:g} ({band})"
    values = {"law": 2, "k": rating_stiffness(rating), **_LINE}
    return _ball(name, title, _RATING_SOURCE, values)


_PRESETS = (
    _ball(
        *("document", "the document's fit by trial and error (law 1)", _DOCUMENT),
        {"law": 1, "k": 1e6, "b": 9.0},
    ),
    _ball(
        *("document-old", "the document's old ball: softer, more damped (law 1)", _DOCUMENT),
        {"law": 1, "k": 0.5e6, "b": 12.0},
    ),
    _ball(
        *("roh-lee", "the finite-element ball at 35 m/s (law 2, n free)", _FITTED),
        {**_ROH_LEE, "b": 39.20569001063178},
    ),
    _ball(
        *("roh-lee-tsuji", "the same with n = 1.5", _FITTED),
        {"law": 2, "k": 823261.7897934683, "b": 37.075005685987676, **_power(1.5)},
    ),
    _ball(
        *("roh-lee-linear", "the same with n = 1 (Kelvin–Voigt), a poor fit", _FITTED),
        {"law": 2, "k": 1038092.3101883758, "b": 26.169288181247552},
    ),
    _ball(
        "penner",
        "stiffness of the finite-element ball, COR decreasing with speed as measured",
        f"k, n: {ROH}; COR 0.86 - 0.0029 v: {PENNER}",
        {**_ROH_LEE, **_LINE},
    ),
    _ball(
        "tour",
        "ball and flexible face of a tour driver together: 113 mph, S 1.478, 475 µs",
        f"{TRACKMAN}; contact 450-500 µs: {USGA}; fitted by golf-impact calibrate",
        {"law": 2, "k": 1241578.1199332434, "b": 35.73150805888275, **_power(1.5)},
    ),
    _rated("rating-low", 45.0, "low, 30-60"),
    _rated("rating-mid", 73.0, "mid, 61-85"),
    _rated("rating-high", 98.0, "high, 86-110+"),
)

BALLS: dict[str, Ball] = {ball.name: ball for ball in _PRESETS}


def ball(name: str) -> Ball:
    """The preset ball of this name; UserError if there is none."""
    if name not in BALLS:
        raise UserError(f"there is no ball {name!r}: choose from {', '.join(BALLS)}")
    return BALLS[name]
