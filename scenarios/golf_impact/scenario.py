"""The interface of scenario scripts.

A scenario is a file with a function `run(impact)` that returns a `Result`: `impact` is an open
`golf_impact.Impact`. `golf-impact run FILE` runs it, or `python FILE` if it ends with `main(run)`.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from golf_impact.report.results import Result

__all__ = ["Result", "main"]


def main(run: Callable[..., Any]) -> NoReturn:
    """Run the script of this function with the options of `golf-impact run`, and exit."""
    from golf_impact.commands.app import main as command

    command(["run", str(Path(run.__code__.co_filename).resolve()), *sys.argv[1:]])
