"""The document's impact (k = 1e6 N/m, b = 9 N·s/m, 35 m/s): its first list, Figs. 4 and 5."""

from golf_impact.scenario import Report, document, document_fmu, main

TITLE = "Baseline: the document's impact, solved exactly"
CHAPTER = 2


def run(fmu):
    """Metrics in one communication step, then 301 samples over the contact."""
    report = Report(TITLE, fmu)
    case = f"{report.describe()}, 35 m/s"
    metrics = report.impact("baseline", document.BASELINE)
    with document_fmu() as euler:
        scheme = euler.as_printed()
    report.compare(f"The document's impact: {case}", document.BASELINE, scheme, metrics)

    impulse, gained = metrics["impulse"], metrics["momentum_gain_ball"]
    drag = 9.0 * metrics["contact_displacement"]
    claim = "J − P_B agrees with the impulse of the drag on the ball, b x_B"
    report.check_close(claim, impulse - gained, drag, 1e-12, kind="invariants")
    energy, efficiency = metrics["kinetic_energy_initial"], metrics["energy_efficiency"]
    of_ball = 0.5 * document.USED["m_ball"] * metrics["ball_velocity"] ** 2 / energy
    cor = metrics["coefficient_of_restitution"]
    error = (scheme["coefficient_of_restitution"] / cor - 1.0) * 100
    lost = 1.0 - metrics["momentum_final"] / metrics["momentum_initial"]
    report.conclude(
        f"The document's impact: S = {metrics['smash_factor']:.4f}, COR = {cor:.4f}, "
        f"E = {efficiency * 100:.2f} %. The document's scheme has an error of {error:+.2f} % in "
        f"COR; its damping removes {lost * 100:.1f} % of the momentum."
    )
    report.say(
        f"The contact force transfers {impulse:.4f} N·s to the ball. The ball keeps {gained:.4f} "
        f"N·s; the drag takes b x_B = {drag:.4f} N·s. Of the initial kinetic energy the ball gets "
        f"{of_ball * 100:.1f} %, the club keeps {(efficiency - of_ball) * 100:.1f} %.",
    )

    path = fmu.trajectory()
    report.trajectories["baseline"] = path
    micro, kilonewton = path["time"] * 1e6, path["force"] / 1e3
    end, peak = metrics["contact_time"] * 1e6, metrics["max_force"]

    @report.figure("baseline_force", "The area under the curve is the impulse J.")
    def force(figures):
        figure, axes = figures.new("Contact force on the ball", case=case)
        axes.fill_between(micro, kilonewton, color=figures.SKY, alpha=0.35, lw=0)
        axes.plot(micro, kilonewton, **figures.STYLES["ball"].line)
        at = metrics["time_of_max_force"] * 1e6
        figures.mark(axes, at, peak / 1e3, f"{peak:.0f} N at {at:.1f} µs")
        words = f"impulse J = {impulse:.3f} N·s\ncontact time {end:.1f} µs"
        axes.text(0.5 * end, 0.35e-3 * peak, words, ha="center")
        axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, 7.7))
        return figure

    @report.figure("baseline_forces", "The forces on club and ball are opposite and equal.")
    def both(figures):
        figure, axes = figures.new("Contact force on each body: opposite and equal", case=case)
        axes.axhline(0, color="0.6", lw=0.8)
        axes.plot(micro, kilonewton, **figures.STYLES["ball"].line, label="on the ball")
        axes.plot(micro, -kilonewton, **figures.STYLES["club"].line, label="on the club")
        axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)")
        figures.add_legend_above(axes)
        return figure

    @report.figure("baseline_motion", "Ball speed peaks before separation: drag exceeds the force.")
    def motion(figures):
        figure, (left, right) = figures.new_pair("Velocities and positions", case)
        kinds = (left, "velocity", "m/s", 1.0), (right, "position", "mm", 1e3)
        for axes, what, unit, factor in kinds:
            for body in ("club", "ball"):
                values = path[f"{body}_{what}"] * factor
                axes.plot(micro, values, **figures.STYLES[body].line, label=body)
            axes.axvline(end, color="0.45", lw=1.0, ls=":")
            below = axes.get_xaxis_transform()
            axes.text(0.98 * end, 0.03, "separation", ha="right", transform=below)
            axes.set(xlabel="time since touch (µs)", ylabel=f"{what} ({unit})")
            figures.add_legend_above(axes)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
