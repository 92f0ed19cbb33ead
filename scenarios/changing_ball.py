"""Stiffness and damping that change during contact: inputs of the FMU, by fmpy's `input=`."""

import matplotlib.pyplot as plt
import numpy as np

from golf_impact.data.quantities import describe
from golf_impact.scenario import Result, main

#: All inputs of the FMU over time. The ball yields at 0.2 ms: k drops and b doubles. Of two rows
#: with the same time the second holds from then on.
SIGNAL = np.rec.fromrecords(
    [
        (0.0, 1e6, 9.0, 35.0, 0.0),
        (0.2e-3, 1e6, 9.0, 35.0, 0.0),
        (0.2e-3, 6e5, 18.0, 35.0, 0.0),
        (1.0, 6e5, 18.0, 35.0, 0.0),
    ],
    names="time, k, b, club_speed, club_force",
)

OUTPUTS = ["force", "smash_factor", "coefficient_of_restitution", "contact_time", "impulse"]

#: Communication step sizes, s; the first is longer than the contact.
STEPS = (1e-3, 1e-4, 1e-5, 1e-6)


def run(impact):
    result = Result("A ball that yields in mid-contact")
    figure, axes = plt.subplots()
    rows, final = [], []
    for step in STEPS:
        # fmpy adds a communication point where the input changes.
        path = impact.simulate(1e-3, OUTPUTS, step, input=SIGNAL, start_values={"law": 2})
        end = {name: float(path[name][-1]) for name in OUTPUTS[1:]}
        result.cases[f"step {step * 1e6:g} µs"] = end
        final.append(list(end.values()))
        rows.append([f"{step * 1e6:g}", *(repr(value) for value in end.values())])
        # The coarse steps over the line of the fine ones.
        style = {1e-3: "s", 1e-4: "o"}.get(step, "-")
        label = f"steps of {step * 1e6:g} µs"
        order = 3.0 - step
        axes.plot(path["time"] * 1e6, path["force"] / 1e3, style, lw=1, zorder=order, label=label)
    constant = impact.simulate(1e-3, ["force"], 1e-6, start_values={"law": 2})
    axes.plot(constant["time"] * 1e6, constant["force"] / 1e3, ":", label="without the change")
    axes.set(title="A ball that yields at 200 µs: less force, longer contact")
    axes.set(xlabel="time (µs)", ylabel="contact force (kN)")
    axes.legend()
    result.figures["changing_ball"] = figure

    before, after = describe({"law": 2}), describe({"law": 2, "k": 6e5, "b": 18.0})
    columns = ["step (µs)", "S", "COR", "contact time (s)", "impulse (N·s)"]
    result.tables.append((f"{before}; from 200 µs on {after}", columns, rows))
    spread = np.ptp(final, axis=0) / np.abs(final[0])
    coarse = result.cases["step 1000 µs"]
    result.claims = {
        "results are the same at any communication step size": bool(spread.max() < 1e-13),
        "impulse is the ball's momentum (law 2)": (
            abs(coarse["impulse"] - 0.04593 * 35.0 * coarse["smash_factor"]) < 1e-12
        ),
    }
    result.words = (
        f"COR is {coarse['coefficient_of_restitution']:.4f} at every communication step size "
        f"(spread {spread.max():.0e}). Each change begins a new phase of the contact, which "
        "continues from the present state."
    )
    return result


if __name__ == "__main__":
    main(run)
