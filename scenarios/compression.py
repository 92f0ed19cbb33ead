"""Balls of different compression: k = 0.5e6, 1e6 and 2e6 N/m (the document's table)."""

from golf_scenarios.facts.document import COMPRESSION
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import check_printed, comparison, falls, rises, run_case
from golf_scenarios.report.outcome import Outcome

TITLE = "Compression: a stiffer ball"


def run(fmu: ImpactFmu) -> Outcome:
    """Metrics only: three impacts, three communication steps."""
    outcome = Outcome(TITLE)
    found = {}
    for k, printed in COMPRESSION.items():
        name = f"k = {k / 1e6:g}e6"
        metrics = run_case(outcome, fmu, name, k=k)
        check_printed(outcome, name, metrics, printed)
        found[name] = (metrics, printed)
    outcome.tables.append(comparison(TITLE, found))

    def each(metric: str) -> list[float]:
        return [metrics[metric] for metrics, _ in found.values()]

    rises(outcome, "a stiffer ball: the club is faster at release", each("club_velocity"))
    rises(outcome, "a stiffer ball: the ball is faster at release", each("ball_velocity"))
    rises(outcome, "a stiffer ball: the contact force is larger", each("max_force"))
    rises(outcome, "a stiffer ball: the smash factor is larger", each("smash_factor"))
    rises(outcome, "a stiffer ball: COR is larger", each("coefficient_of_restitution"))
    falls(outcome, "a stiffer ball: contact is shorter", each("contact_time"))
    falls(outcome, "a stiffer ball: it is compressed less", each("max_compression"))
    falls(outcome, "a stiffer ball: it moves less in contact", each("contact_displacement"))
    rises(outcome, "a stiffer ball: energy is transferred better", each("energy_efficiency"))
    outcome.words.append(
        f"At k = 2e6 the document prints v_B = 55.8 m/s; its own scheme gives 55.67, the exact "
        f"answer is {each('ball_velocity')[-1]:.3f} m/s."
    )
    return outcome


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("compression")
