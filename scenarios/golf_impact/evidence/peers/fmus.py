"""Builds the FMUs of the document's impact in sub-steps."""

import shutil
import subprocess
from pathlib import Path

import fmpy

from golf_build.native import pythonfmu_runs_here
from golf_build.packaging import packaged
from golf_impact.data.errors import UserError, first_line

HERE = Path(__file__).parent

PYTHON, EULER = "explicit Euler, Python FMU", "explicit Euler, C FMU"
RUNGE_KUTTA = "Runge–Kutta 4, C FMU"


def build_plain_fmu(script: Path, folder: Path) -> Path:
    """Package a self-contained slave with pythonfmu, without additions."""
    with packaged(script.stem, script.read_bytes(), {}) as fmu:
        return Path(shutil.copy(fmu, folder))


def compiler() -> str | None:
    """The C compiler of this machine, if it has one."""
    return shutil.which("cc") or shutil.which("gcc")


def extract_peers(scratch: str | Path) -> dict[str, Path]:
    """SteppedImpact.fmu by method and language, built and extracted in this folder.

    Without a C compiler there is none in C; where pythonfmu has no binary, none in Python.
    UserError: the compiler fails.
    """
    fmu = build_plain_fmu(HERE / "stepped_impact.py", Path(scratch))
    orders = {PYTHON: 0} if pythonfmu_runs_here() else {}
    orders |= {EULER: 1, RUNGE_KUTTA: 4} if compiler() else {}
    # Without blanks, of which pythonfmu's runtime dies.
    folders = {n: Path(fmpy.extract(fmu, Path(scratch, f"{order}"))) for n, order in orders.items()}
    library = f"binaries/{fmpy.platform}/SteppedImpact{fmpy.sharedLibraryExtension}"
    for name, order in orders.items():
        if order:  # in C: the model description is the same
            compile_library(order, folders[name] / library)
    return folders


def compile_library(order: int, library: Path) -> None:
    """Compile the method of this order with FMI's headers."""
    source, headers = HERE / "stepped_impact.c", Path(str(fmpy.__file__)).parent / "c-code"
    flags = ["-O2", "-shared", "-fPIC", f"-I{headers}", f"-DORDER={order}"]
    command = [compiler() or "cc", *flags, str(source), "-o", str(library)]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        why = first_line(getattr(error, "stderr", None) or error)
        raise UserError(f"{source} can't be compiled: {why}") from error
