"""`golf-impact list`: scenarios and preset balls."""

from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from golf_impact.commands.console import print_list, print_table, say
from golf_impact.commands.options import complete_ball
from golf_impact.data.errors import UserError

if TYPE_CHECKING:
    from golf_impact.data.balls import Ball

EPILOG = "Examples: golf-impact list · golf-impact list --balls · golf-impact list --balls tour"

_BALLS = "List the preset balls; with NAME (or a .toml file) the values and the source of one."


def list_(
    names: Annotated[
        list[str] | None, Argument(metavar="NAME", hidden=True, autocompletion=complete_ball)
    ] = None,
    balls: Annotated[bool, Option("--balls", help=_BALLS)] = False,
) -> None:
    """List the scenarios, or the preset balls."""
    from golf_impact.data import balls as ball
    from golf_impact.report import scripts

    if names and not balls:
        raise UserError(f"a name needs --balls: golf-impact list --balls {names[0]}")
    for name in names or ():
        describe_ball(ball.ball(name))
    if names:
        return
    if balls:
        list_balls()
    else:
        print_list((name, scripts.title_of(scripts.path_of(name))) for name in scripts.ALL)


def list_balls() -> None:
    """Print a table of the preset balls with their results."""
    from golf_impact.api import run_impact_anywhere
    from golf_impact.data.balls import BALLS
    from golf_impact.data.quantities import START

    rows = []
    for one in BALLS.values():
        # The start value, or the nearest speed for which the ball holds.
        speed = min(max(START["club_speed"], one.speeds[0]), one.speeds[1])
        found = run_impact_anywhere(**one.values, club_speed=speed)
        rows.append([
            one.name, one.title, f"{speed:g}", f"{found['smash_factor']:.3f}",
            f"{found['coefficient_of_restitution']:.3f}", f"{found['contact_time'] * 1e6:.0f}",
        ])  # fmt: skip
    columns = "ball", "what it is", "at m/s", "S", "COR", "contact (µs)"
    print_table("", columns, rows, texts=2)
    say("Values, source and limits of a ball: golf-impact list --balls NAME")


def describe_ball(one: "Ball") -> None:
    """Print the values of a ball, its source, and what it isn't for."""
    from golf_impact.data.quantities import format_shortest, format_unit
    from golf_impact.data.units import unit_of

    values = (
        f"{name} = {format_shortest(value)} {format_unit(unit_of(name))}".rstrip()
        for name, value in one.values.items()
    )
    rows = [("values", ", ".join(values)), ("source", one.source)]
    if one.speeds:
        rows.append(("holds", "for {:g} to {:g} m/s".format(*one.speeds)))
    if one.limits:
        rows.append(("limits", one.limits))
    say(f"{one.name}: {one.title}", style="bold")
    print_list(rows)
