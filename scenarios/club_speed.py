"""A faster club: 35 and 50 m/s (the document's table and its Fig. 6)."""

from golf_scenarios.facts.document import CLUB_SPEED
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import check_printed, comparison, rises, run_case, stays
from golf_scenarios.report.outcome import Outcome

TITLE = "Club speed: 35 and 50 m/s"


def run(fmu: ImpactFmu) -> Outcome:
    """Metrics and the force of both impacts."""
    outcome = Outcome(TITLE)
    found = {}
    for speed, printed in CLUB_SPEED.items():
        name = f"{speed:g} m/s"
        metrics = run_case(outcome, fmu, name, club_speed=speed)
        check_printed(outcome, name, metrics, printed)
        outcome.trajectories[f"club_speed_{speed:g}"] = fmu.trajectory(
            names=("force",), club_speed=speed
        )
        found[name] = (metrics, printed)
    outcome.tables.append(comparison(TITLE, found))

    def both(metric: str) -> list[float]:
        return [metrics[metric] for metrics, _ in found.values()]

    rises(outcome, "with club speed the ball's release speed rises", both("ball_velocity"))
    rises(outcome, "with club speed the contact force rises", both("max_force"))
    rises(
        outcome,
        "with club speed the ball is squashed more and moves further in contact",
        both("contact_displacement"),
    )
    rises(outcome, "with club speed the compression rises", both("max_compression"))
    stays(outcome, "S is the same", both("smash_factor"))
    stays(outcome, "COR is the same", both("coefficient_of_restitution"))
    stays(outcome, "E is the same", both("energy_efficiency"))
    stays(outcome, "the contact time is the same", both("contact_time"))
    outcome.words.append(
        "The equations are linear: every force, speed and length is proportional to the club speed "
        "(to 1e-12 here), so nothing dimensionless and no time can depend on it. The document's "
        "621 and 620 µs differ by its time step."
    )
    paths = dict(outcome.trajectories)

    def force():
        from golf_scenarios.report import figures

        figure, axes = figures.new("A faster club: more force, the same time")
        for (name, path), colour, style in zip(
            paths.items(), (figures.BLUE, figures.ORANGE), ("-", "--"), strict=True
        ):
            label = f"{name.rpartition('_')[2]} m/s"
            axes.plot(path["time"] * 1e6, path["force"] / 1e3, color=colour, ls=style, label=label)
        axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
        figures.legend_above(axes)
        return figure

    outcome.figures["club_speed_force"] = force
    return outcome


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("club_speed")
