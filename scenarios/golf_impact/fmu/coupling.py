"""ClubBallImpact with a head that a tool pushes: from touch on the FMU's head is the only one."""

from collections.abc import Callable

from golf_impact.fmu.loaded import LoadedFmu

#: How the force of a step is chosen: that at its beginning; predicted for its middle; the mean of
#: those at both ends, by repeating the step from a saved state.
COUPLINGS = ("late", "middle", "repeated")

#: Force on the head, N, by time (s), position (m) and velocity (m/s) of the head.
Push = Callable[[float, float, float], float]

_HEAD = ("club_position", "club_velocity", "force")

#: Passes of a repeated step; each reduces the error some h^2 k/(4 m) fold, k that of the tool.
_PASSES = 5


def run_pushed(fmu: LoadedFmu, push: Push, size: float, coupling: str, **values: float) -> float:
    """Ball velocity (m/s) after an impact under a force that depends on the head's motion.

    Several steps must fall into the contact: one longer than it leaves the error of a free head.

    Args:
        fmu: ClubBallImpact.
        push: the force of the tool.
        size: communication step size, s.
        coupling: one of `COUPLINGS`; "middle" is of second order without repetition.
        values: inputs and parameters, `m_club` among them; `club_speed` is held until touch.

    UserError: the FMU refuses a value.
    """
    fmu.start(**values)
    half, number, passes = 0.5 * size, 0, _PASSES if coupling == "repeated" else 1
    while not fmu.read_flag("separated"):
        time = number * size
        x, v, contact_force = fmu.read(_HEAD).values()
        force = at_begin = push(time, x, v)
        if coupling == "middle":
            a = (at_begin - contact_force) / values["m_club"]
            force = push(time + half, x + half * (v + 0.5 * half * a), v + half * a)
        before = fmu.slave.getFMUstate()
        for repetition in range(passes):
            if repetition:
                x, v, _ = fmu.read(_HEAD).values()
                force = 0.5 * (at_begin + push(time + size, x, v))
                fmu.slave.setFMUstate(before)
            fmu.set({"club_force": force})
            fmu.step(time, size)
        fmu.slave.freeFMUstate(before)
        number += 1
    return fmu.read(["ball_velocity"])["ball_velocity"]
