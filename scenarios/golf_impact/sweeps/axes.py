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

#: Forms that begin with a word.
_FORMS = {"normal": "normal:MEAN:SIGMA", "uniform": "uniform:LO:HI", "log": "log:LO:HI:COUNT"}
FORMS = "VALUE, A,B,C, LO:HI:COUNT, log:LO:HI:COUNT, normal:MEAN:SIGMA or uniform:LO:HI"


@dataclass(frozen=True)
class Grid:
    """A variable of the FMU, or "ball", that takes each of these values, shape (n,).

    They are doubles, integers for `law`, or names for `ball`.
    """

    name: str
    values: np.ndarray

    @property
    def varies(self) -> bool:
        return len(self.values) > 1

    @property
    def described(self) -> str:
        values = [value if isinstance(value, str) else f"{value:g}" for value in self.values[:6]]
        if len(self.values) > len(values):
            return f"{', '.join(values[:3])} … {self.values[-1]:g} ({len(self.values):,} values)"
        return ", ".join(values)


@dataclass(frozen=True)
class Normal:
    """A variable that is normally distributed, with this mean and standard deviation."""

    name: str
    mean: float
    sigma: float

    @property
    def described(self) -> str:
        return f"normal, mean {self.mean:g}, standard deviation {self.sigma:g}"

    def from_unit(self, u: np.ndarray) -> np.ndarray:
        """Values at these places (0 to 1) of the cumulative distribution."""
        from scipy.special import ndtri

        # A place of 0 would be minus infinity.
        return self.mean + self.sigma * ndtri(np.clip(u, 2.0**-53, 1.0 - 2.0**-53))

    def drawn(self, generator: np.random.Generator, number: int) -> np.ndarray:
        return generator.normal(self.mean, self.sigma, number)


@dataclass(frozen=True)
class Uniform:
    """A variable that is equally likely anywhere between two values."""

    name: str
    low: float
    high: float

    @property
    def described(self) -> str:
        return f"uniform, {self.low:g} to {self.high:g}"

    def from_unit(self, u: np.ndarray) -> np.ndarray:
        """Values at these places (0 to 1) of the cumulative distribution."""
        return self.low + (self.high - self.low) * u

    def drawn(self, generator: np.random.Generator, number: int) -> np.ndarray:
        return self.from_unit(generator.random(number))


Distribution = Normal | Uniform
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
        return Grid(name, np.array(names, dtype=object))
    try:
        if name != "law":
            return _axis(name, text)
        if text.isalpha():
            raise ValueError(LAWS_IN_WORDS)
        made = _axis(name, text)
        if not isinstance(made, Grid) or (made.values % 1.0).any():
            raise ValueError(f"law takes whole numbers: {LAWS_IN_WORDS}")
        if np.abs(made.values).max() >= 2**31:
            raise ValueError(LAWS_IN_WORDS)
        return Grid(name, made.values.astype(np.int64))
    except ValueError as error:
        raise UserError(f"{name}={text} is refused: {error}") from None


def _axis(name: str, text: str) -> Axis:
    first, *rest = text.split(":")
    if "," in text or not rest:
        return Grid(name, np.array([_number(item) for item in text.split(",")]))
    word = first.strip().lower()
    if word not in _FORMS:
        if word[:1].isalpha() and word not in ("inf", "nan"):
            raise ValueError(f"{first!r} is none of the forms {FORMS}")
        rest = [first, *rest]
    form = _FORMS.get(word, "LO:HI:COUNT")
    if len(rest) != (3 if form.endswith("COUNT") else 2):
        raise ValueError(f"write {form}")
    low, high, *count = map(_number, rest)
    if word == "normal":
        if high <= 0.0:
            raise ValueError(f"the standard deviation {high:g} must be > 0")
        return Normal(name, low, high)
    if word == "log" and low <= 0.0:
        raise ValueError(f"a logarithmic range must begin above 0, not at {low:g}")
    if low > high:
        raise ValueError(f"the range begins at {low:g}, above its end {high:g}")
    if word == "uniform":
        return Uniform(name, low, high)
    (number,) = count
    if number % 1.0 or number < 1:
        raise ValueError(f"the count {number:g} must be a whole number of at least 1")
    if number > _MOST_VALUES:
        raise ValueError(f"{number:g} values of one variable are more than {_MOST_VALUES:,}")
    spaced = np.geomspace if word == "log" else np.linspace
    return Grid(name, spaced(low, high, int(number)))


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{text.strip()!r} is no number; write {FORMS}") from None
    if not math.isfinite(value):
        raise ValueError(f"{text.strip()} is no finite number")
    return value
