"""A drive as one SSP file, by fmpy.ssp: Swing ⇄ ClubBallImpact → Launch → BallFlight."""

from math import degrees

import matplotlib.pyplot as plt
from fmpy.ssp.simulation import simulate_ssp

from golf_impact.data.measured import RPM, YARD
from golf_impact.scenario import Result, main

RESULTS = (
    "Swing.reaction_impulse", "Swing.head_speed", "ClubBallImpact.touch_time",
    "ClubBallImpact.impulse", "ClubBallImpact.smash_factor",
    "ClubBallImpact.coefficient_of_restitution", "ClubBallImpact.ball_velocity",
    "ClubBallImpact.club_velocity", "Launch.ball_speed", "Launch.launch_angle", "Launch.backspin",
    "BallFlight.carry", "BallFlight.apex", "BallFlight.flight_time",
)  # fmt: skip


def run(impact):
    ssp = str(impact.companion("GolfSwing.ssp"))
    result = Result("A drive: swing, impact, launch, flight")
    # Until just after touch, and until the ball has landed. fmpy adds up its steps: half a step
    # less, and it ends at the stop time.
    for step, stop in ((1e-3, 0.967), (5e-3, 8.4)):
        rows = simulate_ssp(ssp, stop_time=stop - 0.5 * step, step_size=step)
        case = {name.partition(".")[2]: float(rows[name][-1]) for name in RESULTS}
        result.cases[f"step_{step:g}_s"] = case
    fine, drive = result.cases.values()

    same = ("impulse", "smash_factor", "backspin", "launch_angle", "carry", "flight_time")
    gained = 0.04593 * drive["ball_velocity"]
    spin, angle = drive["backspin"] / RPM, degrees(drive["launch_angle"])
    result.claims = {
        "impact, launch and flight are the same at both communication step sizes": all(
            abs(fine[name] / drive[name] - 1.0) < 1e-12 for name in same
        ),
        "the ball's momentum is the impulse of the contact": (
            abs(drive["impulse"] / gained - 1.0) < 1e-13
        ),
        "and that on the swing": drive["reaction_impulse"] == drive["impulse"],
        "backspin and launch angle are a driver's": 2200 < spin < 3200 and 9 < angle < 14,
    }
    table = [[name, *(f"{case[name]:.9g}" for case in (fine, drive))] for name in drive]
    title = "SI units; law 2, k = 1.24 MN/m, n = 1.5, b by COR = 0.9476 − 0.0029 s/m · v"
    result.tables.append((title, ["", "steps of 1 ms", "steps of 5 ms"], table))
    result.words = (
        f"The ball leaves with {drive['ball_speed']:.1f} m/s at {angle:.1f}° and {spin:.0f} rpm, "
        f"and carries {drive['carry']:.1f} m ({drive['carry'] / YARD:.0f} yd). The contact of "
        "0.5 ms lies inside one step: the swing gets its impulse one step later."
    )

    figure, axes = plt.subplots(figsize=(8, 3))
    axes.plot(rows["BallFlight.distance"], rows["BallFlight.height"])
    axes.set(title=f"A drive carries {drive['carry']:.1f} m and rises to {drive['apex']:.1f} m")
    axes.set(xlabel="distance (m)", ylabel="height (m)")
    result.figures["system_flight"] = figure
    return result


if __name__ == "__main__":
    main(run)
