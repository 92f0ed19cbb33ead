"""`golf-impact doctor`: does the FMU load here, and what does a host that isn't Python need?

Nothing in here may fail: whatever goes wrong is a finding.
"""

import importlib.metadata
import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Generator, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

from typer import Argument

from golf_impact.commands.console import out
from golf_impact.fmu.archive import flaw, odd_characters
from golf_impact.fmu.libpython import last_line, libpython_files, preloaded
from golf_impact.stopping import temporary_folder

EPILOG = "Example: golf-impact doctor ClubBallImpact.fmu"

_TIMEOUT = 120.0

#: Packages whose version matters to the FMU and to those who drive it.
_PACKAGES = ("golf-impact", "pythonfmu", "fmpy", "numpy", "libcosimpy", "ecospy")

#: One impact in a process of its own: a crash there is a finding here.
_LOAD = """
import fmpy, json, sys
rows = fmpy.simulate_fmu(sys.argv[1], stop_time=0.005, step_size=0.001, output_interval=0.001,
                         output=["smash_factor", "coefficient_of_restitution"])
print(json.dumps([float(rows[-1][1]), float(rows[-1][2])]))
"""

#: What Python needs inside a native host: its standard library, found without its own program.
_EMBEDDED = "import ctypes, encodings, json, math, threading"

_COLOURS = {"ok": "green", "warning": "yellow", "problem": "red"}


#: Of one thing: "ok", "note", "warning" or "problem", and what was found.
Finding = tuple[str, str]

#: One at a time; what it returns is of use to what is looked at next.
_Findings = Generator[Finding, None, Any]


def examine(fmu: Path | None = None) -> Iterator[Finding]:
    """Look at the interpreter, packages, folders, an FMU and libpython, one finding at a time.

    The FMU is that of the present sources if none is given, built if need be.
    """
    yield from _guarded("interpreter", _interpreter())
    yield from _guarded("packages", _packages())
    yield from _guarded("folders", _folders(fmu))
    usable = yield from _guarded("FMU", _file(fmu))
    if usable:
        yield from _guarded("FMU", _load(usable))
    yield from _guarded("native hosts", _native(usable))


def doctor(
    fmu: Annotated[
        Path | None, Argument(metavar="[FMU]", help="The .fmu file; the built one by default.")
    ] = None,
) -> int:
    """Look whether the FMU loads on this machine, and show how hosts that aren't Python load it."""
    from rich.text import Text

    status = 0
    for level, text in examine(fmu):
        line = Text(f"{level:<8} ", _COLOURS.get(level, "")).append(text, "default")
        out.print(line, soft_wrap=True, highlight=False)
        status |= level == "problem"
    return int(status)


def _guarded(what: str, findings: _Findings) -> _Findings:
    try:
        return (yield from findings)
    except Exception as error:
        yield "warning", f"{what}: couldn't be examined: {last_line(error)}"
        return None


def _interpreter() -> _Findings:
    kind, bits = platform.python_implementation(), 64 if sys.maxsize > 2**32 else 32
    old = sys.version_info < (3, 10) or kind != "CPython"
    text = f"Python: {kind} {platform.python_version()}, {bits} bit, {sys.executable}"
    yield "problem" if old else "ok", text
    if old:
        yield "problem", "Python: the FMU needs CPython 3.10 or later"
    machine = f"{platform.system()} {platform.machine()}"
    if machine in ("Linux x86_64", "Windows AMD64"):
        yield "ok", f"platform: {machine}"
    else:
        yield "problem", f"platform: pythonfmu has no binary for {machine}"


def _packages() -> _Findings:
    versions = []
    for name in _PACKAGES:
        with suppress(importlib.metadata.PackageNotFoundError):
            versions.append(f"{name} {importlib.metadata.version(name)}")
    yield "ok", f"packages: {', '.join(versions)}"


def _folders(fmu: Path | None) -> _Findings:
    folders = {"temporary folder, where tools extract FMUs": Path(temporary_folder())}
    folders["current folder"] = Path.cwd()
    if fmu is not None:
        folders["folder of the FMU"] = fmu.absolute().parent
    for what, folder in folders.items():
        odd = odd_characters(folder)
        if odd:
            yield (
                "warning",
                f"{what}: {folder} has {' '.join(odd)} in its name: pythonfmu can't load a "
                "plain FMU that is extracted there (set TMPDIR to a folder without, e.g. "
                "TMPDIR=/tmp; a standalone FMU doesn't mind)",
            )
        else:
            yield "ok", f"{what}: {folder}"


def _file(fmu: Path | None) -> _Findings:
    """Returns the FMU if it can be read."""
    if fmu is None:
        from golf_impact.fmu.file import current_fmu

        fmu, why = current_fmu()
        if why:
            yield "note", f"FMU: built, since {why}"
    why = flaw(fmu)
    if why is not None:
        yield "problem", f"FMU: {why}"
        return None
    with zipfile.ZipFile(fmu) as archive:
        names = [name for name in archive.namelist() if name[-1] != "/"]
    platforms = sorted({name.split("/")[1] for name in names if name.startswith("binaries/")})
    yield "ok", f"FMU: {fmu}, binaries for {', '.join(platforms) or 'nothing'}"
    return fmu


def _load(fmu: Path) -> _Findings:
    command = [sys.executable, "-c", _LOAD, str(fmu)]
    done = subprocess.run(
        command, capture_output=True, text=True, errors="replace", timeout=_TIMEOUT
    )
    lines = done.stdout.strip().splitlines()
    if done.returncode == 0 and lines:
        smash, restitution = json.loads(lines[-1])
        yield "ok", f"FMU: loads and runs here (S = {smash:.6g}, COR = {restitution:.6g})"
        return
    ended = f"signal {-done.returncode}" if done.returncode < 0 else f"exit {done.returncode}"
    yield "problem", f"FMU: can't be run here ({ended}): {last_line(done.stderr)}"


def _native(fmu: Path | None) -> _Findings:
    from golf_build import standalone

    if os.name == "nt":
        folder = Path(sys.base_prefix)
        yield "ok", f"native hosts: set PATH={folder};%PATH%  (python3.dll is there)"
    elif not sys.platform.startswith("linux"):
        yield "warning", "native hosts: pythonfmu has binaries for Linux and Windows only"
    elif fmu is not None and (oldest := standalone.glibc_of(fmu)):
        # It has a Python of its own.
        here = platform.libc_ver()[1] or "0"
        enough = tuple(map(int, here.split("."))) >= oldest
        text = f"glibc {'.'.join(map(str, oldest))} or newer, and nothing of Python (here: {here})"
        level = "ok" if enough else "problem"
        yield level, f"native hosts: this FMU needs {text}"
    else:
        try:
            standalone.compiler()
            standalone.libpython()
        except standalone.StandaloneError as error:
            why = f"no FMU that needs no Python can be built: {error}"
            yield "note", f"native hosts: {why}"
        else:
            yield (
                "ok",
                "native hosts: recommended is the standalone FMU (golf-impact build --standalone), "
                "which needs no Python; this plain one needs libpython, by LD_PRELOAD",
            )
        yield from _with_libpython(fmu)


def _with_libpython(fmu: Path | None) -> _Findings:
    for file in libpython_files():
        if " " in str(file) or ":" in str(file):
            yield "warning", f"libpython: {file}: LD_PRELOAD can't take spaces or colons"
        elif wrong := preloaded(file, fmu):
            yield "warning", f"libpython: {file} doesn't serve: {wrong}"
        else:
            yield "ok", f"libpython: {file}"
            yield "ok", f"native hosts: {_native_line(file)}"
            yield (
                "note",
                "native hosts: or let a host of your own call "
                f'dlopen("{file}", RTLD_NOW | RTLD_GLOBAL) before it loads the FMU',
            )
            return
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    yield (
        "warning",
        f"libpython: none found for Python {version}; hosts written in Python don't need it, "
        f"others do (Debian, Ubuntu: apt-get install libpython{version}; pyenv: "
        "PYTHON_CONFIGURE_OPTS=--enable-shared pyenv install; conda has it)",
    )


def _native_line(libpython: Path) -> str:
    """The command line that starts a native host with this library.

    PYTHONHOME is in it if a Python without a program of its own misses its standard library here:
    a host of another name and a PATH without Python is what Python finds inside a native host.
    """
    parts = [f"LD_PRELOAD={shlex.quote(str(libpython))}"]
    program = getattr(sys, "_base_executable", None) or sys.executable
    command = ["native-host", "-c", _EMBEDDED]
    with tempfile.TemporaryDirectory(prefix="golf-impact-doctor-") as empty:
        place: dict[str, Any] = {"executable": program, "env": {"PATH": empty}, "cwd": empty}
        if subprocess.run(command, **place, capture_output=True, timeout=_TIMEOUT).returncode:
            parts.append(f"PYTHONHOME={shlex.quote(sys.base_prefix)}")
    return " ".join([*parts, "your-host"])
