"""Balls of different compression: k = 0.5e6, 1e6 and 2e6 N/m (the document's table)."""

from golf_impact.scenario import Report, document, document_fmu, main

TITLE = "Compression: a stiffer ball"
CHAPTER = 5


def run(fmu):
    """Metrics and the force of three impacts."""
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for look, k in (("less", 0.5e6), ("baseline", 1e6), ("more", 2e6)):
            printed = document.COMPRESSION[k]
            exact = report.impact(f"k = {k / 1e6:g}e6", printed, k=k)
            scheme = euler.as_printed(k=k)
            report.compare(f"k = {k / 1e6:g}e6 N/m", printed, scheme, exact)
            path = fmu.trajectory(names=("force",), k=k)
            curves.append((look, f"k = {k / 1e6:g} MN/m", exact, path))

    report.rises("a stiffer ball: the club is faster at release", "club_velocity")
    report.rises("a stiffer ball: the ball is faster at release", "ball_velocity")
    report.rises("a stiffer ball: the contact force is larger", "max_force")
    report.rises("a stiffer ball: the smash factor is larger", "smash_factor")
    report.rises("a stiffer ball: COR is larger", "coefficient_of_restitution")
    report.falls("a stiffer ball: contact is shorter", "contact_time")
    report.falls("a stiffer ball: it is compressed less", "max_compression")
    report.falls("a stiffer ball: it moves less in contact", "contact_displacement")
    report.rises("a stiffer ball: energy is transferred better", "energy_efficiency")
    report.say(
        f"At k = 2e6 N/m the document prints v_B = {printed['ball_velocity'].text} m/s; its own "
        f"scheme gives {scheme['ball_velocity']:.2f} m/s, the exact answer is "
        f"{exact['ball_velocity']:.3f} m/s."
    )

    @report.figure(
        "compression_force",
        "A stiffer ball is pushed harder for a shorter time: twice the stiffness, 1.4 times the "
        "force, nearly the same impulse.",
    )
    def force(figures):
        return figures.force_curves("A stiffer ball: more force, a shorter contact", curves)

    return report


if __name__ == "__main__":
    main(__file__)
