"""Law 2 with exponent 1, below critical damping: no equation needs to be solved."""

from __future__ import annotations

from functools import cached_property
from math import pi
from typing import ClassVar

import numpy as np

from golf_impact.arrays.contacts import Contacts, States
from golf_impact.arrays.elementwise import Values, angle, cos_sin, exp, log, newton


class RelativeContacts(Contacts):
    """Contacts whose compression is x = exp(-ζθ/w) sin(θ)/w in units of `length`.

    θ is the phase since touch, w = √(1 - ζ²); u = exp(-ζθ/w) (cos θ - ζ sin(θ)/w) is its rate in
    units of the approach speed. The force, in units of `scale`, is x + 2ζu, so that contact ends at
    θ = 2 arccos ζ with u = -COR.
    """

    #: Nearer to critical damping (here ζ = 0.985) w is small, and x and u lose digits.
    least_restitution: ClassVar[float] = 0.14

    @cached_property
    def closed(self) -> Values:
        e = np.real(self.coefficient_of_restitution)
        return (e >= self.least_restitution) & (e <= 1.0)

    @cached_property
    def omega(self) -> Values:
        """Undamped frequency, 1/s."""
        return np.sqrt(self.k / self.mu)

    @cached_property
    def length(self) -> Values:
        return self.closing / self.omega

    @cached_property
    def scale(self) -> Values:
        return self.mu * self.omega * self.closing

    @cached_property
    def coefficient_of_restitution(self) -> Values:
        given = np.real(self.restitution_at_rest) != 0.0
        line = self.restitution_at_rest - self.restitution_slope * self.closing
        if np.all(given):
            return line
        zeta = self.b / (2.0 * self.mu * self.omega)
        w = np.sqrt((1.0 - zeta) * (1.0 + zeta))
        e = exp(-2.0 * zeta * (angle(w, zeta) / w))
        return np.where(given, line, e)[()] if np.any(given) else e

    @cached_property
    def zeta(self) -> Values:
        """Damping ratio; see `golf_physics.laws.relative` for that of a COR."""
        given = np.real(self.restitution_at_rest) != 0.0
        zeta = self.b / (2.0 * self.mu * self.omega)
        if not np.any(given):
            return zeta
        half = -0.5 * log(self.coefficient_of_restitution)

        def step(zeta: Values) -> Values:
            square = (1.0 - zeta) * (1.0 + zeta)
            w = np.sqrt(square)
            s = angle(w, zeta) / w
            return (half - zeta * s) / (s - zeta * ((1.0 - zeta * s) / square))

        return np.where(given, newton(step, 2.0 / pi * half), zeta)[()]

    @cached_property
    def w(self) -> Values:
        return np.sqrt((1.0 - self.zeta) * (1.0 + self.zeta))

    @cached_property
    def decay(self) -> Values:
        return self.zeta / self.w

    @cached_property
    def change(self) -> Values:
        """Of the closing speed in contact, m/s."""
        return (1.0 + self.coefficient_of_restitution) * self.closing

    @cached_property
    def club_velocity(self) -> Values:
        return self.club_speed - self.p * self.change

    @cached_property
    def ball_velocity(self) -> Values:
        return self.ball_speed + self.q * self.change

    @cached_property
    def impulse(self) -> Values:
        return self.mu * self.change

    @cached_property
    def max_compression(self) -> Values:
        return self.length * self.relative(exp(-self.decay * angle(self.w, self.zeta)))

    @cached_property
    def d_end(self) -> Values:
        return self.length * self.relative(2.0 * self.zeta * self.coefficient_of_restitution)

    @cached_property
    def contact_displacement(self) -> Values:
        drift = self.q * self.club_speed + self.p * self.ball_speed
        return drift * self.contact_time - self.q * self.d_end

    @cached_property
    def contact_time(self) -> Values:
        return 2.0 * angle(self.w, self.zeta) / (self.w * self.omega)

    @cached_property
    def _phase_of_max_force(self) -> Values:
        """0 if the force falls from touch on."""
        zeta = self.zeta
        rise = np.maximum((1.0 - 2.0 * zeta) * (1.0 + 2.0 * zeta), 0.0)
        return angle(self.w * rise, zeta * (rise + 2.0))

    @cached_property
    def time_of_max_force(self) -> Values:
        return self._phase_of_max_force / (self.w * self.omega)

    @cached_property
    def max_force(self) -> Values:
        start = np.maximum(2.0 * self.zeta, 1.0)
        return self.scale * start * exp(-self.decay * self._phase_of_max_force)

    def relative(self, x: Values) -> Values:
        """The compression in units of `length`."""
        return x

    def stiffening(self, x: Values) -> Values:
        """The force in units of that of a linear contact."""
        return 1.0

    def phase(self, t: Values) -> Values:
        """θ at a time since touch, s."""
        return self.w * self.omega * t

    def states(self, t: Values) -> States:
        theta = self.phase(t)
        cos, sin = cos_sin(theta)
        size = exp(-self.decay * theta)
        x = size * sin / self.w
        u = size * (cos - self.decay * sin)
        d = self.length * self.relative(x)
        force = self.scale * self.stiffening(x) * (x + 2.0 * self.zeta * u)
        lost = self.closing * (1.0 - u)
        drift = self.q * self.club_speed + self.p * self.ball_speed
        x_club = drift * t + self.p * d
        v_club, v_ball = self.club_speed - self.p * lost, self.ball_speed + self.q * lost
        return States(force, x_club, x_club - d, v_club, v_ball, d)
