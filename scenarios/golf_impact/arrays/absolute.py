"""Law 1 below critical damping: two equations are solved by Newton's method.

With time τ in units of 1/ω, ω² = k/μ, a quantity is a e^(-rτ) + e^(-hτ) (c cos wτ + s sin wτ), a
real mode and an oscillating pair (`golf_physics.laws.linear`). Rows (a, c, s) are those of
ω · compression and of the velocities; θ is the phase wτ.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from golf_impact.arrays.contacts import COMMON, Contacts, Values, angle, cos_sin, newton

#: With more damping contact may never end, and the largest compression may be at another zero (seen
#: from 0.7 on).
_MOST_DAMPING = 0.5

#: Of a row's zero from the pair's, rad: the growth of the real mode beside the pair is 1/√3 at most
#: per rad there, so that the zero is the first one, and steep.
_NEAR = 0.5

Row = tuple[Values, Values, Values]


class Modes(NamedTuple):
    """Rates r, h, w, and the rows of ω · compression and the velocities."""

    r: Values
    h: Values
    w: Values
    d: Row
    club: Row
    ball: Row


class Instant(NamedTuple):
    """τ, the real mode and the pair at some phase."""

    tau: Values
    real: Values
    cos: Values
    sin: Values


def _modes(c: Contacts) -> Modes:
    p, q, zeta = c.p, c.q, c.zeta
    # r = 2ζ(p + z) lies between the drags 2ζp and 2ζq, 2ζy below the other one; no digits are lost
    # without damping or with equal masses, nor in q - p.
    square, span = 4.0 * zeta * zeta, (c.m_club - c.m_ball) / (c.m_club + c.m_ball)

    def function(z: Values) -> tuple[Values, Values]:
        slope, rest = p + square * (p + z) * z, span - z
        return q * z - rest * slope, q + slope - rest * square * (p + 2.0 * z)

    z = p * span
    z = newton(function, z + z * q * span * square * (p + z))
    u = p + square * (p + z) * z
    y = q * z / u
    rate = np.where(np.real(z) > 0.0, p + z, q - y)[()]
    r, h = 2.0 * zeta * rate, zeta * (p + y)
    w = np.sqrt(2.0 * p * q / rate - h * h)
    x = 2.0 * zeta * z
    a = (q * c.club_speed + u * c.ball_speed) / (q * (p - x * x) + u * u)
    a0, a1, a2 = a * x, a * p, a * u
    c1, c2 = c.club_speed - a1, c.ball_speed - a2
    d = a0, -a0, (c.closing + (r - h) * a0) / w
    club = a1, c1, ((h - 2.0 * zeta * p) * c1 + p * a0) / w
    ball = a2, c2, ((h - 2.0 * zeta * q) * c2 - q * a0) / w
    return Modes(r, h, w, d, club, ball)


def _zero(modes: Modes, row: Row) -> tuple[Values, Values]:
    """Phase of a row's first downward zero, and whether that is near the pair's."""
    a, c, s = row
    growth = (modes.h - modes.r) / modes.w

    def function(theta: Values) -> tuple[Values, Values]:
        cos, sin = cos_sin(theta)
        real = a * np.exp(growth * theta)
        return real + c * cos + s * sin, growth * real + s * cos - c * sin

    start = pi - angle(c, s)
    theta = newton(function, start)
    return theta, np.abs(theta - start) < _NEAR


def _instant(modes: Modes, theta: Values) -> Instant:
    cos, sin = cos_sin(theta)
    tau = theta / modes.w
    size = np.exp(-modes.h * tau)
    return Instant(tau, np.exp(-modes.r * tau), size * cos, size * sin)


def _value(row: Row, at: Instant) -> Values:
    return row[0] * at.real + row[1] * at.cos + row[2] * at.sin


def _integral(modes: Modes, row: Row, at: Instant) -> Values:
    """Over τ from touch on."""
    a, c, s = row
    h, w, fall = modes.h, modes.w, modes.r * at.tau
    pair = (h * c + w * s) * (1.0 - at.cos) + (w * c - h * s) * at.sin
    # The mean of e^-t for t from 0 to `fall`, which is below 5. Its slope, too, keeps all digits.
    mean: Values = 1.0
    for n in range(40, 1, -1):
        mean = 1.0 - mean * fall / n
    return pair / (h * h + w * w) + a * at.tau * mean


def _peak(c: Contacts) -> Values:
    """Phase of the largest compression."""
    (r, h, w), (a0, c0, s0) = c.modes[:3], c.modes.d
    return _zero(c.modes, (-r * a0, w * s0 - h * c0, -w * c0 - h * s0))[0]


def _compression(c: Contacts, theta: Values) -> Values:
    return _value(c.modes.d, _instant(c.modes, theta)) / c.omega


ABSOLUTE = COMMON | {
    "omega": lambda c: np.sqrt(c.k / c.mu),
    "zeta": lambda c: c.b / (2.0 * c.mu * c.omega),
    "modes": _modes,
    "end": lambda c: _zero(c.modes, c.modes.d),
    "at_end": lambda c: _instant(c.modes, c.end[0]),
    "closed": lambda c: (np.real(c.zeta) <= _MOST_DAMPING) & c.end[1],
    "club_velocity": lambda c: _value(c.modes.club, c.at_end),
    "ball_velocity": lambda c: _value(c.modes.ball, c.at_end),
    "coefficient_of_restitution": lambda c: (c.ball_velocity - c.club_velocity) / c.closing,
    "contact_time": lambda c: c.end[0] / (c.modes.w * c.omega),
    "contact_displacement": lambda c: _integral(c.modes, c.modes.ball, c.at_end) / c.omega,
    "impulse": lambda c: c.k / (c.omega * c.omega) * _integral(c.modes, c.modes.d, c.at_end),
    "peak": _peak,
    "time_of_max_force": lambda c: c.peak / (c.modes.w * c.omega),
    "max_compression": lambda c: _compression(c, c.peak),
    "max_force": lambda c: c.k * c.max_compression,
    "force_at": lambda c: lambda t: c.k * _compression(c, c.modes.w * c.omega * t),
}
