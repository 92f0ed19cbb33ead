"""A faster club: 35 and 50 m/s (the document's table and its Fig. 6)."""

from golf_impact.scenario import Report, document, document_fmu, main

TITLE = "Club speed: 35 and 50 m/s"
CHAPTER = 4


def run(fmu):
    """Metrics and the force of both impacts."""
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for look, speed in (("baseline", 35.0), ("more", 50.0)):
            printed = document.CLUB_SPEED[speed]
            exact = report.impact(f"{speed:g} m/s", printed, club_speed=speed)
            scheme = euler.as_printed(club_speed=speed)
            report.compare(f"Club speed {speed:g} m/s", printed, scheme, exact)
            path = fmu.trajectory(names=("force",), club_speed=speed)
            report.trajectories[f"club_speed_{speed:g}"] = path
            curves.append((look, f"{speed:g} m/s", exact, path))

    report.rises("with club speed the ball's release speed rises", "ball_velocity")
    report.rises("with club speed the contact force rises", "max_force")
    claim = "with club speed the ball is squashed more and moves further in contact"
    report.rises(claim, "contact_displacement")
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

    @report.figure(
        "club_speed_force", "A faster club pushes harder, in proportion, and for the same time."
    )
    def force(figures):
        return figures.force_curves("A faster club: more force, the same time", curves)

    return report


if __name__ == "__main__":
    main(__file__)
