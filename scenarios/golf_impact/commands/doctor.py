"""`golf-impact doctor`: whether the FMU loads here, and what hosts without Python need."""

import importlib.metadata
import platform
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from typer import Argument

from golf_build import elf, standalone
from golf_build.archive import unpack
from golf_build.toolchain import VERSION, this_machine
from golf_impact.commands.console import out, say
from golf_impact.errors import UserError
from golf_impact.fmu.archive import check_temporary_folder, find_flaw
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.libpython import find_libpython_for

EPILOG = "Example: golf-impact doctor ClubBallImpact.fmu"

#: One impact, and the reference results in the file, in a process of its own: a crash there is a
#: finding here.
_LOAD = """
import sys; sys.path[:] = {path!r}
from pathlib import Path
from golf_impact.fmu.reference import deviations, loaded
path = Path(sys.argv[1])
with loaded(path) as fmu:
    fmu.start()
    fmu.step(0.0, 0.005)
    metrics = [n for n in ("smash_factor", "coefficient_of_restitution") if n in fmu.variables]
    results = ", ".join(f"{{name}} = {{value:.6g}}" for name, value in fmu.read(metrics).items())
found = deviations(path).values()
print(results or "a step of 5 ms", len(found), max(found, default=0.0), sep=";")
"""

#: Of the relative deviation. Measured: 5.3e-16; another C library may have other last digits.
_TOLERANCE = 1e-12

_STANDALONE = (
    "recommended is the standalone FMU (golf-impact build --standalone), which needs no Python; "
    "this plain one needs libpython, by LD_PRELOAD"
)
_NO_LIBPYTHON = (
    f"none for Python {VERSION} that loads this FMU; hosts written in Python don't need it, "
    f"others do (Debian, Ubuntu: apt-get install libpython{VERSION}; pyenv: "
    "PYTHON_CONFIGURE_OPTS=--enable-shared pyenv install; conda has it)"
)
_COLOURS = {"ok": "green", "warning": "yellow", "problem": "red"}


def doctor(fmu: Annotated[Path | None, Argument(metavar="FMU", hidden=True)] = None) -> int:
    """Check whether the FMU loads here, and how native hosts load it.

    FMU is an .fmu file; by default the built one.
    """
    levels = set()
    for level, text in examine(fmu):
        out.print(f"{level:<8}", style=_COLOURS[level], end=" ")
        say(text)
        levels.add(level)
    return int("problem" in levels)


def examine(fmu: Path | None = None) -> Iterator[tuple[str, str]]:
    """Level and text of each finding about this Python, an FMU and native hosts, as `doctor`."""
    names = ("golf-impact", "fmpy", "pythonfmu")
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)
    machine = this_machine()
    yield "ok", f"Python {platform.python_version()} ({sys.executable}), {versions}, {machine}"
    try:
        check_temporary_folder()
    except UserError as error:
        yield "warning", f"temporary folder: {error}; a standalone FMU can be loaded there"
    fmu = fmu or current_fmu()[0]
    if why := find_flaw(fmu):
        yield "problem", f"FMU: {why}"
        return
    binaries = standalone.binaries_of(unpack(fmu))
    command = [sys.executable, "-c", _LOAD.format(path=sys.path), str(fmu)]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    if code := done.returncode:
        ended = f"signal {-code}" if code < 0 else f"exit {code}"
        why = (done.stderr.strip() or "no message").splitlines()[-1]
        yield "problem", f"FMU: {fmu} can't be run here ({ended}): {why}"
    else:
        results, cases, worst = done.stdout.splitlines()[-1].split(";")
        yield "ok", f"FMU: {fmu} loads and runs here ({results})"
        if int(cases):
            text = f"{cases} reference results in it, relative deviation {float(worst):.1e} at most"
            yield "ok" if float(worst) <= _TOLERANCE else "problem", f"FMU: {text}"
    yield "ok", f"FMU: it has binaries for {', '.join(sorted(binaries))}"
    alone = any(name.startswith("golf-python-") for name in binaries[machine])
    if sys.platform == "win32":
        path = f"set PATH={sys.base_prefix};%PATH%  (python3.dll is there)"
        yield "ok", f"native hosts: {'this FMU needs nothing of Python' if alone else path}"
    elif alone:
        oldest = max(map(elf.glibc, binaries[machine].values()))
        here = platform.libc_ver()[1] or "0"
        enough = tuple(map(int, here.split("."))) >= oldest
        text = f"glibc {'.'.join(map(str, oldest))} or newer, and nothing of Python (here: {here})"
        yield "ok" if enough else "problem", f"native hosts: this FMU needs {text}"
    else:
        yield "ok", f"native hosts: {_STANDALONE}"
        if file := find_libpython_for(fmu):
            home = shlex.quote(sys.base_prefix)
            preload = f"LD_PRELOAD={shlex.quote(str(file))} PYTHONHOME={home}"
            yield "ok", f"native hosts: {preload} your-host"
        else:
            yield "warning", f"libpython: {_NO_LIBPYTHON}"
