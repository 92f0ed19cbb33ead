"""The path of the FMU file, and building it if it is missing, damaged or out of date."""

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
from golf_build.archive import write_archive
from golf_impact.errors import UserError
from golf_impact.fmu.archive import check_temporary_folder
from golf_impact.stopping import held

#: build/ in a checkout; has no build_fmu.py where golf_build is installed.
_CHECKOUT = packaging.HERE.parent

#: The builders of the FMU by version of FMI.
BUILDERS = {2: fmi2.BUILDER, 3: fmi3.BUILDER}

#: Runs an impact in a separate process, which a foreign or damaged FMU may crash. Modules are
#: imported from the same folders as here, never from the working folder.
_TRIAL = """
import sys; sys.path[:] = {path!r}
from pathlib import Path
from golf_impact.fmu.impact_fmu import ImpactFmu
with ImpactFmu(Path(sys.argv[1])) as fmu:
    fmu.trajectory(points=3)
"""


def default_path(builder: packaging.Builder, standalone: bool = False) -> Path:
    """In build/ of a checkout; else in the user's cache, below the digest of the sources."""
    name = f"{builder.name}{alone.SUFFIX if standalone else ''}.fmu"
    if (_CHECKOUT / "build_fmu.py").is_file():
        return _CHECKOUT / name
    import platformdirs

    cache = platformdirs.user_cache_path("golf-impact")
    if not cache.is_absolute():
        # Without a home folder it would be a folder named ~ in the working folder.
        cache = Path(tempfile.gettempdir(), "golf-impact")
    return cache / builder.digest()[:16] / name


def build_fmu(
    out: Path | None = None,
    fmi: int = 2,
    standalone: bool = False,
    pythons: alone.Pythons = None,
) -> Path:
    """Build the FMU for FMI 2 or 3, by default at `default_path`.

    UserError: the file can't be written, or this machine can't build a standalone one.
    """
    out = default_path(BUILDERS[fmi], standalone) if out is None else out
    if not str(out).endswith(".fmu"):
        raise UserError(f"{out} is refused: the file's name must end in .fmu")
    with building(str(out)):
        files = BUILDERS[fmi].files()
        return write_archive(out, alone.standalone(files, pythons) if standalone else files)


@contextmanager
def building(where: str) -> Iterator[None]:
    """Turn errors of building and writing into UserErrors; signals are held back meanwhile."""
    try:
        with held():
            yield
    except alone.StandaloneError as error:
        raise UserError(str(error)) from error
    except OSError as error:
        raise UserError(f"can't write {where}: {error.strerror or error}") from error


def current_fmu(fmi: int = 2) -> tuple[Path, str | None]:
    """The FMU of the current sources, and why it was built; None if it existed.

    If it can't be written to its default path, it is built for this process only.
    """
    builder = BUILDERS[fmi]
    path = default_path(builder)
    if builder.is_current(path):
        return path, None
    why = "its sources have changed"
    if packaging.guid_of(path) is None:
        why = "it was damaged" if os.path.exists(path) else "it was missing"
    try:
        return build_fmu(path, fmi), why
    except UserError as error:
        folder = tempfile.mkdtemp(prefix="golf-impact-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        return build_fmu(Path(folder, path.name), fmi), f"{why}; for this run only, since {error}"


def check_fmu(path: Path) -> Path:
    """Check an FMU that a user names; unless it is that of the current sources, by running it.

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
    # Of a traceback the message of the error.
    message = done.stderr.strip().rpartition("\n")[2].partition(": ")[2]
    why = message if done.returncode > 0 and message else "the process crashed"
    raise UserError(f"{path} can't be run here ({why}): run `golf-impact build`")


def build_plain_fmu(script: Path, folder: Path) -> Path:
    """Package a self-contained slave with pythonfmu, without additions."""
    with packaging.packaged(2, script.stem, script.read_bytes(), {}) as fmu:
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(fmu, folder))
