"""Law 2 with an exponent above 1, below critical damping: closed forms but for times."""

from __future__ import annotations

from functools import cached_property
from math import pi, sin
from typing import ClassVar

import numpy as np
from golf_physics.numerics.chebyshev import NODES, evaluate, interpolate

from golf_impact.arrays.elementwise import Values, angle, exp, newton, power
from golf_impact.arrays.relative import RelativeContacts

_PHASES = [0.25 * pi * (1.0 + z) for z in NODES]


class PhaseIntegral:
    """∫ exp(growth φ) sin(φ)^-P dφ from 0 on, up to φ = π/2.

    It is φ^(1-P) G(φ), where φ G' + (1-P) G = g = exp(growth φ) (φ/sin φ)^P, as Chebyshev series:
    g's nearest pole, at π, is so far that 18 terms suffice.
    """

    def __init__(self, exponent: Values, growth: Values) -> None:
        self.exponent, self.growth = exponent, growth
        g = interpolate([self._g(phase, phase / sin(phase)) for phase in _PHASES])[::-1]
        # (1 + z) T_j' = j T_j + 2j (T_(j-1) + T_(j-2) + ... + T_0 / 2): solved from the top.
        above: Values = 0.0
        self.series = []
        for j in range(len(g) - 1, 0, -1):
            coefficient = (g[j] - 2.0 * above) / (j + 1.0 - exponent)
            above = above + j * coefficient
            self.series.append(coefficient)
        self.series.append((g[0] - above) / (1.0 - exponent))
        self.whole = self(0.5 * pi)

    def _g(self, phase: Values, ratio: Values) -> Values:
        return exp(self.growth * phase) * power(ratio, self.exponent)

    def __call__(self, phase: Values) -> Values:
        return power(phase, 1.0 - self.exponent) * evaluate(self.series, phase * (4.0 / pi) - 1.0)

    def inverse(self, value: Values) -> Values:
        """φ at which the integral is this."""
        m = 1.0 / (1.0 - self.exponent)

        def step(v: Values) -> Values:
            phase = power(v, m)
            rest = value - v * evaluate(self.series, phase * (4.0 / pi) - 1.0)
            return rest / (m * self._g(phase, 1.0 / np.sinc(phase / pi)))

        # In v = φ^(1-P) the integral hardly bends.
        return power(newton(step, value * (power(0.5 * pi, 1.0 / m) / self.whole)), m)


class PowerLawContacts(RelativeContacts):
    """Contacts under F = k d_r (d/d_r)^n + b (d/d_r)^((n-1)/2) d': see `RelativeContacts`.

    With m = (n+1)/2 and P = (n-1)/(n+1), x is (d/length)^m, ω² = m k/μ for the damping ratio, and
    time passes as dt ~ x^-P dθ (`golf_physics.laws.power_law`).
    """

    #: ζ = 0.69: contact always ends beyond θ = π/2.
    least_restitution = 0.22

    @cached_property
    def m(self) -> Values:
        return 0.5 * (self.exponent + 1.0)

    @cached_property
    def exponent_of_x(self) -> Values:
        """P."""
        return (self.exponent - 1.0) / (self.exponent + 1.0)

    @cached_property
    def omega(self) -> Values:
        return np.sqrt(self.m * (self.k / self.mu))

    @cached_property
    def length(self) -> Values:
        reach = power(self.m * self.closing / self.omega, 1.0 / self.m)
        return reach * power(self.reference_compression, self.exponent_of_x)

    @cached_property
    def scale(self) -> Values:
        return self.mu * self.closing * (self.m * self.closing / self.length)

    def relative(self, x: Values) -> Values:
        return power(x, 1.0 / self.m)

    def stiffening(self, x: Values) -> Values:
        return power(x, self.exponent_of_x)

    @cached_property
    def _ratio_at_max_force(self) -> Values:
        """u/x, where 2ζP r² + (1 + P - 4ζ²) r - 2ζ = 0."""
        zeta, exponent = self.zeta, self.exponent_of_x
        half = 0.5 * (1.0 + exponent) - 2.0 * zeta * zeta
        root = np.sqrt(half * half + 4.0 * zeta * zeta * exponent)
        steep = (root - half) / (2.0 * zeta * exponent)
        return np.where(np.real(half) > 0.0, 2.0 * zeta / (half + root), steep)[()]

    @cached_property
    def _phase_of_max_force(self) -> Values:
        return angle(self.w, self.zeta + self._ratio_at_max_force)

    @cached_property
    def max_force(self) -> Values:
        ratio = self._ratio_at_max_force
        drive = 1.0 + 2.0 * self.zeta * ratio
        x = exp(-self.decay * self._phase_of_max_force) / np.sqrt(drive + ratio * ratio)
        return self.scale * drive * x * self.stiffening(x)

    @cached_property
    def _unit_of_time(self) -> Values:
        return power(self.w, self.exponent_of_x - 1.0) * self.length / (self.m * self.closing)

    @cached_property
    def _early(self) -> PhaseIntegral:
        return PhaseIntegral(self.exponent_of_x, self.exponent_of_x * self.decay)

    @cached_property
    def _late(self) -> PhaseIntegral:
        """Over π - θ; in the unit of `_swell`."""
        return PhaseIntegral(self.exponent_of_x, -self.exponent_of_x * self.decay)

    @cached_property
    def _swell(self) -> Values:
        return exp(pi * self.exponent_of_x * self.decay)

    @cached_property
    def contact_time(self) -> Values:
        left = self._late.whole - self._late(2.0 * angle(self.zeta, self.w))
        return self._unit_of_time * (self._early.whole + self._swell * left)

    @cached_property
    def time_of_max_force(self) -> Values:
        return self._unit_of_time * self._early(self._phase_of_max_force)

    def phase(self, t: Values) -> Values:
        time = t / self._unit_of_time
        rest = time - self._early.whole
        early = self._early.inverse(np.minimum(time, self._early.whole))
        late = self._late.inverse(np.minimum(self._late.whole - rest / self._swell, self._late.whole))
        return np.where(np.real(rest) <= 0.0, early, pi - late)
