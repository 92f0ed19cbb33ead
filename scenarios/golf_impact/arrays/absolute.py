"""Law 1 below critical damping: two equations are solved by Newton's method."""

from __future__ import annotations

from functools import cached_property
from math import pi

import numpy as np

from golf_impact.arrays.contacts import Contacts, States
from golf_impact.arrays.elementwise import Values, angle, cos_sin, exp, expm1, newton

#: A damping ratio this small changes no bit of any result; 0 would divide by 0.
_LEAST_DAMPING = 1e-30

#: More damping, or a real mode that is more of the approach speed, leaves closed forms few digits,
#: or contact goes on beyond the first half period.
_MOST_DAMPING, _MOST_REAL_MODE = 0.5, 0.25

#: Of the slope at an event, as part of the oscillating pair: rounding then moves it by 1e-14.
_LEAST_SLOPE = 0.125


class AbsoluteContacts(Contacts):
    """Contacts as sums of a real mode and an oscillating pair (`golf_physics.laws.closed_form`).

    A quantity is a e^(-rτ) + e^(-hτ) (c cos Rτ + s sin Rτ), with τ in units of 1/ω, ω² = k/μ; rows
    (a, c, s) are those of ω·compression, v_club and v_ball. θ is the phase Rτ.
    """

    d_end = 0.0

    def __init__(self, values: dict[str, Values]) -> None:
        super().__init__(values)
        p, q, v = self.p, self.q, self.closing
        self.omega = np.sqrt(self.k / self.mu)
        self.zeta = zeta = self.b / (2.0 * self.mu * self.omega) + _LEAST_DAMPING
        drag_club, drag_ball = 2.0 * zeta * p, 2.0 * zeta * q
        span = 2.0 * zeta * (q - p)

        def step(x: Values) -> Values:
            slope, rest = p + (drag_club + x) * x, span - x
            return (q * x - rest * slope) / (rest * (drag_club + 2.0 * x) - slope - q)

        x = p * span
        x = newton(step, x + x * q * span * (drag_club + x))
        u = p + (drag_club + x) * x
        y = q * x / u
        self.r = r = np.where(np.real(x) > 0.0, drag_club + x, drag_ball - y)[()]
        self.h = h = 0.5 * (drag_club + y)
        self.w = w = np.sqrt(4.0 * zeta * p * q / r - h * h)
        a = (q * self.club_speed + u * self.ball_speed) / (q * (p - x * x) + u * u)
        a0, a1, a2 = a * x, a * p, a * u
        c1, c2 = self.club_speed - a1, self.ball_speed - a2
        self._d = a0, -a0, (v + (r - h) * a0) / w
        self._club = a1, c1, ((h - drag_club) * c1 + p * a0) / w
        self._ball = a2, c2, ((h - drag_ball) * c2 - q * a0) / w

    def _zero(self, a: Values, c: Values, s: Values) -> tuple[Values, Values]:
        """Phase of a row's first downward zero, and whether it is safe."""
        growth = (self.h - self.r) / self.w
        slope = amplitude = np.sqrt(c * c + s * s)

        def step(theta: Values) -> Values:
            nonlocal slope
            cos, sin = cos_sin(theta)
            real = a * exp(growth * theta)
            slope = growth * real + s * cos - c * sin
            return -(real + c * cos + s * sin) / slope

        start = pi - angle(c, s)
        theta = newton(step, start)
        # Another zero would be half a period away.
        steep = np.real(slope) < -_LEAST_SLOPE * np.real(amplitude)
        return theta, steep & (np.abs(theta - start) < 0.5)

    @cached_property
    def _end(self) -> tuple[Values, Values]:
        return self._zero(*self._d)

    @cached_property
    def closed(self) -> Values:
        real_mode = np.abs(np.real(self._d[0]))
        moderate = real_mode <= _MOST_REAL_MODE * np.real(self.closing)
        return (np.real(self.zeta) <= _MOST_DAMPING) & moderate & self._end[1]

    def _modes(self, theta: Values) -> tuple[Values, Values, Values, Values]:
        """The real mode less 1, and the pair, at a phase; the first is τ if there is no drag."""
        cos, sin = cos_sin(theta)
        size = exp(-(self.h / self.w) * theta)
        travel = expm1(-(self.r / self.w) * theta)
        return travel, 1.0 + travel, size * cos, size * sin

    @cached_property
    def _modes_at_end(self) -> tuple[Values, Values, Values, Values]:
        return self._modes(self._end[0])

    @staticmethod
    def _value(row: tuple[Values, ...], modes: tuple[Values, ...]) -> Values:
        a, c, s = row
        return a * modes[1] + c * modes[2] + s * modes[3]

    def _integral(self, row: tuple[Values, ...], modes: tuple[Values, ...]) -> Values:
        """Of a row over the time since touch."""
        a, c, s = row
        travel, _, cos, sin = modes
        h, w = self.h, self.w
        pair = (h * c + w * s) * (1.0 - cos) + (w * c - h * s) * sin
        return (pair / (h * h + w * w) - a / self.r * travel) / self.omega

    @cached_property
    def contact_time(self) -> Values:
        return self._end[0] / (self.w * self.omega)

    @cached_property
    def club_velocity(self) -> Values:
        return self._value(self._club, self._modes_at_end)

    @cached_property
    def ball_velocity(self) -> Values:
        return self._value(self._ball, self._modes_at_end)

    @cached_property
    def coefficient_of_restitution(self) -> Values:
        return (self.ball_velocity - self.club_velocity) / self.closing

    @cached_property
    def contact_displacement(self) -> Values:
        return self._integral(self._ball, self._modes_at_end)

    @cached_property
    def impulse(self) -> Values:
        return self.k / self.omega * self._integral(self._d, self._modes_at_end)

    @cached_property
    def _phase_of_peak(self) -> Values:
        (a, c, s), r, h, w = self._d, self.r, self.h, self.w
        return self._zero(-r * a, w * s - h * c, -w * c - h * s)[0]

    @cached_property
    def time_of_max_force(self) -> Values:
        return self._phase_of_peak / (self.w * self.omega)

    @cached_property
    def max_compression(self) -> Values:
        return self._value(self._d, self._modes(self._phase_of_peak)) / self.omega

    @cached_property
    def max_force(self) -> Values:
        return self.k * self.max_compression

    def states(self, t: Values) -> States:
        modes = self._modes(self.w * self.omega * t)
        d = self._value(self._d, modes) / self.omega
        x_ball = self._integral(self._ball, modes)
        v_club, v_ball = self._value(self._club, modes), self._value(self._ball, modes)
        return States(self.k * d, x_ball + d, x_ball, v_club, v_ball, d)
