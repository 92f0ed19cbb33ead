"""A system of three FMUs, Swing ⇄ ClubBallImpact → BallFlight: a swing that feels the ball.

The swing gives the head's speed, and takes the force of the contact back, one step later. What that
delay costs is measured, and what a host that repeats the step takes off it.
"""

import math
import tempfile
from pathlib import Path

import numpy as np

from golf_scenarios.scenario import (
    Report,
    build_system,
    main,
    run_ssp,
    run_system,
    start_values,
)

TITLE = "A system: a swing that feels the ball, the impact, the flight"
CHAPTER = 14

#: Communication steps, s.
STEPS = (1e-3, 5e-4, 1e-4, 1e-5)

#: Of these, those of the runs by fmpy.ssp, from address on.
_SSP_STEPS = STEPS[:2]

#: s: what comes before is taken in steps of 5 ms; the ball has been launched at the end; and it has
#: landed.
_NEAR, _END, _LANDED = 0.96, 0.966, 8.4

#: The source's speed at the ball, m/s, and time from the top, s (see fmu_src/swing.py).
_SOURCE_SPEED, _SOURCE_TIME = 52.76, 0.2125

_BACKSWING = 0.75

_COLUMNS = {
    "ClubBallImpact.touch_time": "touch_time",
    "ClubBallImpact.impulse": "impulse",
    "Swing.reaction_impulse": "reaction_impulse",
    "ClubBallImpact.smash_factor": "smash_factor",
    "ClubBallImpact.ball_velocity": "ball_velocity",
    "ClubBallImpact.club_velocity": "club_velocity",
    "Swing.head_speed": "head_speed",
    "BallFlight.carry": "carry",
    "BallFlight.apex": "apex",
    "BallFlight.flight_time": "flight_time",
}


def run(fmu):
    """The loop at four communication steps, with and without its delay; the flight; the shaft."""
    report = Report(TITLE, fmu)
    with tempfile.TemporaryDirectory(prefix="golf-impact-system-") as folder:
        swing, flight, ssp = build_system(Path(folder), fmu.path)
        parts = {"Swing": swing, "ClubBallImpact": fmu.path, "BallFlight": flight}
        runs = {step: run_system(parts, _steps(step)) for step in STEPS}
        by_ssp = {step: run_ssp(ssp, step, _END) for step in _SSP_STEPS}
        whole = run_ssp(ssp, 5e-3, _LANDED)
        fine = runs[STEPS[-1]]
        defaults = start_values(swing)
        loop = {"Swing": swing, "ClubBallImpact": fmu.path}
        matched = {"ClubBallImpact": {"law": 2, "m_club": fine["Swing.effective_mass"][0]}}
        delayed, repeated = (
            {step: run_system(loop, _steps(step), matched, rollback=again) for step in _FINER}
            for again in (False, True)
        )
    _show_steps(report, runs, by_ssp)
    _check_swing(report, fine)
    _show_order(report, delayed, repeated, matched["ClubBallImpact"]["m_club"])
    _show_shaft(report, fine, defaults)
    report.check_close(
        "the ball comes down where carry said at launch",
        float(whole["BallFlight.distance"][-1]),
        report.cases[_name(STEPS[0])]["carry"],
        0.0,
    )
    report.trajectories["system_flight"] = {
        "time": whole["time"],
        "distance": whole["BallFlight.distance"],
        "height": whole["BallFlight.height"],
    }
    _draw(report, runs, whole, delayed, repeated, defaults)
    return report


#: s: at these the error of the coupling is measured; that of the last is what the others go to.
_FINER = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 4e-6)


def _steps(size):
    """5 ms until the ball is near, then steps of this size."""
    return [5e-3] * round(_NEAR / 5e-3) + [size] * round((_END - _NEAR) / size)


def _name(step):
    return f"step_{step:g}_s"


def _show_steps(report, runs, by_ssp):
    rows = []
    for step, path in runs.items():
        case = {name: float(path[column][-1]) for column, name in _COLUMNS.items()}
        report.cases[_name(step)] = case
        rows.append(
            [
                f"{step * 1e6:g} µs",
                f"{case['impulse']:.8f}",
                f"{case['reaction_impulse'] - case['impulse']:.0e}",
                f"{case['head_speed']:.4f}",
                f"{case['club_velocity']:.4f}",
                f"{case['carry']:.6f}",
            ]
        )
        label = f"{step * 1e6:g} µs"
        report.check_close(
            f"momentum handed to the swing is the impulse at {label}",
            case["reaction_impulse"],
            case["impulse"],
            1e-12 * case["impulse"],
            "mean_force, one step late: nothing is lost",
        )
        balance = path["Swing.energy"] - path["Swing.work"] + path["Swing.reaction_work"]
        late = balance[path["time"] > _NEAR]
        report.check_close(
            f"the swing's energy is its work less that against the ball at {label}",
            float(np.ptp(late)),
            0.0,
            1e-11,
            "J, of 140",
        )
    columns = ["step", "impulse (N.s)", "handed over, less that", "swing's head (m/s)"]
    title = "The loop, 3.5 ms after touch (law 1)"
    report.table(title, [*columns, "free head (m/s)", "carry (m)"], rows)
    for name in ("impulse", "smash_factor", "carry"):
        values = [report.cases[_name(step)][name] for step in STEPS]
        report.stays(f"{name} is the same at every step", values)
    for step, path in by_ssp.items():
        for column, name in _COLUMNS.items():
            case = report.cases[_name(step)]
            if name != "head_speed":  # Its end isn't at the same instant.
                report.check_close(
                    f"{column} by fmpy.ssp at {step * 1e6:g} µs",
                    float(path[column][-1]),
                    case[name],
                    1e-12 * abs(case[name]),
                )


def _check_swing(report, path):
    case = report.cases[_name(STEPS[-1])]
    speed = case["ball_velocity"] / case["smash_factor"]
    report.check_close(
        "the head's speed at the ball is the source's",
        speed,
        _SOURCE_SPEED,
        0.005,
        "half of its last digit",
    )
    report.check_close(
        "the time from the top to the ball is the source's",
        case["touch_time"] - _BACKSWING,
        _SOURCE_TIME,
        5e-5,
        "half of its last digit",
    )
    report.say(
        f"The swing comes to the ball with {speed:.2f} m/s ({speed / 0.44704:.0f} mph), "
        f"{case['touch_time'] - _BACKSWING:.4f} s after the top, as in its source. The ball "
        f"leaves with {case['ball_velocity']:.1f} m/s and, launched at 10.9° with 2686 rpm, "
        f"carries {case['carry']:.1f} m ({case['carry'] / 0.9144:.0f} yd). Spin and launch angle "
        "are averages of the PGA Tour, not results: the impact has one dimension."
    )


def _show_order(report, delayed, repeated, mass):
    """The error of the coupling, with a club in the impact as heavy as the swing's head acts."""
    column = "Swing.reaction_work"
    limit = float(repeated[_FINER[-1]][column][-1])
    rows, errors = [], {}
    for label, paths in (("delayed", delayed), ("repeated", repeated)):
        errors[label] = [abs(float(paths[step][column][-1]) - limit) for step in _FINER[:-1]]
    for n, step in enumerate(_FINER[:-1]):
        rows.append(
            [
                f"{step * 1e6:g} µs",
                f"{delayed[step]['Swing.head_speed'][-1]:.5f}",
                f"{errors['delayed'][n]:.2e}",
                f"{repeated[step]['Swing.head_speed'][-1]:.5f}",
                f"{errors['repeated'][n]:.2e}",
            ]
        )
    columns = ["step", "head (m/s), delayed", "energy off (J)", "head (m/s), repeated"]
    report.table("What one step's delay costs (law 2)", [*columns, "energy off (J)"], rows)
    # Steps well below the contact's 0.6 ms.
    first, last = _FINER.index(2e-4), _FINER.index(1e-5)
    sizes = np.log(_FINER[first : last + 1])
    orders = {
        label: np.polyfit(sizes, np.log(found[first : last + 1]), 1)[0]
        for label, found in errors.items()
    }
    report.check(
        "with one step's delay the error is of first order in the step",
        0.9 < orders["delayed"] < 1.1,
        f"order {orders['delayed']:.2f} from 200 to 10 µs",
    )
    report.check(
        "without the delay it is of second order",
        1.6 < orders["repeated"] < 2.4,
        f"order {orders['repeated']:.2f} from 200 to 10 µs",
    )
    path = repeated[_FINER[-1]]
    speed = path["ClubBallImpact.ball_velocity"][-1] / path["ClubBallImpact.smash_factor"][-1]
    lost = 0.5 * mass * (speed**2 - path["ClubBallImpact.club_velocity"][-1] ** 2)
    ball = 0.5 * report.fmu.default("m_ball") * path["ClubBallImpact.ball_velocity"][-1] ** 2
    report.check_close(
        "what the swing gives is what the free head loses, but for what the golfer adds meanwhile",
        limit,
        lost,
        1e-3 * lost,
        "the torques go on, and the head turns, during the 0.6 ms",
    )
    report.say(
        f"Energy under law 2: the swing gives {limit:.2f} J, the free head of the impact loses "
        f"{lost:.2f} J, the ball has {ball:.2f} J of it, and {lost - ball:.2f} J become heat. With "
        f"a step's delay the swing gives {errors['delayed'][0] / limit * 100:.2f} % too much at "
        f"1 ms and {errors['delayed'][last] / limit * 1e6:.0f} parts in a million at 10 µs (order "
        f"{orders['delayed']:.2f}); a host that repeats the step with the force known has "
        f"{errors['repeated'][last] / limit * 1e9:.0f} in 10⁹ there "
        f"(order {orders['repeated']:.2f}; it depends on where in a step touch falls)."
    )


def _rigid_shaft(swing):
    """What the head acts like, kg, if the shaft of 0.1 kg and 1 m is a rigid rod, in one line."""
    r, length, first = swing["arm_length"], swing["club_length"], swing["club_first_moment"]
    arms, club = swing["arm_inertia"] + swing["club_mass"] * r * r, 0.2 * length**2 + 0.1 / 3.0
    mixed = r * first
    turn = club * r * r - 2.0 * mixed * r * length + arms * length * length
    return (arms * club - mixed * mixed) / turn


def _show_shaft(report, path, swing):
    """Does the ball feel the shaft?"""
    fmu, case = report.fmu, report.cases[_name(STEPS[-1])]
    speed = case["ball_velocity"] / case["smash_factor"]
    acting, rigid = float(path["Swing.effective_mass"][0]), _rigid_shaft(swing)
    balls = {
        mass: fmu.impact(("ball_velocity",), law=2, m_club=mass, club_speed=speed)["ball_velocity"]
        for mass in (0.2, acting, rigid)
    }
    more = {mass: (ball / balls[0.2] - 1.0) * 100.0 for mass, ball in balls.items()}
    rows = [
        [what, f"{mass:.4f}", f"{balls[mass]:.3f}", f"{more[mass]:+.2f} %"]
        for what, mass in (
            ("the head alone", 0.2),
            ("with club and arms behind it, as in the swing", acting),
            ("the same, the shaft a rigid rod", rigid),
        )
    ]
    columns = ["what hits the ball", "mass (kg)", "ball (m/s)", "more than the head"]
    report.table("Does the ball feel the shaft? (law 2)", columns, rows)
    report.check(
        "club and arms add less than 3 % to the ball's speed",
        balls[0.2] < balls[acting] < balls[rigid] < 1.03 * balls[0.2],
        f"{more[acting]:.2f} %, with a rigid shaft {more[rigid]:.2f} %",
    )
    after = int(np.argmax(path["time"] > case["touch_time"] + 7e-4))
    masses = {"acting": acting, "free": fmu.default("m_club"), "rod": rigid}
    grams = {name: mass * 1e3 for name, mass in masses.items()}
    report.say(
        f"After the impact the swing's head has {path['Swing.head_speed'][after]:.2f} m/s, the "
        f"free head of ClubBallImpact {case['club_velocity']:.2f}. Both gave the same momentum; "
        f"but the swing's head acts like {grams['acting']:.1f} g, the free one has "
        f"{grams['free']:.0f} g, and law 1 drags it, too. "
        "Of the swing's, 200 g are the head: club and arms add "
        f"{grams['acting'] - 200:.1f} g, and {more[acting]:.1f} % to the ball's speed. The source "
        "lumps the club's mass in one point; a shaft that is a rigid rod adds "
        f"{grams['rod'] - 200:.0f} g and {more[rigid]:.1f} %. A real shaft bends, so the ball "
        "feels less than that of it."
    )


def _draw(report, runs, whole, delayed, repeated, swing):
    arm, club = swing["arm_length"], swing["club_length"]
    coarse, fine = runs[STEPS[0]], runs[STEPS[-1]]
    touch = report.cases[_name(STEPS[-1])]["touch_time"]

    @report.figure(
        "system_swing",
        "The wrist keeps its angle for the first half of the downswing by inertia, and opens then: "
        "the arms slow down, and the club takes their energy.",
    )
    def downswing(figures):
        figure, axes = figures.new("The downswing, every 10 ms and at the ball", size=(6.4, 5.8))
        instants = [*np.arange(_BACKSWING, touch, 0.01), touch]
        shown = np.searchsorted(fine["time"], np.array(instants) - 1e-9)
        p, q = fine["Swing.arm_angle"], fine["Swing.club_angle"]
        wrist = arm * np.array([np.sin(p), -np.cos(p)])
        head = wrist + club * np.array([np.sin(q), -np.cos(q)])
        for n in shown:
            last = n == shown[-1]
            x, y = zip((0.0, 0.0), wrist[:, n], head[:, n], strict=True)
            names = ("arms", "club", "head") if last else (None, None, None)
            axes.plot(x[:2], y[:2], color=figures.BLUE, lw=2.2 if last else 1.4, label=names[0])
            axes.plot(x[1:], y[1:], color=figures.ORANGE, lw=2.0 if last else 1.2, label=names[1])
            axes.plot(x[2:], y[2:], "o", color=figures.BLACK, ms=4, label=names[2])
        axes.annotate("top", head[:, shown[0]], xytext=(8, -3), textcoords="offset points")
        axes.annotate("ball", head[:, shown[-1]], xytext=(10, -3), textcoords="offset points")
        axes.set(xlabel="towards the target (m)", ylabel="up, in the plane of the swing (m)")
        axes.set(xlim=(-1.45, 0.95))
        axes.set_aspect("equal")
        figures.legend_above(axes)
        return figure

    @report.figure(
        "system_speeds",
        "The swing loses as much momentum as the ball gains: at a step of 10 µs as the force acts, "
        "at 1 ms a step late.",
    )
    def speeds(figures):
        figure, axes = figures.new("Speeds through the impact")
        milli = (fine["time"] - touch) * 1e3
        near = (milli > -1.0) & (milli < 3.2)
        axes.plot(
            milli[near],
            fine["ClubBallImpact.ball_velocity"][near],
            **figures.LOOKS["ball"].line,
            label="ball",
        )
        axes.plot(
            milli[near],
            fine["ClubBallImpact.club_velocity"][near],
            **figures.LOOKS["club"].line,
            label="free head in the impact",
        )
        axes.plot(
            milli[near], fine["Swing.head_speed"][near], color=figures.BLACK, label="swing, 10 µs"
        )
        milli = (coarse["time"] - touch) * 1e3
        near = (milli > -1.2) & (milli < 3.6)
        axes.plot(
            milli[near],
            coarse["Swing.head_speed"][near],
            "o:",
            color=figures.VERMILION,
            lw=1.4,
            ms=5,
            label="swing, 1 ms",
        )
        axes.set(xlabel="time since touch (ms)", ylabel="speed (m/s)")
        for name, above in (("Swing.head_speed", 5), ("ClubBallImpact.club_velocity", -15)):
            speed = fine[name][np.argmax(fine["time"] > touch + 2.6e-3)]
            axes.annotate(
                f"{speed:.1f} m/s", (2.62, speed), xytext=(0, above), textcoords="offset points"
            )
        axes.set(xlim=(-0.6, 3.0), ylim=(-3, 92))
        figures.legend_above(axes)
        return figure

    @report.figure(
        "system_force",
        "The force itself, its mean over steps of 1 ms, and that mean as the swing feels it: three "
        "times the same area.",
    )
    def force(figures):
        figure, axes = figures.new("Force: what a step of 1 ms hands over has the same area")
        milli = (fine["time"] - touch) * 1e3
        near = (milli > -0.7) & (milli < 2.2)
        curve = fine["ClubBallImpact.force"][near] / 1e3
        axes.plot(milli[near], curve, color=figures.BLUE, label="force")
        ends = (coarse["time"] - touch) * 1e3
        for late, color, label in (
            (0.0, figures.VERMILION, "mean_force at 1 ms"),
            (1.0, figures.GREEN, "felt by the swing"),
        ):
            edges = np.append(ends[0] - 1.0, ends) + late
            mean = coarse["ClubBallImpact.mean_force"] / 1e3
            axes.stairs(mean, edges, color=color, lw=2, label=label)
        axes.set(xlabel="time since touch (ms)", ylabel="force on the ball (kN)")
        axes.set(xlim=(-0.7, 2.2), ylim=(-0.3, None))
        figures.legend_above(axes, columns=3)
        return figure

    @report.figure(
        "system_error",
        "Energy that the swing gives, against the limit of small steps: first order with the "
        "delay of a step, second without.",
    )
    def error(figures):
        figure, axes = figures.new("What the delay of one step costs")
        column = "Swing.reaction_work"
        limit = repeated[_FINER[-1]][column][-1]
        micro = np.array(_FINER[:-1]) * 1e6
        for paths, color, mark, label in (
            (delayed, figures.VERMILION, "o", "a step late"),
            (repeated, figures.BLUE, "s", "steps repeated with the force known"),
        ):
            off = [abs(paths[step][column][-1] / limit - 1.0) for step in _FINER[:-1]]
            axes.loglog(micro, off, mark + "-", color=color, label=label)
        for order, at in ((1, 1.2e-4), (2, 2e-7)):
            scale = np.array([10.0, 100.0])
            axes.loglog(scale, at * (scale / 100.0) ** order * 0.6, color="0.5", lw=1, ls=":")
            axes.annotate(f"order {order}", (14, at * 0.14**order * 0.6), va="top", color="0.4")
        axes.set(xlabel="communication step (µs)", ylabel="energy from the swing, relative error")
        figures.legend_above(axes)
        return figure

    @report.figure(
        "system_flight",
        "Backspin lifts the ball above the line of its launch. Launch angle and spin are averages "
        "of the PGA Tour.",
    )
    def flight(figures):
        figure, axes = figures.new("Flight of the ball", size=(7.2, 3.2))
        x, y = whole["BallFlight.distance"], whole["BallFlight.height"]
        axes.plot(x, y, color=figures.BLUE)
        top = int(np.argmax(y))
        figures.mark(axes, x[top], y[top], f"apex {whole['BallFlight.apex'][-1]:.1f} m")
        figures.mark(axes, x[-1], 0.0, f"carry {x[-1]:.1f} m")
        # The label above the landing stands clear of the path.
        axes.texts[-1].set(ha="left")
        reach = np.array([0.0, 120.0])
        axes.plot(reach, reach * math.tan(math.radians(10.9)), color="0.5", lw=1, ls="--")
        axes.annotate("launch angle 10.9°\nbackspin 2686 rpm", (72, 2), va="bottom")
        axes.set(xlabel="distance (m)", ylabel="height (m)")
        axes.set(xlim=(0, 1.22 * x[-1]), ylim=(0, 1.3 * y[top]))
        return figure


if __name__ == "__main__":
    main(__file__)
