"""Packages FMUs with pythonfmu, completely and reproducibly.

pythonfmu 0.7.0 writes a random GUID and the time of day; its modelDescription.xml lacks units,
ranges and initial unknowns, and has 16 digits of a start value. Its runtime finds modules by name:
here the names of an FMU's modules contain the digest of its sources, so that a process that loads
an older and a newer FMU runs the code of each.
"""

import hashlib
import importlib.metadata
import re
import subprocess
import sys
import uuid
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import golf_physics
from golf_physics.variables import Variable

from golf_build.archive import SUMS, checksums, scratch, unpack, write_archive
from golf_build.errors import UserError
from golf_build.sources import HERE, PHYSICS, fmu_source, project_license
from golf_build.templates import render

#: Files of FMUs, as they are.
_CONTENTS = HERE / "contents"

#: The folder of the reference results in `extra`, named as FMI has it: no other tool's.
_REFERENCE = "org.golf-impact.reference"

#: The package that makes FMUs of Python, whose runtime they contain.
RUNTIME = "pythonfmu"


@dataclass(frozen=True)
class Builder:
    """Builds an FMU; what it contains beside its binaries and their sources is here.

    Attributes:
        name: of the file, without .fmu; up to a dot, that of the model and its class.
        tables: `rows`, the variables; `description`; `units` by name; `experiment`, the proposed
            stop time and step size (s); `model` of a companion, in words; `laws` of ClubBallImpact;
            `constant` (outputs whose initial values depend on no variable) and `discrete` (outputs
            that change at events only). With Model Exchange `derivatives` (by the names of their
            states), `unsolved` (outputs that are NaN there), `indicators`, and `dependencies` of
            outputs, derivatives and indicators (names by name; none where it is missing).
        start: start values by name, where they aren't those of the tables.
        fmi: version of FMI, 2 or 3.
    """

    name: str
    tables: dict[str, Any]
    start: Mapping[str, float] = field(default_factory=dict)
    fmi: int = 2

    #: Of the file.
    suffix = ".fmu"

    @property
    def model(self) -> str:
        """The name of the model, its class and its libraries."""
        return self.name.partition(".")[0]

    def guid(self) -> str:
        """The GUID (FMI 3.0: instantiation token) of an FMU of the current sources."""
        return str(uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/{self.digest()}"))

    def is_current(self, fmu: Path | BinaryIO) -> bool:
        """Whether a file is that of the current sources, unchanged since it was built."""
        try:
            files = unpack(fmu)
            intact = files.pop(SUMS) == checksums(files)
            return intact and f'"{self.guid()}"'.encode() in files["modelDescription.xml"]
        except Exception:  # zipfile raises many types for damaged files
            return False

    def build(self, out: Path) -> Path:
        """Write the FMU to this file, whose folder is made if necessary; OSError if it can't be."""
        return write_archive(out, self.files())

    def digest(self) -> str:
        """SHA-256 digest of all sources of an FMU; it decides whether a build is current."""
        raise NotImplementedError

    def files(self) -> dict[str, bytes]:
        """The FMU's files by name."""
        raise NotImplementedError

    def rows(self) -> list[Variable]:
        """The variables with the start values of this FMU."""
        start = self.start
        return [row._replace(start=start.get(row.name, row.start)) for row in self.tables["rows"]]

    def _context(self, **others: Any) -> dict[str, Any]:
        """What the templates have, and `others`."""
        about = {"fmi": self.fmi, "name": self.model, "rows": self.rows(), "runtime": RUNTIME}
        return self.tables | about | {"version": golf_physics.__version__} | others

    def describe(self, token: str, tool: str, sources: Iterable[str] = ()) -> bytes:
        """The model description with a GUID, the tool that made it, and the names of C sources."""
        # In FMI 2.0 an index is the position from 1 on, not the value reference.
        places = enumerate(self.tables["rows"], 1)
        known = {row.name: n if self.fmi == 2 else row.reference for n, row in places}
        listed = {
            name: " ".join(str(known[other]) for other in others if other in known)
            for name, others in self.tables.get("dependencies", {}).items()
        }
        context = self._context(token=token, tool=tool, sources=sources, known=known)
        context["dependencies"] = listed
        # All attributes are in double quotes, so apostrophes need no escape.
        return render(HERE / "modelDescription.xml.jinja", **context).replace(b"&#39;", b"'")

    def documents(self, platforms: Iterable[str] = ()) -> dict[str, bytes]:
        """Documentation; of ClubBallImpact also reference results and icons. By name.

        `platforms` are those of a native FMU.
        """
        folder = HERE / "documentation"
        template = "index" if "laws" in self.tables else "companion"
        page = render(folder / f"{template}.html.jinja", **self._context(platforms=platforms))
        files = {"documentation/index.html": page}
        files["documentation/licenses/license.txt"] = project_license()
        if template == "companion":
            return files
        files |= {f"documentation/{f.name}": f.read_bytes() for f in folder.glob("*.png")}
        if not self.start:
            # They are results of the table's start values.
            reference = (_CONTENTS / "reference").iterdir()
            files |= {f"extra/{_REFERENCE}/{f.name}": f.read_bytes() for f in reference}
        icon = (HERE / "model.png").read_bytes()
        if self.fmi == 2:
            return files | {"model.png": icon}
        terminals = "terminalsAndIcons/terminalsAndIcons.xml"
        files[terminals] = (_CONTENTS / Path(terminals).name).read_bytes()
        return files | {"terminalsAndIcons/icon.png": icon}


@dataclass(frozen=True)
class PythonBuilder(Builder):
    """Builds an FMU 2.0 of a Python class, by pythonfmu.

    Attributes:
        sources: files and folders of fmu_src, the module with the class first.
        entry: the module that the runtime loads; {package}, {module} and {model} are filled in. The
            package has VALUES: `start` if there are laws; else the fields of every variable.
    """

    sources: tuple[str, ...] = ()
    entry: str = ""

    def digest(self) -> str:
        settings = importlib.metadata.version(RUNTIME), self.name, self.start, self.tables
        # With names that don't depend on the location of the files.
        files = {"LICENSE": project_license(), **_read(self.sources)}
        ours = (*HERE.glob("*.py"), *HERE.glob("model*"), *(HERE / "documentation").iterdir())
        ours += tuple(file for file in _CONTENTS.rglob("*") if file.is_file())
        files |= {f"{f.parent.name}/{f.name}": f.read_bytes() for f in ours}
        return hashlib.sha256(repr(settings).encode() + checksums(files)).hexdigest()

    def files(self) -> dict[str, bytes]:
        suffix, module = self.digest()[:16], Path(self.sources[0]).stem
        package = f"golf_{'physics' if 'golf_physics' in self.sources else module}_{suffix}"
        values = self.start if "laws" in self.tables else [tuple(row) for row in self.rows()]
        modules = {"__init__.py": b"", **_read(self.sources)}
        modules["__init__.py"] += f"VALUES = {values}\n".encode()
        tops = "|".join({name.partition("/")[0].removesuffix(".py") for name in modules})
        beside = {}
        for name, data in modules.items():
            text = re.sub(r"(?m)^from golf_physics\b", f"from {package}", data.decode())
            text = re.sub(rf"(?m)^from ({tops})\b", rf"from {package}.\1", text)
            beside[f"{package}/{name}"] = text.encode()
        entry = self.entry.format(package=package, module=module, model=self.model)
        with packaged(f"{module}_{suffix}", entry.encode(), beside) as raw:
            files = unpack(raw)
        tool = f"PythonFMU {importlib.metadata.version(RUNTIME)}"
        files["modelDescription.xml"] = self.describe(self.guid(), tool)
        needed = (_CONTENTS / "externalDependencies.txt").read_bytes()
        files["documentation/externalDependencies.txt"] = needed
        for file in importlib.metadata.files(RUNTIME) or []:
            if file.name == "LICENSE":
                files[f"documentation/licenses/{RUNTIME}.txt"] = file.read_binary()
        files |= self.documents()
        return files | {SUMS: checksums(files)}


def _read(sources: Iterable[str]) -> dict[str, bytes]:
    """Files and folders of fmu_src by their paths in an FMU's package, which golf_physics is."""
    files: dict[str, bytes] = {}
    for place in map(fmu_source, sources):
        root = PHYSICS if place.is_relative_to(PHYSICS) else place.parent
        inside = place.rglob("*.py") if place.is_dir() else [place]
        files |= {file.relative_to(root).as_posix(): file.read_bytes() for file in inside}
        if place == PHYSICS:
            # ClubBallImpact doesn't need them.
            files = {name: files[name] for name in files if not name.startswith("companions/")}
    return files


@contextmanager
def packaged(module: str, script: bytes, beside: dict[str, bytes]) -> Iterator[Path]:
    """Package an FMU by the command of pythonfmu, for the time of a `with` block.

    `script` is the source of the module with the class; `beside` has further sources by path.
    UserError: the command fails, since a module can't be imported, for instance.
    """
    tops = sorted({name.partition("/")[0] for name in beside})
    command = [sys.executable, "-m", RUNTIME, "build", "-f", f"{module}.py", "-d", "made", *tops]
    with scratch({f"{module}.py": script, **beside}) as folder:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if done.returncode:
            why = done.stderr.strip().rpartition("\n")[2]
            raise UserError(f"{RUNTIME} can't package {module}.py: {why}")
        yield next((folder / "made").iterdir())
