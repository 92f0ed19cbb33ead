"""The document's impact, k = 1e6 N/m, b = 9 N.s/m, 35 m/s: its Figs. 4 and 5, its first list."""

from golf_scenarios.scenario import Report, document, main

TITLE = "Baseline: the document's impact, exactly"
CHAPTER = 2


def run(fmu):
    """Metrics in one step, then 301 samples over the contact."""
    report = Report(TITLE, fmu)
    metrics = report.impact("baseline", document.BASELINE)
    report.compare({"baseline": document.BASELINE})

    drag = 9.0 * metrics["contact_displacement"]
    report.check_close(
        "J and P_B differ because the drag on the ball takes b·x_B",
        metrics["impulse"] - metrics["momentum_gain_ball"],
        drag,
        1e-12,
    )
    report.say(
        f"The contact force gives the ball {metrics['impulse']:.4f} N.s, of which the ball keeps "
        f"{metrics['momentum_gain_ball']:.4f} N.s: the drag takes b·x_B = {drag:.4f} N.s."
    )

    path = fmu.trajectory()
    report.trajectories["baseline"] = path
    micro, kilonewton = path["time"] * 1e6, path["force"] / 1e3
    contact_micro, peak = metrics["contact_time"] * 1e6, metrics["max_force"]

    @report.figure("baseline_force")
    def force(figures):
        figure, axes = figures.new("Contact force on the ball")
        axes.fill_between(micro, kilonewton, color=figures.SKY, alpha=0.35, lw=0)
        axes.plot(micro, kilonewton, color=figures.BLUE)
        figures.mark(axes, metrics["time_of_max_force"] * 1e6, peak / 1e3, f"{peak:.0f} N")
        words = f"impulse J = {metrics['impulse']:.3f} N.s\ncontact time {contact_micro:.1f} µs"
        axes.text(0.5 * contact_micro, 0.35e-3 * peak, words, ha="center")
        axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
        return figure

    @report.figure("baseline_forces")
    def both(figures):
        figure, axes = figures.new("Contact force on each body")
        axes.plot(micro, kilonewton, color=figures.BLUE, label="on the ball")
        axes.plot(micro, -kilonewton, color=figures.ORANGE, ls="--", label="on the club")
        axes.axhline(0, color="0.6", lw=0.8)
        axes.set(xlabel="time since touch (µs)", ylabel="force (kN)")
        figures.legend_above(axes)
        return figure

    @report.figure("baseline_motion")
    def motion(figures):
        figure, pair = figures.new_pair("Velocities and positions")
        shows = (("velocity", "m/s", 1.0, "club"), ("position", "mm", 1e3, "club face"))
        for axes, (what, unit, factor, club) in zip(pair, shows, strict=True):
            axes.axvline(contact_micro, color="0.45", lw=1.0, ls=":", label="they part")
            on_club, on_ball = (path[f"{body}_{what}"] * factor for body in ("club", "ball"))
            axes.plot(micro, on_club, color=figures.ORANGE, ls="--", label=club)
            axes.plot(micro, on_ball, color=figures.BLUE, label="ball")
            axes.set(xlabel="time since touch (µs)", ylabel=f"{what} ({unit})")
            figures.legend_above(axes)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
