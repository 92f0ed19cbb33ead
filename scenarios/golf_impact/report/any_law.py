"""Checks that hold for every contact law, for impacts that have no closed form.

The balances need nothing but Newton's equations with a contact force and a drag on each body; the
integration is SUNDIALS' CVODE, on the equations of motion that the FMI 3.0 FMU has for Model
Exchange.
"""

from collections.abc import Mapping

import numpy as np

from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.loaded import LoadedFmu3
from golf_impact.report.report import Metrics, Report

_STATE = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity")
_SOLVED = ("club_velocity", "ball_velocity", "contact_time")

#: Nodes of the quadrature over the contact, closer at both its ends, where a force may be a power
#: of time; the error allowed: 5e-10 was the largest seen (power laws, exponents 1 to 3, b to 1e6).
_NODES = 200
_QUADRATURE = 1e-8

#: Relative tolerance of CVODE, and the error allowed for it: 1.3e-8 was the largest seen.
_SOLVER, _SOLVED_WITHIN = 1e-10, 1e-6


def check_any_law(report: Report, name: str, values: Mapping[str, float], metrics: Metrics) -> None:
    """Check an impact (all inputs and parameters, SI units) by balances, and by CVODE."""
    if np.isnan(metrics["contact_time"]):
        return
    _check_balances(report, name, values, metrics)
    end = metrics["touch_time"] + 1.5 * metrics["contact_time"]
    options = {"stop_time": end, "output_interval": end / 10, "relative_tolerance": _SOLVER}
    with LoadedFmu3(current_fmu(fmi=3)[0]) as fmi3:
        solved = fmi3.simulate(_SOLVED, fmi3.model, start_values=dict(values), **options)
    # CVODE has gone on after separation, and the force accelerates the head then, too.
    flown = end - metrics["touch_time"] - solved["contact_time"]
    solved["club_velocity"] -= values["club_force"] / values["m_club"] * flown
    speed = abs(values["club_speed"]) + abs(values["ball_speed"])
    # The slower the bodies part, the larger is the effect of an error in position on that time.
    parting = abs(metrics["ball_velocity"] - metrics["club_velocity"])
    time = metrics["contact_time"] * speed / max(parting, 1e-9 * speed)
    scales = dict.fromkeys(_SOLVED, speed) | {"contact_time": time}
    for metric, scale in scales.items():
        claim = f"{name}: {metric} agrees with an integration of the equations of motion by CVODE"
        report.check_close(claim, metrics[metric], solved[metric], _SOLVED_WITHIN * scale)


def _check_balances(
    report: Report, name: str, values: Mapping[str, float], metrics: Metrics
) -> None:
    m_club, m_ball = values["m_club"], values["m_ball"]
    u_club, u_ball = values["club_speed"], values["ball_speed"]
    touch, time, club_force = metrics["touch_time"], metrics["contact_time"], values["club_force"]
    points, weights = np.polynomial.legendre.leggauss(_NODES)
    nodes, weights = 0.5 * points * (3.0 - points**2), 0.75 * time * (1.0 - points**2) * weights
    report.fmu.start(**values)
    instants = np.array([0.0, *(touch + 0.5 * time * (1.0 + nodes)), touch + time])
    path = report.fmu.sample(instants, _STATE)
    force, club, ball = (path[name][1:-1] for name in ("force", "club_velocity", "ball_velocity"))
    end = {name: column[-1] for name, column in path.items()}
    v_club, v_ball = end["club_velocity"], end["ball_velocity"]
    # At touch both are where the ball was: it has moved freely until then.
    club_moved, ball_moved = (end[f"{body}_position"] - u_ball * touch for body in ("club", "ball"))
    momentum = m_club * abs(u_club) + m_ball * abs(u_ball)
    energy = 0.5 * (m_club * u_club**2 + m_ball * u_ball**2)
    # The rest of the ball's change of momentum is drag: a coefficient times its travel.
    impulse = metrics["impulse"]
    dragged = impulse - m_ball * (v_ball - u_ball)
    drag = 0.0 if abs(dragged) <= 1e-9 * momentum else dragged / ball_moved
    of_club, of_ball = m_club * (v_club**2 - u_club**2) / 2, m_ball * (v_ball**2 - u_ball**2) / 2
    work_on_club = -weights @ (force * club + drag * club**2)
    work_on_ball = weights @ (force * ball - drag * ball**2)
    balances = {
        "the impulse is the integral of the force": (impulse, weights @ force, momentum),
        "the club has lost the impulse and what drag took, less what its force gave": (
            m_club * (u_club - v_club),
            impulse + drag * club_moved - club_force * time,
            momentum,
        ),
        "the ball's energy is the work of force and drag": (of_ball, work_on_ball, energy),
        "the club's energy is the work of the forces on it and drag": (
            of_club,
            work_on_club + club_force * club_moved,
            energy,
        ),
    }
    for claim, (value, expected, scale) in balances.items():
        tolerance = _QUADRATURE * scale
        report.check_close(f"{name}: {claim}", value, expected, tolerance, kind="invariants")
    claim = f"{name}: the drag takes momentum from the ball, it doesn't give any"
    report.check(claim, drag * ball_moved >= 0.0, f"{drag * ball_moved:.3g} N·s", "invariants")
