"""Parametric sweeps: grids and samples of distributions, one row a case; their Sobol indices."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from math import inf, prod
from numbers import Integral
from typing import Any

import numpy as np

from golf_build import VERSION
from golf_impact.api import known_names, run_impacts
from golf_impact.data.balls import ball, conditions_of
from golf_impact.data.errors import UserError, missing_package, refused, unknown_name
from golf_impact.data.quantities import LAWS_IN_WORDS, START
from golf_impact.data.runs import FLAGS, ImpactArrays
from golf_impact.data.units import si_values, unit_of

#: Default outputs: those known at the end of contact.
OUTPUTS = (
    "smash_factor", "coefficient_of_restitution", "energy_efficiency", "club_velocity",
    "ball_velocity", "contact_time",
)  # fmt: skip

#: Of every case, whether they vary or not.
CONTACT = ("law", "k", "b")

#: How samples are drawn: samplers of SciPy.
_METHODS = {"random": "", "lhs": "LatinHypercube", "sobol": "Sobol"}

#: Ranges by their first word.
_RANGES = {
    "": "LO:HI:COUNT with LO <= HI and a COUNT of 1 to 10,000,000; write 7e5:9e5:21",
    "log": "log:LO:HI:COUNT with 0 < LO <= HI and a COUNT of 1 to 10,000,000; write log:1e5:1e7:50",
    "normal": "normal:MEAN:SIGMA with SIGMA > 0; write normal:1e6:3e4",
    "uniform": "uniform:LO:HI with LO <= HI; write uniform:7e5:9e5",
}

#: Points of the design for Sobol indices, a power of 2: each takes an impact for every variable and
#: two more. Resamples of these points, from which the intervals are.
_POINTS, _RESAMPLES = 4096, 200

#: Values of a grid (SI units; names of balls), or a frozen distribution of SciPy.
Axis = Any


def parse_axis(name: str, given: Any) -> Axis:
    """An axis from text, a number or a list; UserError if it has none of the forms above."""
    text = given if isinstance(given, str) else ",".join(map(str, np.array(given, object).ravel()))
    if name == "ball":
        return np.array([ball(one.strip()).name for one in text.split(",")], object)
    try:
        axis = _parse(text, unit_of(name))
        if name == "law" and (_is_random(axis) or not {*axis.tolist()} <= {*range(1, 100)}):
            raise ValueError(LAWS_IN_WORDS)
    except ValueError as error:
        raise refused(name, given, str(error), f"{name}={text}") from None
    return axis


def _parse(text: str, unit: str) -> Axis:
    kind, *numbers = text.split(":")
    kind = kind.strip().lower()
    if not numbers:
        values = np.array(si_values(text.split(","), unit))
        if not np.isfinite(values).all():
            raise ValueError("it must be finite")
        return values
    if kind not in _RANGES:
        if kind.isalpha():
            raise ValueError(f"there is no range {kind}: choose from log, normal, uniform")
        kind, numbers = "", text.split(":")
    is_grid = kind in ("", "log")
    try:
        count = float(numbers.pop()) if is_grid else 1.0
    except ValueError:  # a unit, or a word
        count = np.nan
    low, high = si_values(numbers, unit) if len(numbers) == 2 else (np.nan, np.nan)
    rising = high > 0.0 if kind == "normal" else low <= high and (low > 0.0 or kind != "log")
    # A larger count would be a typing error.
    whole = count % 1.0 == 0.0 and 1.0 <= count <= 1e7
    if not (rising and whole and np.isfinite((low, high)).all()):
        raise ValueError(f"it isn't {_RANGES[kind]}, for instance")
    if is_grid:
        return (np.geomspace if kind else np.linspace)(low, high, int(count))
    try:
        from scipy import stats
    except ImportError as error:
        raise missing_package("a distribution", "SciPy", "sweep") from error
    return stats.norm(low, high) if kind == "normal" else stats.uniform(low, high - low)


def _is_random(axis: Axis) -> bool:
    return hasattr(axis, "ppf")


def _is_whole(number: Any, low: int, high: float) -> bool:
    return isinstance(number, Integral) and low <= int(number) <= high


def varies(values: np.ndarray) -> bool:
    """Whether some are finite and differ by more than rounding."""
    values = values[np.isfinite(values)]
    return values.size > 0 and bool(np.ptp(values) > 1e-9 * np.abs(values).max())


class Design:
    """The cases of a sweep, and what is read; arguments and errors as of `sweep`.

    Attributes:
        axes: of the grid and distributions, by variable.
        grid: those of the grid; the last one varies fastest.
        distributions: the others; their samples vary faster still.
        balls: those of the grid, by name.
        shape: numbers of values of the grid's axes, and of samples.
        cases: their product.
        impacts: computes them from outputs and columns: `run_impacts`, or `Impact.many`.
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
        known_names([name for name in sets if name != "ball"], "input or parameter")
        self.outputs = known_names(outputs)
        self.seed, self.method = seed, method
        self.impacts: Callable[..., ImpactArrays] = partial(run_impacts, threads=threads)
        self.axes = {name: parse_axis(name, given) for name, given in sets.items()}
        self.grid = {name: axis for name, axis in self.axes.items() if not _is_random(axis)}
        self.distributions = {name: axis for name, axis in self.axes.items() if _is_random(axis)}
        self.balls = {name: ball(name) for name in self.grid.get("ball", ())}
        if not self.axes:
            raise UserError("nothing is swept: give NAME=LO:HI:COUNT, e.g. k=0.5e6:2e6:100")
        if method not in [*_METHODS]:
            raise unknown_name("method", method, _METHODS)
        if not _is_whole(seed, 0, 2**32 - 1):
            raise refused("seed", seed, "it must be a whole number of 0 to 4,294,967,295")
        if not _is_whole(samples, 1, inf) if self.distributions else samples is not None:
            why = "distributions need a number of samples (--samples N), a grid has none"
            raise UserError(why, "samples", samples, why)
        self.shape = (*map(len, self.grid.values()), int(samples or 1))
        self.cases = prod(self.shape)
        if self.cases > 10**9:
            raise UserError(f"{self.cases:,} cases are refused: at most 1,000,000,000")
        self._samples: dict[str, np.ndarray] = {}
        if self.distributions:
            shares = _shares(method, len(self.distributions), seed, self.shape[-1])
            for (name, axis), column in zip(self.distributions.items(), shares.T):
                self._samples[name] = axis.ppf(column)

    def columns(self, cases: np.ndarray) -> dict[str, np.ndarray]:
        """The swept variables in the cases of these numbers, by name."""
        *points, sample = np.unravel_index(cases, self.shape)
        columns = {name: values[at] for (name, values), at in zip(self.grid.items(), points)}
        columns |= {name: values[sample] for name, values in self._samples.items()}
        return {name: columns[name] for name in self.axes}

    def run(self, columns: Mapping[str, Any]) -> ImpactArrays:
        """The table of these cases: swept variables, law, k and b, outputs."""
        values, presets = {**columns}, self.balls.values()
        balls = values.pop("ball", ())
        for name in {name for one in presets for name in one.values} - values.keys():
            of = {one.name: one.values.get(name, START[name]) for one in presets}
            values[name] = np.array([of[each] for each in balls])
        values |= conditions_of(presets, self.axes)
        found = self.impacts(self.outputs, **values)
        # Of a ball whose stiffness nobody measured, what depends on it isn't known.
        for one in presets:
            for name in one.unknown({*found} - {*FLAGS}, self.axes):
                found[name] = np.where(balls == one.name, np.nan, found[name])
        contact = {
            name: np.broadcast_to(values.get(name, START[name]), found.refused.shape)
            for name in CONTACT
        }
        contact["law"] = contact["law"].astype(np.int64)
        return ImpactArrays({**columns, **contact, **found}, found.refused, found.reason)


def _shares(method: str, dimensions: int, seed: int, number: int) -> Any:
    """Points in the unit cube, shape (number, dimensions)."""
    generator = np.random.default_rng(seed)
    if method == "random":
        return generator.random((number, dimensions))
    from scipy.stats import qmc

    with warnings.catch_warnings():
        # Balanced only for powers of 2: any other number is still a fair sample.
        warnings.simplefilter("ignore", UserWarning)
        return getattr(qmc, _METHODS[method])(dimensions, seed=generator).random(number)


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


def sobol_indices(design: Design) -> dict[str, Any]:
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
    found = design.run(columns)
    rows = np.array([np.where(found.refused, np.nan, found[name]) for name in design.outputs])
    # The rows of a point of the design follow each other.
    rows = rows.reshape(len(rows), _POINTS, -1)
    rows = rows[:, np.isfinite(rows).all(axis=(0, 2))]
    options: Any = {"calc_second_order": False, "num_resamples": _RESAMPLES}
    options["seed"] = seed or 2**32  # 0 is none to SALib
    none = dict.fromkeys(("S1", "S1_conf", "ST", "ST_conf"), np.full(len(axes), np.nan))
    indices: dict[str, Any] = {"first_order": {}, "total": {}}
    for output, values in zip(design.outputs, rows):
        estimates = analyze(problem, values.ravel(), **options) if varies(values) else none
        for kind, name in (("first_order", "S1"), ("total", "ST")):
            value, half = estimates[name], estimates[f"{name}_conf"]
            interval = np.stack([value, value - half, value + half], axis=-1)
            indices[kind][output] = dict(zip(axes, interval.tolist()))
    return indices | {"samples": _POINTS, "seed": seed, "version": VERSION}
