from typing import Annotated

from typer import Option

from golf_impact.commands.console import print_list

EPILOG = "Example: golf-impact list --balls"


def list_(
    balls: Annotated[bool, Option("--balls", help="List the preset balls of --ball.")] = False,
) -> None:
    """List the scenarios, or the preset balls."""
    from golf_impact import scripts
    from golf_impact.ball import BALLS

    if not balls:
        names = *scripts.SCENARIOS, *scripts.BY_NAME
        print_list((name, scripts.title_of(scripts.path_of(name))) for name in names)
        return
    rows = []
    for ball in BALLS.values():
        values = " ".join(f"{name}={value:.6g}" for name, value in ball.values.items())
        holds = "For {:g} to {:g} m/s. ".format(*ball.speeds) if ball.speeds else ""
        lines = ball.title, f"{values} (SI units)", f"Source: {ball.source}"
        rows.append((ball.name, "\n".join([*lines, f"{holds}{ball.limits}\n"])))
    print_list(rows)
