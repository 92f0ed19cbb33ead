"""Taylor series of solutions of differential equations, and event location by bisection.

A series is the list of its coefficients. The recurrences give coefficient n of a result from the
coefficients of its operands (A. Jorba and M. Zou, Experimental Mathematics 14 (2005) 99, section
2.2).
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import pairwise
from math import comb, exp, inf
from operator import mul

#: The last coefficient of a series.
ORDER = 24

Series = list[float]


def empty(count: int) -> list[Series]:
    """As many series without coefficients."""
    return [[] for _ in range(count)]


def product(a: Series, b: Series, n: int) -> float:
    """Coefficient n of a b."""
    return sum(map(mul, a, b[n::-1]))


def quotient(a: Series, b: Series, result: Series, n: int) -> float:
    """Coefficient n of a / b, from the n coefficients before it."""
    return (a[n] - sum(map(mul, result, b[n:0:-1]))) / b[0]


def power(a: Series, exponent: float, result: Series, n: int) -> float:
    """Coefficient n (from 1 on) of a^exponent, from the n coefficients before it."""
    total = 0.0
    for k in range(n):
        total += (exponent * (n - k) - k) * a[n - k] * result[k]
    return total / (n * a[0])


def value(series: Series, t: float) -> float:
    """The series at t."""
    total = 0.0
    for coefficient in reversed(series):
        total = total * t + coefficient
    return total


def slope(series: Series) -> Series:
    """The derivative."""
    return [n * series[n] for n in range(1, len(series))]


def zero(series: Series, high: float) -> float:
    """A zero of a series that is positive at 0 and not at `high`."""
    return bisect(partial(value, series), 0.0, high)


def falls(series: Series, size: float) -> Iterator[float]:
    """The zeros in (0, size] at which a series falls from above 0, in their order.

    They are isolated by its coefficients in Bernstein's basis, whose signs change at least as often
    as the series has zeros (Descartes). A double zero counts as none.
    """
    power, terms = 1.0, []
    for coefficient in series:
        # 0 remains 0 where the power overflows.
        terms.append(coefficient and coefficient * power)
        power *= size
    if terms[0] > sum(map(abs, terms[1:])):
        return
    n, whole = len(series) - 1, []
    differences = [term / comb(n, k) for k, term in enumerate(terms)]
    while differences:
        whole.append(differences[0])
        differences = [a + b for a, b in pairwise(differences)]
    parts = [(0.0, size, whole)]
    while parts:
        low, high, signs = parts.pop()
        changes = sum((a > 0.0) != (b > 0.0) for a, b in pairwise(signs))
        if changes == 1 and signs[0] > 0.0:
            yield bisect(partial(value, series), low, high)
        elif changes > 1 and high - low > 1e-12 * size:
            # De Casteljau's algorithm: the coefficients of both halves.
            left, right = [signs[0]], [signs[-1]]
            while len(signs) > 1:
                signs = [0.5 * (a + b) for a, b in pairwise(signs)]
                left.append(signs[0])
                right.append(signs[-1])
            middle = 0.5 * (low + high)
            parts += [(middle, high, right[::-1]), (low, middle, left)]


def bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """A zero of a function that is positive above `low` and not at `high`."""
    while low < (middle := 0.5 * (low + high)) < high:
        if function(middle) > 0.0:
            low = middle
        else:
            high = middle
    return high


def first_zero(
    function: Callable[[float], float], slope: Callable[[float], float], size: float
) -> float | None:
    """The first downward zero crossing of a function in (0, size], where it has one extremum.

    A zero at 0 is that of the event before: only a later one counts, unless the slope is negative.
    """
    low = 0.0
    if function(0.0) == 0.0:
        if function(size) > 0.0:
            return None
        if slope(0.0) <= 0.0:
            return 0.0
        low = bisect(slope, 0.0, size)
    elif function(size) > 0.0:
        if not slope(0.0) < 0.0 < slope(size):
            return None
        size = bisect(lambda t: -slope(t), 0.0, size)
        if function(size) > 0.0:
            return None
    return bisect(function, low, size)


def reach(several: Iterable[Series], scale: float) -> float:
    """Step size for rounding errors of this scale (Jorba and Zou, section 3.2).

    By four orders: from rest at 90° three of four coefficients are 0.
    """
    least = inf
    for series in several:
        for order in range(len(series) - 4, len(series)):
            last = abs(series[order])
            if last > 0.0:
                least = min(least, (scale / last) ** (1.0 / order))
    return least * exp(-2.0)
