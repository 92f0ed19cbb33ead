"""An old ball, softer and more damped, beside a new one (the document's last table)."""

from golf_impact.scenario import Report, document, document_fmu, main

TITLE = "Old ball: softer and more damped"
CHAPTER = 6


def run(fmu):
    """Metrics and the force of two impacts."""
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for name, look, k, b in (("new", "baseline", 1e6, 9.0), ("old", "less", 0.5e6, 12.0)):
            printed = document.OLD_BALL[k, b]
            exact = report.impact(name, printed, k=k, b=b)
            title = f"{name} ball: k = {k / 1e6:g}e6 N/m, b = {b:g} N·s/m"
            report.compare(title, printed, euler.as_printed(k=k, b=b), exact)
            path = fmu.trajectory(names=("force",), k=k, b=b)
            curves.append((look, f"{name} ({k / 1e6:g} MN/m, {b:g} N·s/m)", exact, path))

    report.falls("an old ball: the club is slower at release", "club_velocity")
    report.falls("an old ball: the ball is slower at release", "ball_velocity")
    report.falls("an old ball: the contact force is smaller", "max_force")
    report.falls("an old ball: the smash factor is smaller", "smash_factor")
    report.falls("an old ball: COR is smaller", "coefficient_of_restitution")
    report.rises("an old ball: contact is longer", "contact_time")
    report.rises("an old ball: it is deformed more", "max_compression")
    report.falls("an old ball: energy is transferred worse", "energy_efficiency")
    new, old = report.each("smash_factor")
    report.say(
        f"Half the stiffness and a third more damping take S from {new:.3f} to {old:.3f}. Softness "
        "alone would not: without damping S doesn't depend on stiffness; a longer contact gives "
        "the drag more time."
    )

    @report.figure(
        "old_ball_force",
        "The old ball is pushed less hard for longer, and it loses more on the way: the area under "
        "its curve is what it gains and what drag takes.",
    )
    def force(figures):
        return figures.force_curves("An old ball: less force, a longer contact", curves)

    return report


if __name__ == "__main__":
    main(__file__)
