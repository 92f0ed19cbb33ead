"""How good is our simple model? The preset balls beside finite elements and published data."""

from math import degrees

import matplotlib.pyplot as plt

from golf_impact.data import measured
from golf_impact.data.balls import BALLS
from golf_impact.data.errors import UnavailableError
from golf_impact.data.quantities import QUANTITIES, describe, format_percent
from golf_impact.fmu import Fmu
from golf_impact.scenario import Result, main
from golf_impact.studies.drive import shot_of

#: From the document's fit to the best one; what the ball roh-lee was fitted to, and the only other
#: independent figure (S and COR follow from the velocities).
NAMES = ("document", "roh-lee-linear", "roh-lee-tsuji", "roh-lee", "penner")
FITTED = ("ball_velocity", "club_velocity", "contact_time", "max_force")
PREDICTED = "time_of_max_force"

CLUBS = ("driver", "3-iron", "5-iron", "7-iron", "9-iron", "PW")


def run(impact):
    result = Result("How good is our simple model?")
    paper = compare(impact, result, "Finite elements (Roh & Lee)", measured.FINITE_ELEMENTS)
    compare(impact, result, "Measured", measured.MEASUREMENTS)
    worst = {name: max(abs(paper[name][metric]) for metric in FITTED) for name in NAMES}
    ahead = paper["roh-lee"][PREDICTED]
    rows, left_out = predictions(impact)
    title = f"Data that nothing was fitted to: penner, {describe(BALLS['penner'].values)}"
    result.tables.append((title, ["", "published", "model", "miss (%)"], rows))

    result.claims = {
        "roh-lee fits the finite-element ball within 1 %": worst["roh-lee"] < 1.0,
        "and predicts the time of maximum force within 2 %": abs(ahead) < 2.0,
        "the document's k and b miss one of these by more than 5 %": worst["document"] > 5.0,
        "the best linear ball misses one by more than 4 %": worst["roh-lee-linear"] > 4.0,
    }
    for what, *_, miss in rows:
        if what == "backspin, driver (rpm)":
            result.claims["backspin of a driver isn't: its head turns"] = float(miss) > 50.0
    result.words = (
        f"Largest error beside the finite-element ball: {worst['document']:.0f} % with the "
        f"document's k and b, {worst['roh-lee-linear']:.1f} % with the best linear ball, "
        f"{worst['roh-lee']:.1f} % with a free exponent, which predicts the time of maximum force "
        f"({ahead:+.1f} %). That is one impact; measured COR falls with speed (penner). {left_out}"
        f"Clubs: {measured.PGA_SOURCE}."
    )

    figure, axes = plt.subplots()
    for name, dashes in zip(NAMES[:4], (":", "-.", "--", "-")):
        path = impact.simulate(0.7e-3, ["force"], 2e-6, start_values=BALLS[name].values)
        label = f"{name} ({worst[name]:.1f} %)"
        axes.plot(path["time"] * 1e6, path["force"] / 1e3, dashes, label=label)
    axes.plot([280.0, 600.0], [6.6, 0.0], "k+", ms=14, mew=2, label="Roh & Lee", clip_on=False)
    axes.set(title="With an exponent the model follows a finite-element ball at 35 m/s")
    axes.set(xlabel="time (µs)", ylabel="contact force (kN)", ylim=(0, None))
    axes.legend(title="ball (its largest error)")
    result.figures["validation"] = figure
    return result


def compare(impact, result, title, data):
    """Add a table of published data with each ball's values; returns their errors in %."""
    errors = {name: {} for name in NAMES}
    rows = [["law, k, b", "", *(describe(BALLS[name].values) for name in NAMES)]]
    for m in data:
        factor, cells = QUANTITIES[m.metric].factor, []
        for name in NAMES:
            values = {**BALLS[name].values, "club_speed": m.club_speed}
            case = result.cases[f"{name}, {m.club_speed:.4g} m/s"] = impact(**values)
            error = case[m.metric] / m.middle - 1.0
            errors[name][m.metric] = error * 100.0
            cells.append(f"{case[m.metric] * factor:.4g} ({format_percent(error, 1)} %)")
        ends = dict.fromkeys(f"{x * factor:.4g}" for x in (m.low, m.high))
        rows.append([f"{m.what}, {m.club_speed:.3g} m/s", "–".join(ends), *cells])
    result.tables.append((title, ["", "published", *NAMES], rows))
    return errors


def predictions(impact):
    """Rows of published and predicted values with their difference, and what is left out."""
    rows, penner = [], {**BALLS["penner"].values, "m_club": 0.200}

    def add(what, published, ours):
        numbers = (f"{x:.0f}" if x > 100.0 else f"{x:.3g}" for x in (published, ours))
        rows.append([what, *numbers, format_percent(ours / published - 1.0, 0)])

    for one in measured.PREDICTIONS:
        metric, factor = one["metric"], one["factor"]
        ours = impact([metric], **{**penner, "club_speed": one["club_speed"]})[metric]
        add(one["what"], one["value"] * factor, ours * factor)
    try:
        files = impact.companion("Launch.fmu"), impact.companion("BallFlight.fmu")
    except UnavailableError as error:
        return rows, f"Spin and flight are left out: {error}. "
    with Fmu(files[0]) as launch, Fmu(files[1]) as flight:
        for s in (measured.PGA[club] for club in CLUBS):
            given = s.club_speed, s.launch_angle, s.attack_angle
            spin = shot_of(impact, launch, *given, m_club=s.m_club)["backspin"]
            add(f"backspin, {s.club} (rpm)", s.backspin / measured.RPM, spin / measured.RPM)
            start = {
                "ball_velocity": s.ball_speed, "launch_angle": s.launch_angle,
                "backspin": s.backspin, "separated": True,
            }  # fmt: skip
            end = flight.simulate(1e-3, ["carry", "land_angle"], start_values=start)[-1]
            add(f"carry, {s.club} (yd)", s.carry / measured.YARD, end["carry"] / measured.YARD)
            add(f"land angle, {s.club} (°)", degrees(s.land_angle), degrees(end["land_angle"]))
    return rows, ""


if __name__ == "__main__":
    main(run)
