"""Packages a slave: pythonfmu does it, and this makes it complete and reproducible.

pythonfmu 0.7.0 writes no units, ranges or initial unknowns, a random GUID and the time of day; its
modules are found by name, so that a second build in one process would silently run the code of the
first. Here every build carries its modules under a name that contains the digest of its sources.
"""

import hashlib
import importlib.metadata
import re
import sys
import tempfile
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import golf_impact
from golf_impact.variables import LAWS

from golf_build.archive import SUMS, packed, sums, unpacked, whole

HERE = Path(__file__).resolve().parent

#: What the package is inside an FMU, in place of its __init__.py, which offers what needs more
#: than the standard library.
_INSIDE = f'''"""The impact of a golf club on a ball."""

__version__ = {golf_impact.__version__!r}
'''


@dataclass(frozen=True)
class Builder:
    """Builds ClubBallImpact for one version of FMI.

    Attributes:
        name: of the file, without .fmu.
        fmi: 2 or 3.
        runtime: the package that packs it, whose runtime travels along.
        face: the module of its class.
        entry: the module that the runtime loads; {package} is filled in.
        capabilities: what the runtime writes into the XML beside its defaults.
        described: modelDescription.xml from what the runtime wrote, and the GUID.
        variables: what the page of documentation lists, by the names that its template gives them.
    """

    name: str
    fmi: int
    runtime: str
    face: str
    entry: str
    capabilities: dict[str, bool]
    described: Callable[[bytes, str], bytes]
    variables: dict[str, Any]

    def digest(self) -> str:
        """SHA-256 of all that an FMU is made from: what decides if a build is current."""
        total = hashlib.sha256(importlib.metadata.version(self.runtime).encode())
        for name, data in sorted(self._sources().items()):
            total.update(name.encode() + b"\0" + hashlib.sha256(data).digest())
        return total.hexdigest()

    def _sources(self) -> dict[str, bytes]:
        """Every file, by a name that doesn't depend on where it lies."""
        files = {f"{self.face}.py": face_file(self.face).read_bytes(), "LICENSE": _license()}
        files |= {f"golf_impact/{name}": data for name, data in bundled().items()}
        files |= {f.name: f.read_bytes() for f in (*HERE.glob("*.py"), HERE / "model.png")}
        files |= {f.name: f.read_bytes() for f in (HERE / "documentation").iterdir()}
        return files

    def guid(self) -> str:
        """The GUID (in FMI 3.0: instantiation token) of an FMU of the present sources."""
        return str(uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/{self.digest()}"))

    def is_current(self, fmu: Path) -> bool:
        """Whether this file was built from the sources as they are now."""
        return guid_of(fmu) == self.guid()

    def build(self, out: Path) -> Path:
        """Build the FMU.

        Args:
            out: the .fmu file to write; its folder is made if need be.

        Returns:
            The file written.

        Raises:
            OSError: the file can't be written.
        """
        suffix = self.digest()[:16]
        package = f"golf_impact_{suffix}"
        face = re.sub(
            rb"(?m)^from golf_impact\b",
            f"from {package}".encode(),
            face_file(self.face).read_bytes(),
        )
        modules = {f"{package}/{name}": data for name, data in bundled().items()}
        modules[f"{package}/{self.face}.py"] = face
        entry = self.entry.format(package=package).encode()
        with packaged(
            self.runtime, f"{self.face}_{suffix}", entry, modules, self.capabilities
        ) as raw:
            files = unpacked(raw)
        description = files["modelDescription.xml"]
        files["modelDescription.xml"] = self.described(description, self.guid())
        files |= self._documents()
        out.parent.mkdir(parents=True, exist_ok=True)
        with whole(out) as stream:
            stream.write(packed(files | {SUMS: sums(files)}))
        return out.resolve()

    def _documents(self) -> dict[str, bytes]:
        """What an FMU has beside its model: pictures, the page of documentation, licences."""
        folder = HERE / "documentation"
        files = {f"documentation/{f.name}": f.read_bytes() for f in folder.glob("*.png")}
        files["model.png"] = (HERE / "model.png").read_bytes()
        files["documentation/index.html"] = rendered(
            folder / "index.html.jinja",
            fmi=self.fmi,
            runtime=self.runtime,
            version=golf_impact.__version__,
            laws=LAWS,
            **self.variables,
        )
        files["documentation/licenses/license.txt"] = _license()
        for file in importlib.metadata.files(self.runtime) or []:
            if file.name == "LICENSE":
                files[f"documentation/licenses/{self.runtime}.txt"] = file.read_binary()
        return files


def rendered(template: Path, **values: Any) -> bytes:
    """What jinja makes of a template (UTF-8)."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template.name).render(values).encode()


def guid_of(fmu: Path) -> str | None:
    """The GUID inside an FMU file, or None if the file isn't as it was built."""
    try:
        files = unpacked(fmu)
        if files.pop(SUMS) != sums(files):
            return None
        root = ElementTree.fromstring(files["modelDescription.xml"])
    except Exception:  # whatever zip and XML make of a damaged file
        return None
    # FMI 3.0 has another name for it.
    return root.get("guid") or root.get("instantiationToken")


def face_file(name: str) -> Path:
    """The file of an FMU's class: beside golf_impact in a checkout, in this package installed."""
    installed = HERE / "faces" / f"{name}.py"
    return installed if installed.exists() else _physics().parent / f"{name}.py"


def _physics() -> Path:
    return Path(golf_impact.__file__).resolve().parent


def bundled() -> dict[str, bytes]:
    """What of golf_impact travels inside an FMU, by its path in the package: sub-packages, too."""
    files = {f.relative_to(_physics()).as_posix(): f.read_bytes() for f in _physics().rglob("*.py")}
    return files | {"__init__.py": _INSIDE.encode()}


def _license() -> bytes:
    """The project's, in this package if it is installed."""
    places = (HERE / "LICENSE", HERE.parents[1] / "LICENSE")
    return next(file for file in places if file.exists()).read_bytes()


@contextmanager
def packaged(
    runtime: str,
    module: str,
    script: bytes,
    beside: dict[str, bytes],
    capabilities: dict[str, bool],
) -> Iterator[Path]:
    """The FMU as its runtime packs it, for the time of a `with` block.

    Args:
        runtime: pythonfmu or pythonfmu3.
        module: name of the module with the class.
        script: its source.
        beside: further sources, by their path beside it.
        capabilities: what the runtime writes into the XML beside its defaults.
    """
    # Only here: listing scenarios must not wait for it.
    build_fmu = importlib.import_module(f"{runtime}.builder").FmuBuilder.build_FMU
    path, modules, bytecode = list(sys.path), set(sys.modules), sys.dont_write_bytecode
    with tempfile.TemporaryDirectory(prefix="golf-impact-build-") as scratch:
        for name, data in {f"{module}.py": script, **beside}.items():
            file = Path(scratch, name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(data)
        tops = sorted({name.partition("/")[0] for name in beside})
        sys.dont_write_bytecode = True
        try:
            yield build_fmu(
                Path(scratch, f"{module}.py"),
                dest=Path(scratch, "packaged"),
                project_files=[Path(scratch, name) for name in tops],
                **capabilities,
            )
        finally:
            sys.dont_write_bytecode = bytecode
            sys.path[:] = path
            ours = {module, *(name.removesuffix(".py") for name in tops)}
            for name in set(sys.modules) - modules:
                if name.partition(".")[0] in ours:
                    del sys.modules[name]
