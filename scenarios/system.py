"""A system of four FMUs, Swing ⇄ ClubBallImpact → Launch → BallFlight: a drive.

The swing gives the head's speed, and gets the impulse of the contact one step later. The cost of
that delay is measured, and what an importer saves that repeats the step. The FMUs are those inside
GolfSwing.ssp.
"""

import tempfile
from math import degrees, pi, tan
from pathlib import Path

import numpy as np

from golf_impact.scenario import (
    Report,
    build_system,
    extract_fmus,
    main,
    run_ssp,
    run_system,
    start_values,
)

TITLE = "System: swing, impact, launch and flight of a drive"
CHAPTER = 14

#: Communication steps, s.
STEPS = (1e-3, 5e-4, 1e-4, 1e-5)

#: s: at these the error of the coupling is measured, against a run with steps of the last.
_FINER, _FINEST = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5), 1e-6

#: Where in its step touch falls: a first step of these shares of the others' size.
_SHARES = (0.0, 0.3, 0.6)

#: s: what comes before is taken in steps of 5 ms; the ball has been launched at the end; and it has
#: landed.
_NEAR, _END, _LANDED = 0.96, 0.967, 8.4

#: The source's speed at the ball, m/s, and time from the top, s (see fmu_src/swing.py).
_SOURCE_SPEED, _SOURCE_TIME = 52.76, 0.2125

_BACKSWING = 0.75

_RESULTS = {
    "Swing": ("reaction_impulse", "head_speed"),
    "ClubBallImpact": (
        "touch_time", "impulse", "smash_factor", "coefficient_of_restitution", "ball_velocity",
        "club_velocity",
    ),
    "Launch": ("ball_speed", "launch_angle", "backspin"),
    "BallFlight": ("carry", "apex", "flight_time"),
}  # fmt: skip


def run(fmu):
    """The loop at four communication steps, with and without its delay; the flight."""
    report = Report(TITLE, fmu)
    with tempfile.TemporaryDirectory(prefix="golf-impact-system-") as folder:
        *_, ssp = build_system(Path(folder))
        drive = extract_fmus(ssp, Path(folder, "drive"))
        values = {name: start_values(file) for name, file in drive.items()}
        runs = {step: run_system(drive, _steps(step)) for step in STEPS}
        acting = runs[STEPS[0]]["Swing.effective_mass"][0]
        flat = run_system(drive, [1e-3], {"Swing": {"spin_loft": 0.0}})
        whole = run_ssp(ssp, 5e-3, _LANDED)
        _show_steps(report, runs)
        _check_drive(report, values)
        errors = _show_order(report, drive, acting)
    _show_shaft(report, flat["Swing.effective_mass"][-1], acting)
    landed = float(whole["BallFlight.distance"][-1])
    carry = report.cases[_name(STEPS[0])]["carry"]
    report.check_close("the ball lands at the carry computed at launch", landed, carry, 0.0)
    names = {"distance": "BallFlight.distance", "height": "BallFlight.height"}
    columns = {name: whole[column] for name, column in names.items()}
    report.trajectories["system_flight"] = {"time": whole["time"], **columns}
    _draw_swing(report, runs, values["Swing"])
    _draw_error(report, errors)
    _draw_flight(report, whole)
    return report


def _steps(size, share=0.0):
    """5 ms until the ball is near, then a share of a step, and steps of this size."""
    first = [share * size] if share else []
    return [5e-3] * round(_NEAR / 5e-3) + first + [size] * round((_END - _NEAR) / size)


def _name(step):
    return f"step_{step:g}_s"


def _micro(step):
    return f"{step * 1e6:g} µs"


def _show_steps(report, runs):
    rows = []
    for step, path in runs.items():
        names = ((part, name) for part, results in _RESULTS.items() for name in results)
        case = {name: float(path[f"{part}.{name}"][-1]) for part, name in names}
        report.cases[_name(step)] = case
        impulse, applied = case["impulse"], case["reaction_impulse"]
        numbers = f"{impulse:.8f}", f"{applied - impulse:.0e}", f"{case['head_speed']:.4f}"
        spin = f"{case['backspin'] * 30.0 / pi:.2f}"
        rows.append([_micro(step), *numbers, spin, f"{case['carry']:.6f}"])
        claim = f"the impulse applied to the swing is that of the contact at {_micro(step)}"
        report.check_close(claim, applied, impulse, 0.0, "cumulative, one step late")
        gained = case["ball_velocity"] * report.fmu.default("m_ball")
        claim = f"the impulse is the ball's momentum at {_micro(step)}"
        report.check_close(claim, impulse, gained, 1e-13 * gained, "law 2")
        balance = path["Swing.energy"] - path["Swing.work"] + path["Swing.reaction_work"]
        drift = float(np.ptp(balance[path["time"] > _NEAR]))
        claim = f"the swing's energy is its work minus that against the ball at {_micro(step)}"
        report.check_close(claim, drift, 0.0, 1e-11, "J, of 140")
    columns = ["step", "impulse (N.s)", "applied − impulse", "swing's head (m/s)"]
    when = f"{(_END - report.cases[_name(STEPS[-1])]['touch_time']) * 1e3:.1f} ms after touch"
    title = f"The loop at the end of the run, {when}"
    report.table(title, [*columns, "backspin (rpm)", "carry (m)"], rows)
    for name in ("impulse", "smash_factor", "backspin", "launch_angle", "carry"):
        report.stays(f"{name} is the same at every step", name)


def _check_drive(report, values):
    case = report.cases[_name(STEPS[-1])]
    normal, time = case["ball_velocity"] / case["smash_factor"], case["touch_time"] - _BACKSWING
    speed = normal / np.cos(values["Swing"]["spin_loft"])
    half = "half of its last digit"
    claim = "the head's speed at the ball is the source's"
    report.check_close(claim, float(speed), _SOURCE_SPEED, 0.005, half)
    claim = "the time from the top to the ball is the source's"
    report.check_close(claim, time, _SOURCE_TIME, 5e-5, half)
    angle, spin = degrees(case["launch_angle"]), case["backspin"] * 30.0 / pi
    claim = "S is at most 1.50, the largest of tour players"
    report.check(claim, case["smash_factor"] <= 1.50, f"{case['smash_factor']:.4f}")
    report.check("the launch angle is a driver's, 9 to 14°", 9.0 < angle < 14.0, f"{angle:.2f}°")
    report.check("so is the backspin, 2200 to 3200 rpm", 2200 < spin < 3200, f"{spin:.0f} rpm")
    launch = values["Launch"]
    report.say(
        f"The head comes to the ball with {speed:.2f} m/s ({speed / 0.44704:.0f} mph), "
        f"{time:.4f} s after the top, as in its source; along the face normal these are "
        f"{normal:.2f} m/s. Law 2 with the ball of the preset `tour` and a COR that falls with the "
        f"approach speed, here {case['coefficient_of_restitution']:.3f}, gives S "
        f"{case['smash_factor']:.3f}. A dynamic loft of "
        f"{degrees(launch['dynamic_loft']):.0f}° and a strike "
        f"{launch['strike_height'] * 1e3:.0f} mm above the head's centre of mass, both chosen, "
        f"launch the ball with {case['ball_speed']:.1f} m/s at {angle:.1f}° with {spin:.0f} rpm. "
        f"It carries {case['carry']:.1f} m ({case['carry'] / 0.9144:.0f} yd).",
    )


def _show_order(report, drive, mass):
    """The error of the coupling, with a head in the impact of the swing's effective mass.

    Returns:
        Relative errors at each step of `_FINER` by the way of coupling, the largest over `_SHARES`.
    """
    loop = {name: drive[name] for name in ("Swing", "ClubBallImpact")}
    matched = {"ClubBallImpact": {"m_club": mass}}
    finest = run_system(loop, _steps(_FINEST)[: round(_NEAR / 5e-3) + 5000], matched, rollback=True)
    limit = float(finest["Swing.reaction_work"][-1])
    errors = {}
    for way, repeated in (("delayed", False), ("repeated", True)):
        largest = []
        for step in _FINER:
            paths = (run_system(loop, _steps(step, one), matched, repeated) for one in _SHARES)
            largest.append(max(abs(path["Swing.reaction_work"][-1] - limit) for path in paths))
        errors[way] = np.array(largest) / limit
    rows = zip(map(_micro, _FINER), *([f"{e:.1e}" for e in errors[way]] for way in errors))
    columns = ["step", "one step late", "steps repeated"]
    report.table("Relative error of the energy taken from the swing", columns, rows)
    # Steps well below the contact's 0.5 ms.
    small = slice(_FINER.index(2e-4), None)
    orders = {
        way: np.polyfit(np.log(_FINER[small]), np.log(off[small]), 1)[0]
        for way, off in errors.items()
    }
    words = {way: f"order {order:.2f} from 200 to 10 µs" for way, order in orders.items()}
    claim = "with one step's delay the error is of first order in the step"
    report.check(claim, 0.95 < orders["delayed"] < 1.05, words["delayed"])
    claim = "with repeated steps it is of second order"
    report.check(claim, 1.9 < orders["repeated"] < 2.2, words["repeated"])
    ball, club, smash = (
        finest[f"ClubBallImpact.{name}"][-1]
        for name in ("ball_velocity", "club_velocity", "smash_factor")
    )
    lost = 0.5 * mass * ((ball / smash) ** 2 - club**2)
    gained = 0.5 * report.fmu.default("m_ball") * ball**2
    report.check_close(
        "the swing gives what a free head loses, except for the golfer's work meanwhile",
        limit,
        lost,
        3e-3 * lost,
        "torques and rotation of the head go on during the 0.5 ms",
    )
    report.say(
        f"Energy: the swing gives {limit:.2f} J, a free head of its effective mass loses "
        f"{lost:.2f} J; the ball gets {gained:.2f} J, and {lost - gained:.2f} J become heat. Each "
        "figure of the table is the largest of three positions of touch inside a step. One step "
        f"late, the swing gives {errors['delayed'][0] * 100:.1f} % too much at 1 ms and "
        f"{errors['delayed'][-1] * 1e6:.0f} parts in a million at 10 µs. With the impulse of the "
        "step itself the only error left is that it acts as a constant force over the step: second "
        "order, as soon as several steps fall into the contact. At 0.5 and 1 ms the contact lies "
        "inside one or two steps; these are no part of the fit.",
    )
    return errors


def _show_shaft(report, head, acting):
    """Influence of club and arms on the ball's speed, without loft."""
    case, alone = report.cases[_name(STEPS[-1])], 0.2
    speed = case["ball_velocity"] / case["smash_factor"]
    given = {"law": 2, "club_speed": speed}
    balls = [
        report.fmu.impact(("ball_velocity",), m_club=mass, **given)["ball_velocity"]
        for mass in (alone, head)
    ]
    more = (balls[1] / balls[0] - 1.0) * 100.0
    claim = "club and arms add less than 1 % to the ball's speed"
    report.check(claim, 0.0 < more < 1.0, f"{more:.2f} %")
    report.say(
        f"Three speeds after touch (law 2): along its path the swing's head has "
        f"{case['head_speed']:.2f} m/s {(_END - case['touch_time']) * 1e3:.1f} ms after touch; the "
        f"free head of ClubBallImpact has {case['club_velocity']:.2f} m/s along the face normal "
        "from separation on. Both lost the same momentum, but the free head turns: struck above "
        f"its centre of mass it has less effective mass than the {acting * 1e3:.1f} g of the "
        f"swing's head along the normal. Without loft the latter is {head * 1e3:.1f} g, 200 g of "
        f"it the head: club and arms add {more:.1f} % to the ball's speed.",
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
        shoulder, wrist, head = np.zeros((2, len(shown))), wrist[:, shown], head[:, shown]
        unnamed = [None] * (len(shown) - 1)
        for start, end, colour, name in (
            (shoulder, wrist, figures.BLUE, "arms"),
            (wrist, head, figures.ORANGE, "club"),
        ):
            lines = np.stack([start, end], axis=1)
            axes.plot(*lines, color=colour, lw=1.4, label=[name, *unnamed])
        axes.plot(*head, "o", color=figures.BLACK, ms=4, label="head")
        for word, n, right in (("top", 0, 8), ("ball", -1, 10)):
            axes.annotate(word, head[:, n], xytext=(right, -3), textcoords="offset points")
        axes.set(xlabel="towards the target (m)", ylabel="up, in the plane of the swing (m)")
        axes.set(xlim=(-1.45, 0.95))
        axes.set_aspect("equal")
        figures.add_legend_above(axes)
        return figure

    @report.figure(
        "system_speeds",
        "The swing loses the momentum that the ball gains: at a step of 10 µs during contact, at "
        "1 ms one step late.",
    )
    def speeds(figures):
        figure, axes = figures.new("Speeds through the impact (law 2)")
        ball, club = "ClubBallImpact.ball_velocity", "ClubBallImpact.club_velocity"
        swinging = "Swing.head_speed"
        points = {"color": figures.VERMILION, "ls": ":", "marker": "o", "lw": 1.4, "ms": 5}
        for path, column, style, label in (
            (fine, ball, figures.STYLES["ball"].line, "ball"),
            (fine, club, figures.STYLES["club"].line, "free head, along the normal"),
            (fine, swinging, {"color": figures.BLACK}, "swing's head, along its path, 10 µs"),
            (coarse, swinging, points, "the same, 1 ms"),
        ):
            near = milli(path) > -1.2
            axes.plot(milli(path)[near], path[column][near], **style, label=label)
        for column, above in ((swinging, 5), (club, -15)):
            speed = fine[column][np.argmax(fine["time"] > touch + 2.6e-3)]
            at, words = (2.62, speed), f"{speed:.1f} m/s"
            axes.annotate(words, at, xytext=(0, above), textcoords="offset points")
        axes.set(xlabel="time since touch (ms)", ylabel="speed (m/s)")
        axes.set(xlim=(-0.6, 3.0), ylim=(-3, 92))
        figures.add_legend_above(axes)
        return figure

    @report.figure(
        "system_force",
        "The force, its mean over steps of 1 ms, and the mean force on the swing, one step later: "
        "three times the same area.",
    )
    def force(figures):
        figure, axes = figures.new("Contact force and its impulse at a step of 1 ms")
        curve = fine["ClubBallImpact.force"] / 1e3
        axes.plot(milli(fine), curve, color=figures.BLUE, label="force")
        ends = milli(coarse)
        mean = coarse["ClubBallImpact.mean_force"] / 1e3
        edges = np.append(ends[0] - 1.0, ends)
        axes.stairs(mean, edges, color=figures.VERMILION, lw=2, label="mean_force at 1 ms")
        axes.stairs(mean, edges + 1.0, color=figures.GREEN, lw=2, label="on the swing")
        axes.set(xlabel="time since touch (ms)", ylabel="force on the ball (kN)")
        axes.set(xlim=(-0.7, 2.2), ylim=(-0.3, None))
        figures.add_legend_above(axes, columns=3)
        return figure


def _draw_error(report, errors):
    @report.figure(
        "system_error",
        "Energy taken from the swing, against the limit of small steps; the largest error of three "
        "positions of touch inside a step. First order with a step's delay, second without.",
    )
    def error(figures):
        figure, axes = figures.new("Error of the coupling")
        micro = np.array(_FINER) * 1e6
        late, again = "one step late", "steps repeated with their impulse"
        axes.loglog(micro, errors["delayed"], "o-", color=figures.VERMILION, label=late)
        axes.loglog(micro, errors["repeated"], "s-", color=figures.BLUE, label=again)
        for order, at in ((1, 1.2e-4), (2, 5e-6)):
            scale = np.array([10.0, 100.0])
            axes.loglog(scale, at * (scale / 100.0) ** order * 0.6, color="0.5", lw=1, ls=":")
            axes.annotate(f"order {order}", (14, at * 0.14**order * 0.6), va="top", color="0.4")
        axes.set(xlabel="communication step (µs)", ylabel="energy from the swing, relative error")
        figures.add_legend_above(axes)
        return figure


def _draw_flight(report, whole):
    @report.figure(
        "system_flight",
        "Backspin lifts the ball above the line of its launch.",
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
        angle, spin = (float(whole[f"Launch.{one}"][-1]) for one in ("launch_angle", "backspin"))
        axes.plot(reach, reach * tan(angle), color="0.5", lw=1, ls="--")
        words = f"launch angle {degrees(angle):.1f}°\nbackspin {spin * 30.0 / pi:.0f} rpm"
        axes.annotate(words, (72, 2), va="bottom")
        axes.set(xlabel="distance (m)", ylabel="height (m)")
        axes.set(xlim=(0, 1.22 * x[-1]), ylim=(0, 1.3 * y[top]))
        return figure


if __name__ == "__main__":
    main(__file__)
