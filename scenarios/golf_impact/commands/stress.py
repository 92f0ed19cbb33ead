"""`golf-impact stress`."""

import math
import sys
from typing import Annotated, Any

from typer import Option

from golf_impact.commands.bench import need, verdict
from golf_impact.commands.console import RESULTS, Out, print_paragraphs, print_table, progress, say

EPILOG = "Example: golf-impact stress --quick --seed 7"


def stress(
    quick: Annotated[bool, Option("--quick", help="Fewer impacts.")] = False,
    folder: Out = RESULTS,
    seed: Annotated[int, Option(metavar="N", help="Repeat the run with this seed.")] = 20,
) -> int:
    """Thousands of extreme impacts through the FMU against a reference and invariants."""
    need("stress", "mpmath", "scipy")
    from golf_impact.files import as_json, prepare, write_together

    prepare(folder, "stress.json")
    from golf_impact.stress.all import all_checks

    with progress() as begin:
        results = all_checks(quick, seed, begin)
    results["conclusion"] = _conclusion(results)
    write_together(folder, {"stress.json": as_json(results)})
    _show(results)
    say(f"Results in {folder}")
    return 0 if results["passed"] else 1


def _conclusion(results: dict[str, Any]) -> list[str]:
    failed = ", ".join(name for name, check in results["checks"].items() if not check["passed"])
    kept = f"all invariants but: {failed}" if failed else "every invariant"
    return [
        f"{results['impacts']} random impacts far beyond golf kept {kept}.",
        "Limits. This doesn't show that the equations describe a golf ball, and covers no inputs "
        "outside the ranges drawn from. After an approach of duration A, times have an error of "
        "4e-16 A/T relative to the contact time T.",
    ]


def _show(results: dict[str, Any]) -> None:
    from golf_impact.report.outcome import Table

    checks = results["checks"]
    rows = []
    for name, check in checks.items():
        numbers = f"{check['worst']:.2g}", f"{check['tolerance']:.2g}", str(check["count"])
        passed = verdict(check["passed"], check["failures"])
        rows.append([f"{name}\n  {check['claim']}", *numbers, passed])
    title = f"Stress, seed {results['seed']}: worst cases"
    print_table(Table(title, ["check", "worst", "tolerance", "count", ""], rows))
    name = max(checks, key=lambda name: _over_tolerance(checks[name]))
    worst = checks[name]["case"]
    # Numbers and names; segments and steps are in stress.json.
    inputs = ", ".join(
        f"{key} {value:.6g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in {**worst, **worst.get("values", {})}.items()
        if not isinstance(value, (dict, list, tuple))
    )
    words = [
        f"The worst case, relative to its tolerance: {name}, {checks[name]['worst']:.2g}, at "
        f"{inputs}. Those of the other checks are in stress.json."
    ]
    for law, run in results["tiny_steps"].items():
        start, *_, end = run["errors"]
        steps = f"{run['steps']} steps of 1 ns, {law}"
        words.append(f"{steps}: error {start:.1g} at the start, {end:.1g} at the end.")
    print_paragraphs([*words, *results["conclusion"]])


def _over_tolerance(check: dict[str, Any]) -> float:
    """The worst error in multiples of its tolerance, which may be 0; infinite for NaN."""
    ratio = check["worst"] / (check["tolerance"] or sys.float_info.min)
    return math.inf if math.isnan(ratio) else ratio
