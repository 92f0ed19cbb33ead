"""Ordinary differential equations y' = f(y) by Dormand and Prince's method of order 5.

J. R. Dormand and P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19. Steps are chosen by the solution
alone; between them it is that of a shorter step, which is at least as accurate.
"""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from math import inf, isfinite

from .events import first_fall

Values = Sequence[float]

#: Weights of the stages after the first; the last ones are the result's.
_STAGES = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)

#: Weights of the difference to the result of order 4.
_ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)

#: Relative to the time and the step tried first: a shorter step is refused.
_SHORTEST = 1e-15

#: A solution ends after so many steps; a flight has some 100, a swing some 60 to the ball.
_MOST = 2000


class Solution:
    """The solution from t = 0 until `left` falls to 0, computed as far as it is needed.

    Args:
        f: the slopes of values; it may raise ArithmeticError or ValueError.
        start: the values at t = 0.
        size: of the step tried first.
        allowed: errors of a step, above 0, from the values after it.
        left: of values: what falls to 0 at the end.
        slope: its derivative.

    Attributes:
        times, values: of the steps so far.
        end: when it ends; infinite until that is known.
        has_ended: whether `left` has fallen to 0; otherwise there have been too many steps.
    """

    def __init__(
        self,
        f: Callable[[Values], Values],
        start: Values,
        size: float,
        allowed: Callable[[Values], Values],
        left: Callable[[Values], float],
        slope: Callable[[Values], float],
    ) -> None:
        self._f, self._size, self._allowed, self._left, self._slope = f, size, allowed, left, slope
        self.times, self.values, self.end, self.has_ended = [0.0], [start], inf, False

    def covers(self, t: float) -> bool:
        """Whether it has a time; ArithmeticError: f has no numbers before that."""
        while self.times[-1] < t and self.end == inf:
            self._go_on()
        return t <= self.end

    def at(self, t: float) -> Values:
        """The values at a time that it covers, or at its end."""
        t = t if self.covers(t) else self.end
        n = bisect_right(self.times, t) - 1
        begin, start = self.times[n], self.values[n]
        return start if t == begin else self._advanced(start, t - begin)[0]

    def _go_on(self) -> None:
        begin, start, size = self.times[-1], self.values[-1], self._size
        shortest = _SHORTEST * (begin + size)
        while size > shortest:
            size = (begin + size) - begin
            try:
                after, errors = self._advanced(start, size)
                excess = max(abs(e) / most for e, most in zip(errors, self._allowed(after)))
            except (ArithmeticError, ValueError):
                excess = inf
            factor = min(0.9 * max(excess, 1e-5) ** -0.2, 5.0) if isfinite(excess) else 0.2
            if excess <= 1.0:
                break
            size *= max(factor, 0.1)
        else:
            raise ArithmeticError(f"the solution has no numbers after t = {begin!r} s")
        self._size = factor * size
        self.times.append(begin + size)
        self.values.append(after)
        end = first_fall(
            lambda t: self._left(self.at(t)),
            lambda t: self._slope(self.at(t)),
            (begin, begin + size),
        )
        if end is not None:
            self.times[-1], self.values[-1] = end, self._advanced(start, end - begin)[0]
            self.has_ended = True
        if end is not None or len(self.times) > _MOST:
            self.end = self.times[-1]

    def _advanced(self, start: Values, size: float) -> tuple[Values, Values]:
        """The values after a step, and their errors."""
        slopes, values = [self._f(start)], start
        for weights in _STAGES:
            changes = [_weighted(weights, one) for one in zip(*slopes)]
            values = [a + size * change for a, change in zip(start, changes)]
            slopes.append(self._f(values))
        return values, [size * _weighted(_ERROR, one) for one in zip(*slopes)]


def _weighted(weights: Sequence[float], slopes: Sequence[float]) -> float:
    """The weighted sum of slopes; Python's sum() has other digits from version 3.12 on."""
    total = 0.0
    for weight, slope in zip(weights, slopes):
        total += weight * slope
    return total
