"""No damping (b = 0), a hard ball and a soft one: what S and the contact time depend on."""

from golf_impact.scenario import Report, closed_forms, document, document_fmu, main

TITLE = "Elastic: b = 0"
CHAPTER = 3


def run(fmu):
    """Two stiffnesses and, for the smash factor, three club speeds."""
    report = Report(TITLE, fmu)
    hard = report.impact("k = 1e6", document.ELASTIC, b=0.0)
    soft = report.impact("k = 0.5e6", document.ELASTIC_SOFT, b=0.0, k=0.5e6)
    fast = report.impact("50 m/s", b=0.0, club_speed=50.0)
    m_club, m_ball = document.USED["m_club"], document.USED["m_ball"]
    largest = closed_forms.elastic_smash_factor(m_club, m_ball)
    report.check_close("S is 2 m_C/(m_C + m_B)", hard["smash_factor"], largest, 1e-12)
    curves = []
    with document_fmu() as euler:
        for look, k, printed, metrics in (
            ("baseline", 1e6, document.ELASTIC, hard),
            ("less", 0.5e6, document.ELASTIC_SOFT, soft),
        ):
            at = f"k = {k / 1e6:g}e6 N/m"
            scheme = euler.as_printed(b=0.0, k=k)
            report.compare(f"b = 0 N·s/m, {at}", printed, scheme, metrics)
            time = closed_forms.elastic_contact_time(k, m_club, m_ball)
            claim = f"contact time is π √(μ/k) at {at}"
            report.check_close(claim, metrics["contact_time"], time, 1e-12 * time)
            path = fmu.trajectory(names=("force",), b=0.0, k=k)
            curves.append((look, f"k = {k / 1e6:g} MN/m", metrics, path))
    for claim, metric, other in (
        ("S doesn't depend on the stiffness", "smash_factor", soft),
        ("S doesn't depend on the club speed", "smash_factor", fast),
        ("the ball's release speed doesn't depend on its stiffness", "ball_velocity", soft),
    ):
        report.stays(claim, [hard[metric], other[metric]])
    for name in ("momentum", "kinetic_energy"):
        ends = [hard[f"{name}_initial"], hard[f"{name}_final"]]
        report.stays(f"{name.replace('_', ' ')} is conserved", ends)
    long, short = soft["contact_time"], hard["contact_time"]
    words = f"{long * 1e6:.2f} µs > {short * 1e6:.2f} µs"
    report.check("contact lasts longer with a softer ball", long > short, words)
    report.say(
        f"S = {largest:.6f} whatever the stiffness and the speed. The document's K2 = 128.81 J is "
        "more than its K1 = 128.62 J: explicit Euler makes 0.15 % of energy from nothing."
    )

    @report.figure(
        "elastic_force",
        "A softer ball is pushed less hard for longer. Without loss the areas, and so the speeds, "
        "are the same.",
    )
    def force(figures):
        figure = figures.force_curves("Without damping: another force, the same impulse", curves)
        words = f"the area under each: {hard['impulse']:.3f} N·s"
        figure.axes[0].text(0.37, 0.14, words, transform=figure.axes[0].transAxes, ha="center")
        return figure

    return report


if __name__ == "__main__":
    main(__file__)
