"""One swept variable: a row of values, or a distribution, as `--set NAME=…` and studies give it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from golf_scenarios.errors import UserError
from golf_scenarios.facts.quantities import LAWS_IN_WORDS

#: More values of one variable than this are a slip of the keyboard.
_MOST_VALUES = 10_000_000

FORMS = "VALUE, A,B,C, LO:HI:COUNT, log:LO:HI:COUNT, normal:MEAN:SIGMA or uniform:LO:HI"


@dataclass(frozen=True)
class Grid:
    """A variable that takes each of these values.

    Attributes:
        name: of the FMU's variable, or "ball".
        values: shape (n,): doubles, integers for `law`, or names for `ball`.
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
    """The axis that a user wrote.

    Args:
        name: of the variable.
        given: text as in `--set NAME=text`; from a study also a number or a list.

    Raises:
        UserError: it is no axis: unknown form, `lo > hi`, a logarithm of nothing, no values, NaN.
    """
    if isinstance(given, Sequence | np.ndarray) and not isinstance(given, str):
        given = ",".join(map(str, given))
    text = str(given).strip()
    try:
        return _ball(text) if name == "ball" else _axis(name, text)
    except _BadAxisError as error:
        raise UserError(f"{name}={text} is refused: {error}") from None


class _BadAxisError(Exception):
    """What is wrong with an axis."""


def _axis(name: str, text: str) -> Axis:
    if name == "law" and text.strip().isalpha():
        raise _BadAxisError(LAWS_IN_WORDS)
    if "," in text or ":" not in text:
        made: Axis = Grid(name, np.array([_number(item) for item in text.split(",")]))
    else:
        first, *rest = text.split(":")
        word = first.strip().lower()
        if word == "normal":
            mean, sigma = _numbers(rest, 2, "normal:MEAN:SIGMA")
            if sigma <= 0.0:
                raise _BadAxisError(f"the standard deviation {sigma:g} must be > 0")
            made = Normal(name, mean, sigma)
        elif word == "uniform":
            made = Uniform(name, *_range(*_numbers(rest, 2, "uniform:LO:HI")))
        elif word == "log":
            low, high, count = _numbers(rest, 3, "log:LO:HI:COUNT")
            if low <= 0.0:
                raise _BadAxisError(f"a logarithmic range must begin above 0, not at {low:g}")
            made = Grid(name, np.geomspace(*_range(low, high), _count(count)))
        elif word[:1].isalpha() and word not in ("inf", "nan"):
            raise _BadAxisError(f"{first!r} is none of the forms {FORMS}")
        else:
            low, high, count = _numbers([first, *rest], 3, "LO:HI:COUNT")
            made = Grid(name, np.linspace(*_range(low, high), _count(count)))
    return _whole(made) if name == "law" else made


def _whole(made: Axis) -> Grid:
    if not isinstance(made, Grid) or not all(value == int(value) for value in made.values):
        raise _BadAxisError("law takes whole numbers, 1 (absolute) and 2 (relative)")
    if not all(abs(value) < 2**31 for value in made.values):
        raise _BadAxisError(LAWS_IN_WORDS)
    return Grid(made.name, made.values.astype(np.int64))


def _ball(text: str) -> Grid:
    from golf_scenarios.facts.balls import ball

    names = [name.strip() for name in text.split(",")]
    for name in names:
        ball(name)
    return Grid("ball", np.array(names, dtype=object))


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise _BadAxisError(f"{text.strip()!r} is no number; write {FORMS}") from None
    if not math.isfinite(value):
        raise _BadAxisError(f"{text.strip()} is no finite number")
    return value


def _numbers(texts: list[str], number: int, form: str) -> list[float]:
    if len(texts) != number:
        raise _BadAxisError(f"write {form}")
    return [_number(text) for text in texts]


def _range(low: float, high: float) -> tuple[float, float]:
    if low > high:
        raise _BadAxisError(f"the range begins at {low:g}, above its end {high:g}")
    return low, high


def _count(value: float) -> int:
    if value != int(value) or value < 1:
        raise _BadAxisError(f"the count {value:g} must be a whole number of at least 1")
    if value > _MOST_VALUES:
        raise _BadAxisError(f"{value:g} values of one variable are more than {_MOST_VALUES:,}")
    return int(value)
