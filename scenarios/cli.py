"""The command `golf-impact`. Heavy modules are imported by the commands that need them."""

import contextlib
import io
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from rich.console import Console

from scenarios.errors import UserError

if TYPE_CHECKING:
    from scenarios.outcome import Outcome

_DEFAULT_FOLDER = Path("golf-impact-results")

app = typer.Typer(
    help="A golf club hits a ball: build the co-simulation FMU, run and check its scenarios.",
    epilog="Example: golf-impact run baseline elastic --out results",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
_out = Console()
_err = Console(stderr=True)


def _version(asked: bool) -> None:
    if asked:
        from golf_impact import __version__

        print(f"golf-impact {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


@app.command(
    epilog="Examples: golf-impact build --out ClubBallImpact.fmu · golf-impact build --system"
)
def build(
    out: Annotated[
        Path | None, typer.Option("--out", help="The .fmu file to write.", show_default="build/")
    ] = None,
    system: Annotated[
        bool,
        typer.Option(
            "--system",
            help="Also Swing.fmu, BallFlight.fmu and GolfSwing.ssp, a system of all three.",
        ),
    ] = False,
) -> None:
    """Build ClubBallImpact.fmu from its sources, and the cross-check files next to it."""
    from scenarios.fmu_file import build_fmu
    from scenarios.system import build_system, write_cross_check

    file = build_fmu(out)
    print(file)
    for other in write_cross_check(file):
        print(other)
    if system:
        for other in build_system(file.parent, file):
            print(other)


@app.command(epilog="Example: golf-impact doctor ClubBallImpact.fmu")
def doctor(
    fmu: Annotated[
        Path | None,
        typer.Argument(metavar="[FMU]", help="The .fmu file; the built one by default."),
    ] = None,
) -> None:
    """Look whether the FMU loads on this machine, and show how hosts that aren't Python load it."""
    from scenarios import doctor as looked

    raise typer.Exit(looked.doctor(fmu))


@app.command("list")
def list_() -> None:
    """List the scenarios."""
    from scenarios.outcome import Table
    from scenarios.registry import SCENARIOS, scenario

    rows = [[name, scenario(name).TITLE] for name in SCENARIOS]
    _print_table(Table("Scenarios", ["name", "what it shows"], rows), numbers=False)


@app.command(
    epilog="Examples: golf-impact run · golf-impact run baseline --no-figures · "
    "golf-impact run --set k=8e5 --set club_speed=42"
)
def run(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Scenarios; all by default.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A case of your own; repeatable."),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", help="The folder for results, figures and report.html.")
    ] = _DEFAULT_FOLDER,
    figures: Annotated[bool, typer.Option(help="Draw figures.")] = True,
    fmu: Annotated[
        Path | None, typer.Option("--fmu", help="Use this .fmu file; don't build.")
    ] = None,
) -> None:
    """Run scenarios through the FMU, print their tables, check them, and write the results."""
    from golf_impact import __version__

    from scenarios import custom
    from scenarios.fmu_file import current_fmu
    from scenarios.impact_fmu import ImpactFmu
    from scenarios.registry import SCENARIOS, scenario
    from scenarios.writing import prepare, write_outcomes

    values = _values(set_ or [])
    chosen = list(dict.fromkeys(names or ([] if values else SCENARIOS)))
    modules = {name: scenario(name) for name in chosen}
    folder = prepare(out)
    if fmu is None:
        fmu, why = current_fmu()
        if why:
            _err.print(f"Built {fmu}: {why}.", soft_wrap=True, highlight=False)
    outcomes: dict[str, Outcome] = {}
    with ImpactFmu(fmu) as instance:
        for name, module in modules.items():
            with _err.status(f"running {name}"):
                outcomes[name] = module.run(instance)
            _show(name, outcomes[name])
        if values:
            outcomes["custom"] = custom.run(instance, values)
            _show("custom", outcomes["custom"])
        guid = instance.description.guid
    with _err.status("writing results"):
        write_outcomes(folder, outcomes, guid, __version__, figures)
    _out.print(f"Results in {folder}{os.sep}", soft_wrap=True, highlight=False)
    failed = [
        f"{name}: {check.claim} ({check.detail})"
        for name, outcome in outcomes.items()
        for check in outcome.checks
        if not check.passed
    ]
    for line in failed:
        _err.print(f"Check failed: {line}", style="red", soft_wrap=True, highlight=False)
    if failed:
        raise typer.Exit(1)


@app.command(epilog="Example: golf-impact bench --quick --out bench")
def bench(
    quick: Annotated[
        bool, typer.Option("--quick", help="A short run: the same, measured less.")
    ] = (False),
    out: Annotated[Path, typer.Option("--out", help="The folder for bench.json and figures.")] = (
        _DEFAULT_FOLDER
    ),
) -> None:
    """Measure run time against error beside other methods, and what a scene costs."""
    from scenarios.benchmarks.bench import bench as measure

    raise typer.Exit(measure(out, quick))


@app.command(epilog="Example: golf-impact stress --quick --seed 7")
def stress(
    quick: Annotated[bool, typer.Option("--quick", help="Fewer impacts.")] = False,
    out: Annotated[Path, typer.Option("--out", help="The folder for stress.json and figures.")] = (
        _DEFAULT_FOLDER
    ),
    seed: Annotated[
        int | None, typer.Option("--seed", help="Replay the run with this seed.")
    ] = None,
) -> None:
    """Thousands of extreme impacts through the FMU against a reference and invariants."""
    from scenarios.stress import stress as attack

    raise typer.Exit(attack(out, quick, seed))


def _values(pairs: list[str]) -> dict[str, float]:
    values = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name.strip():
            raise UserError(f"--set {pair} is refused: write --set NAME=VALUE, e.g. --set k=8e5")
        try:
            values[name.strip()] = float(text)
        except ValueError:
            raise UserError(
                f"--set {pair} is refused: {text!r} is no number (e.g. --set {name.strip()}=1.5)"
            ) from None
    return values


def _show(name: str, outcome: "Outcome") -> None:
    for table in outcome.tables:
        _print_table(table)
    for words in outcome.words:
        _out.print(words, highlight=False)
    if outcome.checks:
        passed = sum(check.passed for check in outcome.checks)
        _out.print(f"{name}: {passed} of {len(outcome.checks)} checks passed", style="bold")
    _out.print()


def _print_table(table, numbers: bool = True) -> None:
    from rich.table import Table as RichTable

    rich = RichTable(title=table.title, title_justify="left", title_style="bold")
    for n, column in enumerate(table.columns):
        rich.add_column(column, justify="right" if n and numbers else "left", overflow="fold")
    for row in table.rows:
        rich.add_row(*row)
    _out.print(rich)


def _interrupted(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def _one_line(call: Callable[[], None]) -> int:
    """Run a command; whatever a user can mend becomes one line on stderr and exit code 2."""
    signal.signal(signal.SIGTERM, _interrupted)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        call()
    except UserError as error:
        _err.print(f"Error: {error}", style="red", soft_wrap=True, highlight=False, markup=False)
        return 2
    except KeyboardInterrupt:
        _err.print("Stopped; nothing half-written is left.", style="red")
        return 130
    except SystemExit as stop:
        if stop.code == 130:
            _err.print("Stopped; nothing half-written is left.", style="red")
        return stop.code if isinstance(stop.code, int) else 1
    return 0


def main() -> None:
    """The console script."""
    _leave(_one_line(app))


def _leave(code: int) -> NoReturn:
    """End the process here: nothing is open any more.

    Once in some hundred ends of a process that had loaded an FMU, unloading pythonfmu's library
    aborted it ("corrupted double-linked list"), after all was done and written.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


def run_alone(name: str) -> None:
    """One scenario as a script of its own: `python -m scenarios.baseline [OPTIONS]`."""
    _leave(_one_line(lambda: app(["run", name, *sys.argv[1:]])))
