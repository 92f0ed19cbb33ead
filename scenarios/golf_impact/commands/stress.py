from typing import Annotated

from typer import Option

from golf_impact.commands.bench import need, verdict
from golf_impact.commands.console import RESULTS, Out, print_paragraphs, print_table, progress, say
from golf_impact.report.outcome import Table

EPILOG = "Example: golf-impact stress --quick --seed 7"

_LIMITS = (
    "Limits. This doesn't show that the equations describe a golf ball, and covers no inputs "
    "outside the ranges drawn from. After an approach of duration A, times have an error of "
    "4e-16 A/T relative to the contact time T."
)


def stress(
    quick: Annotated[bool, Option("--quick", help="Fewer impacts.")] = False,
    folder: Out = RESULTS,
    seed: Annotated[int, Option(metavar="N", help="Repeat the run with this seed.")] = 20,
) -> int:
    """Check extreme impacts against a reference and invariants.

    Exit codes: 0 all checks passed, 1 some failed. stress.json has the case of each largest error.
    """
    need("stress", "mpmath", "scipy")
    from golf_impact.files import as_json, prepare, write_together

    prepare(folder, "stress.json")
    from golf_impact.stress.all import all_checks

    with progress() as begin:
        results = all_checks(quick, seed, begin)
    checks = results["checks"]
    failed = ", ".join(name for name, check in checks.items() if not check["passed"])
    kept = f"all invariants but: {failed}" if failed else "every invariant"
    words = f"{results['impacts']} random impacts far beyond golf kept {kept}."
    results["conclusion"] = [words, _LIMITS]
    write_together(folder, {"stress.json": as_json(results)})
    rows = []
    for name, check in checks.items():
        numbers = f"{check['worst']:.2g}", f"{check['tolerance']:.2g}", str(check["count"])
        passed = verdict(check["passed"], check["failures"])
        rows.append([f"{name}\n  {check['claim']}", *numbers, passed])
    columns = ["check", "worst", "tolerance", "count", ""]
    print_table(Table(f"Stress, seed {seed}: largest errors", columns, rows))
    print_paragraphs(results["conclusion"])
    say(f"Results in {folder}")
    return 0 if results["passed"] else 1
