"""Units at the door: numbers as text, with or without a unit of the FMU's own table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from math import pi
from typing import Any

from golf_physics.variables import BY_NAME, UNITS

from golf_impact.data.errors import refused

_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*)")

#: Units beside those of the FMU: their sizes by SI unit (NIST SP 811).
_MORE = {
    "m": {"cm": 1e-2, "um": 1e-6, "in": 0.0254, "ft": 0.3048},
    "kg": {"oz": 0.028349523125, "lb": 0.45359237},
    "s": {"ns": 1e-9},
    "m/s": {"ft/s": 0.3048, "fps": 0.3048, "kph": 1.0 / 3.6, "kmh": 1.0 / 3.6},
    "N": {"lbf": 4.4482216152605, "daN": 10.0, "kgf": 9.80665, "MN": 1e6, "mN": 1e-3},
    "rad": {"rad": 1.0, "deg": pi / 180.0, "°": pi / 180.0},
    "rad/s": {"rad/s": 1.0, "rpm": pi / 30.0},
    "N/m": {"kN/mm": 1e6, "MN/m": 1e6, "lbf/in": 4.4482216152605 / 0.0254},
}

#: SI unit and size in it of all units, as they are compared.
SYMBOLS = {
    symbol.replace(".", ""): (si, 1.0 / factor)
    for si, unit in UNITS.items()
    for symbol, factor in {si: 1.0, **unit.display}.items()
} | {symbol: (si, size) for si, sizes in _MORE.items() for symbol, size in sizes.items()}

#: The symbols by their small letters; none where two of them differ in case alone (ns and N·s).
_FOLDED: dict[str, str] = {}
for symbol in SYMBOLS:
    _FOLDED[symbol.lower()] = "" if symbol.lower() in _FOLDED else symbol

#: Sizes that no golf impact has without a slip in the unit: least and largest, SI units, and the
#: units that are probably meant.
REMARKABLE = {
    **dict.fromkeys(("club_speed", "ball_speed"), (0.0, 70.0, ("mph", "km/h"))),
    **dict.fromkeys(("m_club", "m_ball"), (0.0, 10.0, ("g",))),
    **dict.fromkeys(("ball_diameter", "reference_compression", "gap"), (0.0, 1.0, ("mm",))),
    "k": (1e4, float("inf"), ("N/mm",)),
    "b": (0.1, float("inf"), ()),
}


def symbol_of(text: str) -> str:
    """A unit as in `SYMBOLS`, from usual spellings: µs (of any encoding), N·s/m, MPH."""
    symbol = re.sub(r"[µμ\ufffd]", "u", re.sub(r"[.·*\s]", "", text))
    return symbol if symbol in SYMBOLS else _FOLDED.get(symbol.lower()) or symbol


def unit_of(name: str) -> str:
    """The SI unit of a variable of the FMU; empty if it has none."""
    return BY_NAME[name].unit if name in BY_NAME else ""


def _split(text: str) -> tuple[str, str]:
    """A number and its unit, which may be missing."""
    try:
        float(text)
    except ValueError:
        if re.match(r"[-+]?\d*,\d", text.strip()):
            point = text.strip().replace(",", ".", 1)
            raise ValueError(f"write {point}, with a decimal point") from None
        if match := _NUMBER.fullmatch(text.strip()):
            return match[1], match[2]
        raise ValueError(f"{text!r} is not a number (e.g. 1.5)") from None
    return text, ""


def si_value(text: str, unit: str) -> float:
    """A number in SI units; ValueError says what isn't understood."""
    number, symbol = _split(text)
    base, size = SYMBOLS.get(symbol_of(symbol), ("", 0.0)) if symbol else (unit, 1.0)
    if base != unit:
        same = (one for one, (si, _) in SYMBOLS.items() if si == unit and one != symbol_of(unit))
        known = ", ".join([unit, *same]) if unit else "none"
        raise ValueError(f"{symbol!r} isn't a unit it may have: {known}")
    # 15 digits: 45.93 g are 0.04593 kg to the last digit.
    return float(number) if size == 1.0 else float(f"{float(number) * size:.15g}")


def number(name: str, value: Any, unit: str | None = None) -> float:
    """The value of an input or parameter in SI units, from a number or text; else a UserError.

    `unit` is the SI unit, by default that of ClubBallImpact's variable.
    """
    try:
        if isinstance(value, str):
            return si_value(value, unit_of(name) if unit is None else unit)
        if isinstance(value, bytes) or getattr(value, "ndim", None):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError) as error:
        why = "it must be a number in SI units, or text with a unit"
        if isinstance(value, str):
            why = str(error)
        raise refused(name, value, why) from None


def si_values(texts: Iterable[str], unit: str) -> list[float]:
    """Numbers of a range: each in its own unit, or all in that of the last one."""
    pairs = [_split(text) for text in texts]
    shared = "" if any(symbol for _, symbol in pairs[:-1]) else pairs[-1][1]
    return [si_value(f"{number} {symbol or shared}", unit) for number, symbol in pairs]


def remarks(values: Mapping[str, Any], form: str = "--set {}=") -> list[str]:
    """Sentences about numbers (SI units) that look like those of another unit."""
    words = []
    for name, (low, high, units) in REMARKABLE.items():
        value = values.get(name, 0.0)
        if value > 0.0 and not low <= value <= high:
            given, unit = form.format(name), unit_of(name).replace(".", "·")
            meant = " or ".join(
                f"{given}{value * SYMBOLS[symbol][1]:g} for {value:g} {symbol}" for symbol in units
            )
            hint = f"write {meant}" if meant else "golf balls have 1 to 100 there"
            words.append(f"{given}{value:g} is taken in {unit}: {hint}.")
    return words
