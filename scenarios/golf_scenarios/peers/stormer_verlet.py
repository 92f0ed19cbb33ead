"""Störmer–Verlet in its velocity form, order 2, with the damping half implicit.

Kick, drift, kick. The damping depends on the velocities, so the first half kick takes them at its
start and the second one at its end: the step is then symmetric and stays of order 2. The implicit
half is linear and solved by hand: a division by 1 + dt b/(2 m). The last step and the one with the
peak are interpolated by cubic Hermite polynomials.
Source: Hairer, Lubich, Wanner, Geometric Numerical Integration, sections I.1.4 and II.3.
"""

from __future__ import annotations

import math

from golf_scenarios.peers.interpolation import peak, separation
from golf_scenarios.peers.problem import Case, Outcome


def solve(case: Case, dt: float) -> Outcome:
    """The outcome with steps of `dt` s."""
    m_club, m_ball, k = case.m_club, case.m_ball, case.k
    drag, damper = (case.b, 0.0) if case.law == 1 else (0.0, case.b)
    half = 0.5 * dt
    club_divisor, ball_divisor = 1.0 + half * drag / m_club, 1.0 + half * drag / m_ball
    force_divisor = 1.0 + half * damper / case.reduced_mass
    compression = 0.0
    v_club, v_ball = case.club_speed, case.ball_speed
    closing = v_club - v_ball
    force = max_force = damper * closing
    a_club, a_ball = -(force + drag * v_club) / m_club, (force - drag * v_ball) / m_ball
    rise = k * closing + damper * (a_club - a_ball)
    for n in range(math.ceil(case.time_limit / dt)):
        before = force, rise, v_club, a_club, v_ball, a_ball
        v_club += half * a_club
        v_ball += half * a_ball
        compression += dt * (v_club - v_ball)
        force = (k * compression + damper * (v_club - v_ball)) / force_divisor
        v_club = (v_club - half * force / m_club) / club_divisor
        v_ball = (v_ball + half * force / m_ball) / ball_divisor
        a_club, a_ball = -(force + drag * v_club) / m_club, (force - drag * v_ball) / m_ball
        rise = k * (v_club - v_ball) + damper * (a_club - a_ball)
        if rise <= 0.0 < before[1]:
            max_force = max(max_force, peak(dt, *before[:2], force, rise))
        if force < 0.0:
            after = force, rise, v_club, a_club, v_ball, a_ball
            return separation(n, dt, before, after, max_force)
    return Outcome(v_club, v_ball, math.inf, max_force)
