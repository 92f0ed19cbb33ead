"""`golf-impact run`."""

import os
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from golf_impact.commands.console import (
    RESULTS,
    out,
    print_paragraphs,
    print_table,
    progress,
    say,
    warn,
)
from golf_impact.errors import UserError
from golf_impact.facts.quantities import LAWS_IN_WORDS, check_masses

if TYPE_CHECKING:
    from types import ModuleType

    from golf_impact.fmu.impact_fmu import ImpactFmu
    from golf_impact.report.outcome import Check, Outcome

EPILOG = (
    "Examples: golf-impact run · golf-impact run baseline --no-figures · golf-impact run "
    "--set k=8e5 --set club_speed=42 · golf-impact run path/to/mine.py"
)

_BALL = (
    "Run a case with this ball (golf-impact list --balls, or a file .toml); repeatable; --set "
    "overrides its values."
)


#: Longest title in the summary of all scenarios: a line each at 80 columns.
_TITLE = 46


def run(
    names: Annotated[
        list[str] | None,
        Argument(metavar="NAME", help="Scenarios or scripts of your own; default: all scenarios."),
    ] = None,
    set_: Annotated[
        list[str] | None,
        Option("--set", metavar="NAME=VALUE", help="Run a case of your own; repeatable."),
    ] = None,
    balls: Annotated[list[str] | None, Option("--ball", metavar="NAME", help=_BALL)] = None,
    folder: Annotated[Path, Option("--out", help="Output folder.")] = RESULTS,
    figures: Annotated[bool, Option(help="Plot figures.")] = True,
    fmu: Annotated[Path | None, Option("--fmu", help="Use this .fmu file; don't build.")] = None,
) -> int:
    """Run and check scenarios; write results and a report.

    All scenarios are summarized in a line each. With NAME, --set or --ball the tables are printed.
    """
    from golf_impact.commands.scripts import load_scenario, load_scenarios
    from golf_impact.facts.balls import ball as named_ball
    from golf_impact.files import prepare
    from golf_impact.fmu.impact_fmu import ImpactFmu
    from golf_impact.report.own_cases import own_cases
    from golf_impact.report.page import write_outcomes

    values = values_of(set_ or [])
    own_balls = [named_ball(name) for name in dict.fromkeys(balls or ())]
    own = bool(values or own_balls)
    masses = {f"--set {name}=": values[name] for name in ("m_club", "m_ball") if name in values}
    for words in check_masses(masses):
        warn(words, style="yellow")
    if names and own:
        say(f"--set and --ball define a case of your own; they don't change {', '.join(names)}.")
    scripts = {} if names or own else load_scenarios()
    for given in dict.fromkeys(names or ()):
        script, name = load_scenario(given), Path(given).stem
        if scripts.setdefault(name, script) is not script:
            raise UserError(f"two scenarios are named {name}: run one at a time")
    prepare(folder, *(("results.json", "report.html") if scripts else ()))
    outcomes: dict[str, Outcome] = {}
    with ImpactFmu(fmu_file(fmu)) as instance, progress() as begin:
        guid = instance.description.guid
        advance = begin("running", len(scripts) + own)
        for name, script in scripts.items():
            advance(len(outcomes), f"running {name}")
            outcomes[name] = _outcome(script, instance)
        # The files of a set of outcomes have a prefix of their own.
        sets = {"": outcomes} if outcomes else {}
        if own:
            with as_typed(set_ or []):
                case = own_cases(instance, values, own_balls)
            sets[case.prefix] = {"custom": case}
    outcomes = {name: outcome for of_set in sets.values() for name, outcome in of_set.items()}
    if names or own:
        for name, outcome in outcomes.items():
            _show(name, outcome)
    else:
        _summarize(outcomes)
    replaced = any((folder / f"{prefix}report.html").exists() for prefix in sets)
    with progress() as begin:
        number = sum(len(outcome.figures) for outcome in outcomes.values())
        advance = begin("plotting" if figures else "writing", number if figures else 1)
        reports = [
            write_outcomes(folder, of_set, guid, figures, prefix, advance)
            for prefix, of_set in sets.items()
        ]
    code = _conclude(outcomes)
    words = f"Results in {folder}{os.sep}; report: {', '.join(report.name for report in reports)}"
    say(f"{words} (replaces an earlier one)" if replaced else words)
    return code


def fmu_file(given: Path | None) -> Path:
    """The FMU that a user names (UserError if it can't be used), or that of the current sources."""
    from golf_impact.fmu.file import check_fmu, current_fmu

    if given is not None:
        return check_fmu(given)
    path, why = current_fmu()
    if why:
        warn(f"Built {path}: {why}.")
    return path


def _outcome(script: "ModuleType", fmu: "ImpactFmu") -> "Outcome":
    from golf_impact.commands.scripts import describe_error, locate_error
    from golf_impact.report.outcome import Outcome

    path = Path(str(script.__file__))
    try:
        outcome = script.run(fmu)
    except OSError:
        raise
    except UserError as error:
        raise UserError(f"{locate_error(path, error)}: {error}") from error
    except Exception as error:
        raise UserError(describe_error(path, error)) from error
    if not isinstance(outcome, Outcome):
        raise UserError(f"{path}: run(fmu) returns {outcome!r}; it must return its Report")
    return outcome


@contextmanager
def as_typed(pairs: list[str]) -> Iterator[None]:
    """Begin errors about a variable with the option --set that gave its value."""
    try:
        yield
    except UserError as error:
        for pair in pairs:
            if str(error).startswith(f"{pair.partition('=')[0].strip()} = "):
                raise UserError(f"--set {pair}: {error}") from error
        raise


def values_of(pairs: list[str]) -> dict[str, float]:
    """Numbers by name of options --set NAME=VALUE; UserError for another form, or a name twice."""
    values = {}
    for name, text in pairs_of(pairs, "VALUE", "k=8e5", "write it once").items():
        try:
            values[name] = float(text)
        except ValueError:
            why = f"{text!r} is no number (e.g. --set {name}=1.5)"
            why = LAWS_IN_WORDS if name == "law" else why
            raise UserError(f"--set {name}={text} is refused: {why}") from None
    return values


def pairs_of(pairs: list[str], what: str, example: str, once: str) -> dict[str, str]:
    """Texts by name of options --set NAME=TEXT; UserError for another form, or a name twice.

    `what`, `example` and `once` (in place of a name twice) are for error messages.
    """
    texts: dict[str, str] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not (equals and name.strip() and text.strip()):
            raise UserError(
                f"--set {pair} is refused: write --set NAME={what}, e.g. --set {example}"
            )
        name = name.strip()
        if name in texts:
            raise UserError(f"--set {name} is given twice: {once}")
        texts[name] = text
    return texts


def _show(name: str, outcome: "Outcome") -> None:
    """Print the tables, conclusions and number of checks of one scenario."""
    for table in outcome.tables:
        print_table(table)
    print_paragraphs(outcome.words)
    if outcome.checks:
        words, style = _verdict(outcome.checks)
        say(f"{name}: {words}", f"bold {style}")
    out.print()


def _summarize(outcomes: "dict[str, Outcome]") -> None:
    """Print a line for each scenario, and the verdicts."""
    from golf_impact.commands.list import title_beside
    from golf_impact.report.outcome import Table

    rows = []
    for name, outcome in outcomes.items():
        passed = [check.passed for check in outcome.checks if check.kind != "consistency"]
        rows.append(
            [
                name,
                textwrap.shorten(title_beside(name, outcome.title), _TITLE, placeholder=" …"),
                f"{sum(passed)}/{len(passed)}" if passed else "–",
            ]
        )
    print_table(Table("", ["scenario", "what it shows", "checks"], rows), numbers=False)
    print_paragraphs(outcome.verdict for outcome in outcomes.values() if outcome.verdict)
    out.print()


def _conclude(outcomes: "dict[str, Outcome]") -> int:
    """Print failed checks and totals; the exit code is 1 if a check failed."""
    checks = [(name, check) for name, outcome in outcomes.items() for check in outcome.checks]
    failed = [(name, check) for name, check in checks if not check.passed]
    for name, check in failed:
        claim = check.claim.removeprefix(f"{name}: ")
        warn(f"Check failed: {name}: {claim} ({check.detail})", style="red")
    if checks:
        words, style = _verdict([check for _, check in checks])
        say(f"{words}.", style)
    deviations = sum(len(outcome.deviations) for outcome in outcomes.values())
    if deviations:
        say(f"Printed numbers of the document not reproduced: {deviations} (see the report).")
    return 1 if failed else 0


def _verdict(checks: "list[Check]") -> tuple[str, str]:
    """The number of checks passed, in words, and their colour."""
    from golf_impact.report.outcome import summarize_checks

    return summarize_checks(checks), "green" if all(check.passed for check in checks) else "red"
