"""Speed dependence: measured COR falls with club speed; constant k and b don't give that."""

import matplotlib.pyplot as plt
import numpy as np

from golf_impact.data import measured
from golf_impact.data.balls import BALLS
from golf_impact.data.errors import UserError
from golf_impact.data.quantities import describe
from golf_impact.scenario import Result, main

NAMES = ("document", "roh-lee-linear", "roh-lee", "penner")
SPEEDS = np.arange(10.0, 71.0, 5.0)

#: A. R. Penner, Am. J. Phys. 69 (2001) 563: a ball on a rigid head.
LINE = measured.PENNER_AT_REST - measured.PENNER_SLOPE * SPEEDS


def run(impact):
    result, over = Result("Speed dependence: COR falls with club speed"), {}
    for name in NAMES:
        values, rows = BALLS[name].values, []
        for speed in SPEEDS.tolist():
            rows.append(impact(**{**values, "club_speed": speed}))
            result.cases[f"{name}, {speed:g} m/s"] = rows[-1]
        over[name] = {metric: np.array([row[metric] for row in rows]) for metric in rows[0]}
    try:
        impact(**{**BALLS["penner"].values, "club_speed": 300.0})
        refused = False
    except UserError as error:
        refused = "restitution_slope" in error.reason

    cor, time = "coefficient_of_restitution", "contact_time"
    result.claims = {
        "with constant k and b COR is the same at all speeds": all(
            np.ptp(over[name][cor]) < 1e-13 for name in NAMES[:3]
        ),
        "penner has the measured line": np.allclose(over["penner"][cor], LINE, rtol=1e-13, atol=0),
        "contact time is the same if n = 1": np.ptp(over["roh-lee-linear"][time]) < 1e-16,
        "and falls with speed if n > 1": np.all(np.diff(over["roh-lee"][time]) < 0.0),
        "an approach speed at which the line is below 0 is refused": refused,
    }
    result.words = (
        "Measured COR falls by 0.0029 per m/s (Penner). With constant k and b it is independent of "
        "speed; restitution_at_rest and restitution_slope follow the measurement (ball penner). "
        f"Contact becomes shorter with speed, as measured ({measured.LOUGHBOROUGH}). Tour drivers "
        "are above the line: their faces are flexible, the line is a rigid head's."
    )
    rows = [["law, k, b", *(describe(BALLS[name].values) for name in NAMES)]]
    for metric, label, factor in ((cor, "COR", 1.0), (time, "contact time (µs)", 1e6)):
        for n in (2, 6, 10):
            numbers = (f"{over[name][metric][n] * factor:.4g}" for name in NAMES)
            rows.append([f"{label} at {SPEEDS[n]:g} m/s", *numbers])
    result.tables.append(("COR and contact time over club speed", ["", *NAMES], rows))

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    for name, dashes in zip(NAMES, ("--", "-.", "-", "-")):
        left.plot(SPEEDS, over[name][cor], dashes, lw=4 if name == "penner" else 2, label=name)
        right.plot(SPEEDS, over[name]["smash_factor"], dashes, lw=4 if name == "penner" else 2)
    left.plot(SPEEDS, LINE, "k:", label="measured line (Penner)")
    for axes, metric in ((left, cor), (right, "smash_factor")):
        for m in (one for one in measured.MEASUREMENTS if one.metric == metric):
            marker = "o" if m.face == "rigid" else "^"
            axes.plot(m.club_speed, m.middle, f"k{marker}", zorder=5, label=f"{m.face} face")
            above = {"tour, 115 mph": 13, "rules' limit": 5}.get(m.short, -12)
            where = {"xytext": (6, above), "textcoords": "offset points"}
            axes.annotate(m.short, (m.club_speed, m.middle), **where)
    left.set(xlabel="club speed (m/s)", ylabel="COR", ylim=(0.62, 1.0))
    right.set(xlabel="club speed (m/s)", ylabel="smash factor S")
    figure.suptitle("Measured COR falls with speed; with constant k and b it stays the same")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    result.figures["speed_dependence"] = figure
    return result


if __name__ == "__main__":
    main(run)
