"""Differential equations of second order, q'' = f(q, q'), by collocation at Chebyshev nodes.

On a panel the accelerations are Chebyshev series, found by Picard iteration at the nodes (C. W.
Clenshaw and H. J. Norton, Comput. J. 6 (1963) 88); their integrals are the dense output. A panel is
as long as its series converge: short where f has a kink. Quantities are listed as positions q and,
in the same order, their rates q'.
"""

from collections.abc import Callable, Sequence
from operator import sub
from typing import NamedTuple

from ..refusals import failure
from .chebyshev import INTEGRALS, NODES, ORDER, Series, dot, evaluate, integrate, interpolate

#: What a panel may leave out, and an iteration still change, relative to the speed.
_SERIES_TOLERANCE = 1e-14

#: Iterations on a panel before it is halved.
_ITERATIONS = 30

#: Relative to the time and the width tried first: a panel so short is accepted, since f jumps.
_SHORTEST = 1e-15


class Panel(NamedTuple):
    """The solution on an interval: the series of the quantities, and of the accelerations."""

    begin: float
    end: float
    start: Sequence[float]  #: quantities at the begin, where the series have rounding errors
    series: list[Series]
    accelerations: list[Series]

    def z(self, t: float) -> float:
        """The argument of the series."""
        return 2.0 * ((t - self.begin) / (self.end - self.begin)) - 1.0

    def function(self, series: Series) -> Callable[[float], float]:
        """A series as a function of time."""
        return lambda t: evaluate(series, self.z(t))

    def quantity(self, n: int) -> Callable[[float], float]:
        """A quantity as a function of time."""
        series, start, begin = self.series[n], self.start[n], self.begin
        return lambda t: start if t <= begin else evaluate(series, self.z(t))

    def at(self, t: float) -> Sequence[float]:
        """All quantities."""
        if t <= self.begin:
            return self.start
        z = self.z(t)
        return [evaluate(series, z) for series in self.series]

    def times(self) -> list[float]:
        """The begin, the nodes in order, the end: quantities have few extrema in between."""
        half = 0.5 * (self.end - self.begin)
        return [self.begin, *(self.begin + half * (1.0 + z) for z in reversed(NODES)), self.end]


#: From quantities to accelerations.
Equations = Callable[[Sequence[float]], Sequence[float]]


def next_panel(
    f: Equations, t: float, width: float, start: Sequence[float], speed: Callable[[float], float]
) -> tuple[Panel, float]:
    """The panel from a time t >= 0 on, and the width to try for the next one.

    Args:
        f: the accelerations; it may raise ArithmeticError or ValueError.
        t: where the panel begins.
        width: how wide it may be.
        start: the quantities at t.
        speed: that relative to which errors of rates count, above 0, from the width of a panel.

    ArithmeticError, ValueError: f has no numbers right after t.
    """
    shortest = _SHORTEST * (t + width)
    while True:
        width = (t + width) - t
        half, allowed = 0.5 * width, _SERIES_TOLERANCE * speed(width)
        try:
            slopes = _slopes(f, t, half, start, allowed)
        except (ArithmeticError, ValueError):
            if width <= shortest:
                raise
            width *= 0.5
            continue
        series = [interpolate(slope) for slope in slopes]
        excess = max(abs(slope[0]) + abs(slope[1]) for slope in series) * width / allowed
        if excess <= 1.0 or width <= shortest:
            break
        # At a kink the last coefficients fall slowly with the width, elsewhere fast.
        width *= min(max(excess**-0.4, 0.1), 0.5)
    rates = [integrate(*one, half) for one in zip(series, start[len(series) :])]
    positions = [integrate(*one, half) for one in zip(rates, start)]
    factor = max(excess, 1e-16) ** (-1.0 / ORDER)
    return Panel(t, t + width, start, positions + rates, series), factor * width


def _slopes(
    f: Equations, t: float, half: float, start: Sequence[float], allowed: float
) -> Sequence[Sequence[float]]:
    """The accelerations at the nodes of a panel; ArithmeticError: they don't converge."""

    def integrals(slopes: Sequence[Sequence[float]], starts: Sequence[float]) -> list[list[float]]:
        return [
            [start + half * dot(row, slope) for row in INTEGRALS]
            for slope, start in zip(slopes, starts)
        ]

    moving = start[len(start) // 2 :]
    rates = [[value] * ORDER for value in moving]
    for _ in range(_ITERATIONS):
        # Before f, which may be 0 at the start alone: then rates don't change, but haven't
        # converged.
        positions, before = integrals(rates, start), rates
        slopes = list(zip(*map(f, zip(*positions, *rates))))
        rates = integrals(slopes, moving)
        if all(max(map(abs, map(sub, *both))) <= allowed for both in zip(rates, before)):
            return slopes
    raise failure("NO_NUMBERS", time=t)
