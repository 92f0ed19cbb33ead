"""A faster club: 35 and 50 m/s (the document's table and its Fig. 6)."""

from golf_scenarios.scenario import Report, document, main

TITLE = "Club speed: 35 and 50 m/s"
CHAPTER = 4


def run(fmu):
    """Metrics and the force of both impacts."""
    report = Report(TITLE, fmu)
    paths = {}
    for speed, printed in document.CLUB_SPEED.items():
        report.impact(f"{speed:g} m/s", printed, club_speed=speed)
        paths[speed] = fmu.trajectory(names=("force",), club_speed=speed)
        report.trajectories[f"club_speed_{speed:g}"] = paths[speed]
    report.compare({f"{speed:g} m/s": row for speed, row in document.CLUB_SPEED.items()})

    report.rises("with club speed the ball's release speed rises", "ball_velocity")
    report.rises("with club speed the contact force rises", "max_force")
    report.rises(
        "with club speed the ball is squashed more and moves further in contact",
        "contact_displacement",
    )
    report.rises("with club speed the compression rises", "max_compression")
    report.stays("S is the same", "smash_factor")
    report.stays("COR is the same", "coefficient_of_restitution")
    report.stays("E is the same", "energy_efficiency")
    report.stays("the contact time is the same", "contact_time")
    report.say(
        "The equations are linear: every force, speed and length is proportional to the club speed "
        "(to 1e-12 here), so nothing dimensionless and no time can depend on it. The document's "
        "621 and 620 µs differ by its time step."
    )

    @report.figure("club_speed_force")
    def force(figures):
        figure, axes = figures.new("A faster club: more force, the same time")
        looks = ((figures.BLUE, "-"), (figures.ORANGE, "--"))
        for (speed, path), (colour, style) in zip(paths.items(), looks, strict=True):
            micro, kilo = path["time"] * 1e6, path["force"] / 1e3
            axes.plot(micro, kilo, color=colour, ls=style, label=f"{speed:g} m/s")
        axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
        figures.legend_above(axes)
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
