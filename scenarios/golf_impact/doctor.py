"""Whether an FMU loads and runs here, and what hosts that aren't Python need for it."""

import importlib.metadata
import json
import os
import platform
import re
import shlex
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path

import fmpy

from golf_build.archive import SUMS, checksums, unpack
from golf_build.fmi2 import BUILDER
from golf_build.native import binaries_of, this_machine
from golf_build.packaging import guid_in
from golf_impact.errors import UserError, first_line
from golf_impact.runs import FLAGS, METRICS, PATH

#: One step, and the reference results in the file. Prints the outputs, and the largest relative
#: deviation by case, as JSON.
_LOAD = r"""
import sys, json, pathlib, tempfile, zipfile, fmpy
from fmpy.util import read_csv
path, deviations = sys.argv[1], {}
variables = fmpy.read_model_description(path).modelVariables
outputs = [v.name for v in variables if v.causality == "output"]
names = [n for n in ("smash_factor", "coefficient_of_restitution") if n in outputs] or outputs[:1]
end = fmpy.simulate_fmu(path, stop_time=5e-3, output_interval=5e-3, output=names)[-1]
with tempfile.TemporaryDirectory() as folder:
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder, [n for n in archive.namelist() if n.startswith("extra/")])
    for file in pathlib.Path(folder).rglob("*_ref.csv"):
        case, expected = str(file).removesuffix("_ref.csv"), read_csv(file)
        start, inputs = pathlib.Path(f"{case}_start.csv"), pathlib.Path(f"{case}_in.csv")
        values = start.read_text().split()[1:] if start.exists() else []
        found = fmpy.simulate_fmu(
            path, start_values=dict(value.split(",") for value in values),
            input=read_csv(inputs) if inputs.exists() else None,
            output=expected.dtype.names[1:], output_interval=expected["time"][1],
            stop_time=expected["time"][-1],
        )
        errors = (
            abs(found[name] - expected[name]).max() / abs(expected[name]).max()
            for name in expected.dtype.names[1:]
        )
        deviations[pathlib.Path(case).name.partition("_")[2]] = float(max(errors))
print(json.dumps([{name: float(end[name]) for name in names}, deviations]))
"""

#: Of the relative deviation. Measured: 5.3e-16; another C library may have other last digits.
_TOLERANCE = 1e-12

Finding = tuple[str, str]


def read_fmu(path: Path) -> tuple[dict[str, bytes], bool]:
    """The files of an FMU that can be run here, and whether its binaries were compiled anew.

    A file that has a list of its members with their digests must have these members and no others,
    except binaries that an importer has compiled from the sources in it.

    Raises:
        UserError: it is missing, damaged, no FMU, or has no binary for this machine.
    """
    # Not Path.is_file, which raises without permission to read.
    if not os.path.isfile(path):
        raise UserError(f"there is no FMU file at {path}: run `golf-impact build`")
    try:
        files = unpack(path)  # which checks sizes and CRCs
        files = {name: data for name, data in files.items() if not name.endswith("/")}
        listed = files.get(SUMS)
        there = checksums({name: files[name] for name in files if name != SUMS})
        changed = set(there.splitlines()) ^ set((there if listed is None else listed).splitlines())
        compiled = bool(changed) and "sources/all.c" in files
        if changed and not (compiled and all(b"  binaries/" in line for line in changed)):
            raise ValueError("it has been changed since it was built")
        if "SystemStructure.ssd" not in files:
            if "modelDescription.xml" not in files:
                raise ValueError("modelDescription.xml is missing")
            fmpy.read_model_description(str(path))
    except Exception as error:  # zipfile, XML and fmpy raise many types for damaged files
        text = f"{path} is not a readable FMU ({first_line(error)}): run `golf-impact build`"
        raise UserError(text) from error
    if "SystemStructure.ssd" in files:
        raise UserError(f"{path} is an SSP, not an FMU: its FMUs are in its folder resources/")
    machine, machines = this_machine(), binaries_of(files)
    if machine not in machines:
        others = " and ".join(sorted(machines)) or "none"
        raise UserError(
            f"{path} has no binary for this machine, {machine}, but for {others}: use it there"
        )
    return files, compiled


def check_fmu(path: Path) -> Path:
    """Check a file that a user names: it must be a ClubBallImpact.fmu that runs here.

    Raises:
        UserError: it is missing, damaged, another FMU, or can't be run here.
    """
    read_fmu(path)
    about = fmpy.read_model_description(str(path))
    known = {variable.name for variable in about.modelVariables}
    if missing := [name for name in (*METRICS, *PATH, *FLAGS) if name not in known]:
        raise UserError(f"{path} is another FMU ({about.modelName}): it lacks {missing[0]}")
    if about.fmiVersion != "2.0" or about.coSimulation is None:
        why = "is not an FMI 2.0 co-simulation FMU"
        raise UserError(f"{path} {why}: run `golf-impact build`")
    if guid_in(path) != BUILDER.guid():
        try:
            run_here(path)
        except UserError as error:
            raise UserError(f"{error}: run `golf-impact build`") from error
    return path


def run_here(fmu: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Run an FMU in a process of its own, which it may crash.

    Modules are imported from the same folders as here, never from the working folder; what the
    process leaves behind is removed.

    Returns:
        Outputs after a step of 5 ms by name (SI units); the largest deviation from the reference
        results in the file by case, relative to the largest value of the output.

    Raises:
        UserError: it can't be run here.
    """
    program = f"import sys; sys.path[:] = {sys.path!r}\n{_LOAD}"
    with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
        done = subprocess.run(
            [sys.executable, "-c", program, str(fmu)],
            capture_output=True,
            text=True,
            errors="replace",
            env={**os.environ, "TMPDIR": folder, "TEMP": folder, "TMP": folder},
        )
    if code := done.returncode:
        ended = f"signal {-code}" if code < 0 else f"exit {code}"
        why = (done.stderr.strip() or "no message").splitlines()[-1]
        raise UserError(f"{fmu} can't be run here ({ended}: {why})")
    outputs, deviations = json.loads(done.stdout.splitlines()[-1])
    return outputs, deviations


def check_temporary_folder() -> None:
    """UserError if pythonfmu would crash in the temporary folder.

    Of the URI of the resources pythonfmu 0.7 decodes %20 only.
    """
    folder = tempfile.gettempdir()
    if re.sub(r"[A-Za-z0-9/._~ \\:-]", "", folder):
        raise UserError(
            f"pythonfmu can't load an FMU from {folder}: set TMPDIR to a folder whose name has "
            "letters, digits, spaces and . _ ~ - only"
        )


def examine(path: Path | None, current_fmu: Callable[[], Path]) -> Iterator[Finding]:
    """Level (ok, warning, problem) and text of each finding about this Python and a file.

    Args:
        path: an .fmu or .ssp file, if it isn't the FMU of the current sources.
        current_fmu: builds that.
    """
    names = ("golf-impact", "fmpy", "pythonfmu")
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)
    machine = this_machine()
    yield "ok", f"Python {platform.python_version()} ({sys.executable}), {versions}, {machine}"
    try:
        check_temporary_folder()
        yield from _examine_file(path or current_fmu())
    except UserError as error:
        yield "problem", str(error)


def _examine_file(path: Path, shown: str = "") -> Iterator[Finding]:
    with suppress(OSError, zipfile.BadZipFile), zipfile.ZipFile(path) as archive:
        inside = [name for name in archive.namelist() if name.endswith(".fmu")]
        if "SystemStructure.ssd" in archive.namelist() and archive.testzip() is None:
            yield "ok", f"SSP: {path} has {len(inside)} FMUs"
            with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
                for name in inside:
                    yield from _examine_file(Path(archive.extract(name, folder)), name)
            return
    files, compiled = read_fmu(path)
    outputs, deviations = run_here(path)
    results = ", ".join(f"{name} = {value:.6g}" for name, value in outputs.items())
    yield "ok", f"FMU: {shown or path} loads and runs here ({results})"
    if compiled:
        yield "ok", "FMU: its binaries were compiled anew from its own sources"
    if deviations:
        worst = max(deviations.values())
        text = f"{len(deviations)} reference results in it, relative deviation {worst:.1e} at most"
        yield "ok" if worst <= _TOLERANCE else "problem", f"FMU: {text}"
    yield "ok", f"FMU: it has binaries for {', '.join(sorted(binaries_of(files)))}"
    yield _native_hosts(files)


def _native_hosts(files: Iterable[str]) -> Finding:
    """What hosts that aren't Python need for an FMU with these files."""
    if not any(re.match(r"resources/.*\.py$", name) for name in files):
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
