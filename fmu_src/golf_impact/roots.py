"""Roots of law 1's characteristic polynomial as offsets from a drag rate; a root in a bracket."""

from collections.abc import Callable
from math import inf, sqrt


def offset_of_real_root(p: float, q: float, drag: float, span: float) -> float:
    """X >= 0 such that r = drag + x is the root between the two drag rates.

    Solves (span - x)(p + r x) = q x by Newton's method inside the bracket [0, span].
    """
    low, high = 0.0, span
    x = p * span
    x += x * q * span * (drag + x)
    if x >= high:
        x = p * span
    while high > low:
        slope = p + (drag + x) * x
        f = (span - x) * slope - q * x
        if f > 0.0:
            low = x
        else:
            high = x
        step = f / ((span - x) * (drag + 2.0 * x) - slope - q)
        if abs(step) <= 1e-9 * x:
            return x - step
        x -= step
        if not low < x < high:
            x = 0.5 * (low + high)
            if x in (low, high):
                break
    return x


def offset_of_partner(
    rate: float, other: float, x: float, y: float, p: float, q: float, drag: float
) -> float:
    """How far one rate of the pair lies above the slower drag; x, y: the single rate's offsets.

    Three ways to the same number; which of them cancels depends on the case.
    """
    own_y = x + other
    rest = q - rate * own_y
    by_product = p * own_y / rest if rest else inf
    ways = (
        (max(rate, drag), rate - drag),
        (max(y, other), y - other),
        (abs(by_product) * q / abs(rest) if rest else inf, by_product),
    )
    return min(ways)[1]


def root_in_bracket(
    value: Callable[[float], tuple[float, float]],
    low: float,
    high: float,
    sign: float,
    guess: float,
) -> float:
    """The zero between low (where f has this sign) and high, by Newton's method in the bracket."""
    t = guess if low < guess < high else 0.5 * (low + high)
    before = inf
    while True:
        f, slope = value(t)
        if f * sign > 0.0:
            low = t
        else:
            high = t
        step = f / slope if slope else inf
        # Convergence is quadratic: the next step would be below 1e-18.
        if abs(step) <= 1e-9 * t:
            return min(max(t - step, low), high)
        new = t - step
        # A step that doesn't shrink is of no use: halve the bracket, by ratio where it is wide.
        if not low < new < high or abs(step) > 0.5 * before:
            new = sqrt(low) * sqrt(high) if high > 4.0 * low > 0.0 else 0.5 * (low + high)
            if new in (low, high):
                return new
            step = inf
        before = abs(step)
        t = new
