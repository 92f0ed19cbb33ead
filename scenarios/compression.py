"""Balls of different stiffness, k = 0.5e6, 1e6 and 2e6 N/m: the document's table."""

from golf_impact.scenario import Report, document, document_fmu, main

TITLE = "Compression: a stiffer ball"
CHAPTER = 5


def run(fmu):
    """Metrics and contact force of three impacts."""
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for style, k in (("less", 0.5e6), ("baseline", 1e6), ("more", 2e6)):
            printed = document.COMPRESSION[k]
            exact = report.impact(f"k = {k / 1e6:g}e6", printed, k=k)
            report.compare(f"k = {k / 1e6:g}e6 N/m", printed, euler.as_printed(k=k), exact)
            path = fmu.trajectory(names=("force",), k=k)
            curves.append((style, f"k = {k / 1e6:g} MN/m", exact, path))

    for claim, check, metric in (
        ("the club is faster after the impact", report.rises, "club_velocity"),
        ("the ball is faster after the impact", report.rises, "ball_velocity"),
        ("the maximum force is larger", report.rises, "max_force"),
        ("S is larger", report.rises, "smash_factor"),
        ("COR is larger", report.rises, "coefficient_of_restitution"),
        ("contact is shorter", report.falls, "contact_time"),
        ("the ball is compressed less", report.falls, "max_compression"),
        ("the contact displacement is smaller", report.falls, "contact_displacement"),
        ("E is larger", report.rises, "energy_efficiency"),
    ):
        check(f"a stiffer ball, as the document states: {claim}", metric, kind="documents")

    @report.figure("compression_force", "Twice the stiffness has 1.4 times the force.")
    def force(figures):
        title, case = "A stiffer ball: more force, shorter contact", "law 1, b = 9 N·s/m, 35 m/s"
        return figures.plot_forces(title, case, curves)

    return report


if __name__ == "__main__":
    main(__file__)
