"""The command `golf-impact`. Heavy modules are imported by the commands that need them."""

import contextlib
import io
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from rich.console import Console

from golf_scenarios import stopping
from golf_scenarios.errors import UserError

if TYPE_CHECKING:
    from golf_scenarios.report.outcome import Outcome

_DEFAULT_FOLDER = Path("golf-impact-results")

_Sigma = Annotated[float | None, typer.Option(help="Its standard deviation.", show_default="1 %")]

app = typer.Typer(
    help="A golf club hits a ball: build the co-simulation FMU, run and check its scenarios.",
    epilog="Example: golf-impact run baseline elastic --out results",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
# What users typed is shown as they typed it.
_out = Console(markup=False, emoji=False)
_err = Console(stderr=True, markup=False, emoji=False)


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
    epilog="Examples: golf-impact build --out ClubBallImpact.fmu · golf-impact build --system · "
    "golf-impact build --fmi 3"
)
def build(
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="The .fmu file to write.",
            show_default="build/ of a checkout, else the user's cache folder",
        ),
    ] = None,
    system: Annotated[
        bool,
        typer.Option(
            "--system",
            help="Also Swing.fmu, BallFlight.fmu and GolfSwing.ssp, a system of all three.",
        ),
    ] = False,
    fmi: Annotated[
        int,
        typer.Option(
            "--fmi",
            min=2,
            max=3,
            help="Version of FMI; 3 is ClubBallImpact.fmi3.fmu, with Model Exchange.",
        ),
    ] = 2,
) -> None:
    """Build ClubBallImpact.fmu from its sources, and the cross-check files next to it."""
    from golf_scenarios.fmu.file import build_fmu, check_temporary_folder
    from golf_scenarios.fmu.system import build_system, write_cross_check
    from golf_scenarios.stopping import held

    check_temporary_folder()
    if fmi == 3:
        if system:
            raise UserError("--system is refused with --fmi 3: the system's FMUs are of FMI 2.0")
        print(build_fmu(out, fmi=3))
        return
    # All of the files, or none.
    with held():
        file = build_fmu(out)
        files = [file, *write_cross_check(file)]
        if system:
            files += build_system(file.parent, file)
    print(*files, sep="\n")


@app.command(epilog="Example: golf-impact doctor ClubBallImpact.fmu")
def doctor(
    fmu: Annotated[
        Path | None,
        typer.Argument(metavar="[FMU]", help="The .fmu file; the built one by default."),
    ] = None,
) -> None:
    """Look whether the FMU loads on this machine, and show how hosts that aren't Python load it."""
    from golf_scenarios.commands import doctor as looked

    raise typer.Exit(looked.doctor(fmu))


@app.command("list")
def list_(
    balls: Annotated[bool, typer.Option("--balls", help="The balls that --ball knows.")] = False,
) -> None:
    """List the scenarios, or the balls."""
    if balls:
        from golf_scenarios.facts.balls import table

        _print_table(table(), numbers=False)
        return
    from golf_scenarios.commands.scripts import SCENARIOS, scenario
    from golf_scenarios.report.outcome import Table

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
    ball: Annotated[
        str | None,
        typer.Option(
            "--ball",
            metavar="NAME",
            help="A case with this ball (golf-impact list --balls); --set wins over its values.",
        ),
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

    from golf_scenarios.commands import custom
    from golf_scenarios.commands.scripts import SCENARIOS, scenario
    from golf_scenarios.facts.balls import ball as named_ball
    from golf_scenarios.fmu.file import current_fmu, given_fmu
    from golf_scenarios.fmu.impact_fmu import ImpactFmu
    from golf_scenarios.report.writing import prepare, write_outcomes

    values = {**(named_ball(ball).values if ball else {}), **_values(set_ or [])}
    chosen = list(dict.fromkeys(names or ([] if values else SCENARIOS)))
    modules = {name: scenario(name) for name in chosen}
    folder = prepare(out)
    if fmu is None:
        fmu, why = current_fmu()
        if why:
            _err.print(f"Built {fmu}: {why}.", soft_wrap=True, highlight=False)
    else:
        fmu = given_fmu(fmu)
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
        replaced = (folder / "results.json").exists()
        write_outcomes(folder, outcomes, guid, __version__, figures)
    # Files of other scenarios than these stay.
    earlier = " (the report and these scenarios' files in place of an earlier run's)"
    earlier = earlier if replaced else ""
    _out.print(f"Results in {folder}{os.sep}{earlier}", soft_wrap=True, highlight=False)
    failed = [
        f"{name}: {check.claim.removeprefix(f'{name}: ')} ({check.detail})"
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
    from golf_scenarios.benchmarks.bench import bench as measure

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
    from golf_scenarios.stress import stress as attack

    raise typer.Exit(attack(out, quick, seed))


@app.command(
    epilog="Examples: golf-impact calibrate --cor 0.743 --contact-time 600e-6 · golf-impact "
    "calibrate --ball-speed 50 --club-speed-after 24 --contact-time 600e-6 --max-force 6600 "
    "--exponent free"
)
def calibrate(
    ball_speed: Annotated[
        float | None, typer.Option(help="Measured ball speed after the impact, m/s.")
    ] = None,
    sigma_ball_speed: _Sigma = None,
    club_speed_after: Annotated[
        float | None, typer.Option(help="Measured club head speed after the impact, m/s.")
    ] = None,
    sigma_club_speed_after: _Sigma = None,
    cor: Annotated[float | None, typer.Option(help="Coefficient of restitution, 0 to 1.")] = None,
    sigma_cor: _Sigma = None,
    contact_time: Annotated[
        float | None, typer.Option(help="Duration of contact, s (600e-6 is 600 µs).")
    ] = None,
    sigma_contact_time: _Sigma = None,
    max_force: Annotated[float | None, typer.Option(help="Largest contact force, N.")] = None,
    sigma_max_force: _Sigma = None,
    time_of_max_force: Annotated[
        float | None, typer.Option(help="When it was largest, s since first touch.")
    ] = None,
    sigma_time_of_max_force: _Sigma = None,
    club_speed: Annotated[
        float | None, typer.Option(help="Club head speed before, m/s.", show_default="35")
    ] = None,
    m_club: Annotated[
        float | None, typer.Option(help="Mass of the club head, kg.", show_default="0.210")
    ] = None,
    m_ball: Annotated[
        float | None, typer.Option(help="Mass of the ball, kg.", show_default="0.04593")
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv",
            help="Read them from a file with the columns target,value,sigma; names as above. "
            "Options win over it.",
        ),
    ] = None,
    law: Annotated[int, typer.Option(help="1 absolute, 2 relative.")] = 2,
    exponent: Annotated[
        str, typer.Option(help="n of law 2's power law: a number, or free to fit it too.")
    ] = "1",
    reference_compression: Annotated[
        float, typer.Option(help="Compression at which k and b hold, m.")
    ] = 0.005,
    out: Annotated[
        Path, typer.Option("--out", help="The folder for calibrate.json and calibrate.png.")
    ] = _DEFAULT_FOLDER,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
) -> None:
    """From measurements of an impact to k and b (and n): SI units, ball at rest before.

    Needs two targets, three with a free exponent. A target without σ gets 1 % of its value.
    """
    from golf_scenarios.calibration.calibrate import calibrate as calibrated
    from golf_scenarios.calibration.laws import asked_for
    from golf_scenarios.calibration.targets import doubts, given

    options = {
        "ball_speed": (ball_speed, sigma_ball_speed),
        "club_speed_after": (club_speed_after, sigma_club_speed_after),
        "cor": (cor, sigma_cor),
        "contact_time": (contact_time, sigma_contact_time),
        "max_force": (max_force, sigma_max_force),
        "time_of_max_force": (time_of_max_force, sigma_time_of_max_force),
    }
    conditions = {"club_speed": club_speed, "m_club": m_club, "m_ball": m_ball}
    impact, targets = given(options, conditions, csv)
    chosen = asked_for(law, exponent, reference_compression)
    for words in doubts(impact, targets):
        _err.print(words, style="yellow", soft_wrap=True, highlight=False)
    with _err.status("calibrating"):
        found, written = calibrated(impact, targets, chosen, out, figures)
    for table in found.tables():
        _print_table(table)
    for words in found.words:
        _out.print(words, highlight=False)
    _out.print(f"\n{', '.join(str(file) for file in written)}", soft_wrap=True, highlight=False)
    _out.print("Run it:", style="bold")
    # Plain, so that it can be copied: no wrapping, no mark-up.
    print(found.command)


@app.command(
    epilog="Examples: golf-impact sweep --set k=0.5e6:2e6:100 --out k.csv · golf-impact sweep "
    "--set k=log:1e5:1e7:50 --set b=0,9,12 --workers 2 --out k_b.parquet · golf-impact sweep "
    "--set club_speed=normal:45:2 --samples 1000 --out speed.csv"
)
def sweep(
    study: Annotated[
        Path | None,
        typer.Argument(metavar="[STUDY]", help="A study as a TOML file; options win over it."),
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUES",
            help="LO:HI:COUNT, log:LO:HI:COUNT, A,B,C, normal:MEAN:SIGMA or uniform:LO:HI, for an "
            "input or parameter of the FMU or `ball`; repeatable, the last one runs fastest.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="The table: FILE.csv or FILE.parquet.")
    ] = None,
    outputs: Annotated[
        str | None,
        typer.Option("--outputs", metavar="A,B,C", help="The FMU's outputs to read, no others."),
    ] = None,
    samples: Annotated[
        int | None, typer.Option("--samples", help="How many to draw of the distributions.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Of the samples.", show_default="0")
    ] = None,
    design: Annotated[
        str | None,
        typer.Option(
            "--design",
            metavar="random|lhs|sobol",
            help="How samples lie: independent, Latin hypercube, Sobol sequence.",
            show_default="random",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", help="Processes that compute.", show_default="1")
    ] = None,
    chunk: Annotated[
        int | None,
        typer.Option(
            "--chunk",
            help="Cases that a worker gets at a time; changes no result.",
            show_default="2000",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler", metavar="tcp://HOST:PORT|local", help="Compute on a Dask cluster."
        ),
    ] = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="Also measure a loop over fmpy.simulate_fmu.")
    ] = False,
    figures: Annotated[
        bool | None,
        typer.Option("--figures/--no-figures", help="Draw a picture, and write report.html."),
    ] = None,
    fmu: Annotated[
        Path | None, typer.Option("--fmu", help="Use this .fmu file; don't build.")
    ] = None,
) -> None:
    """Many impacts through the FMU into one table: a row a case, variables first, then outputs."""
    from golf_scenarios.sweeps.command import sweep as run_sweep
    from golf_scenarios.sweeps.study_file import Options

    options = Options(
        sets=_texts(set_ or []),
        out=out,
        outputs=None if outputs is None else tuple(outputs.split(",")),
        samples=samples,
        seed=seed,
        design=design,
        workers=workers,
        chunk=chunk,
        scheduler=scheduler,
        compare=compare or None,
        figures=figures,
        fmu=fmu,
    )
    raise typer.Exit(run_sweep(options, study))


def _texts(pairs: list[str]) -> dict[str, str]:
    texts: dict[str, str] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        name = name.strip()
        if not equals or not name or not text.strip():
            raise UserError(
                f"--set {pair} is refused: write --set NAME=VALUES, e.g. --set k=0.5e6:2e6:100"
            )
        if name in texts:
            raise UserError(f"--set {name} is given twice: write one list, e.g. --set {name}=A,B")
        texts[name] = text
    return texts


def _values(pairs: list[str]) -> dict[str, float]:
    values = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name.strip():
            raise UserError(f"--set {pair} is refused: write --set NAME=VALUE, e.g. --set k=8e5")
        if name.strip() in values:
            raise UserError(f"--set {name.strip()} is given twice: write it once")
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


def _refuse_empty(arguments: list[str]) -> None:
    for text in arguments:
        option, equals, value = text.partition("=")
        if not text or (equals and not value and option.startswith("--")):
            raise UserError(
                f"an argument is empty ({option or 'two quotes with nothing in between'}): "
                "write a value, or leave the option out; is a variable of your shell unset?"
            )


def _one_line(call: Callable[[], object]) -> int:
    """Run a command; whatever a user can mend becomes one line on stderr and exit code 2."""
    stopping.listen()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        _refuse_empty(sys.argv[1:])
        stopping.open_scratch()
        code = _code_of(call)
        if sys.stdout is not None:
            # A full disk shows here, if not before.
            sys.stdout.flush()
        return code
    except (UserError, OSError) as error:
        _complain(error)
        return 2
    finally:
        stopping.close_scratch()


def _code_of(call: Callable[[], object]) -> int:
    try:
        code = call()
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 1
    except Exception as error:
        # The parser's own errors, from click or from typer's copy of it.
        words = getattr(error, "format_message", None)
        if words is None:
            raise
        if type(error).__name__ == "NoArgsIsHelpError":
            error.show()  # type: ignore[attr-defined]
            return 2
        context = getattr(error, "ctx", None)
        where = f" (see {context.command_path} --help)" if context else ""
        raise UserError(f"{words().rstrip('.')}{where}") from None
    if code == 130:
        _err.print("Stopped; nothing half-written is left.", style="red")
    return code if isinstance(code, int) else 0


def _complain(error: Exception) -> None:
    words = str(error)
    if isinstance(error, OSError) and error.strerror:
        words = f"{error.strerror}: {error.filename}" if error.filename else error.strerror
    _err.print(
        f"Error: {' '.join(words.split())}",
        style="red", soft_wrap=True, highlight=False, markup=False,
    )  # fmt: skip


def main() -> None:
    """The console script."""
    _leave(_one_line(lambda: app(standalone_mode=False)))


def _leave(code: int) -> NoReturn:
    """End the process here: nothing is open any more.

    Some commands load FMUs that are packaged as pythonfmu does it, whose library touches freed
    memory at the end of a process (see golf_impact.at_exit): once in some hundred times it aborted.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)


def run_alone(name: str) -> None:
    """One scenario as a script of its own: `python scenarios/baseline.py [OPTIONS]`."""
    _leave(_one_line(lambda: app(["run", name, *sys.argv[1:]], standalone_mode=False)))
