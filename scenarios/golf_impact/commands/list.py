from typing import Annotated

from typer import Option

from golf_impact.commands.console import print_table
from golf_impact.report.outcome import Table

EPILOG = "Example: golf-impact list --balls"


def list_(
    balls: Annotated[bool, Option("--balls", help="List the preset balls of --ball.")] = False,
) -> None:
    """List the scenarios, or the preset balls."""
    from golf_impact.ball import BALLS
    from golf_impact.commands.scripts import load_scenarios

    if balls:
        rows = []
        for ball in BALLS.values():
            values = " ".join(f"{name}={value:.6g}" for name, value in ball.values.items())
            holds = "For {:g} to {:g} m/s. ".format(*ball.speeds) if ball.speeds else ""
            lines = ball.title, f"{values} (SI units)", f"Source: {ball.source}"
            rows.append([ball.name, "\n".join([*lines, f"{holds}{ball.limits}\n"])])
        table = Table("Balls", ["name", "what it is"], rows)
    else:
        rows = [[name, title_beside(name, one.TITLE)] for name, one in load_scenarios().items()]
        table = Table("Scenarios", ["name", "what it shows"], rows)
    print_table(table, numbers=False)


def title_beside(name: str, title: str) -> str:
    """A scenario's title as it stands beside its name: without the name, if it begins with it."""
    first, _, rest = title.partition(": ")
    same = first.lower().replace(" ", "") == name.lower().replace("_", "")
    return rest if same and rest else title
