"""Two club speeds, 35 and 50 m/s: the document's table and its Fig. 6."""

from golf_impact.scenario import Report, document, document_fmu, label, main

TITLE = "Club speed: 35 and 50 m/s"
CHAPTER = 4


def run(fmu):
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for style, speed in (("baseline", 35.0), ("more", 50.0)):
            printed = document.CLUB_SPEED[speed]
            exact = report.impact(f"{speed:g} m/s", printed, club_speed=speed)
            report.compare(f"{speed:g} m/s", printed, euler.as_printed(club_speed=speed), exact)
            path = fmu.trajectory(names=("force",), club_speed=speed)
            report.trajectories[f"club_speed_{speed:g}"] = path
            curves.append((style, f"{speed:g} m/s", exact, path))

    for metric in ("ball_velocity", "max_force", "contact_displacement_over_diameter"):
        claim = f"{label(metric)} increases with club speed, as the document states"
        report.rises(claim, metric, "documents")
    for metric in ("smash_factor", "coefficient_of_restitution", "contact_time"):
        claim = f"{label(metric)} is independent of club speed, as the document states"
        report.stays(claim, metric, "documents")
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
