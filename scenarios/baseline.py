"""The document's impact, solved exactly: its first list of numbers, its Figs. 4 and 5."""

import matplotlib.pyplot as plt

from golf_impact.data import document
from golf_impact.data.quantities import START, describe
from golf_impact.scenario import Result, main

PATH = ["force", "club_position", "ball_position", "club_velocity", "ball_velocity", "compression"]


def run(impact):
    exact = impact()  # S, COR, E and the others after one communication step
    path = impact.simulate(stop_time=0.68e-3, output=PATH, output_interval=2e-6)

    drag = 9.0 * exact["contact_displacement"]  # b x_B, N·s
    gained = START["m_ball"] * exact["ball_velocity"]
    result = Result("The document's impact, solved exactly", cases={"baseline": exact})
    result.tables.append(document.compare("baseline", exact))
    result.trajectories["baseline"] = path
    result.claims = {
        "printed numbers are exact within 0.5 % and half a printed digit": document.agrees(
            "baseline", exact
        ),
        "impulse less the ball's momentum is the impulse of its drag, b x_B": (
            abs(exact["impulse"] - gained - drag) < 1e-12
        ),
        "the ball is fastest before separation, where drag exceeds the spring force": (
            path["ball_velocity"].max() > exact["ball_velocity"]
        ),
    }
    result.words = (
        f"S = {exact['smash_factor']:.4f}, COR = {exact['coefficient_of_restitution']:.4f}, "
        f"E = {exact['energy_efficiency'] * 100:.2f} %. The contact force transfers "
        f"{exact['impulse']:.4f} N·s to the ball; drag takes {drag:.4f} N·s of it, and as much "
        f"from the club: {(1 - exact['momentum'] / 7.35) * 100:.1f} % of the momentum is lost."
    )

    time, force = path["time"] * 1e6, path["force"] / 1e3
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    figure.suptitle(f"Contact lasts 0.6 ms, with a peak of 6.8 kN ({describe({})}, 35 m/s)")
    left.fill_between(time, force, alpha=0.2)
    left.plot(time, force)
    peak = exact["time_of_max_force"] * 1e6, exact["max_force"] / 1e3
    words = f"{exact['max_force']:.0f} N at {peak[0]:.1f} µs"
    left.annotate(words, peak, (peak[0], 5.2), ha="center")
    area = f"impulse J = {exact['impulse']:.3f} N·s\nin {exact['contact_time'] * 1e6:.1f} µs"
    left.text(peak[0], 2.4, area, ha="center")
    left.set(xlabel="time (µs)", ylabel="contact force on the ball (kN)", ylim=(0, 7.8))
    right.plot(time, force, label="on the ball")
    right.plot(time, -force, "--", label="on the club")
    right.set(xlabel="time (µs)", ylabel="contact force (kN)")
    right.legend()
    result.figures["baseline_force"] = figure

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    figure.suptitle("The ball leaves at more than the club's speed; the club keeps 60 % of its own")
    for body, dashes in (("ball", "-"), ("club", "--")):
        left.plot(time, path[f"{body}_velocity"], dashes, label=body)
        right.plot(time, path[f"{body}_position"] * 1e3, dashes, label=body)
    for axes, quantity in ((left, "velocity (m/s)"), (right, "position (mm)")):
        axes.axvline(exact["contact_time"] * 1e6, color="0.5", ls=":", label="separation")
        axes.set(xlabel="time (µs)", ylabel=quantity)
        axes.legend()
    result.figures["baseline_motion"] = figure
    return result


if __name__ == "__main__":
    main(run)
