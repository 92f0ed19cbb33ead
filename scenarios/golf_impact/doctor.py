"""Whether an FMU loads and runs here, and what hosts that aren't Python need for it."""

import importlib.metadata
import json
import platform
import re
import shlex
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

from golf_build.archive import unpack
from golf_build.native import binaries_of, this_machine
from golf_impact.errors import UserError
from golf_impact.flaws import check_temporary_folder, find_flaw, run_apart
from golf_impact.fmu import current_fmu

#: One step, and the reference results in the file, in a process of its own: a crash there is a
#: finding here. Prints the outputs, and the largest relative deviation by case, as JSON.
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

#: Of this Python, whose library a native host needs for a pythonfmu FMU.
_VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"

_NO_LIBPYTHON = (
    f"none for Python {_VERSION} that loads this FMU; hosts written in Python don't need it, "
    f"others do (Debian, Ubuntu: apt-get install libpython{_VERSION}; pyenv: "
    "PYTHON_CONFIGURE_OPTS=--enable-shared pyenv install; conda has it)"
)


def examine(fmu: Path | None = None) -> Iterator[tuple[str, str]]:
    """Level (ok, warning, problem) and text of each finding about this Python and an FMU.

    Args:
        fmu: an .fmu file; by default that of the current sources.
    """
    names = ("golf-impact", "fmpy", "pythonfmu")
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)
    machine = this_machine()
    yield "ok", f"Python {platform.python_version()} ({sys.executable}), {versions}, {machine}"
    try:
        check_temporary_folder()
    except UserError as error:
        yield "problem", f"temporary folder: {error}"
        return
    fmu = fmu or current_fmu()
    if why := find_flaw(fmu):
        yield "problem", f"FMU: {why}"
        return
    try:
        outputs, deviations = run_here(fmu)
    except UserError as error:
        yield "problem", f"FMU: {error}"
        return
    results = ", ".join(f"{name} = {value:.6g}" for name, value in outputs.items())
    yield "ok", f"FMU: {fmu} loads and runs here ({results})"
    if deviations:
        worst = max(deviations.values())
        text = f"{len(deviations)} reference results in it, relative deviation {worst:.1e} at most"
        yield "ok" if worst <= _TOLERANCE else "problem", f"FMU: {text}"
    files = unpack(fmu)
    yield "ok", f"FMU: it has binaries for {', '.join(sorted(binaries_of(files)))}"
    if not any(re.match(r"resources/.*\.py$", name) for name in files):
        yield "ok", "native hosts: this FMU needs nothing of Python"
    elif sys.platform == "win32":
        yield "ok", f"native hosts: set PATH={sys.base_prefix};%PATH%  (python3.dll is there)"
    elif file := find_libpython_for(fmu):
        home = shlex.quote(sys.base_prefix)
        preload = f"LD_PRELOAD={shlex.quote(str(file))} PYTHONHOME={home}"
        yield "ok", f"native hosts: {preload} your-host"
    else:
        yield "warning", f"libpython: {_NO_LIBPYTHON}"


def run_here(fmu: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Run an FMU in a process of its own.

    Returns:
        Outputs after a step of 5 ms by name (SI units); the largest deviation from the reference
        results in the file by case, relative to the largest value of the output.

    Raises:
        UserError: it can't be run here.
    """
    outputs, deviations = json.loads(run_apart(_LOAD, fmu).splitlines()[-1])
    return outputs, deviations


def find_libpython_for(fmu: Path) -> Path | None:
    """The library of this Python's version with which a native host loads an FMU, or None."""
    import find_libpython

    # The folder's names in FMI 2.0 and 3.0.
    inside = re.compile(r"binaries/(linux64|x86_64-linux)/.*\.so")
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(fmu) as archive:
        for name in filter(inside.fullmatch, archive.namelist()):
            binary = archive.extract(name, folder)
            for file in find_libpython.candidate_paths():
                preload = {"LD_PRELOAD": f"{file}:{binary}", "LD_BIND_NOW": "1"}
                done = subprocess.run(["true"], env=preload, capture_output=True)
                # The linker goes on without a library that it can't load.
                if done.returncode == 0 and not done.stderr:
                    return Path(file).resolve()
    return None
