"""No damping (b = 0), a hard ball and a soft one: what S and the contact time depend on."""

from golf_scenarios.facts import closed_forms
from golf_scenarios.facts.document import ELASTIC, ELASTIC_SOFT, USED
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import check_printed, comparison, run_case, stays
from golf_scenarios.report.outcome import Outcome

TITLE = "Elastic: b = 0"


def run(fmu: ImpactFmu) -> Outcome:
    """Two stiffnesses and, for the smash factor, three club speeds."""
    outcome = Outcome(TITLE)
    hard = run_case(outcome, fmu, "k = 1e6", b=0.0)
    soft = run_case(outcome, fmu, "k = 0.5e6", b=0.0, k=0.5e6)
    fast = run_case(outcome, fmu, "50 m/s", b=0.0, club_speed=50.0)
    check_printed(outcome, "k = 1e6", hard, ELASTIC)
    check_printed(outcome, "k = 0.5e6", soft, ELASTIC_SOFT)
    outcome.tables.append(
        comparison(TITLE, {"k = 1e6": (hard, ELASTIC), "k = 0.5e6": (soft, ELASTIC_SOFT)})
    )
    m_club, m_ball = USED["m_club"], USED["m_ball"]
    largest = closed_forms.elastic_smash_factor(m_club, m_ball)
    outcome.check_close("S is 2 m_C/(m_C + m_B)", hard["smash_factor"], largest, 1e-12)
    for metrics, k in ((hard, 1e6), (soft, 0.5e6)):
        time = closed_forms.elastic_contact_time(k, m_club, m_ball)
        outcome.check_close(
            f"contact time is π √(μ/k) at k = {k:g}", metrics["contact_time"], time, 1e-12 * time
        )
    stays(
        outcome,
        "S doesn't depend on the stiffness",
        [hard["smash_factor"], soft["smash_factor"]],
    )
    stays(
        outcome,
        "S doesn't depend on the club speed",
        [hard["smash_factor"], fast["smash_factor"]],
    )
    stays(
        outcome,
        "the ball's release speed doesn't depend on its stiffness",
        [hard["ball_velocity"], soft["ball_velocity"]],
    )
    stays(
        outcome,
        "momentum is conserved",
        [hard["momentum_initial"], hard["momentum_final"]],
    )
    stays(
        outcome,
        "kinetic energy is conserved",
        [hard["kinetic_energy_initial"], hard["kinetic_energy_final"]],
    )
    outcome.check(
        "contact lasts longer with a softer ball",
        soft["contact_time"] > hard["contact_time"],
        f"{soft['contact_time'] * 1e6:.2f} µs > {hard['contact_time'] * 1e6:.2f} µs",
    )
    outcome.words.append(
        f"S = {largest:.6f} whatever the stiffness and the speed. The document's K2 = 128.81 J is "
        "more than its K1 = 128.62 J: explicit Euler makes 0.15 % of energy from nothing."
    )
    return outcome


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("elastic")
