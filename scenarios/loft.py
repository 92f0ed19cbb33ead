"""Loft: launch angle and backspin by Launch.fmu, beside the irons of the tour."""

from math import degrees, radians

import matplotlib.pyplot as plt
import numpy as np

from golf_impact.data import measured
from golf_impact.data.balls import BALLS
from golf_impact.data.quantities import describe, format_percent
from golf_impact.fmu import Fmu
from golf_impact.scenario import Result, main
from golf_impact.studies.drive import shot, shot_of

LOFTS, FRICTIONS = np.arange(0.0, 61.0, 2.0), (0.1, 0.2, 0.4)
IRONS = [stroke for club, stroke in measured.PGA.items() if club.endswith("iron") or club == "PW"]


def run(impact):
    result, rows, over = Result("Loft: launch angle and backspin"), [], {}
    with Fmu(impact.companion("Launch.fmu")) as launch:
        of_paper = shot(impact, launch, 35.0, radians(11.5), ball="roh-lee")
        result.cases["Roh & Lee's club"] = of_paper
        for s in IRONS:
            given = s.club_speed, s.launch_angle, s.attack_angle
            found = result.cases[s.club] = shot_of(impact, launch, *given, m_club=s.m_club)
            angles = found["dynamic_loft"], s.launch_angle, found["launch_angle"]
            spins = s.backspin / measured.RPM, found["backspin"] / measured.RPM
            row = [*(f"{degrees(x):.1f}" for x in angles), *(f"{x:.0f}" for x in spins)]
            rows.append([s.club, *row, format_percent(spins[1] / spins[0] - 1.0, 0)])
        for friction in FRICTIONS:
            shots = (shot(impact, launch, 40.0, radians(x), friction=friction) for x in LOFTS)
            over[friction] = [*shots]
    title = f"Irons of the PGA Tour: penner, {describe(BALLS['penner'].values)}, friction 0.4"
    columns = ["club", "loft (°)", "launch (°)", "model", "backspin (rpm)", "model", "error (%)"]
    result.tables.append((title, columns, rows))

    spin, flat = [one["backspin"] for one in over[0.4]], over[0.4][0]
    errors = [float(row[-1]) for row in rows]
    result.claims = {
        "without loft there is no spin": flat["backspin"] == 0.0,
        "and Launch.fmu doesn't change the speed": flat["ball_speed"] == flat["ball_velocity"],
        "backspin grows with loft, up to 44°": np.all(np.diff(spin[:23]) > 0.0),
        "backspin of irons is within -5 and +20 %": -5.0 < min(errors) <= max(errors) < 20.0,
    }
    result.words = (
        "The loft is that of the row's launch angle; backspin is a prediction, off by "
        f"{min(errors):+.0f} to {max(errors):+.0f} %. Roh & Lee's club (11.5°, 35 m/s, ball "
        f"roh-lee) gives {of_paper['backspin'] / measured.RPM:.0f} rpm. Clubs: "
        f"{measured.PGA_SOURCE}."
    )

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    figure.suptitle("More loft, more backspin, until the ball slides (40 m/s, ball penner)")
    for (friction, shots), dashes in zip(over.items(), (":", "--", "-")):
        spins = [one["backspin"] / measured.RPM for one in shots]
        left.plot(LOFTS, spins, dashes, label=f"friction {friction:g}")
        right.plot(LOFTS, [degrees(one["launch_angle"]) for one in shots], dashes)
    right.plot(LOFTS, LOFTS, color="0.5", lw=1, label="face normal")
    left.set(xlabel="spin loft (°)", ylabel="backspin (rpm)")
    right.set(xlabel="spin loft (°)", ylabel="launch angle (°)")
    left.legend()
    right.legend()
    result.figures["loft"] = figure
    return result


if __name__ == "__main__":
    main(run)
