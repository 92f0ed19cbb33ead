"""Club speed: 35 and 50 m/s, the document's table and its Fig. 6."""

import matplotlib.pyplot as plt

from golf_impact.data import document
from golf_impact.data.quantities import QUANTITIES, describe
from golf_impact.scenario import Result, main


def run(impact):
    result = Result("Club speed: more force, the same time")
    figure, axes = plt.subplots()
    for speed in (35.0, 50.0):
        case = f"{speed:g} m/s"
        result.cases[case] = exact = impact(club_speed=speed)
        result.tables.append(document.compare(case, exact))
        claim = f"{case}: printed numbers are exact within 0.5 % and half a digit"
        result.claims[claim] = document.agrees(case, exact)
        path = impact.simulate(0.68e-3, ["force"], 2e-6, start_values={"club_speed": speed})
        result.trajectories[f"club_speed_{speed:g}"] = path
        axes.plot(path["time"] * 1e6, path["force"] / 1e3, label=case)
    axes.set(title="A faster club: more force, the same contact time")
    axes.set(xlabel="time (µs)", ylabel="contact force (kN)")
    axes.legend(title=describe({}))
    result.figures["club_speed_force"] = figure

    slow, fast = result.cases.values()
    for metric in ("smash_factor", "coefficient_of_restitution", "contact_time"):
        same = abs(fast[metric] / slow[metric] - 1.0) < 1e-13
        result.claims[f"{QUANTITIES[metric].name} is independent of club speed"] = same
    ratio = fast["max_force"] / slow["max_force"]
    result.claims["force is proportional to club speed"] = abs(ratio / (50.0 / 35.0) - 1.0) < 1e-13
    result.words = (
        "The equations are linear: forces, speeds and lengths are proportional to club speed. The "
        "document's 621 and 620 µs differ because of its time step."
    )
    return result


if __name__ == "__main__":
    main(run)
