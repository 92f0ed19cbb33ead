import os
import sys
from pathlib import Path
from typing import Annotated

from typer import Option

from golf_impact.commands.console import say, warn
from golf_impact.errors import UserError, missing_package
from golf_impact.units import remarks

EPILOG = (
    "Examples: golf-impact explore --ball roh-lee --set club_speed=50 · "
    "golf-impact explore --export page"
)

_BALL = "The ball to begin with: golf-impact list --balls, or a .toml file."
_SET = "Begin with this value; repeatable."
_PORT = "Of the page; 0 for any free port."
_EXPORT = "Write the page as static files, for any web server."
_PYODIDE = "With --export: Pyodide's files; by npm without it."


def explore(
    ball: Annotated[str | None, Option("--ball", metavar="NAME", help=_BALL)] = None,
    set_: Annotated[list[str] | None, Option("--set", metavar="NAME=VALUE", help=_SET)] = None,
    port: Annotated[int, Option(metavar="N", min=0, max=65535, help=_PORT)] = 5006,
    browser: Annotated[bool, Option(help="Open the page in a browser.")] = True,
    export: Annotated[Path | None, Option(metavar="FOLDER", help=_EXPORT)] = None,
    pyodide: Annotated[Path | None, Option(metavar="FOLDER", help=_PYODIDE)] = None,
) -> None:
    """Explore an impact on an interactive page in a browser.

    The page is served on this machine alone, or exported as files.
    """
    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise missing_package("explore", "Bokeh", "explore") from error
    from golf_impact.ball import ball as named_ball
    from golf_impact.commands.options import take_conditions, values_of

    given, chosen = values_of(set_ or []), [named_ball(ball)] if ball else []
    values = {**(chosen[0].values if chosen else {}), **take_conditions(chosen, given), **given}
    if export is not None and values:
        raise UserError("--export takes no --ball or --set: the address holds the case")
    if export is None and pyodide is not None:
        raise UserError("--pyodide is for --export FOLDER alone")
    for words in remarks(given):
        warn(words, style="yellow")
    if export is not None:
        from golf_impact.explore.export import export as write_page
        from golf_impact.fmu import current_fmu

        sizes = write_page(current_fmu(), export, pyodide)
        say(
            f"{len(sizes)} files, {sum(sizes.values()) / 1e6:.1f} MB, in {export}\n"
            f"To try it: {Path(sys.executable).name} -m http.server -d {export}"
        )
        return
    from golf_impact.explore.server import serve

    def ready(address: str) -> None:
        import webbrowser

        say(f"{address}\nCtrl-C ends it.")
        graphical = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        screen = graphical or sys.platform != "linux"
        if browser and not (screen and webbrowser.open(address)):
            warn("No browser can be opened here: open this address in one.", style="yellow")

    serve(port, values, ready)
