"""The document's impact, k = 1e6 N/m, b = 9 N.s/m, 35 m/s: its Figs. 4 and 5, its first list."""

from golf_scenarios.facts.document import BASELINE
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import check_printed, comparison, run_case
from golf_scenarios.report.outcome import Outcome

TITLE = "Baseline: the document's impact, exactly"


def run(fmu: ImpactFmu) -> Outcome:
    """Metrics in one step, then 301 samples over the contact."""
    outcome = Outcome(TITLE)
    metrics = run_case(outcome, fmu, "baseline")
    check_printed(outcome, "baseline", metrics, BASELINE)
    outcome.tables.append(comparison(TITLE, {"baseline": (metrics, BASELINE)}))
    b = 9.0
    drag = b * metrics["contact_displacement"]
    outcome.check_close(
        "J and P_B differ because the drag on the ball takes b·x_B",
        metrics["impulse"] - metrics["momentum_gain_ball"],
        drag,
        1e-12,
    )
    outcome.words.append(
        f"The contact force gives the ball {metrics['impulse']:.4f} N.s, of which the ball keeps "
        f"{metrics['momentum_gain_ball']:.4f} N.s: the drag takes b·x_B = {drag:.4f} N.s."
    )
    path = fmu.trajectory()
    outcome.trajectories["baseline"] = path

    def force():
        from golf_scenarios.report import figures

        figure, axes = figures.new("Contact force on the ball")
        micro = path["time"] * 1e6
        axes.fill_between(micro, path["force"] / 1e3, color=figures.SKY, alpha=0.35, lw=0)
        axes.plot(micro, path["force"] / 1e3, color=figures.BLUE)
        figures.mark(
            axes,
            metrics["time_of_max_force"] * 1e6,
            metrics["max_force"] / 1e3,
            f"{metrics['max_force']:.0f} N",
        )
        axes.text(
            metrics["contact_time"] * 0.5e6,
            metrics["max_force"] * 0.35e-3,
            f"impulse J = {metrics['impulse']:.3f} N.s\n"
            f"contact time {metrics['contact_time'] * 1e6:.1f} µs",
            ha="center",
        )
        axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
        return figure

    def both():
        from golf_scenarios.report import figures

        figure, axes = figures.new("Contact force on each body")
        micro = path["time"] * 1e6
        axes.plot(micro, path["force"] / 1e3, color=figures.BLUE, label="on the ball")
        axes.plot(micro, -path["force"] / 1e3, color=figures.ORANGE, ls="--", label="on the club")
        axes.axhline(0, color="0.6", lw=0.8)
        axes.set(xlabel="time since touch (µs)", ylabel="force (kN)")
        figures.legend_above(axes)
        return figure

    def motion():
        from golf_scenarios.report import figures

        figure, (left, right) = figures.new_pair("Velocities and positions")
        micro = path["time"] * 1e6
        end = metrics["contact_time"] * 1e6
        for axes in (left, right):
            axes.axvline(end, color="0.45", lw=1.0, ls=":", label="they part")
        left.plot(micro, path["club_velocity"], color=figures.ORANGE, ls="--", label="club")
        left.plot(micro, path["ball_velocity"], color=figures.BLUE, label="ball")
        left.set(xlabel="time since touch (µs)", ylabel="velocity (m/s)")
        right.plot(
            micro, path["club_position"] * 1e3, color=figures.ORANGE, ls="--", label="club face"
        )
        right.plot(micro, path["ball_position"] * 1e3, color=figures.BLUE, label="ball")
        right.set(xlabel="time since touch (µs)", ylabel="position (mm)")
        for axes in (left, right):
            figures.legend_above(axes)
        return figure

    outcome.figures |= {
        "baseline_force": force,
        "baseline_forces": both,
        "baseline_motion": motion,
    }
    return outcome


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("baseline")
