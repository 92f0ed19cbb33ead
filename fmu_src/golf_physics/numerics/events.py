"""Event location: where functions of time fall to 0 on a panel of a solution.

Times are those of the panel; between neighbours a function has at most one extremum.
"""

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise

Function = Callable[[float], float]

#: So many lead from any double to the next one.
_HALVINGS = 1100


def bisect(f: Function, low: float, high: float) -> float:
    """The first double after `low` at which a function isn't above 0; it isn't at `high`."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if f(middle) > 0.0 else (low, middle)
    return high


def minimum(slope: Function, low: float, high: float) -> float | None:
    """When a function has a minimum between two times, from its slope; None: it has none."""
    return bisect(lambda t: -slope(t), low, high) if slope(low) < 0.0 < slope(high) else None


def maxima(slope: Function, times: Iterable[float]) -> Iterator[float]:
    """When a function has maxima, from its slope."""
    for low, high in pairwise(times):
        if slope(low) > 0.0 >= slope(high):
            yield bisect(slope, low, high)


def first_fall(f: Function, slope: Function, times: Iterable[float]) -> float | None:
    """When a function first falls to 0, which it may be at the first of the times; None: never."""
    for low, high in pairwise(times):
        if f(high) > 0.0:
            lowest = minimum(slope, low, high)
            if lowest is None or f(lowest) > 0.0:
                continue
            high = lowest
        # By bisection the first double after 0 takes 1063 halvings.
        is_fallen = f(low) <= 0.0 and slope(low) <= 0.0
        return low if is_fallen else bisect(f, low, high)
    return None
