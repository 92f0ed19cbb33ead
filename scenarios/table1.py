"""The document's Table 1 as printed, beside the parameters that its numbers really come from."""

from golf_scenarios.facts.document import BASELINE, TABLE_1, USED
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.checks import LABELS, run_case, shown
from golf_scenarios.report.outcome import Outcome, Table

TITLE = "Table 1: the parameters printed, and those used"


def run(fmu: ImpactFmu) -> Outcome:
    """Two impacts, two communication steps."""
    outcome = Outcome(TITLE)
    used = run_case(outcome, fmu, "used", **USED)
    printed = run_case(outcome, fmu, "Table 1", **TABLE_1)
    rows = [
        [f"{name} ({unit})", f"{TABLE_1[name]:g}", f"{USED[name]:g}", ""]
        for name, unit in (("m_club", "kg"), ("m_ball", "kg"), ("ball_diameter", "m"))
    ]
    rows += [
        [LABELS[metric], shown(metric, printed[metric]), shown(metric, used[metric]), number.text]
        for metric, number in BASELINE.items()
    ]
    outcome.tables.append(
        Table(TITLE, ["", "with Table 1", "with those used", "document prints"], rows)
    )

    def misses(metrics: dict[str, float]) -> int:
        return sum(
            abs(metrics[metric] - number.value) > 0.005 * number.value + number.half_digit
            for metric, number in BASELINE.items()
        )

    outcome.check(
        "the parameters used explain every printed number of the baseline",
        misses(used) == 0,
        f"{misses(used)} of {len(BASELINE)} are off",
    )
    outcome.check(
        "those of Table 1 don't",
        misses(printed) > 0,
        f"{misses(printed)} of {len(BASELINE)} are off",
    )
    outcome.words.append(
        f"With Table 1's masses and diameter {misses(printed)} of {len(BASELINE)} printed numbers "
        "lie outside the document's numerical error (its initial momentum would be 7.00, not 7.35 "
        "N.s). The numbers come from 0.210 kg, 0.04593 kg and 0.04267 m."
    )
    return outcome


if __name__ == "__main__":
    from golf_scenarios.commands.app import run_alone

    run_alone("table1")
