"""An old ball, softer and more damped, compared with a new one: the document's last table."""

from golf_impact.scenario import Report, document, document_fmu, label, main

TITLE = "Old ball: softer and more damped"
CHAPTER = 6


def run(fmu):
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for name, style, k, b in (("new", "baseline", 1e6, 9.0), ("old", "less", 0.5e6, 12.0)):
            printed = document.OLD_BALL[k, b]
            exact = report.impact(name, printed, k=k, b=b)
            title = f"{name} ball: k = {k / 1e6:g}e6 N/m, b = {b:g} N·s/m"
            report.compare(title, printed, euler.as_printed(k=k, b=b), exact)
            path = fmu.trajectory(names=("force",), k=k, b=b)
            curves.append((style, f"{name} ({k / 1e6:g} MN/m, {b:g} N·s/m)", exact, path))

    for metric in printed:
        more = metric in ("contact_time", "contact_displacement_over_diameter")
        claim = f"an old ball has a {'higher' if more else 'lower'} {label(metric)}"
        check = report.rises if more else report.falls
        check(f"{claim}, as the document states", metric, kind="documents")
    new, old = report.each("smash_factor")
    report.say(
        f"S decreases from {new:.3f} to {old:.3f}. Lower stiffness alone does not reduce it: "
        "without damping S is independent of stiffness. The drag acts longer in a longer contact."
    )

    @report.figure("old_ball_force", "The old ball has less force and a longer contact.")
    def force(figures):
        title = "An old ball: less force, longer contact"
        return figures.plot_forces(title, "law 1, 35 m/s", curves)

    return report


if __name__ == "__main__":
    main(__file__)
