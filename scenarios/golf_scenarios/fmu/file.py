"""Where the FMU file is, and building it when it is missing, damaged or out of date."""

import atexit
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from types import ModuleType

from golf_build import fmi2, fmi3
from golf_scenarios.errors import UserError
from golf_scenarios.fmu.archive import odd_characters
from golf_scenarios.stopping import held

#: build/ of a checkout; anything else where golf_build is installed.
_CHECKOUT = fmi2.HERE.parent


def builder(fmi: int = 2) -> ModuleType:
    """What builds the FMU of this version of FMI."""
    return {2: fmi2, 3: fmi3}[fmi]


def _in_checkout() -> bool:
    return (_CHECKOUT / "build_fmu.py").is_file()


def default_path(build: ModuleType) -> Path:
    """build/ in a checkout; else the user's cache, under the digest of the sources."""
    if _in_checkout():
        return _CHECKOUT / f"{build.NAME}.fmu"
    import platformdirs

    cache = platformdirs.user_cache_path("golf-impact")
    if not cache.is_absolute():
        # A user without a home: it would be a folder named ~ here.
        cache = Path(tempfile.gettempdir(), "golf-impact")
    return cache / build.digest()[:16] / f"{build.NAME}.fmu"


def build_fmu(out: Path | None = None, fmi: int = 2) -> Path:
    """Build the FMU.

    Args:
        out: the file to write; where the scenarios look for it by default.
        fmi: the version of FMI, 2 or 3.

    Raises:
        UserError: the file can't be written.
    """
    build = builder(fmi)
    out = default_path(build) if out is None else out
    # Not Path.is_dir, which raises where one may not look.
    if os.path.isdir(out):
        raise UserError(f"{out} is a folder; give the name of the .fmu file to write")
    if not str(out).endswith(".fmu"):
        raise UserError(f"{out} is refused: the file's name must end in .fmu")
    try:
        with held():
            return build.build(out)
    except OSError as error:
        raise UserError(f"can't write {out}: {error.strerror or error}") from error


def current_fmu(fmi: int = 2) -> tuple[Path, str | None]:
    """The FMU of the present sources, built if need be.

    Where it can't be written to its place, it is built for this process only.

    Args:
        fmi: the version of FMI, 2 or 3.

    Returns:
        The file, and why it was built (None if it was there).
    """
    build = builder(fmi)
    path = default_path(build)
    if not os.path.exists(path):
        why = "it was missing"
    elif build.is_current(path):
        return path, None
    elif build.guid_of(path) is None:
        why = "it was damaged"
    else:
        why = "its sources have changed"
    try:
        return build_fmu(path, fmi), why
    except UserError as error:
        folder = tempfile.mkdtemp(prefix="golf-impact-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        return build_fmu(Path(folder, path.name), fmi), f"{why}; for this run only, since {error}"


def given_fmu(path: Path) -> Path:
    """An FMU that a user names, tried in a process of its own unless it is the present one.

    Raises:
        UserError: it is damaged, another FMU, or can't be run here.
    """
    from golf_scenarios.fmu.impact_fmu import ImpactFmu

    ImpactFmu(path)
    if builder().is_current(path):
        return path
    check_temporary_folder()
    # Its modules come from where ours do, never from the working folder.
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; from golf_scenarios.fmu.trial import main; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)],
        capture_output=True,
        text=True,
        errors="replace",
    )
    if done.returncode == 0:
        return path
    lines = done.stderr.strip().splitlines()
    why = lines[-1] if done.returncode > 0 and lines else "the process crashed"
    raise UserError(f"{path} can't be run here ({why}): run `golf-impact build`")


def check_temporary_folder() -> None:
    """See that an FMU can be loaded where tools extract it.

    Raises:
        UserError: pythonfmu would crash.
    """
    folder = tempfile.gettempdir()
    if odd_characters(folder):
        raise UserError(
            f"pythonfmu can't load an FMU from {folder}: set TMPDIR to a folder whose name has "
            "letters, digits, spaces and . _ ~ - only"
        )


def build_plain_fmu(script: Path, folder: Path) -> Path:
    """Package a self-contained slave as pythonfmu does, with nothing added.

    Args:
        script: the Python file with the slave.
        folder: where the .fmu goes.
    """
    from pythonfmu.builder import FmuBuilder

    path, modules = list(sys.path), set(sys.modules)
    try:
        return FmuBuilder.build_FMU(script, dest=folder)
    finally:
        sys.path[:] = path
        if script.stem not in modules:
            sys.modules.pop(script.stem, None)
