"""An old ball, softer and more damped, beside a new one (the document's last table)."""

from golf_scenarios.scenario import Report, document, main

TITLE = "Old ball: softer and more damped"
CHAPTER = 6


def run(fmu):
    """Metrics only: two impacts, two communication steps."""
    report = Report(TITLE, fmu)
    printed = dict(zip(("new", "old"), document.OLD_BALL.values(), strict=True))
    for (name, numbers), (k, b) in zip(printed.items(), document.OLD_BALL, strict=True):
        report.impact(name, numbers, k=k, b=b)
    report.compare(printed)

    report.falls("an old ball: the club is slower at release", "club_velocity")
    report.falls("an old ball: the ball is slower at release", "ball_velocity")
    report.falls("an old ball: the contact force is smaller", "max_force")
    report.falls("an old ball: the smash factor is smaller", "smash_factor")
    report.falls("an old ball: COR is smaller", "coefficient_of_restitution")
    report.rises("an old ball: contact is longer", "contact_time")
    report.rises("an old ball: it is deformed more", "max_compression")
    report.falls("an old ball: energy is transferred worse", "energy_efficiency")
    return report


if __name__ == "__main__":
    main(__file__)
