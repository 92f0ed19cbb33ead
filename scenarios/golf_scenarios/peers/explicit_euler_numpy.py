"""The source document's scheme as NumPy code: explicit Euler, order 1, the whole path in arrays.

The same steps as in `explicit_euler`, written as the document's kind of program is: one array per
quantity, as long as the longest contact expected, filled element by element; then the results are
taken from the arrays.
"""

from __future__ import annotations

import math

import numpy as np

from .problem import Case, Outcome


def solve(case: Case, dt: float = 0.5e-6) -> Outcome:
    """The outcome with steps of `dt` s."""
    drag, damper = (case.b, 0.0) if case.law == 1 else (0.0, case.b)
    steps = math.ceil(case.time_limit / dt)
    t = np.arange(steps + 1) * dt
    x_club, x_ball, v_club, v_ball, force = np.zeros((5, steps + 1))
    v_club[0], v_ball[0] = case.club_speed, case.ball_speed
    force[0] = damper * (v_club[0] - v_ball[0])
    for n in range(steps):
        x_club[n + 1] = x_club[n] + v_club[n] * dt
        x_ball[n + 1] = x_ball[n] + v_ball[n] * dt
        v_club[n + 1] = v_club[n] + (-force[n] - drag * v_club[n]) / case.m_club * dt
        v_ball[n + 1] = v_ball[n] + (force[n] - drag * v_ball[n]) / case.m_ball * dt
        force[n + 1] = case.k * (x_club[n + 1] - x_ball[n + 1])
        force[n + 1] += damper * (v_club[n + 1] - v_ball[n + 1])
        if force[n + 1] < 0:
            end = n + 1
            return Outcome(
                float(v_club[end]), float(v_ball[end]), float(t[end]), float(np.max(force[:end]))
            )
    return Outcome(float(v_club[-1]), float(v_ball[-1]), math.inf, float(np.max(force)))
