"""Finds the scenario scripts, loads them by path and runs them."""

import ast
import inspect
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from golf_build.sources import CHECKOUT
from golf_impact.data.errors import UnavailableError, UserError, unknown_name
from golf_impact.report.results import Result, plotting

#: Their folder: in a checkout beside golf_impact, inside it where it is installed.
FOLDER = CHECKOUT / "scenarios" if CHECKOUT else Path(__file__).resolve().parents[1] / "scripts"

#: The scenarios of the report, in its order.
SCENARIOS = (
    "baseline", "stiffness", "club_speed", "laws", "changing_ball", "finite_difference",
    "validation", "speed_dependence", "rating", "shaft", "loft", "system",
)  # fmt: skip

#: With those that take longer, and are run by name only.
ALL = (*SCENARIOS, "run_time_vs_error", "stability")


def path_of(name_or_path: str) -> Path:
    """The script of a scenario by its name, or of a path; UserError if there is none."""
    path = Path(name_or_path)
    if path.suffix != ".py":
        if "=" in name_or_path:
            raise UserError(f"{name_or_path} isn't a scenario: write --set {name_or_path}")
        if name_or_path not in ALL:
            raise unknown_name("scenario", name_or_path, ALL, ", or give a .py file")
        path = FOLDER / f"{name_or_path}.py"
    if not path.is_file():
        raise UserError(f"there is no script {path}")
    return path


def title_of(path: Path) -> str:
    """The first line of a script's docstring."""
    text = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or path.stem
    return text.partition("\n")[0].rstrip(".")


def load(path: Path) -> Any:
    """The function `run` of a script.

    Raises:
        UserError: the script can't be loaded, or isn't a scenario.
    """
    module = ModuleType(f"golf_scenario_{path.stem}")
    module.__file__ = str(path)
    with _located(path):
        # As `python FILE` does, without bytecode in the user's folder.
        exec(compile(path.read_bytes(), path, "exec"), vars(module))
    run: Any = getattr(module, "run", None)
    if not callable(run) or next(iter(inspect.signature(run).parameters), "") != "impact":
        raise UserError(
            f"{path} is not a scenario: it needs a function run(impact) that returns a "
            "Result; see scenarios/README.md, “A scenario of your own”"
        )
    return run


def run_script(path: Path, impact: Any, **options: Any) -> Result:
    """Run a script with an open `Impact`; errors in it become UserErrors with their position."""
    with plotting():
        run = load(path)
        with _located(path):
            result = run(impact, **options)
    if not isinstance(result, Result):
        raise UserError(f"{path}: run(impact) returns {result!r}; it must return its Result")
    if fault := next(result.faults(), ""):
        raise UserError(f"{path}: {fault}")
    return result


@contextmanager
def _located(path: Path) -> Iterator[None]:
    """Errors in a script become UserErrors in one line, with the position in it."""
    try:
        yield
    except (Exception, SystemExit) as error:
        # One of ours is left out then; a user's doesn't go missing among others.
        if isinstance(error, UnavailableError) and path.parent == FOLDER:
            raise
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if frame.filename == str(path)]
        line = error.lineno if isinstance(error, SyntaxError) else (lines or [None])[-1]
        where = f"{path}, line {line}" if line else str(path)
        if not isinstance(error, UserError):
            where += f" can't be run: {type(error).__name__}"
        raise UserError(f"{where}: {error}") from error
