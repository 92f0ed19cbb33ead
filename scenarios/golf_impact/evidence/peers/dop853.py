"""The impact by SciPy's DOP853 with its own error control (Hairer, Nørsett & Wanner, 1993)."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

U, M_CLUB, M_BALL, B = 35.0, 0.210, 0.04593, 9.0  # the document's impact, SI units


def solve(law: int, rtol: float, k: float) -> tuple[float, float, float]:
    """S, COR and E of the document's impact with this stiffness, N/m.

    The end of contact is a terminal event. Absolute tolerances are `rtol` of the speed, and of the
    compression that the speed reaches in 0.2 ms.
    """
    drag, damper = (B, 0.0) if law == 1 else (0.0, B)
    # Compression and velocities: y' = rates y. Method dot is faster than @ here.
    force = np.array([k, damper, -damper])
    rates = np.array([[0.0, 1.0, -1.0], -force / M_CLUB, force / M_BALL])
    rates -= np.diag([0.0, drag / M_CLUB, drag / M_BALL])

    def force_of(_: float, y: Any) -> Any:
        return force.dot(y)

    force_of.terminal, force_of.direction = True, -1  # type: ignore[attr-defined]
    start, atol = (0.0, U, 0.0), rtol * U * np.array([2e-4, 1.0, 1.0])
    options = {"method": "DOP853", "events": force_of, "rtol": rtol, "atol": atol}
    path = solve_ivp(lambda _, y: rates.dot(y), (0.0, 1e-2), start, **options)
    _, v_club, v_ball = path.y_events[0][0].tolist()
    efficiency = (M_CLUB * v_club**2 + M_BALL * v_ball**2) / (M_CLUB * U**2)
    return v_ball / U, (v_ball - v_club) / U, efficiency
