"""Two club speeds, 35 and 50 m/s: the document's table and its Fig. 6."""

from golf_impact.scenario import Report, document, document_fmu, main

TITLE = "Club speed: 35 and 50 m/s"
CHAPTER = 4


def run(fmu):
    """Metrics and contact force of both impacts."""
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for style, speed in (("baseline", 35.0), ("more", 50.0)):
            printed = document.CLUB_SPEED[speed]
            exact = report.impact(f"{speed:g} m/s", printed, club_speed=speed)
            scheme = euler.as_printed(club_speed=speed)
            report.compare(f"Club speed {speed:g} m/s", printed, scheme, exact)
            path = fmu.trajectory(names=("force",), club_speed=speed)
            report.trajectories[f"club_speed_{speed:g}"] = path
            curves.append((style, f"{speed:g} m/s", exact, path))

    for claim, check, metric in (
        ("the ball's release speed increases", report.rises, "ball_velocity"),
        ("the contact force increases", report.rises, "max_force"),
        ("the contact displacement increases", report.rises, "contact_displacement"),
        ("the ball is compressed more", report.rises, "max_compression"),
        ("S is the same", report.stays, "smash_factor"),
        ("COR is the same", report.stays, "coefficient_of_restitution"),
        ("E is the same", report.stays, "energy_efficiency"),
        ("the contact time is the same", report.stays, "contact_time"),
    ):
        check(f"with club speed, as the document states: {claim}", metric, kind="documents")
    report.say(
        "The equations are linear: forces, speeds and lengths are proportional to club speed. The "
        "document's 621 and 620 µs differ because of its time step."
    )

    @report.figure("club_speed_force", "Force is proportional to speed; contact time is the same.")
    def force(figures):
        return figures.plot_forces("Club speed: more force, same time", report.describe(), curves)

    return report


if __name__ == "__main__":
    main(__file__)
