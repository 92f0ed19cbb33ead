"""Checks of an .fmu file, and of the folder into which it is extracted, before it is loaded."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import fmpy

from golf_build.archive import SUMS, checksums, unpack
from golf_build.fmi2 import BUILDER
from golf_build.native import binaries_of, this_machine
from golf_build.packaging import guid_in
from golf_impact.errors import UserError, first_line
from golf_impact.runs import FLAGS, METRICS, PATH

#: Reads an output of an FMU.
_TRIAL = """
import sys, fmpy
fmpy.simulate_fmu(sys.argv[1], stop_time=1e-3, output_interval=1e-3, output=["force"])
"""


def find_flaw(path: Path) -> str | None:
    """Why an .fmu file can't be run here, as far as that is seen in it, and what to do; or None.

    A file that has a list of its members, with the digests that they were built with, must have
    these members and no others.
    """
    # Not Path.is_file, which raises without permission to read.
    if not os.path.isfile(path):
        return f"there is no FMU file at {path}: run `golf-impact build`"
    try:
        files = unpack(path)  # which checks sizes and CRCs
        if SUMS in files and files.pop(SUMS) != checksums(files):
            raise ValueError("it has been changed since it was built")
        if "SystemStructure.ssd" in files:
            return f"{path} is an SSP, not an FMU: its FMUs are in its folder resources/"
        if "modelDescription.xml" not in files:
            raise ValueError("modelDescription.xml is missing")
        fmpy.read_model_description(str(path))
    except Exception as error:  # zipfile, XML and fmpy raise many types for damaged files
        return f"{path} is not a readable FMU ({first_line(error)}): run `golf-impact build`"
    machine, there = this_machine(), binaries_of(files)
    if machine not in there:
        others = " and ".join(sorted(there)) or "none"
        return f"{path} has no binary for this machine, {machine}, but for {others}: use it there"
    return None


def check_fmu(path: Path) -> Path:
    """Check a file that a user names: it must be a ClubBallImpact.fmu that runs here.

    Raises:
        UserError: it is missing, damaged, another FMU, or can't be run here.
    """
    if why := find_flaw(path):
        raise UserError(why)
    about = fmpy.read_model_description(str(path))
    known = {variable.name for variable in about.modelVariables}
    for name in (*METRICS, *PATH, *FLAGS):
        if name not in known:
            raise UserError(f"{path} is another FMU ({about.modelName}): it lacks {name}")
    if about.fmiVersion != "2.0" or about.coSimulation is None:
        why = "is not an FMI 2.0 co-simulation FMU"
        raise UserError(f"{path} {why}: run `golf-impact build`")
    if guid_in(path) == BUILDER.guid():
        return path
    try:
        run_apart(_TRIAL, path)
    except UserError as error:
        raise UserError(f"{error}: run `golf-impact build`") from error
    return path


def run_apart(program: str, fmu: Path) -> str:
    """Run a Python program with the path of an FMU, which may crash a process: one of its own.

    Modules are imported from the same folders as here, never from the working folder; what the
    program leaves behind is removed.

    Returns:
        What it prints.

    Raises:
        UserError: it fails, or crashes.
    """
    program = f"import sys; sys.path[:] = {sys.path!r}\n{program}"
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
    return done.stdout


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
