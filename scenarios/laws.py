"""The same impact under both laws: what momentum and energy do."""

from golf_impact.scenario import Report, label, main, shown

TITLE = "Laws: drag on each body, or a damper between them"
CHAPTER = 11

_METRICS = (
    *("club_velocity", "ball_velocity", "smash_factor", "coefficient_of_restitution"),
    *("energy_efficiency", "contact_time", "max_force", "impulse", "momentum_gain_ball"),
    *("momentum_initial", "momentum_final"),
)

_PATH = ("force", "momentum", "kinetic_energy", "energy_efficiency")


def run(fmu):
    """Metrics and the course of momentum and energy under law 1 and law 2."""
    report = Report(TITLE, fmu)
    absolute = report.impact("law 1 (absolute)", law=1)
    relative = report.impact("law 2 (relative)", law=2)
    both = absolute, relative
    rows = ([label(one), *(shown(one, metrics[one]) for metrics in both)] for one in _METRICS)
    report.table(TITLE, ["", *report.cases], rows)

    lost = 1.0 - absolute["momentum_final"] / absolute["momentum_initial"]
    words = f"it loses {lost * 100:.2f} %"
    report.check("law 1 loses 4 % of the momentum", 0.035 < lost < 0.045, words)
    for claim, metric, expected in (
        ("law 2 conserves momentum", "momentum_final", "momentum_initial"),
        ("under law 2 the ball keeps the whole impulse", "momentum_gain_ball", "impulse"),
    ):
        report.check_close(claim, relative[metric], relative[expected], 1e-13 * relative[expected])
    # A moving frame: both bodies 10 m/s faster. Only a law of relative motion can't tell.
    moving = report.impact("law 2, moving", law=2, club_speed=45.0, ball_speed=10.0)
    dragged = report.impact("law 1, moving", law=1, club_speed=45.0, ball_speed=10.0)
    cor = "coefficient_of_restitution"
    claim = "law 2 gives the same COR when both bodies move 10 m/s faster"
    report.check_close(claim, moving[cor], relative[cor], 1e-12)
    shift = dragged[cor] - absolute[cor]
    report.check("law 1 gives another", abs(shift) > 1e-4, f"COR changes by {shift:+.5f}")
    report.say(
        f"Law 1 takes {lost * 100:.2f} % of the momentum out of the system, as if the bodies moved "
        "through a fluid; so the impulse (2.67 N·s) and the ball's gain (2.51 N·s) differ.",
        "Law 2 is what the document's text describes, a spring and a damper connecting the two "
        "masses: momentum stays, and the loss depends on relative velocity alone. Choose law 1 to "
        "reproduce the document, law 2 for everything else.",
    )

    paths = {law: fmu.trajectory(names=_PATH, law=law) for law in (1, 2)}
    report.trajectories |= {f"law_{law}": path for law, path in paths.items()}

    @report.figure(
        "laws",
        "Law 1 takes momentum out of the system, law 2 doesn't. The dip in the energy is what the "
        "ball's spring holds in the middle of the contact.",
    )
    def courses(figures):
        figure, (left, right) = figures.new_pair("Momentum and kinetic energy during contact")
        laws = {1: "law 1: drag on each body", 2: "law 2: damper between them"}
        for law, words in laws.items():
            micro, look = paths[law]["time"] * 1e6, figures.LOOKS[f"law {law}"]
            for axes, column in ((left, "momentum"), (right, "kinetic_energy")):
                axes.plot(micro, paths[law][column], **look.line, label=words)
        left.set(xlabel="time since touch (µs)", ylabel="momentum (kg·m/s)")
        right.set(xlabel="time since touch (µs)", ylabel="kinetic energy (J)")
        figures.legend_below(figure, left, columns=2)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
