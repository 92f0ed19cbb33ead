"""The page as a folder for any web server: the same files, and Python with the physics."""

import hashlib
import json
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import golf_physics

import golf_build
import golf_impact
from golf_build.archive import pack
from golf_impact.errors import UserError
from golf_impact.explore.cases import ROWS, make_evaluator, metrics_by_fmus
from golf_impact.explore.page import page_files
from golf_impact.files import check, write

#: CPython in WebAssembly, as the npm registry has it.
VERSION = "0.29.3"
SHA512 = (
    "db6501ba13896b08fbbca5274bbfc5df12bee75e4b25d8e23001e809fb92ebf3"
    "db1e23ab4905676300defb6b1b57088e677b0c31ec5d5c809ec3a36a38c40680"
)

#: Files of a Pyodide distribution that the page loads.
PYODIDE = (
    "pyodide.mjs", "pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json",
)  # fmt: skip


def export(fmu_file: Path, folder: Path, pyodide: Path | None = None) -> dict[str, int]:
    """Write the page into a folder.

    Args:
        fmu_file: the FMU with whose numbers the page compares its own.
        folder: made if need be; files of the same names are replaced, others stay.
        pyodide: a folder with Pyodide's files; without it they come from npm.

    Returns:
        The size of each file written, bytes, by its name in the folder.

    Raises:
        UserError: Pyodide isn't there, or the folder can't be written; then nothing has changed.
    """
    check(folder / "index.html")
    runtime = from_folder(pyodide) if pyodide else from_npm()
    evaluator = make_evaluator()
    page = page_files(evaluator, exported=True)
    expected = metrics_by_fmus(fmu_file, evaluator.facts)
    page["physics.zip"] = _archive({**evaluator.facts, "expected": expected})
    # The page comes last: as long as it isn't there, nothing uses the rest.
    files = {**{f"pyodide/{name}": data for name, data in runtime.items()}, **page}
    for name, data in files.items():
        write(folder / name, data)
    return {name: len(data) for name, data in files.items()}


def from_folder(folder: Path) -> dict[str, bytes]:
    """Pyodide's files of a folder.

    Raises:
        UserError: some are missing.
    """
    try:
        return {name: (folder / name).read_bytes() for name in PYODIDE}
    except OSError as error:
        raise UserError(
            f"{folder} has no {Path(str(error.filename)).name} that can be read: --pyodide takes "
            f"the folder of Pyodide {VERSION}, with {', '.join(PYODIDE)}"
        ) from error


def from_npm() -> dict[str, bytes]:
    """Pyodide's files of the pinned version, by npm.

    Raises:
        UserError: npm is missing, can't reach its registry, or gives another file.
    """
    what = f"pyodide@{VERSION}"
    instead = f"unpack {what} on a machine with npm, and give its folder with --pyodide"
    npm = shutil.which("npm")
    if npm is None:
        raise UserError(f"--export needs Pyodide, and npm isn't there: install npm, or {instead}")
    with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
        command = [npm, "pack", what, "--silent", "--pack-destination", folder]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
        files = list(Path(folder).glob("*.tgz"))
        if done.returncode or len(files) != 1:
            why = (done.stderr.strip().splitlines() or ["no file"])[-1]
            raise UserError(f"npm can't get {what} ({why}): {instead}")
        if hashlib.sha512(files[0].read_bytes()).hexdigest() != SHA512:
            raise UserError(f"npm gave a {what} with another checksum than expected: {instead}")
        shutil.unpack_archive(files[0], folder, filter="data")
        return from_folder(Path(folder, "package"))


def _archive(facts: dict[str, Any]) -> bytes:
    """The physics, and the evaluator with what it imports and its data, as a zip file."""
    package = Path(golf_physics.__file__).parent
    files = {f"golf_physics/{f.relative_to(package)}": f for f in package.rglob("*.py")}
    files["golf_build/__init__.py"] = Path(golf_build.__file__)
    ours = Path(golf_impact.__file__).parent
    evaluator = ("explore/__init__", "explore/evaluator")
    for name in ("__init__", "units", *evaluator):
        files[f"golf_impact/{name}.py"] = ours / f"{name}.py"
    contents = {name: file.read_bytes() for name, file in files.items()}
    contents["golf_impact/explore/facts.json"] = json.dumps([ROWS, facts]).encode()
    return pack(contents)
