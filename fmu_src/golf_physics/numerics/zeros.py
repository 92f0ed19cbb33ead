"""Zeros: in decimals for any function in a bracket; in doubles for law 1's usual contact."""

from collections.abc import Callable
from decimal import Decimal
from math import atan2, cos, exp, hypot, pi, sin

#: Halley's method takes a shorter step (relative) only once the next one would be below 1e-50.
_TOLERANCE = Decimal(10) ** -17

#: After so many steps Newton's method, which needs 1 to 3 as a rule, is given up.
_NEWTON_STEPS = range(40)


def zero_between(
    value: Callable[[Decimal], tuple[Decimal, Decimal, Decimal]], low: Decimal, high: Decimal,
    falls: bool,
) -> Decimal:  # fmt: skip
    """The only zero between low and high, by Halley's method; where that fails, by halving.

    Args:
        value: gives f, f' and f''.
        low: >= 0.
        high: above low.
        falls: whether f is above 0 just after low, and below 0 at high; or the other way round.
    """
    half = Decimal("0.5")
    t, before = (low + high) / 2, high
    while True:
        f, slope, bend = value(t)
        if (f > 0) == falls:
            low = t
        else:
            high = t
        step = f / slope if slope else high
        if slope:
            # Far from the zero the bend may mislead.
            step /= max(half, 1 - half * step * bend / slope)
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


def offset_of_real_root(p: float, q: float, drag: float, span: float) -> float:
    """X such that r = drag + x is the root between this drag rate and the other, drag + span.

    Solves (span - x)(p + r x) = q x by Newton's method; up to a damping ratio of 0.7 it needs three
    steps at most, and no bracket.
    """
    x = p * span
    x += x * q * span * (drag + x)
    for _ in _NEWTON_STEPS:
        slope = p + (drag + x) * x
        rate = drag + 2.0 * x
        rest = span - x
        fall = rest * rate - slope - q
        step = (rest * slope - q * x) / fall
        if abs(step) <= 3e-6 * abs(x):
            # Chebyshev's correction: what is left is the cube of the step.
            return x - step * (1.0 + step * (rest - rate) / fall)
        x -= step
    return x


def first_fall(rise: float, lone: float, cosine: float, sine: float) -> float | None:
    """The angle at which lone·e^(rise·θ) + cosine·cos θ + sine·sin θ first falls through 0, rad.

    Divided by e^(rise·θ) this rises until it turns, if it does so at first, and falls from there on
    until it turns again, half a turn later. There Newton's method looks for the zero, with
    Chebyshev's correction at the start and at the end. In a usual contact rise is below 1, so
    that nothing overflows.

    Returns:
        None if the search leaves the interval, or finds no way: where the function hardly reaches
        0, Newton's method may go to and fro for ever.
    """
    turning = atan2(sine - rise * cosine, cosine + rise * sine)
    low, high = max(turning, 0.0), turning + pi
    # The oscillation's own zero, where all derivatives are known without another cosine.
    angle = pi - atan2(cosine, sine)
    real = lone * exp(rise * angle)
    growth = rise * real
    slope = growth - hypot(cosine, sine)
    step = real / slope if slope else high
    if abs(step) < 0.1 * angle:
        angle -= step * (1.0 + 0.5 * step * rise * growth / slope)
    for _ in _NEWTON_STEPS:
        if not low < angle < high:
            return None
        c = cos(angle)
        s = sin(angle)
        real = lone * exp(rise * angle)
        growth = rise * real
        swing = cosine * c + sine * s
        slope = growth + sine * c - cosine * s
        if slope >= 0.0:
            return None
        step = (real + swing) / slope
        if abs(step) <= 5e-6 * angle:
            # What is left is the cube of the step.
            angle -= step * (1.0 + 0.5 * step * (rise * growth - swing) / slope)
            return angle if low < angle < high else None
        angle -= step
    return None
