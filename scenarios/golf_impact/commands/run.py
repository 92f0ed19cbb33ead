"""`golf-impact run`."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from golf_impact.commands.console import RESULTS, err, out, paragraphs, print_table, say, warn
from golf_impact.errors import UserError
from golf_impact.facts.quantities import LAWS_IN_WORDS, doubts_of_mass

if TYPE_CHECKING:
    from types import ModuleType

    from golf_impact.fmu.impact_fmu import ImpactFmu
    from golf_impact.report.outcome import Check, Outcome

EPILOG = (
    "Examples: golf-impact run · golf-impact run baseline --no-figures · golf-impact run "
    "--set k=8e5 --set club_speed=42 · golf-impact run path/to/mine.py"
)

_BALL = (
    "A case with this ball (golf-impact list --balls, or a file .toml); repeatable, --set wins "
    "over its values."
)


def run(
    names: Annotated[
        list[str] | None,
        Argument(
            metavar="[NAME]...", help="Scenarios, or scripts of your own; all of ours by default."
        ),
    ] = None,
    set_: Annotated[
        list[str] | None,
        Option("--set", metavar="NAME=VALUE", help="A case of your own; repeatable."),
    ] = None,
    balls: Annotated[list[str] | None, Option("--ball", metavar="NAME", help=_BALL)] = None,
    folder: Annotated[
        Path, Option("--out", help="The folder for results, figures and report.html.")
    ] = RESULTS,
    figures: Annotated[bool, Option(help="Draw figures.")] = True,
    fmu: Annotated[Path | None, Option("--fmu", help="Use this .fmu file; don't build.")] = None,
) -> int:
    """Run scenarios through the FMU, print their tables, check them, and write the results."""
    from golf_impact.commands.scripts import scenario, scenarios
    from golf_impact.facts.balls import ball as named_ball
    from golf_impact.files import prepare
    from golf_impact.fmu.impact_fmu import ImpactFmu
    from golf_impact.report.own_cases import own_cases
    from golf_impact.report.page import write_outcomes

    values = values_of(set_ or [])
    own_balls = [named_ball(name) for name in dict.fromkeys(balls or ())]
    own = bool(values or own_balls)
    masses = {f"--set {name}=": values[name] for name in ("m_club", "m_ball") if name in values}
    for words in doubts_of_mass(masses):
        warn(words, style="yellow")
    if names and own:
        say(f"--set and --ball make a case of your own: {', '.join(names)} stays as it is.")
    scripts = {} if names or own else scenarios()
    for given in dict.fromkeys(names or ()):
        script, name = scenario(given), Path(given).stem
        if scripts.setdefault(name, script) is not script:
            raise UserError(f"two scenarios are named {name}: run one at a time")
    prepare(folder, "results.json", "report.html")
    outcomes: dict[str, Outcome] = {}
    with ImpactFmu(fmu_file(fmu)) as instance:
        for name, script in scripts.items():
            with err.status(f"running {name}"):
                outcomes[name] = _outcome(script, instance)
            _show(name, outcomes[name])
        if own:
            outcomes["custom"] = own_cases(instance, values, own_balls)
            _show("custom", outcomes["custom"])
        guid = instance.description.guid
    with err.status("writing results"):
        replaced = (folder / "results.json").exists()
        write_outcomes(folder, outcomes, guid, figures)
    checks = [(name, check) for name, outcome in outcomes.items() for check in outcome.checks]
    failed = [(name, check) for name, check in checks if not check.passed]
    for name, check in failed:
        claim = check.claim.removeprefix(f"{name}: ")
        warn(f"Check failed: {name}: {claim} ({check.detail})", style="red")
    passed, style = _verdict([check for _, check in checks])
    # Files of other scenarios than these stay.
    earlier = " (the report and these scenarios' files in place of an earlier run's)"
    say(f"{passed}. Results in {folder}{os.sep}{earlier if replaced else ''}", style)
    return 1 if failed else 0


def fmu_file(given: Path | None) -> Path:
    """The FMU that a user names, or that of the present sources, built if need be.

    Raises:
        UserError: the given one can't be used.
    """
    from golf_impact.fmu.file import current_fmu, given_fmu

    if given is not None:
        return given_fmu(given)
    path, why = current_fmu()
    if why:
        warn(f"Built {path}: {why}.")
    return path


def _outcome(script: "ModuleType", fmu: "ImpactFmu") -> "Outcome":
    from golf_impact.commands.scripts import wrong
    from golf_impact.report.outcome import Outcome

    try:
        outcome = script.run(fmu)
    except (UserError, OSError):
        raise
    except Exception as error:
        raise UserError(wrong(Path(str(script.__file__)), error)) from error
    if not isinstance(outcome, Outcome):
        raise UserError(f"{script.__file__}: run(fmu) gives {outcome!r}; it must give its Report")
    return outcome


def values_of(pairs: list[str]) -> dict[str, float]:
    """Numbers by name of options --set NAME=VALUE.

    Raises:
        UserError: one is no number, has another form, or a name is given twice.
    """
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
    """Texts by name of options --set NAME=TEXT.

    Raises:
        UserError: one has another form, or a name is given twice.
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
    for table in outcome.tables:
        print_table(table)
    paragraphs(outcome.words)
    if outcome.checks:
        words, style = _verdict(outcome.checks)
        out.print(f"{name}: {words}", style=f"bold {style}", highlight=False)
    out.print()


def _verdict(checks: "list[Check]") -> tuple[str, str]:
    """In words, and their colour."""
    passed = sum(check.passed for check in checks)
    return f"{passed} of {len(checks)} checks passed", "green" if passed == len(checks) else "red"
