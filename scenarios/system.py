"""A system of four FMUs, Swing ⇄ ClubBallImpact → Launch → BallFlight: a drive.

The swing gets the impulse of the contact one step later: the cost of that delay, and what an
importer saves that repeats the step. The FMUs are those inside GolfSwing.ssp. A shaft on the
head, which an impulse can't carry, returns a force in three ways.
"""

import tempfile
from math import degrees, pi, tan
from pathlib import Path

import numpy as np

from golf_impact.scenario import (
    COUPLINGS,
    Report,
    build_system,
    extract_fmus,
    main,
    measured,
    run_pushed,
    run_ssp,
    run_system,
)

TITLE = "System: swing, impact, launch and flight of a drive"
CHAPTER = 14

#: Communication steps, s.
STEPS = (1e-3, 5e-4, 1e-4, 1e-5)

#: s: at these the error of the coupling is measured, against a run with steps of the last.
_FINER, _FINEST = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5), 1e-6

#: Where in its step touch falls: a first step of these shares of the others' size.
_SHARES = (0.0, 0.3, 0.6)

#: A shaft: stiffnesses, N/m; mass of its tip, kg; damping, N.s/m; speed of the grip, m/s.
_SHAFTS, _TIP, _DAMPING, _GRIP = (2e4, 2e5, 2e6), 0.2, 5.0, 40.0

#: s: steps of the shaft's force; the reference; touch falls at so many places in the step.
_PUSHED, _EXACT, _PLACES = (1e-4, 5e-5, 2e-5, 1e-5), 1e-6, 8

#: s: what comes before is taken in steps of 5 ms; the ball has been launched at the end; and it has
#: landed.
_NEAR, _END, _LANDED = 0.96, 0.967, 8.4

#: Speed at the ball, m/s, and time from the top, s, by the source that swing.toml names.
_SOURCE_SPEED, _SOURCE_TIME = 52.76, 0.2125

#: Start values of the swing: time of the backswing, s; lengths of arms and club, m.
_BACKSWING, _ARMS, _CLUB = 0.75, 0.5754, 1.05

_RPM = 30.0 / pi

_RESULTS = (
    "Swing.reaction_impulse", "Swing.head_speed", "ClubBallImpact.touch_time",
    "ClubBallImpact.impulse", "ClubBallImpact.smash_factor",
    "ClubBallImpact.coefficient_of_restitution", "ClubBallImpact.ball_velocity",
    "ClubBallImpact.club_velocity", "Launch.ball_speed", "Launch.launch_angle", "Launch.backspin",
    "BallFlight.carry", "BallFlight.apex", "BallFlight.flight_time",
)  # fmt: skip


def run(fmu):
    """The loop at four communication steps, with and without its delay; the flight."""
    report = Report(TITLE, fmu)
    with tempfile.TemporaryDirectory(prefix="golf-impact-system-") as folder:
        ssp = build_system(Path(folder))["GolfSwing"]
        drive = extract_fmus(ssp, Path(folder, "drive"))
        runs = {step: run_system(drive, _steps(step)) for step in STEPS}
        flat = run_system(drive, [1e-3], {"Swing": {"spin_loft": 0.0}})
        whole = run_ssp(ssp, 5e-3, _LANDED)
        acting = runs[STEPS[0]]["Swing.effective_mass"][0]
        _show_steps(report, runs)
        _show_order(report, drive, acting)
    _show_shaft(report)
    _show_drive(report, runs[STEPS[-1]], acting, flat["Swing.effective_mass"][-1])
    _draw_swing(report, runs[STEPS[0]], runs[STEPS[-1]])
    _show_flight(report, whole)
    return report


def _steps(size, share=0.0):
    """5 ms until the ball is near, then a share of a step, and steps of this size."""
    first = [share * size] if share else []
    return [5e-3] * round(_NEAR / 5e-3) + first + [size] * round((_END - _NEAR) / size)


def _show_steps(report, runs):
    rows = []
    for step, path in runs.items():
        at = f"at {step * 1e6:g} µs"
        case = {name.partition(".")[2]: float(path[name][-1]) for name in _RESULTS}
        report.cases[f"step_{step:g}_s"] = case
        impulse, applied = case["impulse"], case["reaction_impulse"]
        numbers = f"{impulse:.8f}", f"{applied - impulse:.0e}", f"{case['head_speed']:.4f}"
        spin, carry = f"{case['backspin'] * _RPM:.2f}", f"{case['carry']:.6f}"
        rows.append([at.removeprefix("at "), *numbers, spin, carry])
        claim = f"the impulse applied to the swing is that of the contact {at}"
        report.check_close(claim, applied, impulse, 0.0, "cumulative, one step late")
        gained = case["ball_velocity"] * report.fmu.default("m_ball")
        claim = f"the impulse is the ball's momentum {at}"
        report.check_close(claim, impulse, gained, 1e-13 * gained, "law 2")
        balance = path["Swing.energy"] - path["Swing.work"] + path["Swing.reaction_work"]
        drift = float(np.ptp(balance[path["time"] > _NEAR]))
        claim = f"the swing's energy is its work minus that against the ball {at}"
        report.check_close(claim, drift, 0.0, 1e-11, "J, of 140")
    columns = ["step", "impulse (N·s)", "applied − impulse", "swing's head (m/s)"]
    title = f"The loop {(_END - case['touch_time']) * 1e3:.1f} ms after touch"
    report.table(title, [*columns, "backspin (rpm)", "carry (m)"], rows)
    for name in ("impulse", "smash_factor", "backspin", "launch_angle", "carry"):
        report.stays(f"{name} is the same at every step", name)


def _show_order(report, drive, mass):
    """The error of the coupling, with a head in the impact of the swing's effective mass (kg)."""
    loop = {name: drive[name] for name in ("Swing", "ClubBallImpact")}
    matched = {"ClubBallImpact": {"m_club": mass}}
    finest = run_system(loop, _steps(_FINEST), matched, rollback=True)
    limit = float(finest["Swing.reaction_work"][-1])

    def error(step, rollback):
        """The largest relative error of the energy taken from the swing, over `_SHARES`."""
        paths = (run_system(loop, _steps(step, share), matched, rollback) for share in _SHARES)
        return max(abs(path["Swing.reaction_work"][-1] / limit - 1.0) for path in paths)

    late, repeated = "one step late", "steps repeated"
    errors = {late: [error(h, False) for h in _FINER], repeated: [error(h, True) for h in _FINER]}
    rows = (
        [f"{h * 1e6:g} µs", *map("{:.1e}".format, e)] for h, *e in zip(_FINER, *errors.values())
    )
    title = "Energy taken from the swing: largest relative error of three touches in a step"
    report.table(title, ["step", *errors], rows)
    for expected, (way, found) in enumerate(errors.items(), 1):
        # From 200 µs on, steps are well below the contact's 0.5 ms.
        order = np.polyfit(np.log(_FINER[2:]), np.log(found[2:]), 1)[0]
        claim = f"{way}: the error is of order {expected} in the step"
        report.check(claim, abs(order - expected) < 0.05, f"{order:.2f} from 200 to 10 µs")
    impact = {name: column[-1] for name, column in finest.items()}
    ball, club = (impact[f"ClubBallImpact.{body}_velocity"] for body in ("ball", "club"))
    lost = 0.5 * mass * ((ball / impact["ClubBallImpact.smash_factor"]) ** 2 - club**2)
    gained = 0.5 * report.fmu.default("m_ball") * ball**2
    claim = "the swing gives what a free head loses, except for the golfer's work meanwhile"
    why = "torques and rotation of the head go on during the 0.5 ms"
    report.check_close(claim, limit, lost, 3e-3 * lost, why)
    report.say(
        f"Energy: the swing gives {limit:.2f} J, a free head of its effective mass loses "
        f"{lost:.2f} J; the ball gets {gained:.2f} J, and {lost - gained:.2f} J become heat. With "
        "the impulse of the step itself the only error left is that it acts as a constant force "
        "over the step: second order, as soon as several steps fall into the contact. At 0.5 and "
        "1 ms it lies inside one or two steps; these are no part of the fit.",
    )

    @report.figure("system_error", "First order with one step's delay, second order without.")
    def plot(figures):
        figure, axes = figures.new("Error of the coupling")
        micro, scale = np.array(_FINER) * 1e6, np.array([10.0, 100.0])
        axes.loglog(micro, errors[late], "o-", color=figures.VERMILION, label=late)
        axes.loglog(micro, errors[repeated], "s-", color=figures.BLUE, label=repeated)
        for order, at in ((1, 7.2e-5), (2, 3e-6)):
            axes.loglog(scale, at * (scale / 100.0) ** order, color="0.5", lw=1, ls=":")
            axes.annotate(f"order {order}", (14, at * 0.14**order), va="top", color="0.4")
        axes.set(xlabel="communication step (µs)", ylabel="energy from the swing, relative error")
        figures.add_legend_above(axes)
        return figure


def _show_shaft(report):
    """The error of the ball's speed by a force late, in the middle of a step, and repeated."""

    def speed(stiffness, size, coupling, place=0):
        gap = place / _PLACES * size * _GRIP
        values = {"law": 2, "m_club": _TIP, "club_speed": _GRIP, "gap": gap}

        def push(t, x, v):
            return stiffness and stiffness * (_GRIP * t - gap - x) + _DAMPING * (_GRIP - v)

        return run_pushed(report.fmu, push, size, coupling, **values)

    free, rows, errors = {}, [], {}
    for shaft in _SHAFTS:
        exact = speed(shaft, _EXACT, "middle")
        free[shaft] = abs(speed(0.0, _PUSHED[0], "late") / exact - 1.0)
        for way in COUPLINGS:
            errors[shaft, way] = found = [
                max(abs(speed(shaft, h, way, n) / exact - 1.0) for n in range(_PLACES))
                for h in _PUSHED
            ]
            numbers = (f"{e:.1e}" for e in (free[shaft], *found))
            rows.append([f"{shaft / 1e3:g}", way, *numbers])
            order = np.polyfit(np.log(_PUSHED), np.log(found), 1)[0]
            expected = 1 if way == "late" else 2
            claim = f"a shaft of {shaft / 1e3:g} kN/m, force {way}: order {expected}"
            report.check(claim, abs(order - expected) < 0.1, f"{order:.2f} from 100 to 10 µs")
    columns = ["shaft (kN/m)", "force", "by impulse", *(f"{h * 1e6:g} µs" for h in _PUSHED)]
    report.table("A shaft on the head: error of the ball's speed", columns, rows)
    report.say(
        "By its impulse a club never changes the ball: the head in contact is free. From touch on "
        "the FMU's head is therefore the only one, and the shaft returns its force (`club_force`): "
        "that at the beginning of each step, that predicted for its middle, or the mean of both "
        "ends by repeating the step. The middle needs no repetition and has the smallest error.",
    )

    @report.figure("system_shaft", "The force for the middle of a step: second order in one pass.")
    def plot(figures):
        figure, axes = figures.new("A shaft of 200 kN/m on the head")
        micro, colours = np.array(_PUSHED) * 1e6, (figures.VERMILION, figures.GREEN, figures.BLUE)
        axes.axhline(free[2e5], color="0.4", ls="--", label="impulse")
        for way, colour, mark in zip(COUPLINGS, colours, "o^s"):
            axes.loglog(micro, errors[2e5, way], mark + "-", color=colour, label=f"force {way}")
        axes.set(xlabel="communication step (µs)", ylabel="ball speed, relative error")
        figures.add_legend_above(axes)
        return figure


def _show_drive(report, path, acting, flat):
    """The drive at the smallest step; effective masses (kg) of the head with and without loft."""
    case = list(report.cases.values())[-1]
    touch, smash = case["touch_time"], case["smash_factor"]
    speed = path["Swing.head_speed"][path["time"] < touch][-1]
    normal, time = case["ball_velocity"] / smash, touch - _BACKSWING
    half = "half of its last digit"
    claim = "the head's speed at the ball is the source's"
    report.check_close(claim, speed, _SOURCE_SPEED, 0.005, half)
    claim = "the time from the top to the ball is the source's"
    report.check_close(claim, time, _SOURCE_TIME, 5e-5, half)
    angle, spin = degrees(case["launch_angle"]), case["backspin"] * _RPM
    report.check("S is at most 1.50, the largest of tour players", smash <= 1.50, f"{smash:.4f}")
    report.check("the launch angle is a driver's, 9 to 14°", 9.0 < angle < 14.0, f"{angle:.2f}°")
    report.check("so is the backspin, 2200 to 3200 rpm", 2200 < spin < 3200, f"{spin:.0f} rpm")
    given = {"law": 2, "club_speed": normal}
    free, behind = (report.fmu.impact(m_club=m, **given)["ball_velocity"] for m in (0.2, flat))
    more = (behind / free - 1.0) * 100.0
    claim = "club and arms add less than 1 % to the ball's speed"
    report.check(claim, 0.0 < more < 1.0, f"{more:.2f} %")
    report.say(
        f"The head comes to the ball with {speed:.2f} m/s, along the face normal {normal:.2f} m/s. "
        f"COR is {case['coefficient_of_restitution']:.3f} at this speed. Loft and height of the "
        f"strike are chosen: {case['ball_speed']:.1f} m/s at {angle:.1f}° with {spin:.0f} rpm. The "
        f"ball carries {case['carry']:.1f} m ({case['carry'] / measured.YARD:.0f} yd).",
        "Three speeds (law 2): before touch the swing's head has that speed, "
        f"{(_END - touch) * 1e3:.1f} ms after it {case['head_speed']:.2f} m/s along its path; the "
        f"free head of ClubBallImpact has {case['club_velocity']:.2f} m/s along the face normal "
        "from separation on. Both lost the same momentum, but the free head turns: struck above "
        f"its centre of mass it has less effective mass than the {acting * 1e3:.1f} g of the "
        f"swing's head along the normal. Without loft the latter is {flat * 1e3:.1f} g, 200 g of "
        f"it the head: club and arms add {more:.1f} % to the ball's speed.",
    )


def _draw_swing(report, coarse, fine):
    touch = fine["ClubBallImpact.touch_time"][-1]

    @report.figure("system_swing", "The wrist opens late; the club takes the arms' energy.")
    def downswing(figures):
        figure, axes = figures.new("The downswing, every 10 ms and at the ball", size=(6.4, 5.8))
        instants = np.append(np.arange(_BACKSWING, touch, 0.01), touch)
        shown = np.searchsorted(fine["time"], instants - 1e-9)
        p, q = (fine[f"Swing.{part}_angle"][shown] for part in ("arm", "club"))
        wrist = _ARMS * np.array([np.sin(p), -np.cos(p)])
        head = wrist + _CLUB * np.array([np.sin(q), -np.cos(q)])
        for ends, colour, name in (
            ([0.0 * wrist, wrist], figures.BLUE, "arms"),
            ([wrist, head], figures.ORANGE, "club"),
        ):
            axes.plot(*np.stack(ends, axis=1), color=colour, lw=1.4)[0].set_label(name)
        axes.plot(*head, "o", color=figures.BLACK, ms=4, label="head")
        for word, n, right in (("top", 0, 8), ("ball", -1, 10)):
            axes.annotate(word, head[:, n], xytext=(right, -3), textcoords="offset points")
        axes.set(xlabel="towards the target (m)", ylabel="up, in the plane of the swing (m)")
        axes.set(xlim=(-1.45, 0.95), aspect="equal")
        figures.add_legend_above(axes)
        return figure

    @report.figure("system_speeds", "The swing loses what the ball gains, at 1 ms one step late.")
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
            milli = (path["time"] - touch) * 1e3
            near = milli > -1.2
            axes.plot(milli[near], path[column][near], **style, label=label)
        for column, above in ((swinging, 5), (club, -15)):
            speed = fine[column][np.argmax(fine["time"] > touch + 2.6e-3)]
            at, words = (2.62, speed), f"{speed:.1f} m/s"
            axes.annotate(words, at, xytext=(0, above), textcoords="offset points")
        axes.set(xlabel="time since touch (ms)", ylabel="speed (m/s)")
        axes.set(xlim=(-0.6, 3.0), ylim=(-3, 92))
        figures.add_legend_above(axes)
        return figure


def _show_flight(report, path):
    """By fmpy.ssp, from the swing to the landing."""
    end = {name: float(column[-1]) for name, column in path.items()}
    carry = report.each("carry")[0]
    claim = "the ball lands at the carry computed at launch"
    report.check_close(claim, end["BallFlight.distance"], carry, 0.0)
    x, y = path["BallFlight.distance"], path["BallFlight.height"]
    report.trajectories["system_flight"] = {"time": path["time"], "distance": x, "height": y}

    @report.figure("system_flight", "Backspin lifts the ball above the line of its launch.")
    def flight(figures):
        figure, axes = figures.new("Flight of the ball", size=(7.2, 3.2))
        axes.plot(x, y, color=figures.BLUE)
        top = int(np.argmax(y))
        figures.mark(axes, x[top], y[top], f"apex {end['BallFlight.apex']:.1f} m")
        figures.mark(axes, carry, 0.0, f"carry {carry:.1f} m")
        # The label above the landing stands clear of the path.
        axes.texts[-1].set(ha="left")
        angle, spin, reach = end["Launch.launch_angle"], end["Launch.backspin"] * _RPM, 120.0
        axes.plot([0.0, reach], [0.0, reach * tan(angle)], color="0.5", lw=1, ls="--")
        words = f"launch angle {degrees(angle):.1f}°\nbackspin {spin:.0f} rpm"
        axes.annotate(words, (72, 2), va="bottom")
        axes.set(xlabel="distance (m)", ylabel="height (m)")
        axes.set(xlim=(0, 1.22 * carry), ylim=(0, 1.3 * y[top]))
        return figure


if __name__ == "__main__":
    main(__file__)
