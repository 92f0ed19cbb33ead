"""Where the FMU file is, and building it when it is missing, damaged or out of date."""

import atexit
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from golf_build import fmi2, fmi3, packaging
from golf_build import standalone as alone
from golf_impact.errors import UserError
from golf_impact.fmu.archive import check_temporary_folder
from golf_impact.stopping import held

#: build/ of a checkout; anything else where golf_build is installed.
_CHECKOUT = packaging.HERE.parent

#: What builds the FMU, by the version of FMI.
BUILDERS = {2: fmi2.BUILDER, 3: fmi3.BUILDER}

#: One impact in a process of its own, which an FMU that isn't ours, or has been damaged, may take
#: down. Its modules come from where ours do, never from the working folder.
_TRIAL = """
import sys; sys.path[:] = {path!r}
from pathlib import Path
from golf_impact.fmu.impact_fmu import ImpactFmu, UserError
try:
    with ImpactFmu(Path(sys.argv[1])) as fmu:
        fmu.trajectory(points=3)
except UserError as error:
    sys.exit(str(error))
"""


def default_path(builder: packaging.Builder, standalone: bool = False) -> Path:
    """build/ in a checkout; else the user's cache, under the digest of the sources."""
    name = f"{builder.name}{alone.SUFFIX if standalone else ''}.fmu"
    if (_CHECKOUT / "build_fmu.py").is_file():
        return _CHECKOUT / name
    import platformdirs

    cache = platformdirs.user_cache_path("golf-impact")
    if not cache.is_absolute():
        # A user without a home: it would be a folder named ~ here.
        cache = Path(tempfile.gettempdir(), "golf-impact")
    return cache / builder.digest()[:16] / name


def build_fmu(out: Path | None = None, fmi: int = 2, standalone: bool = False) -> Path:
    """Build the FMU.

    Args:
        out: the file to write; where the scenarios look for it by default.
        fmi: the version of FMI, 2 or 3.
        standalone: whether it brings a Python of its own.

    Raises:
        UserError: the file can't be written, or this machine can't build a standalone one.
    """
    out = default_path(BUILDERS[fmi], standalone) if out is None else out
    # Not Path.is_dir, which raises where one may not look.
    if os.path.isdir(out):
        raise UserError(f"{out} is a folder; give the name of the .fmu file to write")
    if not str(out).endswith(".fmu"):
        raise UserError(f"{out} is refused: the file's name must end in .fmu")
    with building(str(out)):
        if not standalone:
            return BUILDERS[fmi].build(out)
        return alone.build(BUILDERS[fmi], out)


@contextmanager
def building(where: str) -> Iterator[None]:
    """What can't be built or written within this block is a UserError; signals are held back."""
    try:
        with held():
            yield
    except alone.StandaloneError as error:
        raise UserError(str(error)) from error
    except OSError as error:
        raise UserError(f"can't write {where}: {error.strerror or error}") from error


def current_fmu(fmi: int = 2) -> tuple[Path, str | None]:
    """The FMU of the present sources, and why it was built, or None if it was there.

    Where it can't be written to its place, it is built for this process only.
    """
    builder = BUILDERS[fmi]
    path = default_path(builder)
    if builder.is_current(path):
        return path, None
    if not os.path.exists(path):
        why = "it was missing"
    else:
        damaged = packaging.guid_of(path) is None
        why = "it was damaged" if damaged else "its sources have changed"
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
    from golf_impact.fmu.impact_fmu import ImpactFmu

    ImpactFmu(path)
    if BUILDERS[2].is_current(path):
        return path
    check_temporary_folder()
    command = [sys.executable, "-c", _TRIAL.format(path=sys.path), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    if done.returncode == 0:
        return path
    lines = done.stderr.strip().splitlines()
    why = lines[-1] if done.returncode > 0 and lines else "the process crashed"
    raise UserError(f"{path} can't be run here ({why}): run `golf-impact build`")


def build_plain_fmu(script: Path, folder: Path) -> Path:
    """Package a self-contained slave as pythonfmu does, with nothing added."""
    with packaging.packaged(2, script.stem, script.read_bytes(), {}) as fmu:
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(fmu, folder))
