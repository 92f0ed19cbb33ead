"""Semi-implicit (symplectic) Euler, order 1: new velocities first, then positions with them.

What game engines do. Damping acts with the velocities at the start of the step. The last step is
interpolated linearly in the force, which is enough for order 1.
Source: Hairer, Lubich, Wanner, Geometric Numerical Integration, section I.1.2.
"""

from __future__ import annotations

import math

from golf_scenarios.peers.problem import Case, Outcome


def solve(case: Case, dt: float) -> Outcome:
    """The outcome with steps of `dt` s."""
    m_club, m_ball, k = case.m_club, case.m_ball, case.k
    drag, damper = (case.b, 0.0) if case.law == 1 else (0.0, case.b)
    compression = 0.0
    v_club, v_ball = case.club_speed, case.ball_speed
    force = max_force = damper * (v_club - v_ball)
    for n in range(math.ceil(case.time_limit / dt)):
        before = force, v_club, v_ball
        v_club -= dt * (force + drag * v_club) / m_club
        v_ball += dt * (force - drag * v_ball) / m_ball
        compression += dt * (v_club - v_ball)
        force = k * compression + damper * (v_club - v_ball)
        if force > max_force:
            max_force = force
        elif force < 0.0:
            part = before[0] / (before[0] - force)
            return Outcome(
                before[1] + part * (v_club - before[1]),
                before[2] + part * (v_ball - before[2]),
                (n + part) * dt,
                max_force,
            )
    return Outcome(v_club, v_ball, math.inf, max_force)
