"""Builds the FMUs of this folder."""

import shutil
import subprocess
from pathlib import Path

import fmpy

from golf_build.archive import unpack, write_archive
from golf_build.native import pythonfmu_runs_here
from golf_build.packaging import packaged
from golf_impact.data.errors import UserError, first_line
from golf_impact.evidence.peers import empty_fmu, stepped_impact


def build_plain_fmu(script: Path, folder: Path) -> Path:
    """Package a self-contained slave with pythonfmu, without additions."""
    with packaged(script.stem, script.read_bytes(), {}) as fmu:
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(fmu, folder))


def compiler() -> str | None:
    """The C compiler of this machine, if it has one."""
    return shutil.which("cc") or shutil.which("gcc")


def compile_library(source: Path, library: Path) -> Path:
    """Compile a file in C with FMI's headers; UserError: it can't be compiled."""
    headers = Path(str(fmpy.__file__)).parent / "c-code"
    flags = ["-O2", "-shared", "-fPIC", f"-I{headers}"]
    command = [compiler() or "cc", *flags, str(source), "-o", str(library)]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        why = first_line(getattr(error, "stderr", None) or error)
        raise UserError(f"{source} can't be compiled: {why}") from error
    return library


def build_compiled_fmu(folder: Path) -> Path:
    """`stepped_impact.c` with the model description of the same FMU in Python.

    UserError: it can't be compiled.
    """
    script = Path(str(stepped_impact.__file__))
    description = unpack(build_plain_fmu(script, folder))["modelDescription.xml"]
    library = folder / f"SteppedImpact{fmpy.sharedLibraryExtension}"
    compile_library(script.with_suffix(".c"), library)
    description = description.replace(b'needsExecutionTool="true"', b'needsExecutionTool="false"')
    binary = f"binaries/{fmpy.platform}/{library.name}"
    files = {"modelDescription.xml": description, binary: library.read_bytes()}
    return write_archive(folder / "compiled" / "SteppedImpact.fmu", files)


def compile_calls(folder: str) -> Path:
    """The library of impacts.c, in this folder; UserError: it can't be compiled."""
    source = Path(__file__).with_name("impacts.c")
    return compile_library(source, Path(folder, f"impacts{fmpy.sharedLibraryExtension}"))


def extract_peers(scratch: str) -> tuple[dict[str, Path], Path | None]:
    """SteppedImpact.fmu by its language, the fastest last, and Empty.fmu, extracted.

    They are built and extracted in this folder. Without a C compiler there is none in C; where
    pythonfmu has no binary, none in Python.
    UserError: the compiler fails.
    """
    folder = Path(scratch)
    python, empty = (
        build_plain_fmu(Path(str(peer.__file__)), folder) for peer in (stepped_impact, empty_fmu)
    )
    in_python = pythonfmu_runs_here()
    stepped = {"Python": python} if in_python else {}
    if compiler():
        stepped["C"] = build_compiled_fmu(folder)
    extracted = {
        language: Path(fmpy.extract(fmu, folder / language)) for language, fmu in stepped.items()
    }
    return extracted, Path(fmpy.extract(empty, folder / "empty")) if in_python else None
