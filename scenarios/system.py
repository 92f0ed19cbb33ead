"""A system of three FMUs, Swing ⇄ ClubBallImpact → BallFlight: a swing that feels the ball.

The swing gives the head's speed, and takes the force of the contact back, one step later. What that
delay costs is measured, and what a host that repeats the step takes off it.
"""

import math
import tempfile
from pathlib import Path

import numpy as np

from golf_impact.scenario import Report, build_system, main, run_ssp, run_system, start_values

TITLE = "A system: a swing that feels the ball, the impact, the flight"
CHAPTER = 14

#: Communication steps, s.
STEPS = (1e-3, 5e-4, 1e-4, 1e-5)

#: Of these, those of the runs by fmpy.ssp, from address on.
_SSP_STEPS = STEPS[:2]

#: s: at these the error of the coupling is measured; that of the last is what the others go to.
_FINER = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 4e-6)

#: s: what comes before is taken in steps of 5 ms; the ball has been launched at the end; and it has
#: landed.
_NEAR, _END, _LANDED = 0.96, 0.966, 8.4

#: The source's speed at the ball, m/s, and time from the top, s (see fmu_src/swing.py).
_SOURCE_SPEED, _SOURCE_TIME = 52.76, 0.2125

_BACKSWING = 0.75

_COLUMNS = (
    *("ClubBallImpact.touch_time", "ClubBallImpact.impulse", "Swing.reaction_impulse"),
    *("ClubBallImpact.smash_factor", "ClubBallImpact.ball_velocity"),
    *("ClubBallImpact.club_velocity", "Swing.head_speed"),
    *("BallFlight.carry", "BallFlight.apex", "BallFlight.flight_time"),
)


def run(fmu):
    """The loop at four communication steps, with and without its delay; the flight; the shaft."""
    report = Report(TITLE, fmu)
    with tempfile.TemporaryDirectory(prefix="golf-impact-system-") as folder:
        swing, flight, ssp = build_system(Path(folder), fmu.path)
        loop = {"Swing": swing, "ClubBallImpact": fmu.path}
        runs = {step: run_system({**loop, "BallFlight": flight}, _steps(step)) for step in STEPS}
        by_ssp = {step: run_ssp(ssp, step, _END) for step in _SSP_STEPS}
        whole = run_ssp(ssp, 5e-3, _LANDED)
        fine = runs[STEPS[-1]]
        defaults = start_values(swing)
        acting = fine["Swing.effective_mass"][0]
        matched = {"ClubBallImpact": {"law": 2, "m_club": acting}}
        delayed, repeated = (
            {step: run_system(loop, _steps(step), matched, rollback=again) for step in _FINER}
            for again in (False, True)
        )
    _show_steps(report, runs, by_ssp)
    _check_swing(report)
    errors = _show_order(report, delayed, repeated, acting)
    _show_shaft(report, fine, defaults)
    landed = float(whole["BallFlight.distance"][-1])
    carry = report.cases[_name(STEPS[0])]["carry"]
    report.check_close("the ball comes down where carry said at launch", landed, carry, 0.0)
    names = {"distance": "BallFlight.distance", "height": "BallFlight.height"}
    columns = {name: whole[column] for name, column in names.items()}
    report.trajectories["system_flight"] = {"time": whole["time"], **columns}
    _draw_swing(report, runs, defaults)
    _draw_error(report, errors)
    _draw_flight(report, whole)
    return report


def _steps(size):
    """5 ms until the ball is near, then steps of this size."""
    return [5e-3] * round(_NEAR / 5e-3) + [size] * round((_END - _NEAR) / size)


def _name(step):
    return f"step_{step:g}_s"


def _micro(step):
    return f"{step * 1e6:g} µs"


def _show_steps(report, runs, by_ssp):
    rows = []
    for step, path in runs.items():
        case = {column.partition(".")[2]: float(path[column][-1]) for column in _COLUMNS}
        report.cases[_name(step)] = case
        impulse, handed = case["impulse"], case["reaction_impulse"]
        speeds = f"{case['head_speed']:.4f}", f"{case['club_velocity']:.4f}"
        felt = f"{impulse:.8f}", f"{handed - impulse:.0e}"
        rows.append([_micro(step), *felt, *speeds, f"{case['carry']:.6f}"])
        claim = f"momentum handed to the swing is the impulse at {_micro(step)}"
        why = "mean_force, one step late: nothing is lost"
        report.check_close(claim, handed, impulse, 1e-12 * impulse, why)
        balance = path["Swing.energy"] - path["Swing.work"] + path["Swing.reaction_work"]
        drift = float(np.ptp(balance[path["time"] > _NEAR]))
        claim = f"the swing's energy is its work less that against the ball at {_micro(step)}"
        report.check_close(claim, drift, 0.0, 1e-11, "J, of 140")
    columns = ["step", "impulse (N.s)", "handed over, less that", "swing's head (m/s)"]
    title = "The loop, 3.5 ms after touch (law 1)"
    report.table(title, [*columns, "free head (m/s)", "carry (m)"], rows)
    for name in ("impulse", "smash_factor", "carry"):
        report.stays(f"{name} is the same at every step", name)
    for step, path in by_ssp.items():
        for column in _COLUMNS:
            if column != "Swing.head_speed":  # Its end isn't at the same instant.
                value = report.cases[_name(step)][column.partition(".")[2]]
                claim = f"{column} by fmpy.ssp at {_micro(step)}"
                report.check_close(claim, float(path[column][-1]), value, 1e-12 * abs(value))


def _check_swing(report):
    case = report.cases[_name(STEPS[-1])]
    speed, time = case["ball_velocity"] / case["smash_factor"], case["touch_time"] - _BACKSWING
    half = "half of its last digit"
    claim = "the head's speed at the ball is the source's"
    report.check_close(claim, speed, _SOURCE_SPEED, 0.005, half)
    claim = "the time from the top to the ball is the source's"
    report.check_close(claim, time, _SOURCE_TIME, 5e-5, half)
    report.say(
        f"The swing comes to the ball with {speed:.2f} m/s ({speed / 0.44704:.0f} mph), "
        f"{time:.4f} s after the top, as in its source. The ball "
        f"leaves with {case['ball_velocity']:.1f} m/s and, launched at 10.9° with 2686 rpm, "
        f"carries {case['carry']:.1f} m ({case['carry'] / 0.9144:.0f} yd). Spin and launch angle "
        "are averages of the PGA Tour, not results: the impact has one dimension."
    )


def _show_order(report, delayed, repeated, mass):
    """The error of the coupling, relative, with a club in the impact as heavy as the swing's head.

    Returns:
        By the way of coupling, at each step of `_FINER` but the last.
    """
    steps, path = _FINER[:-1], repeated[_FINER[-1]]
    limit = float(path["Swing.reaction_work"][-1])
    columns, errors, orders = [], {}, {}
    # Steps well below the contact's 0.6 ms.
    small = slice(_FINER.index(2e-4), _FINER.index(1e-5) + 1)
    for way, paths in (("delayed", delayed), ("repeated", repeated)):
        off = np.array([abs(paths[step]["Swing.reaction_work"][-1] - limit) for step in steps])
        columns.append([f"{paths[step]['Swing.head_speed'][-1]:.5f}" for step in steps])
        columns.append([f"{energy:.2e}" for energy in off])
        orders[way] = np.polyfit(np.log(steps[small]), np.log(off[small]), 1)[0]
        errors[way] = off / limit
    heads = ("head (m/s), delayed", "energy off (J)", "head (m/s), repeated", "energy off (J)")
    rows = zip(map(_micro, steps), *columns)
    report.table("What one step's delay costs (law 2)", ["step", *heads], rows)
    words = {way: f"order {order:.2f} from 200 to 10 µs" for way, order in orders.items()}
    claim = "with one step's delay the error is of first order in the step"
    report.check(claim, 0.9 < orders["delayed"] < 1.1, words["delayed"])
    claim = "without the delay it is of second order"
    report.check(claim, 1.6 < orders["repeated"] < 2.4, words["repeated"])
    ball, club, smash = (
        path[f"ClubBallImpact.{name}"][-1]
        for name in ("ball_velocity", "club_velocity", "smash_factor")
    )
    lost = 0.5 * mass * ((ball / smash) ** 2 - club**2)
    gained = 0.5 * report.fmu.default("m_ball") * ball**2
    report.check_close(
        "what the swing gives is what the free head loses, but for what the golfer adds meanwhile",
        *(limit, lost, 1e-3 * lost),
        "the torques go on, and the head turns, during the 0.6 ms",
    )
    last = steps.index(1e-5)
    report.say(
        f"Energy under law 2: the swing gives {limit:.2f} J, the free head of the impact loses "
        f"{lost:.2f} J, the ball has {gained:.2f} J of it, and {lost - gained:.2f} J become heat. "
        f"With a step's delay the swing gives {errors['delayed'][0] * 100:.2f} % too much at "
        f"1 ms and {errors['delayed'][last] * 1e6:.0f} parts in a million at 10 µs (order "
        f"{orders['delayed']:.2f}); a host that repeats the step with the force known has "
        f"{errors['repeated'][last] * 1e9:.0f} in 10⁹ there "
        f"(order {orders['repeated']:.2f}; it depends on where in a step touch falls)."
    )
    return errors


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
    head, acting, rigid = 0.2, float(path["Swing.effective_mass"][0]), _rigid_shaft(swing)
    rows, balls, more = [], {}, {}
    for what, mass in (
        ("the head alone", head),
        ("with club and arms behind it, as in the swing", acting),
        ("the same, the shaft a rigid rod", rigid),
    ):
        given = {"law": 2, "m_club": mass, "club_speed": speed}
        balls[mass] = fmu.impact(("ball_velocity",), **given)["ball_velocity"]
        more[mass] = (balls[mass] / balls[head] - 1.0) * 100.0
        rows.append([what, f"{mass:.4f}", f"{balls[mass]:.3f}", f"{more[mass]:+.2f} %"])
    columns = ["what hits the ball", "mass (kg)", "ball (m/s)", "more than the head"]
    report.table("Does the ball feel the shaft? (law 2)", columns, rows)
    report.check(
        "club and arms add less than 3 % to the ball's speed",
        balls[head] < balls[acting] < balls[rigid] < 1.03 * balls[head],
        f"{more[acting]:.2f} %, with a rigid shaft {more[rigid]:.2f} %",
    )
    after = int(np.argmax(path["time"] > case["touch_time"] + 7e-4))
    report.say(
        f"After the impact the swing's head has {path['Swing.head_speed'][after]:.2f} m/s, the "
        f"free head of ClubBallImpact {case['club_velocity']:.2f}. Both gave the same momentum; "
        f"but the swing's head acts like {acting * 1e3:.1f} g, the free one has "
        f"{fmu.default('m_club') * 1e3:.0f} g, and law 1 drags it, too. Of the swing's, 200 g are "
        f"the head: club and arms add {acting * 1e3 - 200:.1f} g, and {more[acting]:.1f} % to the "
        "ball's speed. The source lumps the club's mass in one point; a shaft that is a rigid rod "
        f"adds {rigid * 1e3 - 200:.0f} g and {more[rigid]:.1f} %. A real shaft bends, so the ball "
        "feels less than that of it."
    )


def _draw_swing(report, runs, swing):
    coarse, fine = runs[STEPS[0]], runs[STEPS[-1]]
    touch = report.cases[_name(STEPS[-1])]["touch_time"]

    def milli(path):
        """Time since touch, ms."""
        return (path["time"] - touch) * 1e3

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
        wrist = swing["arm_length"] * np.array([np.sin(p), -np.cos(p)])
        head = wrist + swing["club_length"] * np.array([np.sin(q), -np.cos(q)])
        for n in shown:
            last = n == shown[-1]
            x, y = zip((0.0, 0.0), wrist[:, n], head[:, n], strict=True)
            names = ("arms", "club", "head") if last else (None, None, None)
            axes.plot(x[:2], y[:2], color=figures.BLUE, lw=2.2 if last else 1.4, label=names[0])
            axes.plot(x[1:], y[1:], color=figures.ORANGE, lw=2.0 if last else 1.2, label=names[1])
            axes.plot(x[2:], y[2:], "o", color=figures.BLACK, ms=4, label=names[2])
        for word, n, right in (("top", shown[0], 8), ("ball", shown[-1], 10)):
            axes.annotate(word, head[:, n], xytext=(right, -3), textcoords="offset points")
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
        ball, club = "ClubBallImpact.ball_velocity", "ClubBallImpact.club_velocity"
        swinging = "Swing.head_speed"
        points = {"color": figures.VERMILION, "ls": ":", "marker": "o", "lw": 1.4, "ms": 5}
        for path, column, look, label in (
            (fine, ball, figures.LOOKS["ball"].line, "ball"),
            (fine, club, figures.LOOKS["club"].line, "free head in the impact"),
            (fine, swinging, {"color": figures.BLACK}, "swing, 10 µs"),
            (coarse, swinging, points, "swing, 1 ms"),
        ):
            near = milli(path) > -1.2
            axes.plot(milli(path)[near], path[column][near], **look, label=label)
        for column, above in ((swinging, 5), (club, -15)):
            speed = fine[column][np.argmax(fine["time"] > touch + 2.6e-3)]
            at, words = (2.62, speed), f"{speed:.1f} m/s"
            axes.annotate(words, at, xytext=(0, above), textcoords="offset points")
        axes.set(xlabel="time since touch (ms)", ylabel="speed (m/s)")
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
        curve = fine["ClubBallImpact.force"] / 1e3
        axes.plot(milli(fine), curve, color=figures.BLUE, label="force")
        ends = milli(coarse)
        mean = coarse["ClubBallImpact.mean_force"] / 1e3
        edges = np.append(ends[0] - 1.0, ends)
        axes.stairs(mean, edges, color=figures.VERMILION, lw=2, label="mean_force at 1 ms")
        axes.stairs(mean, edges + 1.0, color=figures.GREEN, lw=2, label="felt by the swing")
        axes.set(xlabel="time since touch (ms)", ylabel="force on the ball (kN)")
        axes.set(xlim=(-0.7, 2.2), ylim=(-0.3, None))
        figures.legend_above(axes, columns=3)
        return figure


def _draw_error(report, errors):
    @report.figure(
        "system_error",
        "Energy that the swing gives, against the limit of small steps: first order with the "
        "delay of a step, second without.",
    )
    def error(figures):
        figure, axes = figures.new("What the delay of one step costs")
        micro = np.array(_FINER[:-1]) * 1e6
        late, again = "a step late", "steps repeated with the force known"
        axes.loglog(micro, errors["delayed"], "o-", color=figures.VERMILION, label=late)
        axes.loglog(micro, errors["repeated"], "s-", color=figures.BLUE, label=again)
        for order, at in ((1, 1.2e-4), (2, 2e-7)):
            scale = np.array([10.0, 100.0])
            axes.loglog(scale, at * (scale / 100.0) ** order * 0.6, color="0.5", lw=1, ls=":")
            axes.annotate(f"order {order}", (14, at * 0.14**order * 0.6), va="top", color="0.4")
        axes.set(xlabel="communication step (µs)", ylabel="energy from the swing, relative error")
        figures.legend_above(axes)
        return figure


def _draw_flight(report, whole):
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
