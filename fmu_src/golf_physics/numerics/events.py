"""Event location on the panels of a solution."""

from collections.abc import Callable, Sequence
from itertools import pairwise


def bisect(f: Callable[[float], float], low: float, high: float) -> float:
    """The first double after `low` at which a function isn't above 0; it isn't at `high`."""
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if f(middle) > 0.0 else (low, middle)
    return high


def minimum(slope: Callable[[float], float], low: float, high: float) -> float | None:
    """When a function has a minimum between two times, from its slope; None: it has none."""
    return bisect(lambda t: -slope(t), low, high) if slope(low) < 0.0 < slope(high) else None


def first_fall(
    f: Callable[[float], float], slope: Callable[[float], float], times: Sequence[float]
) -> float | None:
    """When a function first falls to 0; None if it doesn't.

    It has at most one minimum between neighbours of the times, and may be 0 at the first.
    """
    for low, high in pairwise(times):
        if f(high) > 0.0:
            lowest = minimum(slope, low, high)
            if lowest is None or f(lowest) > 0.0:
                continue
            high = lowest
        return bisect(f, low, high)
    return None
