from pathlib import Path
from typing import Annotated

from typer import Argument

from golf_impact.commands.console import out, say

EPILOG = "Example: golf-impact doctor ClubBallImpact.fmu"

_COLOURS = {"ok": "green", "warning": "yellow", "problem": "red"}


def doctor(fmus: Annotated[list[Path] | None, Argument(metavar="FMU", hidden=True)] = None) -> int:
    """Check whether FMUs load here, and how native hosts load them.

    FMU is an .fmu file, or an .ssp file with several, repeatable; by default the built one. Exit
    code 1: there is a problem.
    """
    from golf_impact.fmu.doctor import examine

    levels = set()
    chosen: list[Path | None] = [*fmus] if fmus else [None]
    for fmu in chosen:
        for level, text in examine(fmu):
            out.print(f"{level:<8}", style=_COLOURS[level], end=" ")
            say(text)
            levels.add(level)
    return int("problem" in levels)
