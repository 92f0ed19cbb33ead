"""The classical Runge–Kutta method, order 4.

The last step and the one with the peak are interpolated by cubic Hermite polynomials, whose error
over a step is of the same order.
Source: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, section II.1.
"""

from __future__ import annotations

import math

from golf_scenarios.peers.interpolation import peak, separation
from golf_scenarios.peers.problem import Case, Outcome


def solve(case: Case, dt: float) -> Outcome:
    """The outcome with steps of `dt` s."""
    m_club, m_ball, k = case.m_club, case.m_ball, case.k
    drag, damper = (case.b, 0.0) if case.law == 1 else (0.0, case.b)

    def rates(d: float, v_club: float, v_ball: float) -> tuple[float, float, float, float]:
        """d', v_club', v_ball' and the force."""
        closing = v_club - v_ball
        force = k * d + damper * closing
        return closing, -(force + drag * v_club) / m_club, (force - drag * v_ball) / m_ball, force

    half, sixth = 0.5 * dt, dt / 6.0
    d, v_club, v_ball = 0.0, case.club_speed, case.ball_speed
    w1, p1, q1, force = rates(d, v_club, v_ball)
    max_force = force
    rise = k * w1 + damper * (p1 - q1)
    for n in range(math.ceil(case.time_limit / dt)):
        before = force, rise, v_club, p1, v_ball, q1
        w2, p2, q2, _ = rates(d + half * w1, v_club + half * p1, v_ball + half * q1)
        w3, p3, q3, _ = rates(d + half * w2, v_club + half * p2, v_ball + half * q2)
        w4, p4, q4, _ = rates(d + dt * w3, v_club + dt * p3, v_ball + dt * q3)
        d += sixth * (w1 + 2.0 * (w2 + w3) + w4)
        v_club += sixth * (p1 + 2.0 * (p2 + p3) + p4)
        v_ball += sixth * (q1 + 2.0 * (q2 + q3) + q4)
        w1, p1, q1, force = rates(d, v_club, v_ball)
        rise = k * w1 + damper * (p1 - q1)
        if rise <= 0.0 < before[1]:
            max_force = max(max_force, peak(dt, *before[:2], force, rise))
        if force < 0.0:
            after = force, rise, v_club, p1, v_ball, q1
            return separation(n, dt, before, after, max_force)
    return Outcome(v_club, v_ball, math.inf, max_force)
