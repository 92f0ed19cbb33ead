import json
import os
from collections.abc import Container, Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from golf_impact.commands.console import (
    RESULTS,
    Out,
    print_paragraphs,
    print_table,
    progress,
    say,
    warn,
)
from golf_impact.commands.list import title_beside
from golf_impact.errors import UserError
from golf_impact.quantities import LAWS_IN_WORDS, format_options
from golf_impact.report.outcome import Table, summarize_checks
from golf_impact.units import remarks, si_value, unit_of

if TYPE_CHECKING:
    from golf_impact.ball import Ball
    from golf_impact.report.report import Report

EPILOG = (
    "Examples: golf-impact run · golf-impact run baseline --no-figures · golf-impact run "
    "--set k=8e5 --set club_speed=42 · golf-impact run path/to/mine.py"
)

_SET = "Run a case of your own; repeatable."
_BALL = (
    "Run a case with this ball (golf-impact list --balls, or a .toml file); repeatable; --set "
    "overrides its values."
)


def run(
    names: Annotated[list[str] | None, Argument(metavar="NAME", hidden=True)] = None,
    set_: Annotated[list[str] | None, Option("--set", metavar="NAME=VALUE", help=_SET)] = None,
    balls: Annotated[list[str] | None, Option("--ball", metavar="NAME", help=_BALL)] = None,
    folder: Out = RESULTS,
    figures: Annotated[bool, Option(help="Plot figures.")] = True,
    fmu: Annotated[Path | None, Option(metavar="FILE.fmu", help="Use this; don't build.")] = None,
) -> int:
    """Run and check scenarios; write results and a report.

    NAME is a scenario or a script of your own. All scenarios, the default, are summarized in a line
    each; with NAME, --set or --ball the tables are printed.
    """
    from golf_impact.ball import ball as named_ball
    from golf_impact.ball import range_remarks
    from golf_impact.commands.scripts import load_scenario, load_scenarios, run_scenario
    from golf_impact.files import prepare
    from golf_impact.fmu.impact_fmu import ImpactFmu
    from golf_impact.report.own_cases import own_cases
    from golf_impact.report.page import write_reports

    values = values_of(set_ or [])
    own_balls = [named_ball(name) for name in dict.fromkeys(balls or ())]
    own = bool(values or own_balls)
    values = {**take_conditions(own_balls, values), **values}
    for words in remarks(values):
        warn(words, style="yellow")
    if names and own:
        say(f"--set and --ball define a case of your own; they don't change {', '.join(names)}.")
    scripts = {} if names or own else load_scenarios()
    for name_or_path in dict.fromkeys(names or ()):
        script, name = load_scenario(name_or_path), Path(name_or_path).stem
        if scripts.setdefault(name, script) is not script:
            raise UserError(f"two scenarios are named {name}: run one at a time")
    if names and (others := _scenarios_in(folder) - scripts.keys()):
        # Nothing of a larger run is lost, or mixed with another FMU's.
        folder /= "_".join(scripts)[:100]
        kept = ", ".join(sorted(others))
        say(f"{folder.parent} has results of {kept}, too: these go into {folder}.")
    prepare(folder, *(("results.json", "report.html") if scripts else ()))
    # By the beginning of their files' names.
    sets: dict[str, dict[str, Report]] = {}
    with ImpactFmu(fmu_file(fmu)) as instance, progress() as begin:
        guid = instance.description.guid
        starts = ((name, instance.default(name)) for name in ("club_speed", "ball_speed"))
        club, ball = (values.get(name, start) for name, start in starts)
        for words in range_remarks(own_balls, club - ball):
            warn(words, style="yellow")
        advance = begin("running", len(scripts) + own)
        for n, (name, script) in enumerate(scripts.items()):
            advance(n, f"running {name}")
            sets.setdefault("", {})[name] = run_scenario(script, instance)
        if own:
            try:
                stem, report = own_cases(instance, values, own_balls)
            except UserError as error:
                # With the option that gave the value.
                given = {pair.partition("=")[0].strip(): pair for pair in set_ or []}
                option = given.get(error.variable)
                raise UserError(f"--set {option}: {error}" if option else str(error)) from error
            sets[f"{stem}_"] = {"custom": report}
    reports = {name: report for of_set in sets.values() for name, report in of_set.items()}
    (_show if names or own else _summarize)(reports)
    pages = [f"{prefix}report.html" for prefix in sets]
    replaced = any((folder / page).exists() for page in pages)
    with progress() as begin:
        number = sum(len(report.figures) for report in reports.values())
        advance = begin("plotting" if figures else "writing", number)
        for prefix, of_set in sets.items():
            write_reports(folder, of_set, guid, figures, prefix, advance)
    passed = _conclude(reports)
    words = f"Results in {folder}{os.sep}; report: {', '.join(pages)}"
    say(f"{words} (replaces an earlier one)" if replaced else words)
    return 0 if passed else 1


def take_conditions(balls: "Iterable[Ball]", given: Container[str]) -> dict[str, float]:
    """Conditions in the files of balls, as far as they aren't given otherwise; prints them.

    Values that look like those of another unit are remarked on.
    """
    from golf_impact.ball import conditions_of

    balls = [*balls]
    for one in balls:
        for words in remarks(one.values, "{} = "):
            warn(f"{one.name}: {words}", style="yellow")
    conditions = conditions_of(balls, given)
    if conditions:
        say(f"Conditions of the ball's file: {format_options(conditions)}")
    return conditions


def _scenarios_in(folder: Path) -> set[str]:
    path = folder / "results.json"
    with suppress(OSError, ValueError):
        # Not of a pipe, for whose other end it would wait.
        results = json.loads(path.read_text("utf-8")) if path.is_file() else None
        return set(results) if isinstance(results, dict) else set()
    return set()


def fmu_file(path: Path | str | None) -> Path:
    """The FMU that a user names (UserError if it can't be used), or that of the current sources."""
    from golf_impact.fmu.file import check_fmu, current_fmu

    if path is not None:
        return check_fmu(Path(path))
    built, why = current_fmu()
    if why:
        warn(f"Built {built}: {why}.")
    return built


def values_of(pairs: list[str]) -> dict[str, float]:
    """Numbers by name of options --set NAME=VALUE; UserError for another form, or a name twice."""
    values = {}
    for name, text in pairs_of(pairs, "NAME=VALUE, e.g. --set k=8e5").items():
        try:
            values[name] = si_value(text, unit_of(name))
        except ValueError as error:
            why = LAWS_IN_WORDS if name == "law" else error
            raise UserError(f"--set {name}={text} is refused: {why}") from None
    return values


def pairs_of(pairs: list[str], form: str) -> dict[str, str]:
    """Texts by name of options --set NAME=TEXT; UserError for another form, or a name twice."""
    texts: dict[str, str] = {}
    for pair in pairs:
        name, _, text = map(str.strip, pair.partition("="))
        if not (name and text):
            raise UserError(f"--set {pair} is refused: write --set {form}")
        if name in texts:
            raise UserError(f"--set {name} is given twice: write it once, as --set {form}")
        texts[name] = text
    return texts


def _show(reports: "dict[str, Report]") -> None:
    for name, report in reports.items():
        for table in report.tables:
            print_table(table)
        print_paragraphs(report.words)
        if report.checks:
            passed = all(check.passed for check in report.checks)
            style = "bold green" if passed else "bold red"
            say(f"{name}: {summarize_checks(report.checks)}", style)
        say("")


def _summarize(reports: "dict[str, Report]") -> None:
    rows = []
    for name, report in reports.items():
        passed = [check.passed for check in report.checks if check.kind != "consistency"]
        count = f"{sum(passed)}/{len(passed)}" if passed else "–"
        rows.append([name, title_beside(name, report.title), count])
    print_table(Table("", ["scenario", "what it shows", "checks"], rows), numbers=False)
    print_paragraphs(report.verdict for report in reports.values() if report.verdict)
    say("")


def _conclude(reports: "dict[str, Report]") -> bool:
    """Print failed checks and totals; whether all checks passed."""
    checks = [(name, check) for name, report in reports.items() for check in report.checks]
    failed = [(name, check) for name, check in checks if not check.passed]
    for name, check in failed:
        claim = check.claim.removeprefix(f"{name}: ")
        warn(f"Check failed: {name}: {claim} ({check.detail})", style="red")
    if checks:
        say(f"{summarize_checks([check for _, check in checks])}.", "red" if failed else "green")
    deviations = sum(len(report.deviations) for report in reports.values())
    if deviations:
        say(f"Printed numbers of the document not reproduced: {deviations} (see the report).")
    return not failed
