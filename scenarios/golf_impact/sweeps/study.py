"""What a sweep computes: the swept variables, their cases in order, and the outputs."""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.ball import ball
from golf_impact.errors import UserError, missing_package, unknown_name
from golf_impact.quantities import LAWS_IN_WORDS
from golf_impact.toml import read_toml
from golf_impact.units import si_values, unit_of

#: Default outputs: those known at the end of contact. Law 1 has to search for extremes (max_force).
OUTPUTS = (
    "smash_factor", "coefficient_of_restitution", "energy_efficiency", "club_velocity",
    "ball_velocity", "contact_time",
)  # fmt: skip

#: Values by variable or output, arrays of one shape (cases,); doubles are NaN where there is none.
Columns = Mapping[str, np.ndarray]

_FORMS = "VALUE, A,B,C, LO:HI:COUNT, log:LO:HI:COUNT, normal:MEAN:SIGMA or uniform:LO:HI"

#: Keys of a study as a file beside [set]: their types, and these in words.
KEYS = {
    **dict.fromkeys(("out", "design", "scheduler", "fmu"), (str, "a text")),
    **dict.fromkeys(("samples", "seed", "workers", "chunk"), (int, "a whole number")),
    **dict.fromkeys(("compare", "figures"), (bool, "true or false")),
    "outputs": (list, "a list of names"),
}


@dataclass(frozen=True)
class Grid:
    """A variable of the physics, or "ball", that takes each of these values, shape (n,).

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
    kind: str  # "normal" or "uniform", as NumPy's generators call it
    first: float  # its mean, or its least value
    second: float  # its standard deviation, or its greatest value

    def of_scipy(self) -> Any:
        from scipy import stats

        if self.kind == "normal":
            return stats.norm(self.first, self.second)
        return stats.uniform(self.first, self.second - self.first)


def parse_axis(name: str, spec: Any) -> Grid | Distribution:
    """The axis that a user gives: text as in `--set NAME=text`, a number or a list.

    UserError: it is no axis: unknown form, `lo > hi`, a logarithm of nothing, no values, NaN.
    """
    if isinstance(spec, Sequence | np.ndarray) and not isinstance(spec, str):
        spec = ",".join(map(str, spec))
    text = str(spec).strip()
    if name == "ball":
        names = [ball(item.strip()).name for item in text.split(",")]
        return Grid(name, text, np.array(names, dtype=object))
    try:
        axis = _parse(name, text)
        if name != "law":
            return axis
        # An Integer of FMI has 32 bits.
        if isinstance(axis, Grid) and not (axis.values % 1.0).any() and max(abs(axis.values)) < 2e9:
            return Grid(name, text, axis.values.astype(np.int64))
        raise ValueError("not whole numbers")
    except ValueError as error:
        why = LAWS_IN_WORDS if name == "law" else error
        raise UserError(f"{name}={text} is refused: {why}") from None


def _parse(name: str, text: str) -> Grid | Distribution:
    word, _, rest = text.partition(":")
    word = word.strip().lower()
    if word not in ("log", "normal", "uniform"):
        word, rest = "", text
    parts = rest.split(":" if word or ":" in rest else ",")
    ends = parts[:2] if word or ":" in rest else parts
    try:
        numbers = si_values(ends, unit_of(name)) + [float(part) for part in parts[len(ends) :]]
    except ValueError as error:
        raise ValueError(f"{error}; write {_FORMS}") from None
    if not np.isfinite(numbers).all():
        raise ValueError("its numbers must be finite")
    if not word and ":" not in rest:
        return Grid(name, text, np.array(numbers))
    if len(numbers) != (2 if word in ("normal", "uniform") else 3):
        raise ValueError(f"write {_FORMS}")
    low, high, *count = numbers
    if word == "normal" and high <= 0.0:
        raise ValueError(f"the standard deviation {high:g} must be > 0")
    if word == "log" and low <= 0.0:
        raise ValueError(f"a logarithmic range must begin above 0, not at {low:g}")
    if word != "normal" and low > high:
        raise ValueError(f"the range begins at {low:g}, above its end {high:g}")
    if not count:
        return Distribution(name, text, word, low, high)
    # More would be a typing error.
    if count[0] % 1.0 or not 1 <= count[0] <= 10_000_000:
        raise ValueError(f"the count {count[0]:g} must be a whole number, 1 to 10,000,000")
    spaced = np.geomspace if word == "log" else np.linspace
    return Grid(name, text, spaced(low, high, int(count[0])))


@dataclass(frozen=True)
class Study:
    """A parametric study.

    The cases are those of the grid; the last axis varies fastest. With a distribution, every point
    of the grid has the same samples (otherwise one), which vary faster than any axis.
    """

    axes: tuple[Grid | Distribution, ...]
    outputs: tuple[str, ...] = OUTPUTS
    number_of_samples: int = 1
    seed: int = 0
    design: str = "random"

    @classmethod
    def of(
        cls,
        sets: Mapping[str, Any],
        outputs: Sequence[str] | None = None,
        number_of_samples: int | None = None,
        seed: int = 0,
        design: str = "random",
    ) -> "Study":
        """The study that a user describes.

        Args:
            sets: by variable: a number, a list, or text as in `--set`: "0.5e6:2e6:100",
                "log:1e5:1e7:50", "0,9,12", "normal:45:2", "uniform:30:50".
            outputs: names; `OUTPUTS` by default.
            number_of_samples: needed with a distribution.
            seed: of the samples, at least 0.
            design: "random", "lhs" (Latin hypercube) or "sobol".

        Raises:
            UserError: an axis, an output or a number isn't allowed.
        """
        axes = tuple(parse_axis(name, spec) for name, spec in sets.items())
        names = OUTPUTS if outputs is None else tuple(str(name).strip() for name in outputs)
        number = 1 if number_of_samples is None else number_of_samples
        study, samples = cls(axes, names, number, seed, design), f"--samples {number:,}"
        designs = ("random", "lhs", "sobol")
        without, random = number_of_samples is None, bool(study.distributions)
        of_nothing = "has no distribution to draw from, e.g. --set club_speed=normal:45:2"
        too_many = f"is refused: the design sobol gives at most {2**30:,}"
        for refused, reason in (
            (not axes, "nothing is swept: give --set NAME=LO:HI:COUNT, e.g. k=0.5e6:2e6:100"),
            (not names, "outputs is an empty list: name one at least, or leave it out"),
            (len({*names}) < len(names), f"--outputs {','.join(names)} names one output twice"),
            (design not in designs, f"--design {design} is unknown: it is {', '.join(designs)}"),
            (seed < 0, f"--seed {seed} is refused: it must be at least 0"),
            (random and without, "a distribution needs a number of samples: give --samples N"),
            (not random and not without, f"{samples} {of_nothing}"),
            (number < 1, f"{samples} is refused: it must be at least 1"),
            (design == "sobol" and number > 2**30, f"{samples} {too_many}"),
        ):
            if refused:
                raise UserError(reason)
        return study

    @property
    def grid(self) -> tuple[Grid, ...]:
        """The axes that are lists of values."""
        return tuple(axis for axis in self.axes if isinstance(axis, Grid))

    @property
    def varied_grid(self) -> tuple[Grid, ...]:
        """Those of them with more than one value."""
        return tuple(axis for axis in self.grid if len(axis.values) > 1)

    @property
    def distributions(self) -> tuple[Distribution, ...]:
        return tuple(axis for axis in self.axes if isinstance(axis, Distribution))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(axis.name for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """The numbers of values of the grid's axes, and of samples."""
        return (*(len(axis.values) for axis in self.grid), self.number_of_samples)

    @property
    def cases(self) -> int:
        return math.prod(self.shape)

    def columns(self, index: np.ndarray) -> Columns:
        """Arrays of the swept variables' values in the cases of these numbers (from 0), by name.

        Each is a function of the case's number alone: chunks of any size give the same.
        """
        *points, sample = np.unravel_index(index, self.shape)
        columns = {axis.name: axis.values[at] for axis, at in zip(self.grid, points)}
        columns |= {name: samples[sample] for name, samples in self._samples.items()}
        return {name: columns[name] for name in self.names}

    @cached_property
    def _samples(self) -> dict[str, np.ndarray]:
        """The samples by variable, shape (number_of_samples,)."""
        generator, number = np.random.default_rng(self.seed), self.number_of_samples
        axes = self.distributions
        if self.design == "random":
            draws = (getattr(generator, axis.kind) for axis in axes)
            return {a.name: draw(a.first, a.second, number) for a, draw in zip(axes, draws)}
        try:
            from scipy.stats import qmc
        except ImportError as error:
            what, otherwise = f"the design {self.design}", ", or use --design random"
            raise missing_package(what, "SciPy", "sweep", otherwise) from error
        if self.design == "lhs":
            # Its dimensions are independent: separately they take less memory.
            units = (qmc.LatinHypercube(1, seed=generator).random(number)[:, 0] for _ in axes)
        else:
            with warnings.catch_warnings():
                # Balanced only for powers of 2: any other number is still a fair sample.
                warnings.simplefilter("ignore", UserWarning)
                units = iter(qmc.Sobol(len(axes), seed=generator).random(number).T)
        return {axis.name: axis.of_scipy().ppf(next(units)) for axis in axes}


def read_study(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read a TOML file: swept variables by name, as `Study.of` takes them, and other options.

    UserError if it can't be read, or has a key that isn't in `KEYS`, or a value of another type.
    """
    options = read_toml(path)
    sets = options.pop("set", {})
    if not isinstance(sets, dict):
        raise UserError(f"{path}: write a table [set] with a line for each swept variable")
    for key, value in options.items():
        if key not in KEYS:
            raise UserError(f"{path}: {unknown_name('key', key, KEYS, ', [set]')}")
        kind, words = KEYS[key]
        # Not isinstance: a Boolean is an integer to Python. No path has a NUL character.
        if type(value) is not kind or "\0" in str(value):
            raise UserError(f"{path}: {key} = {value!r} is refused: it must be {words}")
    return sets, options
