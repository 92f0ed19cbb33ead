"""Packages FMUs with pythonfmu, completely and reproducibly.

pythonfmu 0.7.0 writes a random GUID and the time of day. Its modules are found by name, so that a
second build in the same process would silently run the code of the first one; here the names of an
FMU's modules contain the digest of its sources.
"""

import hashlib
import importlib.metadata
import re
import sys
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import golf_physics
from golf_physics.variables import LAWS

from golf_build.archive import SUMS, scratch, sums, unpacked, write_archive
from golf_build.description import HERE, RUNTIMES, described, rendered

_PHYSICS = Path(golf_physics.__file__).resolve().parent


class Builder(NamedTuple):
    """Builds ClubBallImpact for a version of FMI.

    Attributes:
        fmi: 2 or 3.
        name: of the file, without .fmu.
        face: the module of its FMI adapter.
        entry: the module that the runtime loads; {package} is filled in.
        tables: arguments of `described`.
    """

    fmi: int
    name: str
    face: str
    entry: str
    tables: dict[str, Any]

    def digest(self) -> str:
        """SHA-256 digest of all sources of an FMU; it decides whether a build is current."""
        total = hashlib.sha256(importlib.metadata.version(RUNTIMES[self.fmi]).encode())
        # With names that don't depend on the location of the files.
        face = fmu_source(f"{self.face}.py")
        files = {face.name: face.read_bytes(), "LICENSE": _license()}
        files |= {f"golf_physics/{name}": data for name, data in bundled().items()}
        ours = (*HERE.glob("*.py"), *HERE.glob("model*"), *(HERE / "documentation").iterdir())
        files |= {f"{f.parent.name}/{f.name}": f.read_bytes() for f in ours}
        for name, data in sorted(files.items()):
            total.update(name.encode() + b"\0" + hashlib.sha256(data).digest())
        return total.hexdigest()

    def guid(self) -> str:
        """The GUID (FMI 3.0: instantiation token) of an FMU of the current sources."""
        return str(uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/{self.digest()}"))

    def is_current(self, fmu: Path) -> bool:
        """Whether this file was built from the current sources."""
        return guid_of(fmu) == self.guid()

    def build(self, out: Path) -> Path:
        """Write the FMU to this file, whose folder is made if necessary; OSError if it can't be."""
        return write_archive(out, self.files())

    def files(self) -> dict[str, bytes]:
        """The FMU's files by name."""
        suffix = self.digest()[:16]
        package = f"golf_physics_{suffix}"
        face = fmu_source(f"{self.face}.py").read_text("utf-8")
        face = re.sub(r"(?m)^from host\b", "from golf_physics.host", face)
        face = re.sub(r"(?m)^from golf_physics\b", f"from {package}", face)
        modules = {f"{package}/{name}": data for name, data in bundled().items()}
        modules[f"{package}/{self.face}.py"] = face.encode()
        entry = self.entry.format(package=package).encode()
        with packaged(self.fmi, f"{self.face}_{suffix}", entry, modules) as raw:
            files = unpacked(raw)
        about = "Impact of a golf club on a ball: contact force, smash factor, restitution, energy"
        naming: dict[str, Any] = {
            "name": "ClubBallImpact",
            "token": self.guid(),
            "description": about,
        }
        files["modelDescription.xml"] = described(self.fmi, laws=LAWS, **naming, **self.tables)
        files |= self._documents()
        return files | {SUMS: sums(files)}

    def _documents(self) -> dict[str, bytes]:
        """The documentation of an FMU: pictures, index.html, licences."""
        folder, runtime = HERE / "documentation", RUNTIMES[self.fmi]
        files = {f"documentation/{f.name}": f.read_bytes() for f in folder.glob("*.png")}
        files["model.png"] = (HERE / "model.png").read_bytes()
        files["documentation/index.html"] = rendered(
            folder / "index.html.jinja",
            fmi=self.fmi,
            runtime=runtime,
            version=golf_physics.__version__,
            laws=LAWS,
            **self.tables,
        )
        files["documentation/licenses/license.txt"] = _license()
        for file in importlib.metadata.files(runtime) or []:
            if file.name == "LICENSE":
                files[f"documentation/licenses/{runtime}.txt"] = file.read_binary()
        return files


def guid_of(fmu: Path) -> str | None:
    """The GUID in an FMU file; None if the file has been changed since it was built."""
    try:
        files = unpacked(fmu)
        if files.pop(SUMS) != sums(files):
            return None
        root = ElementTree.fromstring(files["modelDescription.xml"])
    except Exception:  # zipfile and ElementTree raise many types for damaged files
        return None
    # It has another name in FMI 3.0.
    return root.get("guid") or root.get("instantiationToken")


def fmu_source(name: str) -> Path:
    """A file or folder of fmu_src; inside this package where it is installed."""
    installed = HERE / "faces" / name
    return installed if installed.exists() else _PHYSICS.parent / name


def bundled() -> dict[str, bytes]:
    """The modules inside an FMU by their paths in its package: golf_physics, and host in it."""
    files = {f.relative_to(_PHYSICS).as_posix(): f.read_bytes() for f in _PHYSICS.rglob("*.py")}
    files |= {f"host/{f.name}": f.read_bytes() for f in fmu_source("host").glob("*.py")}
    return files


def _license() -> bytes:
    """The licence of the project; inside this package where it is installed."""
    places = (HERE / "LICENSE", HERE.parents[1] / "LICENSE")
    return next(file for file in places if file.exists()).read_bytes()


@contextmanager
def packaged(fmi: int, module: str, script: bytes, beside: dict[str, bytes]) -> Iterator[Path]:
    """Package an FMU with pythonfmu (FMI 2) or pythonfmu3, for the time of a `with` block.

    `script` is the source of the module with the class; `beside` has further sources by path.
    """
    # Imported here, since it is slow and most commands don't build.
    build_fmu = importlib.import_module(f"{RUNTIMES[fmi]}.builder").FmuBuilder.build_FMU
    path, modules, bytecode = list(sys.path), set(sys.modules), sys.dont_write_bytecode
    with scratch({f"{module}.py": script, **beside}) as folder:
        tops = sorted({name.partition("/")[0] for name in beside})
        sys.dont_write_bytecode = True
        try:
            yield build_fmu(
                folder / f"{module}.py",
                dest=folder / "packaged",
                project_files=[folder / name for name in tops],
            )
        finally:
            sys.dont_write_bytecode = bytecode
            sys.path[:] = path
            ours = {module, *(name.removesuffix(".py") for name in tops)}
            for name in set(sys.modules) - modules:
                if name.partition(".")[0] in ours:
                    del sys.modules[name]
