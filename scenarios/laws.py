"""Two laws, drag on each body or a damper between them: momentum, frame of reference."""

import matplotlib.pyplot as plt

from golf_impact.data.quantities import QUANTITIES, describe
from golf_impact.scenario import Result, main

NAMES = {1: "law 1 (absolute)", 2: "law 2 (relative)"}
PATH = ["force", "momentum", "kinetic_energy", "energy_efficiency"]


def run(impact):
    result = Result("Two laws: drag on each body, or a damper between them")
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2))
    figure.suptitle("Law 1 loses momentum, law 2 conserves it (k = 1 MN/m, b = 9 N·s/m, 35 m/s)")
    for law, name in NAMES.items():
        result.cases[name] = impact(law=law)
        # Another frame of reference: both bodies are 10 m/s faster.
        moving = impact(law=law, club_speed=45.0, ball_speed=10.0)
        result.cases[f"law {law}, moving"] = moving
        path = impact.simulate(0.68e-3, PATH, 2e-6, start_values={"law": law})
        result.trajectories[f"law_{law}"] = path
        for axes, quantity in ((left, "momentum"), (right, "kinetic_energy")):
            axes.plot(path["time"] * 1e6, path[quantity], ["-", "--"][law - 1], label=name)
    left.set(xlabel="time (µs)", ylabel="momentum of both bodies (kg·m/s)")
    right.set(xlabel="time (µs)", ylabel="kinetic energy of both bodies (J)")
    left.legend()
    result.figures["laws"] = figure

    one, two = (result.cases[name] for name in NAMES.values())
    rows = [
        [about.label, about.format_value(one[name]), about.format_value(two[name])]
        for name, about in QUANTITIES.items()
        if name in one
    ]
    result.tables.append(
        ("The same impact, 35 m/s", ["", *(describe({"law": n}) for n in NAMES)], rows)
    )

    cor = [case["coefficient_of_restitution"] for case in result.cases.values()]
    lost = 1.0 - one["momentum"] / 7.35
    result.claims = {
        "law 1 loses 4 to 5 % of the momentum": 0.04 < lost < 0.05,
        "law 2 conserves momentum": abs(two["momentum"] / 7.35 - 1.0) < 1e-14,
        "law 1: COR depends on the frame of reference": abs(cor[1] - cor[0]) > 1e-4,
        "law 2: COR is the same in all frames of reference": abs(cor[3] - cor[2]) < 1e-13,
    }
    result.words = (
        f"Law 1 (the document's equations) loses {lost * 100:.2f} % of the momentum and depends on "
        "the frame of reference; law 2 (its text) does neither. Use law 1 to reproduce the "
        "document, law 2 for everything else."
    )
    return result


if __name__ == "__main__":
    main(run)
