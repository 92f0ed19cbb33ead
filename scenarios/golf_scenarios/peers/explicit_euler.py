"""The source document's scheme in plain Python: explicit Euler, order 1.

Everything moves on with the rates it has at the start of the step. Contact ends with the first step
after which the force is negative, and is as long as all the steps until then; the largest force is
the largest one seen. Nothing is interpolated, as in the document.
"""

from __future__ import annotations

import math

from golf_scenarios.peers.problem import Case, Outcome


def solve(case: Case, dt: float) -> Outcome:
    """The outcome with steps of `dt` s."""
    m_club, m_ball, k = case.m_club, case.m_ball, case.k
    drag, damper = (case.b, 0.0) if case.law == 1 else (0.0, case.b)
    x_club = x_ball = 0.0
    v_club, v_ball = case.club_speed, case.ball_speed
    max_force = 0.0
    for n in range(math.ceil(case.time_limit / dt) + 1):
        force = k * (x_club - x_ball) + damper * (v_club - v_ball)
        if force < 0.0:
            return Outcome(v_club, v_ball, n * dt, max_force)
        if force > max_force:
            max_force = force
        x_club += dt * v_club
        x_ball += dt * v_ball
        v_club -= dt * (force + drag * v_club) / m_club
        v_ball += dt * (force - drag * v_ball) / m_ball
    return Outcome(v_club, v_ball, math.inf, max_force)
