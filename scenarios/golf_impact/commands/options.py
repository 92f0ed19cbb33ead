"""Options that several commands have: --set, --ball, and their values."""

from collections.abc import Container, Iterable
from typing import TYPE_CHECKING, Any

from golf_physics.variables import BY_NAME
from typer import Option

from golf_impact.commands.console import say, warn
from golf_impact.data.errors import UserError, unknown_name
from golf_impact.data.quantities import LAWS_IN_WORDS, START, format_options
from golf_impact.data.units import remarks, si_value, unit_of

if TYPE_CHECKING:
    from golf_impact.data.balls import Ball

#: What users look for here, and other FMUs have.
_OF_A_SHOT = (
    "loft", "dynamic_loft", "spin_loft", "attack_angle", "launch_angle", "backspin", "friction",
    "wind_speed", "carry",
)  # fmt: skip


def complete_ball(incomplete: str) -> list[str]:
    """Names of balls for the completion of a shell."""
    from golf_impact.data.balls import BALLS

    return [name for name in BALLS if name.startswith(incomplete)]


def ball_option(words: str) -> Any:
    """The option --ball with this help."""
    return Option("--ball", metavar="NAME|FILE", help=words, autocompletion=complete_ball)


def set_option(words: str, values: str = "VALUE") -> Any:
    """The option --set with this help, whose names of inputs and parameters are completed."""

    def complete(incomplete: str) -> list[str]:
        return [f"{name}=" for name in START if name.startswith(incomplete)]

    return Option("--set", metavar=f"NAME={values}", help=words, autocompletion=complete)


def complete_output(incomplete: str) -> list[str]:
    """Names of outputs, the last one after a comma, for the completion of a shell."""
    before, comma, last = incomplete.rpartition(",")
    names = (row.name for row in BY_NAME.values() if row.causality == "output")
    return [f"{before}{comma}{name}" for name in names if name.startswith(last)]


def case_of(
    pairs: Iterable[str], names: Iterable[str]
) -> tuple[dict[str, float], dict[str, float], "list[Ball]"]:
    """Numbers (SI) by name, of options --set and of the other conditions of balls; these balls."""
    from golf_impact.data.balls import ball

    values: dict[str, float] = {}
    for name, text in pairs_of(pairs, "NAME=VALUE, e.g. --set k=8e5").items():
        if name in _OF_A_SHOT:
            raise UserError(
                f"--set {name}={text} is refused: ClubBallImpact moves along the face normal; "
                "loft and flight are in golf_impact.drive(loft=…, attack_angle=…) and in "
                "GolfSwing.ssp (Launch.dynamic_loft, Launch.attack_angle)"
            )
        try:
            values[name] = si_value(text, unit_of(name))
        except ValueError as error:
            if name not in START:
                also = f"; a ball is --ball {text}" if name == "ball" else ""
                raise unknown_name("input or parameter", name, START, also) from None
            why = LAWS_IN_WORDS if name == "law" else error
            raise UserError(f"--set {name}={text} is refused: {why}") from None
    balls = [ball(name) for name in dict.fromkeys(names)]
    conditions = take_conditions(balls, values)
    for words in remarks(conditions | values):
        warn(words, style="yellow")
    return values, conditions, balls


def pairs_of(pairs: Iterable[str], form: str, option: str = "--set") -> dict[str, str]:
    """Texts by name of an option NAME=TEXT; UserError for another form, or a name twice."""
    texts: dict[str, str] = {}
    for pair in pairs:
        name, _, text = map(str.strip, pair.partition("="))
        if not (name and text):
            raise UserError(f"{option} {pair} is refused: write {form}")
        if name in texts:
            raise UserError(f"{option} {name} is given twice: write it once, as {form}")
        texts[name] = text
    return texts


def take_conditions(balls: "Iterable[Ball]", given: Container[str]) -> dict[str, float]:
    """Conditions in the files of balls, as far as they aren't given otherwise; prints them.

    Warns about values that look like those of another unit.
    """
    from golf_impact.data.balls import conditions_of

    balls = [*balls]
    for one in balls:
        for words in remarks(one.values, "{} = "):
            warn(f"{one.name}: {words}", style="yellow")
        for name in one.undetermined:
            if name not in given:
                warn(
                    f"{one.name}: {name} is undetermined, force, contact time and compression don't "  # noqa: E501
                    f"follow: give --set {name}=… for them.",
                    style="yellow",
                )
    conditions = conditions_of(balls, given)
    if conditions:
        say(f"Conditions of the ball's file: {format_options(conditions)}")
    return conditions
