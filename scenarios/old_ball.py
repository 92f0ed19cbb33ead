"""An old ball, softer and more damped, beside a new one (the document's last table)."""

from golf_scenarios.facts.document import OLD_BALL
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import check_printed, comparison, falls, rises, run_case
from golf_scenarios.report.outcome import Outcome

TITLE = "Old ball: softer and more damped"


def run(fmu: ImpactFmu) -> Outcome:
    """Metrics only: two impacts, two communication steps."""
    outcome = Outcome(TITLE)
    found = {}
    for name, ((k, b), printed) in zip(("new", "old"), OLD_BALL.items(), strict=True):
        metrics = run_case(outcome, fmu, name, k=k, b=b)
        check_printed(outcome, name, metrics, printed)
        found[name] = (metrics, printed)
    outcome.tables.append(comparison(TITLE, found))

    def both(metric: str) -> list[float]:
        return [metrics[metric] for metrics, _ in found.values()]

    falls(outcome, "an old ball: the club is slower at release", both("club_velocity"))
    falls(outcome, "an old ball: the ball is slower at release", both("ball_velocity"))
    falls(outcome, "an old ball: the contact force is smaller", both("max_force"))
    falls(outcome, "an old ball: the smash factor is smaller", both("smash_factor"))
    falls(outcome, "an old ball: COR is smaller", both("coefficient_of_restitution"))
    rises(outcome, "an old ball: contact is longer", both("contact_time"))
    rises(outcome, "an old ball: it is deformed more", both("max_compression"))
    falls(outcome, "an old ball: energy is transferred worse", both("energy_efficiency"))
    return outcome


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("old_ball")
