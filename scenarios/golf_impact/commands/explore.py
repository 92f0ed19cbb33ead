"""`golf-impact explore`: the interactive page."""

import os
import sys
from pathlib import Path
from typing import Annotated

from typer import Option

from golf_impact.commands.console import RESULTS, say, warn
from golf_impact.commands.options import ball_option, case_of, set_option
from golf_impact.data.errors import UserError

EPILOG = (
    "Examples: golf-impact explore --ball roh-lee --set club_speed=50 · "
    "golf-impact explore --export golf.html"
)

_BALL = "The ball to begin with: golf-impact list --balls, or a .toml file."
_SET = "Begin with this value; repeatable."
_EXPORT = "Write the page there, e.g. for a web server or a class, and don't open it."


def explore(
    ball: Annotated[str | None, ball_option(_BALL)] = None,
    set_: Annotated[list[str] | None, set_option(_SET)] = None,
    browser: Annotated[bool, Option(help="Open the page in a browser.")] = True,
    export: Annotated[Path | None, Option(metavar="FILE.html", help=_EXPORT)] = None,
    answers: Annotated[bool, Option(help="Include the answer key of the worksheet.")] = True,
) -> None:
    """Explore an impact on an interactive page in a browser.

    The page is one file that needs no server and no network.
    """
    from golf_impact.api import run_impact_anywhere
    from golf_impact.data.balls import BALLS
    from golf_impact.explore.page import write_page

    if export and export.suffix.lower() != ".html":
        raise UserError(f"--export {export} is refused: its name must end in .html")
    given, conditions, chosen = case_of(set_ or [], [ball] if ball else ())
    values = {**(chosen[0].values if chosen else {}), **conditions, **given}
    # Refused here, rather than on the page.
    run_impact_anywhere(**values)
    own = next((one for one in chosen if one.name not in BALLS), None)
    # Not in a temporary folder: browsers in a sandbox can't read those.
    page = write_page(export or RESULTS / "explore.html", values, own, answers).resolve()
    say(page)
    if export is None and browser:
        import webbrowser

        graphical = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        screen = graphical or sys.platform != "linux"
        if not (screen and webbrowser.open(page.as_uri())):
            warn("No browser can be opened here: open this file in one.", style="yellow")
