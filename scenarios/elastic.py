"""No damping (b = 0): dependence of S and contact time on stiffness and club speed."""

from golf_impact.scenario import Report, closed_forms, document, document_fmu, main

TITLE = "Elastic: no damping (b = 0)"
CHAPTER = 3


def run(fmu):
    """Two stiffnesses, and two club speeds."""
    report = Report(TITLE, fmu)
    hard = report.impact("k = 1e6", document.ELASTIC, b=0.0)
    soft = report.impact("k = 0.5e6", document.ELASTIC_SOFT, b=0.0, k=0.5e6)
    fast = report.impact("50 m/s", b=0.0, club_speed=50.0)
    masses = document.USED["m_club"], document.USED["m_ball"]
    largest = closed_forms.elastic_smash_factor(*masses)
    report.check_close("S agrees with 2 m_C/(m_C + m_B)", hard["smash_factor"], largest, 1e-12)
    curves = []
    with document_fmu() as euler:
        for style, k, printed, exact in (
            ("baseline", 1e6, document.ELASTIC, hard),
            ("less", 0.5e6, document.ELASTIC_SOFT, soft),
        ):
            at = f"k = {k / 1e6:g}e6 N/m"
            report.compare(f"b = 0 N·s/m, {at}", printed, euler.as_printed(b=0.0, k=k), exact)
            time = closed_forms.elastic_contact_time(k, *masses)
            claim = f"contact time agrees with π √(μ/k) at {at}"
            report.check_close(claim, exact["contact_time"], time, 1e-12 * time)
            path = fmu.trajectory(names=("force",), b=0.0, k=k)
            curves.append((style, f"k = {k / 1e6:g} MN/m", exact, path))
    for claim, check, metric, other in (
        ("S is independent of stiffness", report.stays, "smash_factor", soft),
        ("S is independent of club speed", report.stays, "smash_factor", fast),
        ("the release speed is independent of stiffness", report.stays, "ball_velocity", soft),
        ("contact is longer with a softer ball", report.rises, "contact_time", soft),
    ):
        check(f"{claim}, as the document states", [hard[metric], other[metric]], kind="documents")
    for name in ("momentum", "kinetic_energy"):
        ends = [hard[f"{name}_initial"], hard[f"{name}_final"]]
        report.stays(f"{name.replace('_', ' ')} is conserved", ends, kind="invariants")
    report.say(
        f"S = {largest:.6f}, independent of stiffness and club speed. The document's K2 = 128.81 J "
        "exceeds its K1 = 128.62 J: explicit Euler increases the energy by 0.15 %."
    )

    @report.figure(
        "elastic_force",
        "A softer ball has less force and a longer contact. Without losses the areas, and "
        "therefore the ball speeds, are the same.",
    )
    def force(figures):
        figure = figures.plot_forces(
            "Without damping: different force, same impulse", "b = 0 (either law), 35 m/s", curves
        )
        words = f"the area under each: {hard['impulse']:.3f} N·s"
        figure.axes[0].text(0.37, 0.14, words, transform=figure.axes[0].transAxes, ha="center")
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
