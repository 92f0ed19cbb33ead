"""One swept variable: a row of values, or a distribution, as `--set NAME=…` and studies give it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from golf_impact.errors import UserError
from golf_impact.facts.balls import ball
from golf_impact.facts.quantities import LAWS_IN_WORDS

#: More values of one variable than this are a slip of the keyboard.
_MOST_VALUES = 10_000_000

FORMS = "VALUE, A,B,C, LO:HI:COUNT, log:LO:HI:COUNT, normal:MEAN:SIGMA or uniform:LO:HI"


@dataclass(frozen=True)
class Grid:
    """A variable of the FMU, or "ball", that takes each of these values, shape (n,).

    They are doubles, integers for `law`, or names for `ball`.
    """

    name: str
    text: str  # as the user wrote it
    values: np.ndarray


@dataclass(frozen=True)
class Distribution:
    """A variable that is normally or uniformly distributed."""

    name: str
    text: str  # as the user wrote it
    kind: str  # "normal" or "uniform"
    first: float  # its mean, or its least value
    second: float  # its standard deviation, or its greatest value

    def draw(self, generator: np.random.Generator, number: int) -> np.ndarray:
        """Independent samples, shape (number,)."""
        distribution = generator.normal if self.kind == "normal" else generator.uniform
        return distribution(self.first, self.second, number)

    def of_scipy(self) -> Any:
        """The same distribution of scipy.stats."""
        from scipy import stats

        if self.kind == "normal":
            return stats.norm(self.first, self.second)
        return stats.uniform(self.first, self.second - self.first)


Axis = Grid | Distribution


def axis(name: str, given: Any) -> Axis:
    """The axis that a user wrote: text as in `--set NAME=text`, a number or a list.

    UserError: it is no axis: unknown form, `lo > hi`, a logarithm of nothing, no values, NaN.
    """
    if isinstance(given, Sequence | np.ndarray) and not isinstance(given, str):
        given = ",".join(map(str, given))
    text = str(given).strip()
    if name == "ball":
        names = [ball(one.strip()).name for one in text.split(",")]
        return Grid(name, text, np.array(names, dtype=object))
    try:
        made = _axis(name, text)
        if name != "law":
            return made
        # An Integer of FMI has 32 bits.
        if isinstance(made, Grid) and not (made.values % 1.0).any() and max(abs(made.values)) < 2e9:
            return Grid(name, text, made.values.astype(np.int64))
        raise ValueError("not whole numbers")
    except ValueError as error:
        why = LAWS_IN_WORDS if name == "law" else error
        raise UserError(f"{name}={text} is refused: {why}") from None


def _axis(name: str, text: str) -> Axis:
    first, *rest = text.split(":")
    if "," in text or not rest:
        return Grid(name, text, np.array([_number(item) for item in text.split(",")]))
    word = first.strip().lower()
    if word not in ("log", "normal", "uniform"):
        rest = [first, *rest]
    if len(rest) != (2 if word in ("normal", "uniform") else 3):
        raise ValueError(f"write {FORMS}")
    low, high, *count = map(_number, rest)
    if word == "normal" and high <= 0.0:
        raise ValueError(f"the standard deviation {high:g} must be > 0")
    if word == "log" and low <= 0.0:
        raise ValueError(f"a logarithmic range must begin above 0, not at {low:g}")
    if word != "normal" and low > high:
        raise ValueError(f"the range begins at {low:g}, above its end {high:g}")
    if not count:
        return Distribution(name, text, word, low, high)
    number = count[0]
    if number % 1.0 or not 1 <= number <= _MOST_VALUES:
        raise ValueError(f"the count {number:g} must be a whole number, 1 to {_MOST_VALUES:,}")
    spaced = np.geomspace if word == "log" else np.linspace
    return Grid(name, text, spaced(low, high, int(number)))


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{text.strip()!r} is no number; write {FORMS}") from None
    if not math.isfinite(value):
        raise ValueError(f"{text.strip()} is no finite number")
    return value
