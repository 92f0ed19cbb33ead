"""What `golf-impact doctor` finds: does an FMU load here, and what do hosts need for it?"""

import importlib.metadata
import os
import platform
import shlex
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from pathlib import Path

from golf_build.archive import scratch, unpack
from golf_build.native import binaries_of, this_machine
from golf_impact.data.errors import UserError, first_line
from golf_impact.fmu import current_fmu
from golf_impact.fmu.file import TOLERANCE, check_temporary_folder, read_fmu, run_here

Finding = tuple[str, str]


def examine(path: Path | None) -> Iterator[Finding]:
    """Level (ok, warning, problem) and text of each finding about this Python and a file.

    Args:
        path: an .fmu or .ssp file; None: the FMU of the current sources.
    """
    names = ("golf-impact", "fmpy", "pythonfmu")
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)
    machine = this_machine()
    yield "ok", f"Python {platform.python_version()} ({sys.executable}), {versions}, {machine}"
    try:
        check_temporary_folder()
        path = path or current_fmu()
        yield from (_examine_ssp if path.suffix == ".ssp" else _examine_fmu)(path, str(path))
    except UserError as error:
        yield "problem", str(error)


def _examine_ssp(path: Path, name: str) -> Iterator[Finding]:
    try:
        fmus = {one: data for one, data in unpack(path).items() if one.endswith(".fmu")}
    except Exception as error:  # zipfile raises many types for damaged files
        why = getattr(error, "strerror", None) or first_line(error)
        hint = "run `golf-impact build --system`"
        raise UserError(f"{name} is not a readable SSP ({why}): {hint}") from error
    yield "ok", f"SSP: {name} has {len(fmus)} FMUs"
    with scratch({f"{n}.fmu": data for n, data in enumerate(fmus.values())}) as folder:
        for n, one in enumerate(fmus):
            yield from _examine_fmu(folder / f"{n}.fmu", one)


def _examine_fmu(path: Path, name: str) -> Iterator[Finding]:
    files, _ = read_fmu(path)
    outputs, deviations = run_here(path)
    results = ", ".join(f"{output} = {value:.6g}" for output, value in outputs.items())
    yield "ok", f"FMU: {name} loads and runs here ({results})"
    if deviations:
        worst = max(deviations.values())
        text = f"{len(deviations)} reference results in it, relative deviation {worst:.1e} at most"
        yield "ok" if worst <= TOLERANCE else "problem", f"FMU: {text}"
    yield "ok", f"FMU: it has binaries for {', '.join(sorted(binaries_of(files)))}"
    yield _native_hosts(files)


def _native_hosts(files: Iterable[str]) -> Finding:
    """What hosts that aren't Python need for an FMU with these files."""
    if not any(name.startswith("resources/") and name.endswith(".py") for name in files):
        return "ok", "native hosts: this FMU needs nothing of Python"
    if sys.platform == "win32":
        return "ok", f"native hosts: set PATH={sys.base_prefix};%PATH%  (python3.dll is there)"
    if library := find_libpython():
        home = shlex.quote(sys.base_prefix)
        return "ok", f"native hosts: LD_PRELOAD={shlex.quote(library)} PYTHONHOME={home} your-host"
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    return "warning", (
        f"native hosts need libpython{version}, which isn't beside this Python; hosts written in "
        f"Python don't (Debian, Ubuntu: apt-get install libpython{version}; conda has it)"
    )


def find_libpython() -> str | None:
    """The shared library of this Python, which a native host needs for a pythonfmu FMU, or None."""
    folder, name, triplet = map(sysconfig.get_config_var, ("LIBDIR", "INSTSONAME", "MULTIARCH"))
    places = (os.path.join(folder or "", more, name or "") for more in ("", triplet or ""))
    return next((place for place in places if ".so" in place and os.path.isfile(place)), None)
