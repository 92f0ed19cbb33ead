"""Zeros in doubles, which law 1's usual contact needs."""

from math import atan2, cos, exp, hypot, pi, sin

#: After so many steps of Newton's method, as a rule it needs 1 to 3, a sure way is taken.
_NEWTON_STEPS = range(40)

#: A larger exponent would overflow.
_LARGEST_EXPONENT = 700.0


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
        rate = drag + 2.0 * x
        rest = span - x
        fall = rest * rate - slope - q
        step = f / fall
        if abs(step) <= 3e-6 * x:
            # Chebyshev's correction: what is left is the cube of the step.
            return x - step * (1.0 + step * (rest - rate) / fall)
        x -= step
        if not low < x < high:
            x = 0.5 * (low + high)
            if x in (low, high):
                break
    return x


def falling_zero(
    rise: float, lone: float, cosine: float, sine: float, low: float, high: float
) -> float | None:
    """Where lone·e^(rise·θ) + cosine·cos θ + sine·sin θ falls through 0 between low and high.

    Newton's method, with Chebyshev's correction at the start and at the end.

    Args:
        rise: growth of the exponential over the angle θ.
        lone: its amplitude.
        cosine: amplitude of the cosine.
        sine: amplitude of the sine.
        low: angle, rad.
        high: angle, rad; there is at most one zero in between.

    Returns:
        The zero, rad; None if the search leaves the interval, or finds no way: where the function
        hardly reaches 0, Newton's method may go to and fro for ever.
    """
    if rise * high > _LARGEST_EXPONENT:
        return None
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
