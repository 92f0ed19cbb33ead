"""The scenario scripts: found by being there, loaded by their path."""

import importlib.util
import traceback
from pathlib import Path
from types import ModuleType

from golf_impact.errors import UserError

_ROOM = Path(__file__).resolve().parents[1]

#: Where they lie: beside golf_impact in a checkout, inside it where it is installed.
FOLDER = _ROOM / "scripts" if (_ROOM / "scripts").is_dir() else _ROOM.parent


def names() -> list[str]:
    """The names of our scenarios."""
    return sorted(path.stem for path in FOLDER.glob("*.py"))


def scenarios() -> dict[str, ModuleType]:
    """Our scenarios by name, as their chapters follow each other."""
    loaded = {name: scenario(name) for name in names()}
    last = float("inf")
    return dict(sorted(loaded.items(), key=lambda item: getattr(item[1], "CHAPTER", last)))


def scenario(given: str) -> ModuleType:
    """The module of a scenario: it has TITLE and `run(fmu)`.

    Args:
        given: the name of one of ours, or the path of a script.

    Raises:
        UserError: there is none, or it is no scenario.
    """
    if not given.endswith(".py") and given not in names():
        raise UserError(
            f"there is no scenario {given!r}: choose from {', '.join(names())}, or give the path "
            "of a script (.py)"
        )
    path = Path(given) if given.endswith(".py") else FOLDER / f"{given}.py"
    spec = importlib.util.spec_from_file_location(f"golf_scenario_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        missing = isinstance(error, FileNotFoundError) and error.filename == str(path)
        raise UserError(f"there is no script {path}" if missing else wrong(path, error)) from error
    if not isinstance(getattr(module, "TITLE", None), str):
        raise UserError(f'{path} is no scenario: give it a line TITLE = "..."')
    if not callable(getattr(module, "run", None)):
        raise UserError(f"{path} is no scenario: give it a function run(fmu) that gives a Report")
    return module


def wrong(path: Path, error: BaseException) -> str:
    """What is wrong with a script, in one line, with the line of the script that it comes from."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(path)]
    line = error.lineno if isinstance(error, SyntaxError) else (lines or [None])[-1]
    where = f", line {line}" if line else ""
    return f"{path}{where} can't be run: {type(error).__name__}: {error}"
