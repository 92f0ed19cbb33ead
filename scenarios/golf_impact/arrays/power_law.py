"""Law 2 with an exponent above 1, below critical damping: closed forms but for times.

F = k d_r (d/d_r)^n + b (d/d_r)^((n-1)/2) d'. With m = (n+1)/2 and P = (n-1)/(n+1), x = (d/length)^m
moves as the compression under exponent 1 does, over a time that passes as x^-P
(`golf_physics.laws.power_law`): see `relative`.
"""

from __future__ import annotations

import math
from math import pi

import numpy as np
from golf_physics.numerics.chebyshev import NODES, evaluate, interpolate

from golf_impact.arrays.contacts import Contacts
from golf_impact.arrays.elementwise import Values, angle, cos_sin, exp, newton, power
from golf_impact.arrays.relative import RELATIVE, closed_from

_PHASES = [0.25 * pi * (1.0 + z) for z in NODES]


class PhaseIntegral:
    """∫ exp(growth φ) sin(φ)^-P dφ from 0 on, up to φ = π/2.

    It is φ^(1-P) G(φ), where φ G' + (1-P) G = g = exp(growth φ) (φ/sin φ)^P, as Chebyshev series:
    g's nearest pole, at π, is so far that 18 terms suffice.
    """

    def __init__(self, p: Values, growth: Values) -> None:
        self.p, self.growth = p, growth
        g = interpolate([self._g(phase, phase / math.sin(phase)) for phase in _PHASES])[::-1]
        # (1 + z) T_j' = j T_j + 2j (T_(j-1) + T_(j-2) + ... + T_0 / 2): solved from the top.
        above: Values = 0.0
        self.series = []
        for j in range(len(g) - 1, 0, -1):
            self.series.append((g[j] - 2.0 * above) / (j + 1.0 - p))
            above = above + j * self.series[-1]
        self.series.append((g[0] - above) / (1.0 - p))
        self.whole = self(0.5 * pi)

    def _g(self, phase: Values, ratio: Values) -> Values:
        return exp(self.growth * phase) * power(ratio, self.p)

    def __call__(self, phase: Values) -> Values:
        return power(phase, 1.0 - self.p) * evaluate(self.series, phase * (4.0 / pi) - 1.0)

    def inverse(self, value: Values) -> Values:
        """φ at which the integral is this: over v = φ^(1-P) it hardly bends."""
        m = 1.0 / (1.0 - self.p)

        def step(v: Values) -> Values:
            phase = power(v, m)
            rest = value - v * evaluate(self.series, phase * (4.0 / pi) - 1.0)
            return rest / (m * self._g(phase, 1.0 / np.sinc(phase / pi)))

        return power(newton(step, value * (power(0.5 * pi, 1.0 / m) / self.whole)), m)


def _ratio_at_max_force(c: Contacts) -> Values:
    """u/x, where 2ζP r² + (1 + P - 4ζ²) r - 2ζ = 0."""
    half = 0.5 * (1.0 + c.P) - 2.0 * c.zeta * c.zeta
    root = np.sqrt(half * half + 4.0 * c.zeta * c.zeta * c.P)
    steep = (root - half) / (2.0 * c.zeta * c.P)
    return np.where(np.real(half) > 0.0, 2.0 * c.zeta / (half + root), steep)[()]


def _max_force(c: Contacts) -> Values:
    drive = 1.0 + 2.0 * c.zeta * c.ratio
    x = exp(-c.decay * c.peak) / np.sqrt(drive + c.ratio * c.ratio)
    return c.scale * drive * x * c.stiffening(x)


def _phase(c: Contacts, t: Values) -> tuple[Values, Values, Values]:
    """θ, its cosine and sine: of the distance from the nearer zero of x, where x may be tiny."""
    rest = t / c.unit - c.early.whole
    begins = rest <= 0.0
    early = c.early.inverse(np.where(begins, t / c.unit, c.early.whole))
    late = c.late.inverse(np.where(begins, c.late.whole, c.late.whole - rest / c.swell))
    cos, sin = cos_sin(np.where(begins, early, late))
    return np.where(begins, early, pi - late), np.where(begins, cos, -cos), sin


POWER_LAW = RELATIVE | {
    "m": lambda c: 0.5 * (c.exponent + 1.0),
    "P": lambda c: (c.exponent - 1.0) / (c.exponent + 1.0),
    "omega": lambda c: np.sqrt(c.m * (c.k / c.mu)),
    # ζ = 0.69: contact always ends beyond θ = π/2.
    "closed": closed_from(0.22),
    "reach": lambda c: power(c.m * c.closing / c.omega, 1.0 / c.m),
    "length": lambda c: c.reach * power(c.reference_compression, c.P),
    "scale": lambda c: c.mu * c.closing * (c.m * c.closing / c.length),
    "stiffening": lambda c: lambda x: power(x, c.P),
    "relative": lambda c: lambda x: power(x, 1.0 / c.m),
    "phase": lambda c: lambda t: _phase(c, t),
    "ratio": _ratio_at_max_force,
    "peak": lambda c: angle(c.w, c.zeta + c.ratio),
    "max_force": _max_force,
    # The unit of time; integrals up to θ = π/2 and, over π - θ in units of `swell`, beyond.
    "unit": lambda c: power(c.w, c.P - 1.0) * c.length / (c.m * c.closing),
    "early": lambda c: PhaseIntegral(c.P, c.P * c.decay),
    "late": lambda c: PhaseIntegral(c.P, -c.P * c.decay),
    "swell": lambda c: exp(pi * c.P * c.decay),
    "after": lambda c: c.late.whole - c.late(2.0 * angle(c.zeta, c.w)),
    "contact_time": lambda c: c.unit * (c.early.whole + c.swell * c.after),
    "time_of_max_force": lambda c: c.unit * c.early(c.peak),
}
