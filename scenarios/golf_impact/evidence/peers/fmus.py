"""Builds the FMUs of this folder."""

import shutil
import subprocess
from pathlib import Path

import fmpy

from golf_build.native import pythonfmu_runs_here
from golf_build.packaging import packaged
from golf_impact.data.errors import UserError, first_line

HERE = Path(__file__).parent


def build_plain_fmu(script: Path, folder: Path) -> Path:
    """Package a self-contained slave with pythonfmu, without additions."""
    with packaged(script.stem, script.read_bytes(), {}) as fmu:
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(fmu, folder))


def compiler() -> str | None:
    """The C compiler of this machine, if it has one."""
    return shutil.which("cc") or shutil.which("gcc")


def compile_library(name: str, library: Path) -> Path:
    """Compile a file of this folder with FMI's headers; UserError: it can't be compiled."""
    source, headers = HERE / name, Path(str(fmpy.__file__)).parent / "c-code"
    flags = ["-O2", "-shared", "-fPIC", f"-I{headers}"]
    command = [compiler() or "cc", *flags, str(source), "-o", str(library)]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        why = first_line(getattr(error, "stderr", None) or error)
        raise UserError(f"{source} can't be compiled: {why}") from error
    return library


def extract_peers(scratch: str | Path) -> tuple[dict[str, Path], Path | None]:
    """SteppedImpact.fmu by its language, the fastest last, and Empty.fmu, extracted.

    They are built and extracted in this folder. Without a C compiler there is none in C; where
    pythonfmu has no binary, none in Python.
    UserError: the compiler fails.
    """

    def extract(fmu: Path, name: str) -> Path:
        return Path(fmpy.extract(fmu, folder / name))

    folder, stepped = Path(scratch), {}
    in_python = pythonfmu_runs_here()
    fmu = build_plain_fmu(HERE / "stepped_impact.py", folder)
    if in_python:
        stepped["Python"] = extract(fmu, "Python")
    if compiler():
        # The model description is the same.
        stepped["C"] = extract(fmu, "C")
        library = f"binaries/{fmpy.platform}/SteppedImpact{fmpy.sharedLibraryExtension}"
        compile_library("stepped_impact.c", stepped["C"] / library)
    empty = build_plain_fmu(HERE / "empty_fmu.py", folder)
    return stepped, extract(empty, "empty") if in_python else None
