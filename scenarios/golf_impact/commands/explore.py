"""`golf-impact explore`."""

import os
import sys
from typing import Annotated

from typer import Option

from golf_impact.commands.console import say, warn
from golf_impact.errors import missing_package

EPILOG = "Examples: golf-impact explore · golf-impact explore --ball roh-lee --set club_speed=50"


def explore(
    ball: Annotated[
        str | None,
        Option(
            "--ball",
            metavar="NAME",
            help="Begin with this ball (golf-impact list --balls, or a file .toml).",
        ),
    ] = None,
    set_: Annotated[
        list[str] | None,
        Option("--set", metavar="NAME=VALUE", help="Begin with this value; repeatable."),
    ] = None,
    port: Annotated[
        int, Option(min=0, max=65535, help="Of the page; 0 for any that is free.")
    ] = 5006,
    browser: Annotated[bool, Option(help="Open the page in a browser.")] = True,
) -> None:
    """One impact under your hands: a page in the browser, served on this machine alone."""
    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise missing_package("explore", "Bokeh", "explore") from error
    from golf_impact.commands.run import fmu_file, values_of
    from golf_impact.explore.cases import query
    from golf_impact.explore.server import serve
    from golf_impact.facts.balls import ball as named_ball
    from golf_impact.fmu.impact_fmu import ImpactFmu

    values = {**(named_ball(ball).values if ball else {}), **values_of(set_ or [])}
    path = fmu_file(None)
    with ImpactFmu(path) as fmu:
        fmu.impact(**values)

    def ready(address: str) -> None:
        import webbrowser

        page = f"{address}?{query(values)}" if values else address
        say(f"{page}\nCtrl-C ends it.")
        graphical = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        screen = graphical or sys.platform != "linux"
        if browser and not (screen and webbrowser.open(page)):
            warn("No browser can be opened here: open this address in one.", style="yellow")

    serve(path, port, ready)
