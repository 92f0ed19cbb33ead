"""Ordinary differential equations y' = f(t, y) by Dormand and Prince's method of order 5.

J. R. Dormand and P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19. Steps are chosen by the motion
alone. Between them the solution is that of a shorter step, which is at least as accurate.
"""

from collections.abc import Callable, Sequence
from math import isfinite
from typing import NamedTuple

Values = Sequence[float]
Slopes = Callable[[float, Values], Values]

#: Nodes and weights of the stages after the first; the last ones are the result's.
_STAGES = (
    (1 / 5, (1 / 5,)),
    (3 / 10, (3 / 40, 9 / 40)),
    (4 / 5, (44 / 45, -56 / 15, 32 / 9)),
    (8 / 9, (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729)),
    (1.0, (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656)),
    (1.0, (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)),
)

#: Weights of the difference to the result of order 4.
_ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)

#: Relative to the time and the step tried first: a shorter step is refused.
_SHORTEST = 1e-15


class Step(NamedTuple):
    """The solution from `begin` to `end`."""

    f: Slopes
    begin: float
    end: float
    start: Values
    after: Values

    def at(self, t: float) -> Values:
        """The values at a time of the step."""
        if t == self.begin or t == self.end:
            return self.start if t == self.begin else self.after
        return _advanced(self.f, self.begin, self.start, t - self.begin)[0]

    def until(self, t: float) -> "Step":
        """The part of the step that ends at this time."""
        return self._replace(end=t, after=self.at(t))

    def quantity(self, n: int) -> Callable[[float], float]:
        """A component as a function of time."""
        return lambda t: self.at(t)[n]


def next_step(
    f: Slopes, t: float, size: float, start: Values, allowed: Callable[[Values], Values]
) -> tuple[Step, float]:
    """The step from a time t >= 0 on, and the size to try for the next one.

    Args:
        f: the slopes; it may raise ArithmeticError or ValueError.
        t: where the step begins.
        size: to be tried.
        start: the values at t.
        allowed: errors of a step, above 0, from the values after it.

    ArithmeticError: f has no numbers right after t.
    """
    shortest = _SHORTEST * (t + size)
    while size > shortest:
        size = (t + size) - t
        try:
            after, errors = _advanced(f, t, start, size)
            excess = max(abs(e) / most for e, most in zip(errors, allowed(after)))
        except (ArithmeticError, ValueError):
            excess = float("inf")
        factor = min(0.9 * max(excess, 1e-5) ** -0.2, 5.0) if isfinite(excess) else 0.2
        if excess <= 1.0:
            return Step(f, t, t + size, start, after), factor * size
        size *= max(factor, 0.1)
    raise ArithmeticError(f"the solution has no numbers after t = {t!r} s")


def _advanced(f: Slopes, t: float, start: Values, size: float) -> tuple[Values, Values]:
    """The values after a step, and their errors."""
    slopes, values = [f(t, start)], start
    for node, weights in _STAGES:
        changes = [_weighted(weights, one) for one in zip(*slopes)]
        values = [a + size * change for a, change in zip(start, changes)]
        slopes.append(f(t + node * size, values))
    return values, [size * _weighted(_ERROR, one) for one in zip(*slopes)]


def _weighted(weights: Sequence[float], slopes: Sequence[float]) -> float:
    """The weighted sum of slopes; Python's sum() has other digits from version 3.12 on."""
    total = 0.0
    for weight, slope in zip(weights, slopes):
        total += weight * slope
    return total
