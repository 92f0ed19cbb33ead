"""Checks of an .fmu file before it is extracted or run."""

import hashlib
import re
import stat
import tempfile
import zipfile
from pathlib import Path, PurePosixPath

from golf_build.archive import SUMS
from golf_impact.errors import UserError

#: Largest unpacked size, bytes; ClubBallImpact.fmu has 1 MB.
_LARGEST = 64 * 2**20


def find_flaw(path: Path) -> str | None:
    """What is wrong with an .fmu file as an archive, in one line that says what to do; or None.

    Rejected are names that lead out of the folder, links, contents that are too large, damage, and
    files that differ from the list of those that it was built with, if there is such a list.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return f"there is no FMU at {path}: run `golf-impact build`"
    except OSError as error:
        return f"can't read {path}: {error.strerror}"
    if stat.S_ISDIR(mode):
        return f"{path} is a folder, not an FMU: give the .fmu file"
    if not stat.S_ISREG(mode):
        return f"{path} is not a regular file: give the .fmu file"
    try:
        with zipfile.ZipFile(path) as archive:
            why = _flaw_inside(archive)
    except OSError as error:
        why = error.strerror or str(error)
    except Exception as error:  # zipfile raises many types for damaged files
        why = (str(error) or type(error).__name__).splitlines()[0]
    return None if why is None else f"{path} is not a readable FMU ({why}): run `golf-impact build`"


def _flaw_inside(archive: zipfile.ZipFile) -> str | None:
    members = archive.infolist()
    names = [member.filename for member in members]
    for member, name in zip(members, names):
        # zipfile replaces backslashes by slashes where they are separators.
        odd = re.search(r"[\\:\x00-\x1f]", member.orig_filename)
        if odd or name.startswith("/") or ".." in PurePosixPath(name).parts:
            return f"a name in it leads out of the folder: {name!r}"
        if stat.S_ISLNK(member.external_attr >> 16):
            return f"{name} in it is a link"
    if len(set(names)) != len(names):
        return "a name is in it twice"
    size = sum(member.file_size for member in members)
    if size > _LARGEST:
        return f"it unpacks to {size / 2**20:.0f} MB, more than the {_LARGEST / 2**20:.0f} allowed"
    if "modelDescription.xml" not in names:
        return "modelDescription.xml is missing"
    # Reading checks the CRC, too.
    digests = {name: hashlib.sha256(archive.read(name)).hexdigest() for name in names}
    sums = archive.read(SUMS).decode() if SUMS in digests else ""
    for line in sums.splitlines():
        expected, _, name = line.partition("  ")
        if name not in digests:
            return f"{name} is missing"
        if digests[name] != expected:
            return f"{name} has been changed since it was built"
    return None


def find_odd_characters(folder: Path | str) -> str:
    """Characters in the name of a folder with which pythonfmu 0.7 crashes.

    Importers escape them in the URI of an FMU's resources; pythonfmu decodes %20, the space, only.
    """
    return "".join(sorted(set(re.sub(r"[A-Za-z0-9/._~ \\:-]", "", str(folder)))))


def check_temporary_folder() -> None:
    """UserError if pythonfmu would crash in the temporary folder."""
    folder = tempfile.gettempdir()
    if find_odd_characters(folder):
        raise UserError(
            f"pythonfmu can't load an FMU from {folder}: set TMPDIR to a folder whose name has "
            "letters, digits, spaces and . _ ~ - only"
        )
