"""Whether an FMU loads and runs here, and what hosts that aren't Python need for it."""

import importlib.metadata
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
from golf_build.standalone import binaries_of
from golf_build.toolchain import VERSION, this_machine
from golf_impact.errors import UserError
from golf_impact.flaws import check_temporary_folder, find_flaw
from golf_impact.fmu import current_fmu

#: One step, and the reference results in the file, in a process of its own: a crash there is a
#: finding here. Prints the outputs, the number of results and the largest relative deviation.
_LOAD = r"""
import sys, pathlib, tempfile, zipfile, fmpy
from fmpy.util import read_csv
path = sys.argv[1]
about = fmpy.read_model_description(path)
names = [v.name for v in about.modelVariables if v.causality == "output"]
shown = [n for n in ("smash_factor", "coefficient_of_restitution") if n in names]
end = fmpy.simulate_fmu(path, stop_time=5e-3, output_interval=5e-3, output=shown or names[:1])[-1]
worst, cases = 0.0, 0
with tempfile.TemporaryDirectory() as folder:
    zipfile.ZipFile(path).extractall(folder)
    for file in pathlib.Path(folder, "extra").rglob("*_ref.csv"):
        rows, case = read_csv(file), str(file)[: -len("_ref.csv")]
        start, inputs = pathlib.Path(f"{case}_start.csv"), pathlib.Path(f"{case}_in.csv")
        given = start.read_text().split()[1:] if start.exists() else []
        outputs = list(rows.dtype.names[1:])
        signals = None
        if inputs.exists():
            signals = read_csv(inputs)
        found = fmpy.simulate_fmu(
            path, start_values=dict(line.split(",") for line in given), input=signals,
            output=outputs, stop_time=rows["time"][-1], output_interval=rows["time"][1],
        )
        cases += 1
        for name in outputs:
            error = abs(found[name][: len(rows)] - rows[name]).max() / abs(rows[name]).max()
            worst = max(worst, error)
print(", ".join(f"{n} = {end[n]:.6g}" for n in shown) or "a step of 5 ms", cases, worst, sep=";")
"""

#: Of the relative deviation. Measured: 5.3e-16; another C library may have other last digits.
_TOLERANCE = 1e-12

_NO_LIBPYTHON = (
    f"none for Python {VERSION} that loads this FMU; hosts written in Python don't need it, "
    f"others do (Debian, Ubuntu: apt-get install libpython{VERSION}; pyenv: "
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
    done = subprocess.run(
        [sys.executable, "-c", _LOAD, str(fmu)], capture_output=True, text=True, errors="replace"
    )
    if code := done.returncode:
        ended = f"signal {-code}" if code < 0 else f"exit {code}"
        why = (done.stderr.strip() or "no message").splitlines()[-1]
        yield "problem", f"FMU: {fmu} can't be run here ({ended}): {why}"
        return
    results, cases, worst = done.stdout.splitlines()[-1].split(";")
    yield "ok", f"FMU: {fmu} loads and runs here ({results})"
    if int(cases):
        text = f"{cases} reference results in it, relative deviation {float(worst):.1e} at most"
        yield "ok" if float(worst) <= _TOLERANCE else "problem", f"FMU: {text}"
    files = unpack(fmu)
    yield "ok", f"FMU: it has binaries for {', '.join(sorted(binaries_of(files)))}"
    with_python = any("/golf-python-" in name for name in files)
    if with_python or not any(re.match(r"resources/.*\.py$", name) for name in files):
        yield "ok", "native hosts: this FMU needs nothing of Python"
    elif sys.platform == "win32":
        yield "ok", f"native hosts: set PATH={sys.base_prefix};%PATH%  (python3.dll is there)"
    elif file := _libpython(fmu):
        home = shlex.quote(sys.base_prefix)
        preload = f"LD_PRELOAD={shlex.quote(str(file))} PYTHONHOME={home}"
        yield "ok", f"native hosts: {preload} your-host"
    else:
        yield "warning", f"libpython: {_NO_LIBPYTHON}"


def _libpython(fmu: Path) -> Path | None:
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
