"""A system of three FMUs, Swing → ClubBallImpact → BallFlight, as one SSP file run by fmpy.ssp.

The whole contact takes half a communication step of 1 ms; the carry doesn't depend on the step.
"""

import tempfile
from pathlib import Path

import numpy as np

from golf_scenarios.scenario import Report, build_system, main, run_ssp

TITLE = "A system: swing, impact and flight in one SSP file"
CHAPTER = 14

#: Communication steps, s. At 1e-6 s (in the tests) nothing changes but the time it takes.
STEPS = (1e-3, 7e-4, 1e-4, 1e-5)

#: s: the ball has been launched at the end of the first, and has landed at the end of the second.
_LAUNCHED, _LANDED = 0.058, 6.0

_COLUMNS = {
    "ClubBallImpact.touch_time": "touch_time",
    "ClubBallImpact.impulse": "impulse",
    "ClubBallImpact.smash_factor": "smash_factor",
    "ClubBallImpact.ball_velocity": "ball_velocity",
    "BallFlight.carry": "carry",
    "BallFlight.apex": "apex",
    "BallFlight.flight_time": "flight_time",
}


def run(fmu):
    """The same system at four communication steps, then one run as far as the landing."""
    report = Report(TITLE, fmu)
    with tempfile.TemporaryDirectory(prefix="golf-impact-system-") as folder:
        ssp = build_system(Path(folder), fmu.path)[-1]
        runs = {step: run_ssp(ssp, step, _LAUNCHED) for step in STEPS}
        whole = run_ssp(ssp, STEPS[0], _LANDED)
    rows = []
    for step, path in runs.items():
        case = {name: float(path[column][-1]) for column, name in _COLUMNS.items()}
        # A step's share of the impulse is its mean force times its length.
        case["impulse_by_mean_force"] = float(np.sum(path["ClubBallImpact.mean_force"]) * step)
        report.cases[f"step_{step:g}_s"] = case
        rows.append(
            [
                f"{step * 1e6:g} µs",
                *(f"{case[name]:.6f}" for name in ("carry", "apex")),
                *(f"{case[name]:.8f}" for name in ("impulse", "impulse_by_mean_force")),
                f"{np.max(path['ClubBallImpact.force']) / 1e3:.2f}",
            ]
        )
    columns = ["step", "carry (m)", "apex (m)", "J (N.s)", "Σ mean force · step", "peak seen (kN)"]
    report.table(TITLE, columns, rows)
    _check(report, runs, whole)
    coarse = report.cases[f"step_{STEPS[0]:g}_s"]
    report.say(
        f"The ball carries {coarse['carry']:.2f} m and rises to {coarse['apex']:.2f} m, whatever "
        "the communication step. At 1 ms the contact is over between two communication points: a "
        "host may never see the force, but impulse and mean_force have all of it."
    )
    report.trajectories["system_flight"] = {
        "time": whole["time"],
        "distance": whole["BallFlight.distance"],
        "height": whole["BallFlight.height"],
    }
    _draw(report, runs, whole)
    return report


def _check(report, runs, whole):
    alone = report.fmu.impact(("impulse", "smash_factor"))
    carries = [case["carry"] for case in report.cases.values()]
    for step, case in zip(STEPS, report.cases.values(), strict=True):
        label = f"{step * 1e6:g} µs"
        report.check_close(
            f"carry at {label} is that at {STEPS[-1] * 1e6:g} µs",
            case["carry"],
            carries[-1],
            1e-9,
            "1 nm; both come from the same instant of separation",
        )
        for name in ("impulse", "smash_factor"):
            report.check_close(
                f"{name} at {label} is that of the impact alone",
                case[name],
                alone[name],
                1e-12,
                "the club has its peak speed at touch",
            )
        report.check_close(
            f"mean_force loses no momentum at {label}",
            case["impulse_by_mean_force"],
            case["impulse"],
            1e-12,
            "rounding of the sum",
        )
        path = runs[step]
        speed = path["Swing.club_speed"]
        reached = path["time"][np.argmax(speed)]
        report.check(
            f"touch falls after the peak at {label}",
            case["touch_time"] >= reached,
            f"peak from {reached:.6g} s, touch at {case['touch_time']:.6g} s",
        )
    coarse = runs[STEPS[0]]
    report.check(
        "at 1 ms the whole contact falls inside one step: its host never sees a force",
        np.max(coarse["ClubBallImpact.force"]) == 0.0
        and np.count_nonzero(coarse["ClubBallImpact.mean_force"]) == 1,
        f"mean_force of that step {np.max(coarse['ClubBallImpact.mean_force']):.6g} N",
    )
    landed = report.cases[f"step_{STEPS[0]:g}_s"]
    report.check_close(
        "the ball comes down where carry said at launch",
        float(whole["BallFlight.distance"][-1]),
        landed["carry"],
        0.0,
    )


def _draw(report, runs, whole):
    coarse, fine = runs[STEPS[0]], runs[STEPS[-1]]

    @report.figure("system_speeds")
    def speeds(figures):
        figure, axes = figures.new("Speeds, communication step 10 µs")
        milli = fine["time"] * 1e3
        axes.plot(milli, fine["Swing.club_speed"], color=figures.BLACK, ls=":", label="swing")
        club, ball = fine["ClubBallImpact.club_velocity"], fine["ClubBallImpact.ball_velocity"]
        axes.plot(milli, club, color=figures.ORANGE, ls="--", label="club")
        axes.plot(milli, ball, color=figures.BLUE, label="ball")
        axes.set(xlabel="time (ms)", ylabel="speed (m/s)")
        figures.legend_above(axes)
        return figure

    @report.figure("system_force")
    def force(figures):
        figure, axes = figures.new("Force: one step of 1 ms has the same area")
        milli = (fine["time"] - fine["ClubBallImpact.touch_time"][-1]) * 1e3
        near = (milli > -0.7) & (milli < 1.2)
        curve = fine["ClubBallImpact.force"][near] / 1e3
        axes.plot(milli[near], curve, color=figures.BLUE, label="force")
        ends = (coarse["time"] - coarse["ClubBallImpact.touch_time"][-1]) * 1e3
        mean = coarse["ClubBallImpact.mean_force"] / 1e3
        edges = np.append(ends[0] - 1.0, ends)
        axes.stairs(mean, edges, color=figures.VERMILION, lw=2, label="mean_force at 1 ms")
        seen = coarse["ClubBallImpact.force"] / 1e3
        axes.plot(ends, seen, "o", color=figures.BLACK, label="force at 1 ms")
        axes.set(xlabel="time since touch (ms)", ylabel="force on the ball (kN)")
        axes.set(xlim=(-0.7, 1.2), ylim=(-0.3, None))
        figures.legend_above(axes, columns=3)
        return figure

    @report.figure("system_flight")
    def flight(figures):
        figure, axes = figures.new("Flight of the ball", size=(7.2, 3.4))
        x, y = whole["BallFlight.distance"], whole["BallFlight.height"]
        axes.plot(x, y, color=figures.BLUE)
        top = int(np.argmax(y))
        figures.mark(axes, x[top], y[top], f"apex {whole['BallFlight.apex'][-1]:.1f} m")
        figures.mark(axes, x[-1], 0.0, f"carry {x[-1]:.1f} m")
        axes.set(xlabel="distance (m)", ylabel="height (m)")
        # The label above the landing stands clear of the path.
        axes.texts[-1].set(ha="left")
        axes.set(xlim=(0, 1.2 * x[-1]), ylim=(0, 1.25 * y[top]))
        return figure


if __name__ == "__main__":
    main(__file__)
