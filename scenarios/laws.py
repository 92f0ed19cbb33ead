"""The same impact under both laws: momentum and energy."""

from golf_impact.scenario import QUANTITIES, Report, main

TITLE = "Laws: drag on each body or damper between them"
CHAPTER = 11


def run(fmu):
    report = Report(TITLE, fmu)
    absolute = report.impact("law 1 (absolute)", law=1)
    relative = report.impact("law 2 (relative)", law=2)
    rows = (
        [one.label, *(one.format_value(of_law[metric]) for of_law in (absolute, relative))]
        for metric, one in QUANTITIES.items()
    )
    report.table(TITLE, ["", *report.cases], rows)

    lost = 1.0 - absolute["momentum_final"] / absolute["momentum_initial"]
    words = f"{lost * 100:.2f} %"
    report.check("law 1 loses some 4 % of the momentum", 0.035 < lost < 0.045, words)
    # Another frame of reference: both bodies are 10 m/s faster.
    report.impact("law 2, moving", law=2, club_speed=45.0, ball_speed=10.0)
    report.impact("law 1, moving", law=1, club_speed=45.0, ball_speed=10.0)
    first, second, second_moving, first_moving = report.each("coefficient_of_restitution")
    claim = "law 2: COR is the same in a frame of reference that moves by 10 m/s"
    report.check_close(claim, second_moving, second, 1e-12, kind="invariants")
    shift = first_moving - first
    claim = "law 1: COR depends on the frame of reference"
    report.check(claim, abs(shift) > 1e-4, f"it changes by {shift:+.5f}")
    report.conclude(
        f"Law 1 (the document's equations) loses {words} of the momentum and depends on the frame "
        "of reference; law 2 (its text) does neither. Use law 1 to reproduce the document, law 2 "
        "for everything else."
    )

    columns = ("force", "momentum", "kinetic_energy", "energy_efficiency")
    for law in (1, 2):
        report.trajectories[f"law_{law}"] = fmu.trajectory(names=columns, law=law)

    @report.figure("laws", "Law 1 removes momentum, law 2 doesn't; the spring stores energy.")
    def momentum_and_energy(figures):
        title = "Momentum and kinetic energy during contact"
        figure, (left, right) = figures.new_pair(title, "k = 1 MN/m, b = 9 N·s/m, 35 m/s")
        for law, words in ((1, "drag on each body"), (2, "damper between them")):
            path, line = report.trajectories[f"law_{law}"], figures.STYLES[f"law {law}"].line
            left.plot(path["time"] * 1e6, path["momentum"], **line, label=f"law {law}: {words}")
            right.plot(path["time"] * 1e6, path["kinetic_energy"], **line)
        left.set(xlabel="time since touch (µs)", ylabel="momentum (kg·m/s)")
        right.set(xlabel="time since touch (µs)", ylabel="kinetic energy (J)")
        figures.add_legend_below(figure, left, columns=2)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
