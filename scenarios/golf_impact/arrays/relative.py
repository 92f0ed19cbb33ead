"""Law 2 below critical damping: closed forms but for times with an exponent above 1.

F = k d_r (d/d_r)^n + b (d/d_r)^((n-1)/2) d'. With m = (n+1)/2 and P = (n-1)/(n+1), x = (d/length)^m
is a linear oscillator's path over a time that passes as x^-P (`golf_physics.laws.power_law`):
x = exp(-ζθ/w) sin(θ)/w, where θ is the phase since touch and w = √(1 - ζ²); its rate in units of
the approach speed is u = exp(-ζθ/w) (cos θ - ζ sin(θ)/w). The force in units of `scale` is
x^P (x + 2ζu): contact ends at θ = 2 arccos ζ, with u = -COR.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.polynomial.chebyshev import chebpts1, chebval, chebvander

from golf_impact.arrays.contacts import COMMON, Contacts, Values, angle, cos_sin, newton

#: Terms of a Chebyshev series, phases that determine them, and the matrix that does.
_TERMS = 18
_PHASES = 0.25 * pi * (1.0 + chebpts1(_TERMS))
_INTERPOLATION = np.linalg.inv(chebvander(chebpts1(_TERMS), _TERMS - 1))


def _restitution(c: Contacts) -> Values:
    w = np.sqrt((1.0 - c.zeta_of_b) * (1.0 + c.zeta_of_b))
    e = np.exp(-2.0 * c.zeta_of_b * (angle(w, c.zeta_of_b) / w))
    line = c.restitution_at_rest - c.restitution_slope * c.closing
    return np.where(c.has_line, line, e)[()]


def _damping_ratio(c: Contacts) -> Values:
    """By Newton's method on ζ·s(ζ) = -ln(COR)/2, s = arccos ζ/√(1 - ζ²), for a given COR."""
    if not np.any(c.has_line):
        return c.zeta_of_b
    half = -0.5 * np.log(c.coefficient_of_restitution)

    def function(zeta: Values) -> tuple[Values, Values]:
        square = (1.0 - zeta) * (1.0 + zeta)
        w = np.sqrt(square)
        s = angle(w, zeta) / w
        return zeta * s - half, s - zeta * ((1.0 - zeta * s) / square)

    return np.where(c.has_line, newton(function, 2.0 / pi * half), c.zeta_of_b)[()]


def _closed(c: Contacts) -> Values:
    e = np.real(c.coefficient_of_restitution)
    return (e >= c.least_restitution) & (e <= 1.0)


def _peak(c: Contacts) -> Values:
    """Phase of the largest force, where 2ζP r² + (1 + P - 4ζ²) r - 2ζ = 0 for r = u/x = 2ζ/y.

    With exponent 1 and ζ from 1/2 on, y is 0: the force falls from touch on.
    """
    half, product = 0.5 * (1.0 + c.P) - 2.0 * c.zeta * c.zeta, 4.0 * c.zeta * c.zeta * c.P
    root = np.sqrt(half * half + product)
    y = np.where(np.real(half) >= 0.0, half + root, product / (root - half))[()]
    return angle(c.w * y, c.zeta * (y + 2.0))


def _force(c: Contacts, theta: Values, cos: Values, sin: Values) -> Values:
    size = np.exp(-c.decay * theta)
    x, u = size * sin / c.w, size * (cos - c.decay * sin)
    return c.scale * c.stiffening(x) * (x + 2.0 * c.zeta * u)


#: With exponent 1. `zeta_of_b` is ζ without a COR line; `left` the compression at separation, m.
RELATIVE = COMMON | {
    "m": lambda c: 1.0,
    "P": lambda c: 0.0,
    "stiffening": lambda c: lambda x: 1.0,
    "relative": lambda c: lambda x: x,
    "has_line": lambda c: np.real(c.restitution_at_rest) != 0.0,
    "omega": lambda c: np.sqrt(c.m * (c.k / c.mu)),
    "zeta_of_b": lambda c: c.b / (2.0 * c.mu * c.omega),
    "coefficient_of_restitution": _restitution,
    "zeta": _damping_ratio,
    "w": lambda c: np.sqrt((1.0 - c.zeta) * (1.0 + c.zeta)),
    "decay": lambda c: c.zeta / c.w,
    # ζ = 0.985: nearer to critical damping w is small, and x and u lose digits.
    "least_restitution": lambda c: 0.14,
    "closed": _closed,
    "length": lambda c: c.closing / c.omega,
    "scale": lambda c: c.mu * c.closing * (c.m * c.closing / c.length),
    "change": lambda c: (1.0 + c.coefficient_of_restitution) * c.closing,
    "club_velocity": lambda c: c.club_speed - c.p * c.change,
    "ball_velocity": lambda c: c.ball_speed + c.q * c.change,
    "impulse": lambda c: c.mu * c.change,
    "half": lambda c: angle(c.w, c.zeta),
    "max_compression": lambda c: c.length * c.relative(np.exp(-c.decay * c.half)),
    "left": lambda c: c.length * c.relative(2.0 * c.zeta * c.coefficient_of_restitution),
    "drift": lambda c: (c.q * c.club_speed + c.p * c.ball_speed) * c.contact_time,
    "contact_displacement": lambda c: c.drift - c.q * c.left,
    "contact_time": lambda c: 2.0 * c.half / (c.w * c.omega),
    "peak": _peak,
    "time_of_max_force": lambda c: c.peak / (c.w * c.omega),
    "max_force": lambda c: _force(c, c.peak, *cos_sin(c.peak)),
    "phase": lambda c: lambda t: c.w * c.omega * t,
    "force_at": lambda c: lambda t: _force(c, c.phase(t), *cos_sin(c.phase(t))),
}


class PhaseIntegral:
    """∫ exp(growth φ) sin(φ)^-P dφ from 0 on, up to φ = π/2.

    It is φ^(1-P) G(φ), where φ G' + (1-P) G = g = exp(growth φ) (φ/sin φ)^P, as Chebyshev series:
    g's nearest pole, at π, is so far that 18 terms suffice.
    """

    def __init__(self, p: Values, growth: Values) -> None:
        self.p, self.growth = p, growth
        phases = _PHASES.reshape(-1, *[1] * max(np.ndim(p), np.ndim(growth)))
        g = np.tensordot(_INTERPOLATION, self._g(phases, phases / np.sin(phases)), 1)
        # (1 + z) T_j' = j T_j + 2j (T_(j-1) + T_(j-2) + ... + T_0 / 2): solved from the top.
        self.series, above = np.empty_like(g), 0.0
        for j in range(_TERMS - 1, 0, -1):
            self.series[j] = (g[j] - 2.0 * above) / (j + 1.0 - p)
            above = above + j * self.series[j]
        self.series[0] = (g[0] - above) / (1.0 - p)
        self.whole = self(0.5 * pi)

    def _g(self, phase: Values, ratio: Values) -> Values:
        return np.exp(self.growth * phase) * np.power(ratio, self.p)

    def _series_at(self, phase: Values) -> Values:
        return chebval(phase * (4.0 / pi) - 1.0, self.series, tensor=False)

    def __call__(self, phase: Values) -> Values:
        return np.power(phase, 1.0 - self.p) * self._series_at(phase)

    def inverse(self, value: Values) -> Values:
        """φ at which the integral is this: over v = φ^(1-P) it hardly bends."""
        m = 1.0 / (1.0 - self.p)

        def function(v: Values) -> tuple[Values, Values]:
            phase = np.power(v, m)
            slope = m * self._g(phase, 1.0 / np.sinc(phase / pi))
            return v * self._series_at(phase) - value, slope

        start = value * (np.power(0.5 * pi, 1.0 / m) / self.whole)
        return np.power(newton(function, start), m)


def _force_at(c: Contacts, t: Values) -> Values:
    """By θ's distance from the nearer zero of x, where x may be tiny."""
    rest = t / c.unit - c.early.whole
    begins = np.real(rest) <= 0.0
    early = c.early.inverse(np.where(begins, t / c.unit, c.early.whole))
    late = c.late.inverse(np.where(begins, c.late.whole, c.late.whole - rest / c.swell))
    cos, sin = cos_sin(np.where(begins, early, late))
    return _force(c, np.where(begins, early, pi - late), np.where(begins, cos, -cos), sin)


POWER_LAW = RELATIVE | {
    "m": lambda c: 0.5 * (c.exponent + 1.0),
    "P": lambda c: (c.exponent - 1.0) / (c.exponent + 1.0),
    "stiffening": lambda c: lambda x: np.power(x, c.P),
    "relative": lambda c: lambda x: np.power(x, 1.0 / c.m),
    # ζ = 0.69: contact always ends beyond θ = π/2.
    "least_restitution": lambda c: 0.22,
    "reach": lambda c: np.power(c.m * c.closing / c.omega, 1.0 / c.m),
    "length": lambda c: c.reach * np.power(c.reference_compression, c.P),
    # The unit of time; integrals up to θ = π/2 and, over π - θ in units of `swell`, beyond.
    "unit": lambda c: np.power(c.w, c.P - 1.0) * c.length / (c.m * c.closing),
    "early": lambda c: PhaseIntegral(c.P, c.P * c.decay),
    "late": lambda c: PhaseIntegral(c.P, -c.P * c.decay),
    "swell": lambda c: np.exp(pi * c.P * c.decay),
    "after": lambda c: c.late.whole - c.late(2.0 * angle(c.zeta, c.w)),
    "contact_time": lambda c: c.unit * (c.early.whole + c.swell * c.after),
    "time_of_max_force": lambda c: c.unit * c.early(c.peak),
    "force_at": lambda c: lambda t: _force_at(c, t),
}
