"""Kinds of measurements, each with its model: scalars, COR over speed, force curves. SI units."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import polynomial
from scipy.interpolate import CubicSpline

from golf_impact.api import run_impact, run_trajectory
from golf_impact.data.errors import UserError
from golf_impact.data.units import SYMBOLS
from golf_impact.studies.intervals import RANGES

#: Targets that depend on the damping alone, and the FMU's outputs. An impact of two bodies has one
#: COR, so that all of them together are one independent measurement.
RESTITUTION = {
    "ball_speed": "ball_velocity", "club_speed_after": "club_velocity",
    "cor": "coefficient_of_restitution", "smash_factor": "smash_factor",
    "energy_efficiency": "energy_efficiency", "impulse": "impulse",
}  # fmt: skip

#: Outputs of the FMU that may be measured, by the name that results have.
TARGETS = RESTITUTION | {
    name: name
    for name in (
        "contact_time", "max_force", "time_of_max_force", "max_compression", "contact_displacement"
    )
}  # fmt: skip

#: The impact of a measurement, if nothing else is given: speed (m/s), masses (kg) and the force on
#: the club head (N).
IMPACT = {"club_speed": 35.0, "m_club": 0.210, "m_ball": 0.04593, "club_force": 0.0}

#: Parameters of a curve in a fit, with their units in SI units: the instant of touch since the
#: curve's origin, offset and drift of its baseline. Their scales are alike.
UNITS = {"touch": 1e-6, "offset": 1.0, "drift": 1e3}

#: Baselines of a sensor by the number of their coefficients; rows outside contact that one needs.
BASELINES, _OUTSIDE = ("zero", "constant", "linear"), 10

#: Rows in contact above which the force is a cubic spline between so many instants, denser towards
#: touch.
_INSTANTS = 1000

#: Values by name: those of the law, of an impact, and of curves.
Values = Mapping[str, Any]


class Measured(NamedTuple):
    """A number with its standard deviation."""

    value: float
    sigma: float
    stated: bool = True  #: whether σ was given; otherwise it is the default


def inputs(values: Values, impact: Mapping[str, float]) -> dict[str, Any]:
    """Inputs and parameters of the FMU: of a law, and of an impact as far as it isn't fitted."""
    law = {n: values[n] for n in ("law", "reference_compression", *RANGES) if n in values}
    return {**law, **impact, **{name: values[name] for name in IMPACT if name in values}}


def reduced_mass(impact: Mapping[str, float]) -> float:
    """Of club and ball."""
    return 1.0 / (1.0 / impact["m_club"] + 1.0 / impact["m_ball"])


def compute_scalars(names: Sequence[str], values: Values) -> dict[str, float]:
    """Scalars of these names, by the engine."""
    found = run_impact([TARGETS[name] for name in names], **values)
    if any(map(math.isnan, found.values())):
        raise UserError("the bodies don't separate")
    return dict(zip(names, found.values()))


class Scalars:
    """Results of one impact."""

    def __init__(self, measured: Mapping[str, Measured], impact: Mapping[str, float]) -> None:
        self.measured, self.impact = measured, impact
        self.y, self.guess, _ = np.array([*measured.values()], float).reshape(-1, 3).T

    def model(self, values: Values) -> np.ndarray:
        found = compute_scalars([*self.measured], inputs(values, self.impact))
        return np.array([*found.values()])


class Priors(Scalars):
    """Parameters that are known beforehand, of law or impact."""

    def model(self, values: Values) -> np.ndarray:
        return np.array([values[name] for name in self.measured])


@dataclass(frozen=True)
class Series:
    """COR against approach speed, arrays (n,); the parent of curves."""

    name: str  #: the file, or the argument in Python
    where: Callable[[int], str]  #: the place of a row (from 0), for messages
    x: np.ndarray
    y: np.ndarray
    sigma: np.ndarray | None = None  #: of y; None if it follows from the residuals
    step: float = 0.0  #: the resolution of y
    notes: tuple[str, ...] = ()  #: what was changed, left out or is missing, in sentences
    clipped: bool = False  #: whether rows at a sensor's limit are left out

    @property
    def signal(self) -> np.ndarray:
        """What the law describes of y."""
        return self.y

    @property
    def guess(self) -> np.ndarray:
        """σ; where it isn't given 1 % of the largest value, until residuals determine it."""
        return np.full(len(self.y), 0.01 * self.signal.max()) if self.sigma is None else self.sigma

    def model(self, values: Values) -> np.ndarray:
        """A line, from which law 2 takes its damping."""
        cor = values["restitution_at_rest"] - values["restitution_slope"] * self.x
        if cor.min() <= 0.0:
            raise UserError("COR isn't above 0 at these speeds")
        return cor


@dataclass(frozen=True)
class Curve(Series):
    """Contact force over time, with any zero of time and perhaps a baseline."""

    impact: Mapping[str, float] = field(default_factory=IMPACT.copy)
    suffix: str = ""  #: of its own parameters: touch_2
    origin: float = 0.0  #: the instant of the first row in contact, s
    #: Offset at `origin` (N) and drift (N/s) of the sensor, as far as it has them, by the rows
    #: before and after contact.
    baseline: tuple[float, ...] = ()

    @property
    def own(self) -> list[str]:
        """Names of the parameters that this curve alone may have."""
        return [of + self.suffix for of in ("k", *UNITS)]

    @cached_property
    def signal(self) -> np.ndarray:
        """y without the baseline."""
        return self.y - np.polyval(self.baseline[::-1], self.x - self.origin)

    @cached_property
    def contact(self) -> np.ndarray:
        """Rows with more than a quarter of the largest force."""
        return np.flatnonzero(self.signal > 0.25 * self.signal.max())

    @cached_property
    def spacing(self) -> float:
        """Time between rows, s."""
        return float(np.median(np.diff(self.x)))

    def rows(self, chosen: slice | np.ndarray, **changes: Any) -> Curve:
        sigma = self.sigma if self.sigma is None else self.sigma[chosen]
        places, where = np.arange(len(self.x))[chosen], self.where
        changes = {"where": lambda row: where(int(places[row])), **changes}
        return replace(self, x=self.x[chosen], y=self.y[chosen], sigma=sigma, **changes)

    def thinned(self, rows: int) -> Curve:
        """Of a free head; if there are more rows so many of contact and margins, or an eighth."""
        chosen = slice(None)
        if len(self.x) > rows:
            first, last = self.contact[[0, -1]].tolist()
            margin = (last - first) // 2 + 1
            first, last = max(first - margin, 0), last + margin + 1
            chosen = slice(first, last, min(8, math.ceil((last - first) / rows)))
        return self.rows(chosen, impact={**self.impact, "club_force": 0.0})

    def since_touch(self, values: Values) -> np.ndarray:
        return self.x - self.origin - UNITS["touch"] * values["touch" + self.suffix]

    def model(self, values: Values) -> np.ndarray:
        """Force and baseline."""
        law = inputs(values, self.impact) | {"k": values.get("k" + self.suffix, values["k"])}
        own = (UNITS[of] * values.get(of + self.suffix, 0.0) for of in ("drift", "offset"))
        baseline = np.polyval([*own], self.x - self.origin)
        return _forces(self.since_touch(values), law) + baseline


def _forces(times: np.ndarray, impact: Values) -> np.ndarray:
    """Contact force at times since first touch."""
    force = np.zeros(times.shape)
    end = compute_scalars(["contact_time"], impact)["contact_time"]
    inside = (times > 0.0) & (times < end)
    rows = instants = times[inside]
    if len(rows) > _INSTANTS:
        instants = end * np.linspace(1e-3, 1.0 - 1e-9, _INSTANTS) ** 2
    sampled = run_trajectory(0, ["force"], times=instants, **impact)["force"]
    if rows is not instants:
        sampled = CubicSpline(np.sqrt(instants), sampled)(np.sqrt(rows))
    force[inside] = sampled
    return force


def conditioned(curve: Curve, baseline: str) -> Curve:
    """The curve with a force above 0, its baseline found, without rows at the sensor's limit.

    UserError: it is not the curve of a contact, or its impulse isn't possible.
    """
    x, y, notes = curve.x, curve.y, [*curve.notes]
    if (backward := np.flatnonzero(np.diff(x) <= 0.0)).size:
        n = int(backward[0]) + 1
        what = f"time = {x[n]:g} s isn't after {x[n - 1]:g} s"
        how = "sort the rows by time and remove duplicates"
        if x[n] <= x[0] + 0.01 * abs(x[n - 1] - x[0]):
            how = "a further segment begins there: save one segment as a file"
        raise UserError(f"{curve.where(n)}: {what}; {how}")
    few = max(1, min(len(y) // 20, 1000))
    ends = np.array([np.median(y[:few]), np.median(y[-few:])])
    if ends.max() - y.min() > y.max() - ends.min():
        y, ends = -y, -ends
        notes.append("the force is negative; its sign was changed")
    if (cut := _first_pulse(x, y - ends.min())) is not None:
        # Each pulse has its own approach speed.
        notes.append(f"a second pulse from {x[cut]:.4g} s on is left out")
        curve, x, y = curve.rows(slice(cut)), x[:cut], y[:cut]
    inside = np.flatnonzero(y - ends.min() > 0.25 * (y.max() - ends.min()))
    origin, lasting = (float(x[inside[0]]), float(np.ptp(x[inside]))) if len(inside) else (0.0, 0.0)
    outside = before = x < origin - 0.25 * lasting
    after = x > origin + 1.25 * lasting
    # The force of a strongly damped contact ends late; a line doesn't describe it.
    late = before.sum() >= _OUTSIDE
    if not (late and _scatter(x[after], y[after]) > 2.0 * _scatter(x[before], y[before])):
        outside = before | after
    found = _baseline(x[outside] - origin, y[outside], baseline)
    curve = replace(curve, y=y, origin=origin, baseline=found)
    force, peak = curve.signal, int(curve.signal.argmax())
    why = ""
    if force[peak] <= -3.0 * force.min():
        why = "is no more than the rest: there is no touch"
    elif lasting > 0.02:
        unit = "ms" if lasting < 20.0 else "µs"
        head = f"time [{unit}] in its header, or --columns 'time [{unit}],force'"
        why = f"is in a contact of {lasting:.3g} s, not of 600e-6: for {unit} write {head}"
    elif len(inside) < 5:
        why = f"is one of only {len(inside)} row{'s' * (len(inside) > 1)} in contact: 5 are needed"
    elif peak == 0:
        why = "is the first: the record was triggered too late"
    if why:
        raise UserError(f"{curve.where(peak)}: the largest force, {force[peak]:.4g}, {why}")
    # The smallest difference of two values, but for rounding.
    steps = np.diff(np.unique(y))
    step = float(min(steps[steps > 1e-9 * abs(y).max()], default=0.0))
    # Of a peak that is resolved in steps less than 0.71 times as many rows are at the largest value
    # as within a step of it: it is a parabola, as high above its last step as a step or less.
    top = y == y.max()
    near = np.count_nonzero(y > y.max() - 1.5 * step)
    if top.sum() >= max(4, 0.1 * len(inside)) and top.sum() > 0.8 * near:
        notes.append(f"{top.sum()} rows at the largest force are left out: clipped")
        curve = curve.rows(~top, clipped=True)
    for at, what in ((slice(3), "begins"), (slice(-3, None), "ends")):
        share = np.median(force[at]) / force[peak]
        if share > 0.1:
            percent = f"{100.0 * share:.0f} % of the largest force"
            notes.append(f"the record {what} in contact, at {percent}")
            curve = replace(curve, clipped=True)
    _check_impulse(curve)
    if lasting < 30.0 * curve.spacing:
        notes.append(
            f"only {len(inside)} rows in contact: a filter of 10 kHz takes 10 % of k, 20 kHz is fine"  # noqa: E501
        )
    return replace(curve, notes=tuple(notes), step=step)


def _first_pulse(x: np.ndarray, y: np.ndarray) -> int | None:
    """The row at which a record with a second pulse is cut; None if there is only one.

    UserError: the second one follows without a pause at zero.
    """
    high = y > 0.25 * y.max()
    # A pulse ends below a tenth of the largest force.
    low, within = y < 0.1 * y.max(), False
    starts: list[int] = []
    stops: list[int] = []
    for n in np.flatnonzero(high | low).tolist():
        if within != bool(high[n]):
            (starts if high[n] else stops).append(n)
            within = bool(high[n])
    stops += [len(y)] * (len(starts) > len(stops))
    lengths = [stop - start for start, stop in zip(starts, stops)]
    long = [n for n, length in enumerate(lengths) if length >= max(5, 0.2 * max(lengths))]
    if len(long) < 2 or x[-1] - x[0] > 20.0:
        return None
    first, second = long[:2]
    pause = slice(stops[first], starts[second])
    quiet = np.count_nonzero(low[pause])
    if quiet >= max(3, 0.1 * lengths[first]):
        return int(starts[second] - max(1, quiet // 4))
    raise UserError(
        f"two pulses, at {x[starts[first]]:.4g} and {x[starts[second]]:.4g} s, without a pause at "
        "zero between them: cut the record: --window 0:2ms"
    )


def _scatter(x: np.ndarray, y: np.ndarray) -> float:
    """Standard deviation of rows about a line."""
    return float(np.std(y - np.polynomial.Polynomial.fit(x, y, 1)(x))) if len(x) > 2 else 0.0


def _baseline(x: np.ndarray, y: np.ndarray, kind: str) -> tuple[float, ...]:
    """Coefficients of a baseline of this kind, or of the one with the least AIC.

    Of fewer rows than 10 outside contact it is 0, unless a kind is requested.
    """
    sizes = [BASELINES.index(kind)] if kind else range(3 if len(y) >= _OUTSIDE else 1)

    def fitted(size: int) -> np.ndarray:
        return polynomial.polyfit(x, y, size - 1) if 0 < size < len(y) else np.zeros(size)

    def aic(size: int) -> float:
        off = y - polynomial.polyval(x, [*fitted(size), 0.0])
        # Residuals below a millionth are rounding.
        return len(y) * math.log(max(off @ off, 1e-12 * (y @ y), 1e-30)) + 2.0 * size

    return tuple(fitted(min(sizes, key=aic)).tolist())


def _check_impulse(curve: Curve) -> None:
    """Raise UserError for a curve whose impulse isn't (1 + COR) times reduced mass times speed.

    A force on the head adds its own impulse times reduced mass over the head's.
    """
    speed, m_club, m_ball, pushed = curve.impact.values()
    x, reduced = curve.x, reduced_mass(curve.impact)
    first, last = x[curve.contact[[0, -1]]]
    margin = 0.25 * (last - first)
    inside = (x > first - margin) & (x < last + margin)
    impulse = float(np.trapezoid(curve.signal[inside], x[inside]))
    impulse -= pushed * (last - first) * reduced / m_club
    ratio = impulse / (reduced * speed)
    # An incomplete record has less.
    if (0.5 if curve.clipped else 0.95) < ratio < 2.05:
        return
    hints = [
        f"{speed:g} looks like {symbol}: write --club-speed {speed:g}{symbol}"
        for symbol in ("mph", "km/h")
        if 1.0 < ratio / SYMBOLS[symbol][1] < 2.0
    ]
    if 1.0 < 1e3 * ratio < 2.0:
        hints.append("force looks like kN: write force [kN] in its header, or --columns")
    if ratio > 2.0:
        hints.append("if there are two pulses, cut the record: --window 0:2ms")
    hints.append(f"it fits club speeds of {speed * ratio / 2.0:.3g} to {speed * ratio:.3g} m/s")
    masses = [impulse / (speed * part) for part in (2.0, 1.0)]
    if masses[0] < m_ball:
        least, most = (m * m_ball / (m_ball - m) if m < m_ball else math.inf for m in masses)
        ends = f"from {least:.3g} to {most:.3g} kg" if most < 10.0 else f"of {least:.3g} kg or more"
        hints.append(f"or --m-club {ends}")
    raise UserError(
        f"{curve.name}: its impulse, {impulse:.4g} N·s, is {ratio:.3g} times reduced mass times "
        f"club speed ({speed:g} m/s, club {m_club:g} kg), where 1 to 2, 1 + COR, is possible; "
        f"{', '.join(hints)}"
    )
