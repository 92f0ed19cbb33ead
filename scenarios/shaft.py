"""A shaft that pushes the head during contact: a co-simulation master, and its order."""

import matplotlib.pyplot as plt
import numpy as np

from golf_impact.data.quantities import describe
from golf_impact.scenario import Result, main

#: The tip of the shaft is the head (kg); its stiffness (N/m) and damping (N·s/m); the grip moves on
#: with constant speed (m/s).
M_TIP, STIFFNESS, DAMPING, GRIP = 0.2, 2e5, 5.0, 40.0

#: Communication step sizes, s; the reference; touch falls at so many places in a step.
STEPS, FINEST, PLACES = (1e-4, 5e-5, 2e-5, 1e-5), 1e-6, 8

WAYS = {"beginning": 1, "middle": 2, "repeated": 2}  # and the order that each should have


def drive(impact, step, way, gap=0.0, stiffness=STIFFNESS):
    """Ball velocity (m/s) after an impact with a shaft; `way` is when its force is evaluated."""

    def push(time, x, v):
        return stiffness and stiffness * (GRIP * time - gap - x) + DAMPING * (GRIP - v)

    fmu, ref, n = impact.instance, impact.references, 0
    head = [ref[name] for name in ("club_position", "club_velocity", "force")]
    impact.start(law=2, m_club=M_TIP, club_speed=GRIP, gap=gap)
    while not fmu.getBoolean([ref["separated"]])[0]:
        time, half = n * step, 0.5 * step
        x, v, contact_force = fmu.getReal(head)
        force = at_begin = push(time, x, v)
        if way == "middle":  # a prediction for the middle of the step: second order in one pass
            a = (at_begin - contact_force) / M_TIP
            force = push(time + half, x + half * (v + 0.5 * half * a), v + half * a)
        before = fmu.getFMUstate()
        for repetition in range(5 if way == "repeated" else 1):
            if repetition:  # rollback, with the mean of the forces at both ends of the step
                x, v, _ = fmu.getReal(head)
                force = 0.5 * (at_begin + push(time + step, x, v))
                fmu.setFMUstate(before)
            fmu.setReal([ref["club_force"]], [force])
            fmu.doStep(time, step)
        fmu.freeFMUstate(before)
        n += 1
    return fmu.getReal([ref["ball_velocity"]])[0]


def run(impact):
    result = Result("A shaft that pushes the head: coupling by club_force")
    exact = drive(impact, FINEST, "middle")
    free = drive(impact, STEPS[0], "beginning", stiffness=0.0)
    places = np.arange(PLACES) / PLACES * GRIP
    rows, orders = [], {}
    figure, axes = plt.subplots()
    axes.axhline(abs(free / exact - 1.0), color="0.4", ls=":", label="free head")
    for way, expected in WAYS.items():
        speeds = np.array([[drive(impact, h, way, p * h) for p in places] for h in STEPS])
        # Touch elsewhere in a step is another impact by less than the error.
        errors = np.abs(speeds / exact - 1.0).max(axis=1)
        orders[way] = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
        rows.append([way, *(f"{error:.1e}" for error in errors), f"{orders[way]:.2f}"])
        result.claims[f"force at {way}: order {expected}"] = abs(orders[way] - expected) < 0.15
        axes.loglog(np.array(STEPS) * 1e6, errors, "o-", label=f"force: {way}")
    axes.set(title="Shaft force at the middle of a step: second order in one pass")
    axes.set(xlabel="communication step size (µs)", ylabel="relative error of ball speed")
    axes.legend()
    result.figures["shaft"] = figure

    result.cases["shaft"] = {"ball_velocity": exact}
    result.cases["free head"] = {"ball_velocity": free}
    title = (
        f"Error of ball speed over communication step size: {describe({'law': 2})}, shaft 200 kN/m"
    )
    result.tables.append((title, ["force", *(f"{h * 1e6:g} µs" for h in STEPS), "order"], rows))
    result.words = (
        f"The shaft makes the ball {(exact / free - 1.0) * 100:.2f} % faster. From touch on the "
        "FMU's head is the only one, and the tool returns its force: that at the beginning of a "
        "step, that predicted for its middle, or, by repeating the step from a saved state, the "
        "mean of both ends. The middle needs no repetition."
    )
    return result


if __name__ == "__main__":
    main(run)
