"""Balls of different stiffness, k = 0.5e6, 1e6 and 2e6 N/m: the document's table."""

from golf_impact.scenario import Report, document, document_fmu, label, main

TITLE = "Compression: a stiffer ball"
CHAPTER = 5


def run(fmu):
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for style, k in (("less", 0.5e6), ("baseline", 1e6), ("more", 2e6)):
            printed = document.COMPRESSION[k]
            exact = report.impact(f"k = {k / 1e6:g}e6", printed, k=k)
            report.compare(f"k = {k / 1e6:g}e6 N/m", printed, euler.as_printed(k=k), exact)
            path = fmu.trajectory(names=("force",), k=k)
            curves.append((style, f"k = {k / 1e6:g} MN/m", exact, path))

    for metric in printed:
        less = metric in ("contact_time", "contact_displacement_over_diameter")
        claim = f"a stiffer ball has a {'lower' if less else 'higher'} {label(metric)}"
        check = report.falls if less else report.rises
        check(f"{claim}, as the document states", metric, kind="documents")

    @report.figure("compression_force", "Twice the stiffness has 1.4 times the force.")
    def force(figures):
        title = "A stiffer ball: more force, shorter contact"
        return figures.plot_forces(title, "law 1, b = 9 N·s/m, 35 m/s", curves)

    return report


if __name__ == "__main__":
    main(__file__)
