"""The shared library of Python, which the plain FMU needs in a host that isn't Python."""

import re
import subprocess
import tempfile
import zipfile
from pathlib import Path


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
