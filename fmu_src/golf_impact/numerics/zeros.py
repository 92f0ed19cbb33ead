"""Zeros in a bracket."""

from collections.abc import Callable
from decimal import Decimal

#: Newton's method takes a shorter step (relative) only once it has 50 digits.
_TOLERANCE = Decimal(10) ** -25


def zero_between(
    value: Callable[[Decimal], tuple[Decimal, Decimal]], low: Decimal, high: Decimal
) -> Decimal:
    """The only zero between low and high, by Newton's method; where that fails, by halving.

    Args:
        value: gives f and its slope; the sign of f at high is another one than just after low.
        low: >= 0.
        high: above low.
    """
    falls = value(high)[0] < 0
    t, before = (low + high) / 2, high
    while True:
        f, slope = value(t)
        if (f > 0) == falls:
            low = t
        else:
            high = t
        step = f / slope if slope else high
        if abs(step) <= _TOLERANCE * t:
            return min(max(t - step, low), high)
        if low < t - step < high and 2 * abs(step) <= before:
            t, before = t - step, abs(step)
            continue
        # Where the bracket is wide, its exponent is halved.
        middle = (low + high) / 2 if high < 16 * low else (max(low, high / 2**20) * high).sqrt()
        if middle == t or not low < middle < high:
            return middle
        t, before = middle, high
