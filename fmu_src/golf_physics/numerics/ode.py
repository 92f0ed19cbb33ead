"""Ordinary differential equations by collocation at Chebyshev nodes.

For positions q, their rates v and other quantities s the equations are

    q' = v,    (v, s)' = f(t, q, v, s)

On a panel the slopes are Chebyshev series, found by Picard iteration at the nodes (C. W. Clenshaw
and H. J. Norton, Comput. J. 6 (1963) 88); their integrals are the dense output. A panel is as long
as its series converge: short where f has a kink.
"""

from collections.abc import Callable, Sequence
from operator import sub
from typing import NamedTuple

from ..refusals import failure
from .chebyshev import INTEGRALS, NODES, ORDER, Series, dot, evaluate, integrate, interpolate

#: What a panel may leave out, and an iteration still change, relative to the scales.
_TOLERANCE = 1e-14

#: Iterations on a panel before it is halved.
_ITERATIONS = 30

#: Relative to the time and the width tried first: a panel so short is accepted, since f jumps.
_SHORTEST = 1e-15


class Panel(NamedTuple):
    """The solution on an interval: the series of q, v and s, and of the slopes of v and s."""

    begin: float
    end: float
    start: Sequence[float]  #: q, v and s at the begin, where the series have rounding errors
    series: list[Series]
    slopes: list[Series]

    def z(self, t: float) -> float:
        """The argument of the series."""
        return 2.0 * ((t - self.begin) / (self.end - self.begin)) - 1.0

    def function(self, series: Series) -> Callable[[float], float]:
        """A series as a function of time."""
        return lambda t: evaluate(series, self.z(t))

    def quantity(self, n: int) -> Callable[[float], float]:
        """A component of q, v, s as a function of time."""
        series, start, begin = self.series[n], self.start[n], self.begin
        return lambda t: start if t <= begin else evaluate(series, self.z(t))

    def at(self, t: float) -> Sequence[float]:
        """q, v and s."""
        if t <= self.begin:
            return self.start
        z = self.z(t)
        return [evaluate(series, z) for series in self.series]

    def times(self) -> list[float]:
        """The begin, the nodes in order, the end: quantities have few extrema in between."""
        half = 0.5 * (self.end - self.begin)
        return [self.begin, *(self.begin + half * (1.0 + z) for z in reversed(NODES)), self.end]


Equations = Callable[[float, Sequence[float]], Sequence[float]]


def next_panel(
    f: Equations, t: float, width: float, start: Sequence[float], positions: int,
    scales: Callable[[float], Sequence[float]],
) -> tuple[Panel, float]:  # fmt: skip
    """The panel from a time t >= 0 on, and the width to try for the next one.

    Args:
        f: the slopes of v and s from time and quantities; it may raise ArithmeticError or
            ValueError.
        t: where the panel begins.
        width: how wide it may be.
        start: q, v and s at t.
        positions: how many of them are q.
        scales: those of v and s, above 0, in which errors count, from the width of a panel.

    ArithmeticError, ValueError: f has no numbers right after t.
    """
    shortest = _SHORTEST * (t + width)
    while True:
        width = (t + width) - t
        allowed = [_TOLERANCE * scale for scale in scales(width)]
        try:
            slopes = _slopes(f, t, 0.5 * width, start, positions, allowed)
        except (ArithmeticError, ValueError):
            if width <= shortest:
                raise
            width *= 0.5
            continue
        series = [interpolate(slope) for slope in slopes]
        excess = max(
            (abs(slope[0]) + abs(slope[1])) * width / most for slope, most in zip(series, allowed)
        )
        if excess <= 1.0 or width <= shortest:
            break
        # At a kink the last coefficients fall slowly with the width, elsewhere fast.
        width *= min(max(excess**-0.4, 0.1), 0.5)
    moving = start[positions:]
    others = [integrate(*one, 0.5 * width) for one in zip(series, moving)]
    places = [integrate(*one, 0.5 * width) for one in zip(others, start[:positions])]
    factor = max(excess, 1e-16) ** (-1.0 / ORDER)
    return Panel(t, t + width, start, places + others, series), factor * width


def _slopes(
    f: Equations, t: float, half: float, start: Sequence[float], positions: int,
    allowed: Sequence[float],
) -> Sequence[Sequence[float]]:  # fmt: skip
    """The slopes of v and s at the nodes of a panel; ArithmeticError: they don't converge."""
    times = [t + half * (1.0 + z) for z in NODES]
    nodes: list[Sequence[float]] = [[value] * ORDER for value in start]
    for _ in range(_ITERATIONS):
        # Before f, which may be 0 at the start alone: then v doesn't change, but hasn't converged.
        for i in range(positions):
            nodes[i] = [start[i] + half * dot(row, nodes[positions + i]) for row in INTEGRALS]
        slopes, converged = list(zip(*map(f, times, zip(*nodes)))), True
        for i, (slope, most) in enumerate(zip(slopes, allowed), positions):
            before, nodes[i] = nodes[i], [start[i] + half * dot(row, slope) for row in INTEGRALS]
            converged = converged and max(map(abs, map(sub, nodes[i], before))) <= most
        if converged:
            return slopes
    raise failure("NO_NUMBERS", time=t)
