"""`golf-impact stress`: a table, a figure and stress.json."""

from typing import Annotated

from typer import Option

from golf_impact.commands.bench import Out, run_by_name
from golf_impact.commands.console import RESULTS, say

EPILOG = "Example: golf-impact stress --quick --seed 7"


def stress(
    quick: Annotated[bool, Option("--quick", help="Fewer impacts.")] = False,
    folder: Out = RESULTS,
    seed: Annotated[int, Option(metavar="N", help="Repeat the run with this seed.")] = 20,
) -> int:
    """Compare impacts far beyond golf with 80-digit arithmetic.

    Exit code 1: an error is above its tolerance. stress.json has the case of each largest error.
    """
    from golf_impact.data.files import as_json, write

    result = run_by_name("stress", "stability", folder, quick=quick, seed=seed)
    write(folder / "stress.json", as_json({"checks": result.cases}))
    say(f"Results in {folder}")
    return int(bool(result.failed))
