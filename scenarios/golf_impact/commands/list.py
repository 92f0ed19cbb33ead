"""`golf-impact list`."""

from typing import Annotated

from typer import Option

EPILOG = "Example: golf-impact list --balls"


def list_(
    balls: Annotated[bool, Option("--balls", help="The balls that --ball knows.")] = False,
) -> None:
    """List the scenarios, or the balls."""
    from golf_impact.commands.console import print_table
    from golf_impact.commands.scripts import scenarios
    from golf_impact.facts.balls import BALLS
    from golf_impact.report.outcome import Table

    if balls:
        columns, rows = ["name", "what it is", "values (SI)", "source"], []
        for ball in BALLS.values():
            values = ", ".join(f"{name} = {value:.6g}" for name, value in ball.values.items())
            rows.append([ball.name, ball.title, values, ball.source])
        table = Table("Balls", columns, rows)
    else:
        rows = [[name, _shown(name, script.TITLE)] for name, script in scenarios().items()]
        table = Table("Scenarios", ["name", "what it shows"], rows)
    print_table(table, numbers=False)


def _shown(name: str, title: str) -> str:
    """A title without the name that it begins with, which stands beside it."""
    first, _, rest = title.partition(": ")
    same = first.lower().replace(" ", "") == name.lower().replace("_", "")
    return rest if same and rest else title
