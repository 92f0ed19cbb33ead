"""Checks of an .fmu file, and of the folder it is extracted into, before it is loaded."""

import os
import re
import tempfile
from pathlib import Path

import fmpy

from golf_build.archive import SUMS, checksums, unpack
from golf_build.standalone import binaries_of
from golf_build.toolchain import this_machine
from golf_impact.errors import UserError, first_line


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


def find_odd_characters(folder: Path | str) -> str:
    """Those with which pythonfmu 0.7 crashes: of the URI of the resources it decodes %20 only."""
    return "".join(sorted(set(re.sub(r"[A-Za-z0-9/._~ \\:-]", "", str(folder)))))


def check_temporary_folder() -> None:
    """UserError if pythonfmu would crash in the temporary folder."""
    folder = tempfile.gettempdir()
    if find_odd_characters(folder):
        raise UserError(
            f"pythonfmu can't load an FMU from {folder}: set TMPDIR to a folder whose name has "
            "letters, digits, spaces and . _ ~ - only"
        )
