"""Shared libraries of Python, which the plain FMU needs in a host that isn't Python."""

import os
import re
import shutil
import subprocess
import tempfile
import zipfile
from pathlib import Path


def libpython_files() -> list[Path]:
    """Shared libraries of Python on this machine, that of this interpreter first."""
    import find_libpython

    paths = (Path(path) for path in find_libpython.candidate_paths() if path)
    files = (path.resolve() for path in paths if path.is_absolute() and path.is_file())
    return list(dict.fromkeys(file for file in files if ".so" in file.name))


def preloaded(libpython: Path, fmu: Path) -> str | None:
    """What is wrong with a library as the dynamic linker of a native host loads it, or None."""
    # LD_PRELOAD takes no spaces, which the user's temporary folder may have.
    place = "/tmp" if " " in tempfile.gettempdir() else None
    with tempfile.TemporaryDirectory(dir=place) as folder, zipfile.ZipFile(fmu) as archive:
        # The folder's names in FMI 2.0 and 3.0.
        inside = re.compile(r"binaries/(linux64|x86_64-linux)/.*\.so")
        name = next(filter(inside.fullmatch, archive.namelist()), None)
        if name is None:
            return "the FMU has no binary for 64-bit Linux"
        binary = archive.extract(name, folder)
        preload = {"LD_PRELOAD": f"{libpython}:{binary}", "LD_BIND_NOW": "1", "PATH": os.defpath}
        program = shutil.which("true") or "/bin/true"
        done = subprocess.run([program], env=preload, capture_output=True, text=True)
    return last_line(done.stderr) if done.returncode or done.stderr.strip() else None


def last_line(error: object) -> str:
    """The last line of a program's or an exception's message."""
    return (str(error).strip() or "no message").splitlines()[-1]
