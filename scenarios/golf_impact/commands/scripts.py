"""Finds scenario scripts in their folder, and loads them by path."""

import importlib.util
import traceback
from pathlib import Path
from types import ModuleType

from golf_impact.errors import UserError

_PACKAGE = Path(__file__).resolve().parents[1]

#: Their folder: beside golf_impact in a checkout, inside it where it is installed.
FOLDER = _PACKAGE / "scripts" if (_PACKAGE / "scripts").is_dir() else _PACKAGE.parent


def list_names() -> list[str]:
    """The names of the scenarios that come with the package."""
    return sorted(path.stem for path in FOLDER.glob("*.py"))


def load_scenarios() -> dict[str, ModuleType]:
    """Load these scenarios, in the order of their chapters; by name."""
    loaded = {name: load_scenario(name) for name in list_names()}
    last = float("inf")
    return dict(sorted(loaded.items(), key=lambda item: getattr(item[1], "CHAPTER", last)))


def load_scenario(name_or_path: str) -> ModuleType:
    """Load a scenario by name or path: a module with TITLE and `run(fmu)`.

    UserError: there is no such scenario, or it can't be loaded.
    """
    is_path = name_or_path.endswith(".py")
    if not is_path and name_or_path not in list_names():
        raise UserError(
            f"there is no scenario {name_or_path!r}: choose from {', '.join(list_names())}, "
            "or give the path of a .py file"
        )
    path = Path(name_or_path) if is_path else FOLDER / f"{name_or_path}.py"
    spec = importlib.util.spec_from_file_location(f"golf_scenario_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        missing = isinstance(error, FileNotFoundError) and error.filename == str(path)
        raise UserError(
            f"there is no script {path}" if missing else describe_error(path, error)
        ) from error
    if not isinstance(getattr(module, "TITLE", None), str):
        raise UserError(f'{path} is not a scenario: it needs a line TITLE = "..."')
    if not callable(getattr(module, "run", None)):
        raise UserError(
            f"{path} is not a scenario: it needs a function run(fmu) that returns a Report"
        )
    return module


def describe_error(path: Path, error: BaseException) -> str:
    """A message about an error in a script, in one line, with the position in the script."""
    return f"{locate_error(path, error)} can't be run: {type(error).__name__}: {error}"


def locate_error(path: Path, error: BaseException) -> str:
    """The script and its line from which an error was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(path)]
    line = error.lineno if isinstance(error, SyntaxError) else (lines or [None])[-1]
    return f"{path}, line {line}" if line else str(path)
