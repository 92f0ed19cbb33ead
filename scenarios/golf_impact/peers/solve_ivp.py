"""SciPy's `solve_ivp` with its own error control: RK45, DOP853 or LSODA.

The end of contact is a terminal event and the peak of the force another event, both found by SciPy
on its dense output. Tolerances are relative to the size of each quantity in this impact, so that
`rtol` alone decides.
"""

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from golf_impact.peers.problem import Case, Outcome

METHODS = ("RK45", "DOP853", "LSODA")


def solve(case: Case, rtol: float, method: str = "DOP853") -> Outcome:
    """The outcome with the relative tolerance `rtol` and one of METHODS."""
    drag, damper = (case.b, 0.0) if case.law == 1 else (0.0, case.b)
    # Compression and velocities: y' = rates y. Method dot is faster than @ here.
    force = np.array([case.k, damper, -damper])
    rates = np.array([[0.0, 1.0, -1.0], -force / case.m_club, force / case.m_ball])
    rates -= np.diag([0.0, drag / case.m_club, drag / case.m_ball])
    rise = force @ rates

    def force_of(_: float, y: Any) -> Any:
        return force.dot(y)

    def rise_of(_: float, y: Any) -> Any:
        return rise.dot(y)

    force_of.terminal = True  # type: ignore[attr-defined]
    force_of.direction = rise_of.direction = -1  # type: ignore[attr-defined]
    speed = abs(case.club_speed) + abs(case.ball_speed)
    start = np.array([0.0, case.club_speed, case.ball_speed])
    solution = solve_ivp(
        lambda _, y: rates.dot(y),
        (0.0, case.time_limit),
        start,
        method,
        events=(force_of, rise_of),
        rtol=rtol,
        atol=rtol * speed * np.array([1.0 / case.natural_frequency, 1.0, 1.0]),
    )
    max_force = max(force @ y for y in (start, *solution.y_events[1]))
    ended = solution.status == 1
    _, v_club, v_ball = solution.y_events[0][0] if ended else solution.y[:, -1]
    end = solution.t_events[0][0] if ended else math.inf
    return Outcome(float(v_club), float(v_ball), float(end), float(max_force))
