"""Series of measurements; sign, baseline, clipping and impulse of force curves."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from golf_impact.errors import UserError
from golf_impact.units import SYMBOLS

#: Baselines of a sensor by the number of their coefficients; rows outside contact that one needs.
BASELINES, _OUTSIDE = ("zero", "constant", "linear"), 10


@dataclass(frozen=True)
class Series:
    """A measured series, SI units: time and force, or approach speed and COR, arrays (n,)."""

    name: str  #: the file, or the argument in Python
    where: Callable[[int], str]  #: the place of a row (from 0), for messages
    x: np.ndarray
    y: np.ndarray
    sigma: np.ndarray | None = None  #: of y; None if it follows from the residuals
    # Of a curve:
    impact: Mapping[str, float] = field(default_factory=dict)  #: as `measurements.IMPACT`
    step: float = 0.0  #: the resolution of y, N
    notes: tuple[str, ...] = ()  #: what was changed or is missing, in sentences
    origin: float = 0.0  #: the instant of the first row in contact, s
    #: Offset at `origin` (N) and drift (N/s) of the sensor, as far as it has them, by the rows
    #: before and after contact.
    baseline: tuple[float, ...] = ()

    @cached_property
    def force(self) -> np.ndarray:
        """y without the baseline."""
        return self.y - np.polyval(self.baseline[::-1], self.x - self.origin)

    @cached_property
    def contact(self) -> np.ndarray:
        """Rows of a curve with more than a quarter of the largest force."""
        return np.flatnonzero(self.force > 0.25 * self.force.max())

    @cached_property
    def spacing(self) -> float:
        """Time between rows, s."""
        return float(np.median(np.diff(self.x)))

    @property
    def sigma_or_guess(self) -> np.ndarray:
        """σ; where it isn't given 1 % of the largest value, until residuals determine it."""
        if self.sigma is None:
            return np.full(len(self.y), 0.01 * self.force.max())
        return self.sigma

    def rows(self, chosen: slice | np.ndarray) -> Series:
        sigma = self.sigma if self.sigma is None else self.sigma[chosen]
        return replace(self, x=self.x[chosen], y=self.y[chosen], sigma=sigma)

    def thinned(self, rows: int) -> Series:
        """Of contact and margins so many rows, or an eighth, if there are more."""
        if len(self.x) <= rows:
            return self
        first, last = self.contact[[0, -1]].tolist()
        margin = (last - first) // 2 + 1
        first, last = max(first - margin, 0), last + margin + 1
        return self.rows(slice(first, last, min(8, math.ceil((last - first) / rows))))


def reduced_mass(impact: Mapping[str, float]) -> float:
    """Of club and ball, kg."""
    return 1.0 / (1.0 / impact["m_club"] + 1.0 / impact["m_ball"])


def conditioned(curve: Series, baseline: str) -> Series:
    """The curve with a force above 0, its baseline found, without rows at the sensor's limit.

    UserError: it is no curve of a contact, or its impulse isn't possible.
    """
    x, y, notes = curve.x, curve.y, []
    if (backward := np.flatnonzero(np.diff(x) <= 0.0)).size:
        n = int(backward[0]) + 1
        what = f"time = {x[n]:g} s isn't after {x[n - 1]:g} s"
        raise UserError(f"{curve.where(n)}: {what}; sort the rows by time and remove duplicates")
    few = max(1, min(len(y) // 20, 1000))
    ends = float(np.median(y[:few])), float(np.median(y[-few:]))
    if max(ends) - y.min() > y.max() - min(ends):
        y, ends = -y, (-ends[0], -ends[1])
        notes.append("the force is negative; its sign was changed")
    level = min(ends)
    inside = np.flatnonzero(y - level > 0.25 * (y.max() - level))
    origin = float(x[inside[0]]) if len(inside) else 0.0
    lasting = float(np.ptp(x[inside])) if len(inside) else 0.0
    before, after = x < origin - 0.25 * lasting, x > origin + 1.25 * lasting
    # The force of a strongly damped contact ends late; a line doesn't describe it.
    late = before.sum() >= _OUTSIDE
    late = late and _scatter(x[after], y[after]) > 2.0 * _scatter(x[before], y[before])
    outside = before if late else before | after
    found = _baseline(x[outside] - origin, y[outside], baseline)
    curve = replace(curve, y=y, origin=origin, baseline=found)
    force, peak = curve.force, int(curve.force.argmax())
    why = ""
    if force[peak] <= -3.0 * force.min():
        why = "is no more than the rest: there is no touch"
    elif lasting > 0.02:
        unit = "ms" if lasting < 20.0 else "µs"
        head = f"time [{unit}] in its header, or --columns 'time [{unit}],force'"
        why = f"is in a contact of {lasting:.3g} s, not of 600e-6: for {unit} write {head}"
    elif len(inside) < 5:
        rows = "1 row" if len(inside) == 1 else f"{len(inside)} rows"
        why = f"is one of only {rows} in contact: 5 are needed"
    elif peak == 0 or inside[-1] == 0:
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
        curve = curve.rows(~top)
    for at, what in ((slice(3), "begins"), (slice(-3, None), "ends")):
        if np.median(force[at]) > 0.1 * force[peak]:
            share = 100.0 * np.median(force[at]) / force[peak]
            notes.append(f"the record {what} in contact, at {share:.0f} % of the largest force")
    curve = replace(curve, notes=tuple(notes), step=step)
    _check_impulse(curve)
    return curve


def _scatter(x: np.ndarray, y: np.ndarray) -> float:
    """Standard deviation of rows about a line."""
    if len(x) < 3:
        return 0.0
    return float(np.std(y - np.polynomial.Polynomial.fit(x, y, 1)(x)))


def _baseline(x: np.ndarray, y: np.ndarray, kind: str) -> tuple[float, ...]:
    """Coefficients of a baseline of this kind, or of the one with the least AIC.

    Of fewer rows than 10 outside contact it is 0, unless a kind is requested.
    """
    if not kind and len(y) < _OUTSIDE:
        return ()
    best: tuple[float, ...] = ()
    least = math.inf
    for degree in [BASELINES.index(kind)] if kind else range(len(BASELINES)):
        powers = np.vander(x, degree, increasing=True)
        found = np.linalg.lstsq(powers, y, rcond=None)[0] if len(y) > degree else np.zeros(degree)
        # Residuals below a millionth are rounding.
        noise = max(float(np.mean((y - powers @ found) ** 2)), 1e-12 * float(np.mean(y**2)))
        aic = len(y) * math.log(max(noise, 1e-30)) + 2.0 * degree
        if kind or aic < least:
            best, least = tuple(found.tolist()), aic
    return best


def _check_impulse(curve: Series) -> None:
    """Raise UserError for a curve whose impulse isn't (1 + COR) times reduced mass times speed.

    A force on the head adds its own impulse times reduced mass over the head's.
    """
    speed, m_club, m_ball, pushed = curve.impact.values()
    x, reduced = curve.x, reduced_mass(curve.impact)
    first, last = x[curve.contact[[0, -1]]]
    margin = 0.25 * (last - first)
    inside = (x > first - margin) & (x < last + margin)
    impulse = float(np.trapezoid(curve.force[inside], x[inside]))
    impulse -= pushed * (last - first) * reduced / m_club
    ratio = impulse / (reduced * speed)
    # An incomplete record has less.
    if (0.5 if curve.notes else 0.95) < ratio < 2.05:
        return
    hints = [
        f"{speed:g} looks like {symbol}: write --club-speed {speed:g}{symbol}"
        for symbol in ("mph", "km/h")
        if 1.0 < ratio / SYMBOLS[symbol][1] < 2.0
    ]
    if 1.0 < 1e3 * ratio < 2.0:
        hints.append("force looks like kN: write force [kN] in its header, or --columns")
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
