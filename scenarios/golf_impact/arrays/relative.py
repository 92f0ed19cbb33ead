"""Law 2 with exponent 1, below critical damping: only a COR line needs an equation solved.

In units of `length` the compression is x = exp(-ζθ/w) sin(θ)/w, where θ is the phase since touch
and w = √(1 - ζ²); its rate in units of the approach speed is u = exp(-ζθ/w) (cos θ - ζ sin(θ)/w).
The force in units of `scale` is x + 2ζu: contact ends at θ = 2 arccos ζ, with u = -COR.
"""

from __future__ import annotations

from math import pi

import numpy as np

from golf_impact.arrays.contacts import COMMON, Contacts, Formula, Motion
from golf_impact.arrays.elementwise import Values, angle, cos_sin, exp, log, newton


def _restitution(c: Contacts) -> Values:
    line = c.restitution_at_rest - c.restitution_slope * c.closing
    if np.all(c.has_line):
        return line
    w = np.sqrt((1.0 - c.zeta_of_b) * (1.0 + c.zeta_of_b))
    e = exp(-2.0 * c.zeta_of_b * (angle(w, c.zeta_of_b) / w))
    return np.where(c.has_line, line, e)[()] if np.any(c.has_line) else e


def _damping_ratio(c: Contacts) -> Values:
    """By Newton's method on ζ·s(ζ) = -ln(COR)/2, s = arccos ζ/√(1 - ζ²), for a given COR."""
    if not np.any(c.has_line):
        return c.zeta_of_b
    half = -0.5 * log(c.coefficient_of_restitution)

    def step(zeta: Values) -> Values:
        square = (1.0 - zeta) * (1.0 + zeta)
        w = np.sqrt(square)
        s = angle(w, zeta) / w
        return (half - zeta * s) / (s - zeta * ((1.0 - zeta * s) / square))

    return np.where(c.has_line, newton(step, 2.0 / pi * half), c.zeta_of_b)[()]


def _rises(c: Contacts) -> Values:
    # From ζ = 1/2 on the force falls from touch on; ζ may be complex.
    return np.real(c.zeta) < 0.5


def _phase_at_max_force(c: Contacts) -> Values:
    rise = np.where(_rises(c), (1.0 - 2.0 * c.zeta) * (1.0 + 2.0 * c.zeta), 0.0)
    return angle(c.w * rise, c.zeta * (rise + 2.0))


def _phase(c: Contacts, t: Values) -> tuple[Values, Values, Values]:
    """θ, its cosine and sine."""
    theta = c.w * c.omega * t
    return theta, *cos_sin(theta)


def _motion(c: Contacts, t: Values) -> Motion:
    theta, cos, sin = c.phase(t)
    size = exp(-c.decay * theta)
    x, u = size * sin / c.w, size * (cos - c.decay * sin)
    force, d = c.scale * c.stiffening(x) * (x + 2.0 * c.zeta * u), c.length * c.relative(x)
    lost = c.closing * (1.0 - u)
    v_club, v_ball = c.club_speed - c.p * lost, c.ball_speed + c.q * lost
    return Motion(force, d, v_club, v_ball, c.drift * t - c.q * d)


def closed_from(least: float) -> Formula:
    """Closed forms are used for coefficients of restitution from this one on."""

    def closed(c: Contacts) -> Values:
        e = np.real(c.coefficient_of_restitution)
        return (e >= least) & (e <= 1.0)

    return closed


RELATIVE = COMMON | {
    "has_line": lambda c: np.real(c.restitution_at_rest) != 0.0,
    "omega": lambda c: np.sqrt(c.k / c.mu),
    "zeta_of_b": lambda c: c.b / (2.0 * c.mu * c.omega),
    "coefficient_of_restitution": _restitution,
    "zeta": _damping_ratio,
    "w": lambda c: np.sqrt((1.0 - c.zeta) * (1.0 + c.zeta)),
    "decay": lambda c: c.zeta / c.w,
    # ζ = 0.985: nearer to critical damping w is small, and x and u lose digits.
    "closed": closed_from(0.14),
    "length": lambda c: c.closing / c.omega,
    "scale": lambda c: c.mu * c.omega * c.closing,
    "change": lambda c: (1.0 + c.coefficient_of_restitution) * c.closing,
    "club_velocity": lambda c: c.club_speed - c.p * c.change,
    "ball_velocity": lambda c: c.ball_speed + c.q * c.change,
    "impulse": lambda c: c.mu * c.change,
    "drift": lambda c: c.q * c.club_speed + c.p * c.ball_speed,
    # The force over that of a linear contact, and the compression, both of x.
    "stiffening": lambda c: lambda x: 1.0,
    "relative": lambda c: lambda x: x,
    "phase": lambda c: lambda t: _phase(c, t),
    "motion": lambda c: lambda t: _motion(c, t),
    "half": lambda c: angle(c.w, c.zeta),
    "max_compression": lambda c: c.length * c.relative(exp(-c.decay * c.half)),
    "left": lambda c: c.length * c.relative(2.0 * c.zeta * c.coefficient_of_restitution),
    "contact_time": lambda c: 2.0 * c.half / (c.w * c.omega),
    "contact_displacement": lambda c: c.drift * c.contact_time - c.q * c.left,
    "peak": _phase_at_max_force,
    "time_of_max_force": lambda c: c.peak / (c.w * c.omega),
    "max_force": lambda c: (
        c.scale * np.where(_rises(c), 1.0, 2.0 * c.zeta) * exp(-c.decay * c.peak)
    ),
}
