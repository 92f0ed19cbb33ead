"""SciPy's `solve_ivp` with its own error control: RK45, DOP853, LSODA or Radau.

The end of contact is a terminal event and the peak of the force another event, both found by SciPy
on its dense output. Tolerances are relative to the size of each quantity in this impact, so that
`rtol` alone decides; the implicit Radau gets the constant Jacobian of the linear equations.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from golf_impact.peers.problem import Case, Outcome

METHODS = ("RK45", "DOP853", "LSODA", "Radau")


def solve(case: Case, rtol: float, method: str = "DOP853") -> Outcome:
    """The outcome with the relative tolerance `rtol` and one of METHODS."""
    m_club, m_ball, k, drag, damper = case.coefficients

    def rates(_: float, y: Any) -> list[float]:
        x_club, x_ball, v_club, v_ball = y.tolist()  # floats are faster than NumPy's scalars
        force = k * (x_club - x_ball) + damper * (v_club - v_ball)
        return [v_club, v_ball, -(force + drag * v_club) / m_club, (force - drag * v_ball) / m_ball]

    def force_of(_: float, y: Any) -> float:
        return k * (y[0] - y[1]) + damper * (y[2] - y[3])

    def rise_of(t: float, y: Any) -> float:
        _, _, a_club, a_ball = rates(t, y)
        return k * (y[2] - y[3]) + damper * (a_club - a_ball)

    force_of.terminal = True  # type: ignore[attr-defined]
    force_of.direction = rise_of.direction = -1  # type: ignore[attr-defined]
    speed = abs(case.club_speed) + abs(case.ball_speed)
    atol = rtol * speed * np.array([1.0 / case.natural_frequency] * 2 + [1.0] * 2)
    options = {}
    if method == "Radau":
        row = np.array([k, -k, damper, -damper])  # of the force
        club_row = -(row + np.array([0, 0, drag, 0])) / m_club
        ball_row = (row - np.array([0, 0, 0, drag])) / m_ball
        options["jac"] = np.array([[0, 0, 1, 0], [0, 0, 0, 1], club_row, ball_row])
    start = np.array([0.0, 0.0, case.club_speed, case.ball_speed])
    events = (force_of, rise_of)
    solution = solve_ivp(rates, (0.0, case.time_limit), start, method, events=events, rtol=rtol,
                         atol=atol, **options)  # fmt: skip
    forces = [force_of(0.0, start), *(force_of(0.0, y) for y in solution.y_events[1])]
    ended = solution.status == 1
    v_club, v_ball = (solution.y_events[0][0] if ended else solution.y[:, -1])[2:]
    end = solution.t_events[0][0] if ended else math.inf
    return Outcome(float(v_club), float(v_ball), float(end), float(max(forces)))
