"""`golf-impact bench`: a table, a figure and bench.json."""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from golf_impact.commands.console import RESULTS, err, say
from golf_impact.commands.run import show
from golf_impact.data.errors import missing_package

if TYPE_CHECKING:
    from golf_impact.report.results import Result

EPILOG = "Example: golf-impact bench --quick --out bench"

#: The option --out.
Out = Annotated[Path, Option("--out", metavar="FOLDER", help="Folder of the results.")]


def bench(
    quick: Annotated[bool, Option("--quick", help="Coarse grid, fewer repetitions.")] = False,
    folder: Out = RESULTS,
) -> int:
    """Compare run time and error with other calls and other methods.

    Times depend on the machine and on other load; the exit code doesn't.
    """
    from golf_impact.data.files import as_json, write

    result = run_by_name("bench", "run_time_vs_error", folder, quick=quick)
    # scipy and mpmath are installed, whose versions it has.
    from golf_impact.evidence.timing import describe_machine

    machine = describe_machine()
    say(", ".join(f"{name} {text}" for name, text in machine.items()))
    rows = [*result.cases.values()]
    write(folder / "bench.json", as_json({"machine": machine, "rows": rows}))
    say(f"Results in {folder}")
    return 0


def run_by_name(command: str, name: str, folder: Path, **options: Any) -> "Result":
    """Run this script with options, print its result and write its figures.

    UserError: a package is missing, or a file can't be written.
    """
    for package in ("mpmath", "scipy"):
        if find_spec(package) is None:
            raise missing_package(command, package, "bench")
    from functools import partial

    from rich.progress import track

    from golf_impact.data import files
    from golf_impact.fmu import Impact
    from golf_impact.report import scripts
    from golf_impact.report.results import png

    files.check(folder / f"{command}.json")
    shown = partial(
        track, description=command, console=err, transient=True, disable=not err.is_terminal
    )
    with Impact() as impact:
        result = scripts.run_script(scripts.path_of(name), impact, track=shown, **options)
    for title, figure in result.figures.items():
        files.write(folder / f"{title}.png", png(figure))
    show([result])
    return result
