"""Parametric sweeps: grids and samples of distributions, one row a case; their Sobol indices."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from functools import cached_property
from itertools import chain
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from golf_build import VERSION
from golf_impact.api import known_names, run_impacts
from golf_impact.data.balls import ball, conditions_of
from golf_impact.data.errors import UserError, missing_package
from golf_impact.data.quantities import LAWS_IN_WORDS, START
from golf_impact.data.runs import FLAGS, ImpactArrays
from golf_impact.data.units import si_values, unit_of

if TYPE_CHECKING:
    from golf_impact.fmu import Impact

#: Default outputs: those known at the end of contact.
OUTPUTS = (
    "smash_factor", "coefficient_of_restitution", "energy_efficiency", "club_velocity",
    "ball_velocity", "contact_time",
)  # fmt: skip

#: Of every case, whether they vary or not.
CONTACT = ("law", "k", "b")

METHODS = ("random", "lhs", "sobol")

_RANGES = {
    ":": "LO:HI:COUNT", "log": "log:LO:HI:COUNT", "normal": "normal:MEAN:SIGMA",
    "uniform": "uniform:LO:HI",
}  # fmt: skip
_FORMS = " | ".join(("VALUE", "A,B,C", *_RANGES.values()))

#: Points of the design for Sobol indices, a power of 2: each takes an impact for every variable and
#: two more. Resamples of these points, from which the intervals are.
_POINTS, _RESAMPLES = 4096, 200

#: Values of a grid's axis, or a frozen distribution of SciPy.
Axis = Any


def parse_axis(name: str, given: Any) -> Axis:
    """An axis from text, a number or a list: floats (SI units), integers (law), names (ball).

    UserError: it has none of the forms above.
    """
    text = given if isinstance(given, str) else ",".join(map(str, np.ravel(given).tolist()))
    if name == "ball":
        return np.array([ball(one.strip()).name for one in text.split(",")], object)
    try:
        axis = _parse(text.strip(), unit_of(name))
        if name != "law":
            return axis
        # An Integer of FMI has 32 bits.
        if _is_random(axis) or (axis % 1.0).any() or (abs(axis) > 2e9).any():
            raise ValueError
    except ValueError as error:
        why = LAWS_IN_WORDS if name == "law" else f"{error}; write {_FORMS}"
        raise UserError(f"{name}={text} is refused: {why}", name, given, why) from None
    return axis.astype(np.int64)


def _parse(text: str, unit: str) -> Axis:
    kind, _, rest = text.partition(":")
    kind = kind.strip().lower()
    if kind not in _RANGES:
        if rest and kind.isalpha():
            raise ValueError(f"there is no distribution {kind!r}")
        kind, rest = ":" if ":" in text else "", text
    numbers = rest.split(":" if kind else ",")
    given = len(numbers)
    count = float(numbers.pop()) if kind in (":", "log") else 1.0
    values = np.array(si_values(numbers, unit)) if numbers else np.array([])
    if not np.isfinite(values).all():
        raise ValueError("its numbers must be finite")
    if not kind:
        return values
    if len(values) != 2:
        needed = 2 + (kind in (":", "log"))
        raise ValueError(f"{given} numbers are given, {_RANGES[kind]} needs {needed}")
    low, high = values.tolist()
    for wrong, why in (
        (kind == "normal" and high <= 0.0, f"the standard deviation {high:g} must be > 0"),
        (kind == "log" and low <= 0.0, f"a logarithmic range begins above 0, not at {low:g}"),
        (kind != "normal" and low > high, f"the range begins at {low:g}, above its end {high:g}"),
        # More would be a typing error.
        (count % 1.0 or not 1 <= count <= 1e7, f"the count {count:g} isn't 1 to 10,000,000"),
    ):
        if wrong:
            raise ValueError(why)
    if kind in (":", "log"):
        return (np.geomspace if kind == "log" else np.linspace)(low, high, int(count))
    try:
        from scipy import stats
    except ImportError as error:
        raise missing_package("a distribution", "SciPy", "sweep") from error
    return stats.norm(low, high) if kind == "normal" else stats.uniform(low, high - low)


def _is_random(axis: Axis) -> bool:
    return hasattr(axis, "ppf")


def varies(values: np.ndarray) -> bool:
    """Whether finite values differ by more than rounding."""
    return values.size > 0 and bool(np.ptp(values) > 1e-9 * np.abs(values).max())


class Design:
    """The cases of a sweep, and what is read; arguments and errors as of `sweep`.

    Attributes:
        axes: of the grid and distributions, by variable.
        grid: those of the grid; the last one varies fastest.
        distributions: the others; their samples vary faster still.
        outputs: names.
        seed: of the samples.
        method: how they are drawn.
        threads: the most processors to use.
        shape: numbers of values of the grid's axes, and of samples.
        cases: their product.
    """

    def __init__(
        self,
        sets: Mapping[str, Any],
        outputs: Iterable[str] = OUTPUTS,
        samples: int | None = None,
        seed: int = 0,
        method: str = "random",
        threads: int | None = None,
    ) -> None:
        self.threads = threads
        self.axes = {name: parse_axis(name, given) for name, given in sets.items()}
        self.grid = {name: axis for name, axis in self.axes.items() if not _is_random(axis)}
        self.distributions = {name: axis for name, axis in self.axes.items() if _is_random(axis)}
        self.outputs, self.seed, self.method = known_names(outputs), seed, method
        self.shape = (*map(len, self.grid.values()), 1 if samples is None else samples)
        self.cases = prod(self.shape)
        known_names(self.axes.keys() - {"ball"}, "input or parameter")
        number, random = f"samples = {samples}", bool(self.distributions)
        for refused, reason in (
            (not self.axes, "nothing is swept: give NAME=LO:HI:COUNT, e.g. k=0.5e6:2e6:100"),
            (not self.outputs, "there is no output: name one at least"),
            (len({*self.outputs}) < len(self.outputs), "an output is named twice"),
            (method not in METHODS, f"method {method} is unknown: it is {', '.join(METHODS)}"),
            (seed < 0, f"seed = {seed} is refused: it must be at least 0"),
            (random and samples is None, "a distribution needs a number of samples (--samples N)"),
            (not random and samples is not None, f"{number}: there is no distribution to sample"),
            (self.shape[-1] < 1, f"{number} is refused: it must be at least 1"),
            (self.cases > 10**9, f"{self.cases:,} cases are refused: at most 1,000,000,000"),
        ):
            if refused:
                raise UserError(reason)
        self._samples: dict[str, np.ndarray] = {}
        if random:
            generator = np.random.default_rng(seed)
            shares = _shares(method, len(self.distributions), generator, self.shape[-1])
            for n, (name, axis) in enumerate(self.distributions.items()):
                shares[:, n] = axis.ppf(shares[:, n])
                self._samples[name] = shares[:, n]

    @cached_property
    def drawn(self) -> str:
        """The output of the picture: the first that varies in some of the cases, or else the first.

        In a linear law S, COR and E don't depend on speed.
        """
        # They are computed for this alone, each once: some impacts take milliseconds.
        some = np.unique(np.random.default_rng(0).integers(self.cases, size=100))
        found = self.run(self.columns(some)) if len(self.outputs) > 1 else {}
        columns = {name: np.asarray(found[name], float) for name in self.outputs if found}
        varied = (name for name, c in columns.items() if varies(c[np.isfinite(c)]))
        return next(varied, self.outputs[0])

    def columns(self, cases: np.ndarray) -> dict[str, np.ndarray]:
        """The swept variables in the cases of these numbers, by name."""
        *points, sample = np.unravel_index(cases, self.shape)
        columns = {name: values[at] for (name, values), at in zip(self.grid.items(), points)}
        columns |= {name: values[sample] for name, values in self._samples.items()}
        return {name: columns[name] for name in self.axes}

    def values(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """Inputs and parameters in the cases of these columns: swept ones, and those of balls."""
        values = {name: column for name, column in columns.items() if name != "ball"}
        if "ball" in columns:
            balls = {name: ball(name) for name in self.grid["ball"]}
            index = np.array([[*balls].index(name) for name in columns["ball"]])
            for name in {*chain(*(one.values for one in balls.values()))} - values.keys():
                table = [one.values.get(name, START[name]) for one in balls.values()]
                values[name] = np.array(table)[index]
            values |= conditions_of(balls.values(), self.axes)
        return values

    def run(self, columns: Mapping[str, Any], impact: Impact | None = None) -> ImpactArrays:
        """The table of these cases: swept variables, law, k and b, outputs.

        Through an FMU if one is given.
        """
        number = len(next(iter(columns.values())))
        values = {name: np.broadcast_to(x, number) for name, x in self.values(columns).items()}
        if impact is None:
            found = run_impacts(self.outputs, threads=self.threads, **values)
        else:
            found = impact.many(self.outputs, **values)
        # Of a ball whose stiffness nobody measured, what depends on it isn't known.
        for name in self.grid["ball"] if "ball" in columns else ():
            for unknown in ball(name).unknown({*found} - {*FLAGS}, self.axes):
                mine = np.asarray(columns["ball"]) == name
                found[unknown] = np.where(mine, np.nan, found[unknown])
        contact = {name: values.get(name, np.full(number, START[name])) for name in CONTACT}
        contact["law"] = contact["law"].astype(np.int64)
        return ImpactArrays({**columns, **contact, **found}, found.refused, found.reason)


def _shares(method: str, dimensions: int, generator: Any, number: int) -> Any:
    """Points in the unit cube, shape (number, dimensions)."""
    if method == "random":
        return generator.random((number, dimensions))
    from scipy.stats import qmc

    sampler = qmc.Sobol if method == "sobol" else qmc.LatinHypercube
    with warnings.catch_warnings():
        # Balanced only for powers of 2: any other number is still a fair sample.
        warnings.simplefilter("ignore", UserWarning)
        return sampler(dimensions, seed=generator).random(number)


def sweep(
    sets: Mapping[str, Any],
    outputs: Iterable[str] = OUTPUTS,
    *,
    samples: int | None = None,
    seed: int = 0,
    method: str = "random",
    threads: int | None = None,
) -> ImpactArrays:
    """Compute the impacts of a grid of values, of samples of distributions, or of both.

    Args:
        sets: by input, parameter or "ball": a number, a list, or text as in `golf-impact sweep`:
            "0.5e6:2e6:100", "log:1e5:1e7:50", "0,9,12", "normal:45:2", "uniform:30:50", names of
            balls. The last one varies fastest, samples faster still.
        outputs: Real or Boolean outputs.
        samples: with a distribution their number, the same samples at every point of the grid.
        seed: of the samples, at least 0.
        method: "random", "lhs" (Latin hypercube) or "sobol" (Sobol sequence).
        threads: the most processors to use, as of `golf_impact.run_impacts`.

    Returns:
        The swept variables, law, k and b, then the outputs, by name (SI units): arrays of shape
        (cases,), with attributes and missing values as of `golf_impact.run_impacts`.

    Raises:
        UserError: there is no variable of a name, or something else isn't allowed.

    Example:
        >>> table = sweep({"law": 2, "k": [5e5, 1e6], "b": "0:9:2"}, ["smash_factor"])
        >>> table["b"], table["smash_factor"].round(3)
        (array([0., 9., 0., 9.]), array([1.641, 1.562, 1.641, 1.584]))
    """
    design = Design(sets, outputs, samples, seed, method, threads)
    return design.run(design.columns(np.arange(design.cases)))


def sobol_indices(design: Design, impact: Impact | None = None) -> dict[str, Any]:
    """First-order and total Sobol indices of all outputs, with 95 % intervals (bootstrap).

    The shares of an output's variance that a variable explains alone (Saltelli et al., Comput.
    Phys. Commun. 181, 259-270, 2010) and with all its interactions (Jansen, Comput. Phys. Commun.
    117, 35-43, 1999), by SALib, from impacts of a design of its own. Points without a result are
    left out, which `scipy.stats.sobol_indices` can't do; nor are its intervals reproducible.

    Returns:
        {"first_order" | "total": {output: {variable: [value, low, high]}}, "samples", "seed",
        "version"}; NaN for an output that is constant but for rounding.
    """
    try:
        from SALib.analyze.sobol import analyze
        from SALib.sample.sobol import sample
    except ImportError as error:
        raise missing_package("Sobol indices", "SALib", "sweep") from error
    axes, seed = design.distributions, design.seed
    problem = {"num_vars": len(axes), "names": [*axes], "bounds": [[0.0, 1.0]] * len(axes)}
    points = sample(problem, _POINTS, calc_second_order=False, seed=seed)
    columns = {name: np.repeat(values, len(points)) for name, values in design.grid.items()}
    columns |= {name: axis.ppf(points[:, n]) for n, (name, axis) in enumerate(axes.items())}
    found = design.run(columns, impact)
    rows = np.array([np.where(found.refused, np.nan, found[name]) for name in design.outputs])
    # The rows of a point of the design follow each other.
    rows = rows.reshape(len(rows), _POINTS, -1)
    rows = rows[:, np.isfinite(rows).all(axis=(0, 2))]
    indices: dict[str, Any] = {"first_order": {}, "total": {}}
    for output, values in zip(design.outputs, rows):
        shares = dict.fromkeys(("S1", "S1_conf", "ST", "ST_conf"), np.full(len(axes), np.nan))
        if varies(values):
            shares = analyze(
                problem,
                values.ravel(),
                calc_second_order=False,
                num_resamples=_RESAMPLES,
                seed=seed,
            )
        for kind, name in (("first_order", "S1"), ("total", "ST")):
            value, half = shares[name], shares[f"{name}_conf"]
            interval = np.stack([value, value - half, value + half], axis=-1)
            indices[kind][output] = dict(zip(axes, interval.tolist()))
    return indices | {"samples": _POINTS, "seed": seed, "version": VERSION}
