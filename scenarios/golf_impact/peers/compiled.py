"""Stepping methods compiled from C and packed as FMUs 2.0: `compiled.c`.

As a modeller would write them in C: all steps of an impact inside one communication step. The
arithmetic is that of the document's FMU (masses divide; with reciprocals it would be a quarter
faster).
"""

import shutil
import subprocess
from pathlib import Path

import fmpy

from golf_build.archive import write_archive
from golf_build.toolchain import this_machine
from golf_impact.errors import UserError

#: Sub-steps, s, by method: the document's, and one whose error is far below a measurement's.
SUB_STEP = {"euler": 0.5e-6, "rk4": 5e-6}


def compiler() -> str | None:
    """A C compiler of this machine, or None; the FMUs are for Linux x86-64."""
    linux = this_machine() == "Linux x86_64"
    return (shutil.which("cc") or shutil.which("gcc")) if linux else None


def compiled_fmu(method: str, folder: Path) -> Path:
    """The FMU of a method of `SUB_STEP`, built in a folder; UserError if the compiler fails."""
    name, source = f"compiled_{method}", Path(__file__).with_name("compiled.c")
    library, headers = folder / f"{name}.so", Path(fmpy.__file__).with_name("c-code")
    flags = ["-O2", "-ffp-contract=off", "-shared", "-fPIC", f"-I{headers}"]
    flags += ["-DORDER=4" if method == "rk4" else "-DORDER=1", "-o", str(library)]
    try:
        words = [compiler() or "cc", *flags, str(source)]
        subprocess.run(words, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        why = getattr(error, "stderr", None) or error
        raise UserError(f"{source} can't be compiled: {why}") from error
    description = source.with_suffix(".xml").read_text().replace("NAME", name)
    files = {"modelDescription.xml": description.encode()}
    files[f"binaries/linux64/{name}.so"] = library.read_bytes()
    return write_archive(folder / f"{name}.fmu", files)
