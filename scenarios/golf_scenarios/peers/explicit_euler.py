"""The source document's scheme in plain Python: explicit Euler, order 1.

Everything moves on with the rates it has at the start of the step. Contact ends with the first step
after which the force is negative, and is as long as all the steps until then; the largest force is
the largest one seen. Nothing is interpolated, as in the document.
"""

from __future__ import annotations

import math

from golf_scenarios.peers.problem import Case, Outcome

#: The document's time step, s.
DT = 0.5e-6

#: How far apart the bodies are when the document's program seems to stop, m. It isn't stated, but
#: 35 to 48 um is what the printed results need, and no fixed number of steps after d = 0 gives them
#: all: the contact at 50 m/s is printed as shorter than the one at 35 m/s (620, 621 us).
END_GAP = 36e-6


def solve(case: Case, dt: float = DT, end_gap: float = 0.0) -> Outcome:
    """The outcome with steps of `dt` s.

    Law 1 goes on, with its spring pulling, until the bodies are more than `end_gap` m apart.
    """
    m_club, m_ball, k = case.m_club, case.m_ball, case.k
    drag, damper = (case.b, 0.0) if case.law == 1 else (0.0, case.b)
    end_force = -k * end_gap if case.law == 1 else 0.0
    x_club = x_ball = 0.0
    v_club, v_ball = case.club_speed, case.ball_speed
    max_force = 0.0
    for n in range(math.ceil(case.time_limit / dt) + 1):
        force = k * (x_club - x_ball) + damper * (v_club - v_ball)
        if force < end_force:
            return Outcome(v_club, v_ball, n * dt, max_force)
        if force > max_force:
            max_force = force
        x_club += dt * v_club
        x_ball += dt * v_ball
        v_club -= dt * (force + drag * v_club) / m_club
        v_ball += dt * (force - drag * v_ball) / m_ball
    return Outcome(v_club, v_ball, math.inf, max_force)
