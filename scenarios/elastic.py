"""No damping (b = 0): dependence of S and contact time on stiffness and club speed."""

from golf_impact.scenario import Report, document, document_fmu, main

TITLE = "Elastic: no damping (b = 0)"
CHAPTER = 3


def run(fmu):
    report = Report(TITLE, fmu)
    curves = []
    with document_fmu() as euler:
        for style, k, printed in (
            ("baseline", 1e6, document.ELASTIC),
            ("less", 0.5e6, document.ELASTIC_SOFT),
        ):
            name = f"k = {k / 1e6:g}e6"
            exact = report.impact(name, printed, b=0.0, k=k)
            report.compare(f"b = 0, {name} N/m", printed, euler.as_printed(b=0.0, k=k), exact)
            path = fmu.trajectory(names=("force",), b=0.0, k=k)
            curves.append((style, f"k = {k / 1e6:g} MN/m", exact, path))
    claim = "the release speed is independent of stiffness, as the document states"
    report.stays(claim, "ball_velocity", "documents")
    claim = "contact is longer with a softer ball, as the document states"
    report.rises(claim, "contact_time", "documents")
    hard = report.cases["k = 1e6"]
    report.impact("50 m/s", b=0.0, club_speed=50.0)
    claim = "S is independent of stiffness and club speed, as the document states"
    report.stays(claim, "smash_factor", "documents")
    largest = 2.0 / (1.0 + document.USED["m_ball"] / document.USED["m_club"])
    report.check_close("S agrees with 2 m_C/(m_C + m_B)", hard["smash_factor"], largest, 1e-12)
    ends = [hard["kinetic_energy_initial"], hard["kinetic_energy_final"]]
    report.stays("kinetic energy is conserved", ends, "invariants")
    report.say(
        f"S = {largest:.6f}, independent of stiffness and club speed. The document's K2 = 128.81 J "
        "exceeds its K1 = 128.62 J: explicit Euler increases the energy by 0.15 %."
    )

    @report.figure("elastic_force", "A softer ball: less force, longer contact, the same speed.")
    def force(figures):
        title = "Without damping: different force, same impulse"
        return figures.plot_forces(title, "b = 0 (either law), 35 m/s", curves)

    return report


if __name__ == "__main__":
    main(__file__)
