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
    m_club, m_ball = document.USED["m_club"], document.USED["m_ball"]
    largest = closed_forms.elastic_smash_factor(m_club, m_ball)
    claim = "S agrees with 2 m_C/(m_C + m_B)"
    report.check_close(claim, hard["smash_factor"], largest, 1e-12)
    curves = []
    with document_fmu() as euler:
        for style, k, printed, metrics in (
            ("baseline", 1e6, document.ELASTIC, hard),
            ("less", 0.5e6, document.ELASTIC_SOFT, soft),
        ):
            at = f"k = {k / 1e6:g}e6 N/m"
            scheme = euler.as_printed(b=0.0, k=k)
            report.compare(f"b = 0 N·s/m, {at}", printed, scheme, metrics)
            time = closed_forms.elastic_contact_time(k, m_club, m_ball)
            claim = f"contact time agrees with π √(μ/k) at {at}"
            report.check_close(claim, metrics["contact_time"], time, 1e-12 * time)
            path = fmu.trajectory(names=("force",), b=0.0, k=k)
            curves.append((style, f"k = {k / 1e6:g} MN/m", metrics, path))
    for claim, metric, other in (
        ("S is independent of stiffness", "smash_factor", soft),
        ("S is independent of club speed", "smash_factor", fast),
        ("the ball's release speed is independent of stiffness", "ball_velocity", soft),
    ):
        claim = f"{claim}, as the document states"
        report.stays(claim, [hard[metric], other[metric]], kind="documents")
    for name in ("momentum", "kinetic_energy"):
        ends = [hard[f"{name}_initial"], hard[f"{name}_final"]]
        report.stays(f"{name.replace('_', ' ')} is conserved", ends, kind="invariants")
    long, short = soft["contact_time"], hard["contact_time"]
    words = f"{long * 1e6:.2f} µs > {short * 1e6:.2f} µs"
    claim = "contact is longer with a softer ball, as the document states"
    report.check(claim, long > short, words, "documents")
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
