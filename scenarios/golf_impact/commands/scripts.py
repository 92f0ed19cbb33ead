"""Finds scenario scripts in their folder, loads them by path and runs them."""

import math
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from golf_impact.errors import UserError, unknown_name

if TYPE_CHECKING:
    from golf_impact.fmu.impact_fmu import ImpactFmu
    from golf_impact.report.report import Report

_PACKAGE = Path(__file__).resolve().parents[1]

#: Their folder: beside golf_impact in a checkout, inside it where it is installed.
FOLDER = _PACKAGE / "scripts" if (_PACKAGE / "scripts").is_dir() else _PACKAGE.parent


def list_names() -> list[str]:
    """The names of the scenarios that come with the package."""
    return sorted(path.stem for path in FOLDER.glob("*.py"))


def load_scenarios() -> dict[str, ModuleType]:
    """Load these scenarios, in the order of their chapters; by name."""
    loaded = {name: load_scenario(name) for name in list_names()}
    return dict(sorted(loaded.items(), key=lambda one: getattr(one[1], "CHAPTER", math.inf)))


def load_scenario(name_or_path: str) -> ModuleType:
    """Load a scenario by name or path: a module with TITLE and `run(fmu)`.

    UserError: there is no such scenario, or it can't be loaded.
    """
    path = Path(name_or_path)
    if path.suffix != ".py":
        if name_or_path not in list_names():
            raise unknown_name("scenario", name_or_path, list_names(), ", or give a .py file")
        path = FOLDER / f"{name_or_path}.py"
    if not path.is_file():
        raise UserError(f"there is no script {path}")
    loader = SourceFileLoader(f"golf_scenario_{path.stem}", str(path))
    module = ModuleType(loader.name)
    module.__file__ = loader.path
    with _located(path):
        loader.exec_module(module)
    title, run = getattr(module, "TITLE", None), getattr(module, "run", None)
    if not (isinstance(title, str) and callable(run)):
        raise UserError(
            f'{path} is not a scenario: it needs a line TITLE = "..." and a function run(fmu) that '
            "returns a Report"
        )
    return module


def run_scenario(script: ModuleType, fmu: "ImpactFmu") -> "Report":
    """The report of a scenario; UserError for errors in its script, with their position."""
    from golf_impact.report.report import Report

    path = Path(str(script.__file__))
    with _located(path):
        report = script.run(fmu)
    if not isinstance(report, Report):
        raise UserError(f"{path}: run(fmu) returns {report!r}; it must return its Report")
    return report


@contextmanager
def _located(path: Path) -> Iterator[None]:
    """Errors in a script become UserErrors in one line, with the position in it."""
    try:
        yield
    except (Exception, SystemExit) as error:
        frames = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in frames if frame.filename == str(path)]
        line = error.lineno if isinstance(error, SyntaxError) else (lines or [None])[-1]
        where = f"{path}, line {line}" if line else str(path)
        if not isinstance(error, UserError):
            where += f" can't be run: {type(error).__name__}"
        raise UserError(f"{where}: {error}") from error
