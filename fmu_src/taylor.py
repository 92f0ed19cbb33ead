"""Taylor series, for motions that are integrated by them: a swing, a flight.

A series is the list of its coefficients. The recurrences give coefficient n of a result from the
coefficients of what it is made from (A. Jorba and M. Zou, Experimental Mathematics 14 (2005) 99,
section 2.2).
"""

from collections.abc import Iterable
from math import exp, inf
from operator import mul

#: The last coefficient of a series.
ORDER = 24

Series = list[float]


def empty(count: int) -> list[Series]:
    """So many series without coefficients."""
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
    """Where a series that is positive at 0 and not at `high` becomes 0: by bisection."""
    low = 0.0
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return high
        if value(series, middle) > 0.0:
            low = middle
        else:
            high = middle


def reach(several: Iterable[Series], scale: float) -> float:
    """How far series are good to a double of this scale (Jorba and Zou, section 3.2)."""
    least = inf
    for series in several:
        for order in (len(series) - 2, len(series) - 1):
            last = abs(series[order])
            if last > 0.0:
                least = min(least, (scale / last) ** (1.0 / order))
    return least * exp(-2.0)
