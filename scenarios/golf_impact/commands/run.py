"""`golf-impact run`: scenarios, or a case of one's own."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from golf_impact.commands.console import RESULTS, err, out, print_table, progress, say, warn
from golf_impact.commands.options import ball_option, case_of, set_option
from golf_impact.data.errors import UnavailableError, UserError

if TYPE_CHECKING:
    from golf_impact.data.balls import Ball
    from golf_impact.fmu import Impact
    from golf_impact.report.results import Result

EPILOG = (
    "Examples: golf-impact run · golf-impact run baseline --no-figures · golf-impact run "
    "--ball roh-lee --set club_speed=95mph · golf-impact run path/to/mine.py"
)

_SET = "Run a case of your own; repeatable."
_BALL = (
    "Run a case with this ball (golf-impact list --balls, or a .toml file); repeatable; --set "
    "overrides its values."
)
_OUT = "Folder of the results; golf-impact-results if omitted, with NAME a folder in there."
_NAME = "Name of your case and of its files; its balls and values if omitted."
_FMU = "Use this FMU and those beside it; nothing is built."


def complete_scenario(incomplete: str) -> list[str]:
    """Names of scenarios for the completion of a shell."""
    from golf_impact.report.scripts import ALL

    return [name for name in ALL if name.startswith(incomplete)]


def run(
    names: Annotated[
        list[str] | None, Argument(metavar="NAME", hidden=True, autocompletion=complete_scenario)
    ] = None,
    set_: Annotated[list[str] | None, set_option(_SET)] = None,
    balls: Annotated[list[str] | None, ball_option(_BALL)] = None,
    name: Annotated[str | None, Option("--name", metavar="NAME", help=_NAME)] = None,
    folder: Annotated[Path | None, Option("--out", metavar="FOLDER", help=_OUT)] = None,
    figures: Annotated[bool, Option(help="Write figures.")] = True,
    fmu: Annotated[Path | None, Option(metavar="FILE.fmu", help=_FMU)] = None,
) -> int:
    """Run scenarios; write results, figures and a report.

    NAME is a scenario or a script of your own. All scenarios, the default, print a line each; with
    NAME, --set or --ball tables and claims are printed. Exit code 1: a claim doesn't hold.
    """
    from golf_impact.data import balls as ball
    from golf_impact.data import files
    from golf_impact.data.quantities import START
    from golf_impact.fmu import Impact
    from golf_impact.report import scripts
    from golf_impact.report.results import NO_NAME, write_results

    given, conditions, own_balls = case_of(set_ or [], balls or ())
    values, own = conditions | given, bool(given or own_balls)
    if name is not None and not own:
        raise UserError("--name is that of a case of your own: give --set or --ball with it")
    own_name = name or name_of_case(given, own_balls)
    if {*own_name} & {*NO_NAME}:
        raise UserError(f"--name {own_name} can't be in names of files: leave out {NO_NAME}")
    chosen = names or ([] if own else scripts.SCENARIOS)
    paths = [scripts.path_of(name) for name in dict.fromkeys(chosen)]
    if names and own:
        say(f"--set and --ball define a case of your own; they don't change {', '.join(names)}.")
    if len({path.stem for path in paths}) < len(paths):
        raise UserError("two scenarios have the same name: run one at a time")
    place = folder or (RESULTS / "_".join(path.stem for path in paths) if names else RESULTS)
    # Where scenarios, and a case of one's own, are written: the beginnings of paths.
    places = {"": place} if paths else {}
    places |= {f"{own_name}_": folder or RESULTS} if own else {}
    for prefix, where in places.items():
        for file in ("results.json", "report.html"):
            files.check(where / f"{prefix}{file}")
    results: dict[str, Result] = {}
    with Impact(fmu) as impact, progress("running", len(paths) + own) as advance:
        for n, path in enumerate(paths):
            advance(n, f"running {path.stem}")
            try:
                results[path.stem] = scripts.run_script(path, impact)
            except UnavailableError as error:
                warn(f"{path.stem} is left out: {error}.")
        speed = values.get("club_speed", START["club_speed"]) - values.get("ball_speed", 0.0)
        for words in ball.range_remarks(own_balls, speed):
            warn(words, style="yellow")
        mine = {own_name: own_case(impact, values, own_balls, own_name, figures)} if own else {}
        advance(len(paths) + own, "writing")
        pages = [
            write_results(where, some, impact, figures, prefix)
            for prefix, where in places.items()
            if (some := mine if prefix else results)
        ]
    if not pages:
        raise UserError("there is nothing to run")
    if names or own:
        show([*results.values(), *mine.values()])
    else:
        summarize(results)
    say(f"Results in {' and '.join(str(page.parent) for page in pages)}; report: {pages[-1]}")
    return int(any(result.failed for result in (*results.values(), *mine.values())))


def name_of_case(values: Mapping[str, float], balls: "Sequence[Ball]") -> str:
    """The name of a case with these balls and values (SI units); another case has another one."""
    from hashlib import sha256

    from golf_impact.data.quantities import format_shortest

    stems = (Path(one.name).stem for one in balls)
    name = "_".join([*stems, *(f"{key}={format_shortest(x)}" for key, x in values.items())])
    if len(name.encode()) <= 120:
        return name
    # Names of files have at most 255 bytes.
    return f"{name.encode()[:100].decode(errors='ignore')}_{sha256(name.encode()).hexdigest()[:8]}"


def own_case(
    impact: "Impact", values: Mapping[str, float], balls: "Sequence[Ball]", name: str, figures: bool
) -> "Result":
    """Results and force of a case with each ball (or none); values (SI) override a ball's.

    A case is headed by its ball; one without a ball by this name.
    """
    import numpy as np

    from golf_impact.data.balls import Ball
    from golf_impact.data.quantities import DEFAULT_LAW, QUANTITIES, NoValue, derived, describe
    from golf_impact.data.runs import METRICS
    from golf_impact.report.results import Result, plot_forces

    result = Result("Your case" if len(balls) < 2 else "Your cases")
    chosen = {Path(one.name).stem: one for one in balls} or {name: Ball(name, "", {}, "")}
    if len(chosen) < len(balls):
        raise UserError("two balls have the same name: rename a file")
    cells, curves = [], {}
    for case, one in chosen.items():
        given = {**one.values, **values}
        found = dict(impact(**given))
        unknown = one.unknown(found, values)
        result.cases[case] = found | dict.fromkeys(unknown, NoValue("k undetermined"))
        shown, errors = derived(result.cases[case], given), {}
        if one.covariance:
            from golf_impact.studies.intervals import result_intervals

            try:
                errors = derived(result_intervals(one, given, METRICS), given, error=True)
            except UnavailableError as error:
                warn(f"Intervals of {one.name} are left out: {error}.")
            if any(errors.values()):
                result.words = "Intervals are 95 %, from the covariance in the ball's file."
        numbers = (
            q.format_value(shown[n], 1.96 * errors.get(n, 0.0)) for n, q in QUANTITIES.items()
        )
        cells.append([describe(given) if not unknown else "k undetermined", *numbers])
        if unknown:
            continue
        path = impact.trajectory(**given)
        columns: Any = [*path.values()]
        types = [(key, float) for key in path]
        title = f"trajectory_{case}" if len(balls) > 1 else "trajectory"
        result.trajectories[title] = np.rec.fromarrays(columns, types)
        curves[f"{case}: {describe(given)}" if balls else describe(given)] = path
    if figures and curves:
        result.figures["force"] = plot_forces(curves, "Contact force")
    labels = ["law, k, b", *(quantity.label for quantity in QUANTITIES.values())]
    what = ", ".join(f"{name} = {value:g}" for name, value in values.items())
    title = f"{what or 'as in the ball'} (SI units)"
    result.tables.append((title, ["", *result.cases], [*zip(labels, *cells)]))
    if values.get("law", 1.0) == 1.0 and any("law" not in one.values for one in chosen.values()):
        result.words = f"{result.words} {DEFAULT_LAW}".strip()
    return result


def show(results: "Sequence[Result]") -> None:
    """Print tables, words and claims."""
    for result in results:
        say(f"\n{result.title}", style="bold")
        for table in result.tables:
            print_table(*table)
        if result.words:
            out.print(result.words, highlight=False)
        for claim, holds in result.claims.items():
            say(f"{'✓' if holds else '✗'} {claim}", "green" if holds else "bold red")
    say("")


def summarize(results: "Mapping[str, Result]") -> None:
    """Print a line for each scenario, and the claims that don't hold."""
    for name, result in results.items():
        count = f"{len(result.claims) - len(result.failed)}/{len(result.claims)}"
        mark, style = ("✗", "red") if result.failed else ("✓", "green")
        say(f"{mark} {name:<18} {count:>6}  {result.title}", style if result.failed else None)
        for claim in result.failed:
            say(f"✗ {name}: {claim}", "bold red", err)
