"""Damping from a coefficient of restitution that falls with the approach speed.

Measured balls have COR = e₀ - slope · v (v: approach speed at first touch), which no fixed damping
gives: under law 2 COR = exp(-2ζs(ζ)) depends on the damping ratio ζ alone, whatever the exponent,
with s = arccos ζ/√(1-ζ²), or arccosh ζ/√(ζ²-1) above critical damping (Schwager & Pöschel, Granular
Matter 9, 465–469, 2007). So ζ is chosen at touch.
"""

from math import asinh, atan2, log, pi, sqrt

#: A lower COR would need more damping than leaves anything of the spring beside it.
LEAST = 1e-29


def damping_ratio(coefficient: float) -> float:
    """ζ of law 2 for a coefficient of restitution above 0 and at most 1.

    Newton's method on ζ·s(ζ) = -ln(COR)/2, concave and rising: every iterate stays below the root.
    """
    half = -0.5 * log(coefficient)
    zeta = abs(2.0 * half / pi)
    for _ in range(100):
        s, slope = _s(zeta)
        step = (half - zeta * s) / (s + zeta * slope)
        zeta += step
        if step <= 4e-16 * zeta:
            break
    return zeta


def _s(zeta: float) -> tuple[float, float]:
    """s(ζ) and its derivative."""
    square = (zeta - 1.0) * (zeta + 1.0)
    if square < 0.0:
        root = sqrt(-square)
        s = atan2(root, zeta) / root
    elif square > 0.0:
        root = sqrt(square)
        s = asinh(root) / root
    else:
        return 1.0, -1.0 / 3.0
    return s, (1.0 - zeta * s) / square
