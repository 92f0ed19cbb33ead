"""Zeros: in extended precision in a bracket; in double precision of a closed-form contact."""

from collections.abc import Callable, Sequence
from decimal import Decimal
from math import atan2, cos, exp, pi, sin, sqrt

#: Halley's method takes a shorter step (relative) only once the next one would be below 1e-50.
_TOLERANCE = Decimal(10) ** -17

#: After so many steps Newton's method, which needs 1 to 3 as a rule, is given up.
_NEWTON_STEPS = range(40)

#: A zero grazes if the slope there is less than this part of the pair's amplitude. At a zero the
#: real term is no larger than the pair, so rounding makes an error of at most some 4 ulp, 9e-16 of
#: the amplitude, and moves the zero by that over the slope: here by 1.4e-14. With less slope double
#: precision loses the time, and finally whether there is a zero at all.
_GRAZING = 1.0 / 16.0


def zero_between(
    value: Callable[[Decimal], Sequence[Decimal]], low: Decimal, high: Decimal, falls: bool
) -> Decimal:
    """The only zero between low >= 0 and high, by Halley's method; where that fails, by halving.

    `value` gives f, f' and f''; f `falls` if it is above 0 just after low and below 0 at high.
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

    By Newton's method on (span - x)(p + r x) = q x: three steps up to a damping ratio of 0.7.
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
            break
        x -= step
    # Chebyshev's correction: what is left is the cube of the step.
    return x - step * (1.0 + step * (rest - rate) / fall)


def first_downward_zero(growth: float, real: float, cosine: float, sine: float) -> float | None:
    """The first downward zero of real·e^(growth·θ) + cosine·cos θ + sine·sin θ, rad.

    Divided by e^(growth·θ) it falls from its first maximum until its minimum, half a period later.
    Newton's method is confined to that interval, with Chebyshev's correction at the start and at
    the end: None if it has no zero, or one that grazes (`_GRAZING`). growth is below 1.
    """
    if not real:
        angle = atan2(cosine, -sine)
        return angle if angle > 0.0 else angle + 2.0 * pi
    maximum = atan2(sine - growth * cosine, cosine + growth * sine)
    low, high = max(maximum, 0.0), maximum + pi
    # The pair's own zero, where all derivatives are known without another cosine.
    angle = pi - atan2(cosine, sine)
    term = real * exp(growth * angle)
    rise = growth * term
    amplitude = sqrt(cosine * cosine + sine * sine)
    slope = rise - amplitude
    step = term / slope if slope else high
    if abs(step) < 0.1 * angle:
        angle -= step * (1.0 + 0.5 * step * growth * rise / slope)
    for _ in _NEWTON_STEPS:
        if not low < angle < high:
            return None
        c = cos(angle)
        s = sin(angle)
        term = real * exp(growth * angle)
        rise = growth * term
        pair = cosine * c + sine * s
        slope = rise + sine * c - cosine * s
        if slope >= -_GRAZING * amplitude:
            return None
        step = (term + pair) / slope
        if abs(step) <= 5e-6 * angle:
            # The remaining error is of the third order of the step.
            angle -= step * (1.0 + 0.5 * step * (growth * rise - pair) / slope)
            return angle if low < angle < high else None
        angle -= step
    return None
