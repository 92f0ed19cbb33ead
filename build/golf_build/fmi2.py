"""Builds ClubBallImpact.fmu: pythonfmu packages it, this script makes it complete and reproducible.

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
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.dom import minidom
from xml.etree import ElementTree

import golf_impact
from golf_impact.variables import LAWS, UNITS, VARIABLES

HERE = Path(__file__).resolve().parent
NAME = "ClubBallImpact"

#: What the archive contains.
SUMS = "documentation/SHA256SUMS"

#: Everything in the archive is of this time: two builds of the same sources are the same bytes.
_EPOCH = (1980, 1, 1, 0, 0, 0)
EPOCH_TEXT = "1980-01-01T00:00:00Z"

DESCRIPTION = "A golf club hits a ball: contact force, smash factor, restitution, energy"
AUTHOR = "The golf-impact developers"

_ENTRY = '''"""The entry point of the FMU; pythonfmu compiles this file anew for every instance."""

import {package}.club_ball_impact as face


class {name}(face.{name}):
    # What a host calls most is looked up by name, in this class first.
    _set_fmu_state = face.{name}._set_fmu_state
    do_step = face.{name}.do_step
    get_real = face.{name}.get_real
    set_real = face.{name}.set_real

    # pythonfmu 0.7.0 crashes on the second instance of a class that has no method of its own.
    def terminate(self):
        face.{name}.terminate(self)
'''


#: What the package is inside an FMU, in place of its __init__.py.
_INSIDE = f"""\"\"\"The impact of a golf club on a ball.\"\"\"

__version__ = {golf_impact.__version__!r}
"""


def face(name: str) -> Path:
    """The file of an FMU's class: beside golf_impact in a checkout, beside this file installed."""
    installed = HERE / "faces" / f"{name}.py"
    return installed if installed.exists() else physics().parent / f"{name}.py"


def physics() -> Path:
    """The folder of the package golf_impact."""
    return Path(golf_impact.__file__).resolve().parent


def bundled() -> dict[str, bytes]:
    """What travels inside an FMU of golf_impact, by its path in the package: sub-packages, too.

    Not its __init__.py, which offers what needs more than the standard library.
    """
    folder = physics()
    files = {f.relative_to(folder).as_posix(): f.read_bytes() for f in folder.rglob("*.py")}
    return files | {"__init__.py": _INSIDE.encode()}


def sources(face_name: str = "club_ball_impact") -> dict[str, bytes]:
    """Every file that an FMU is made from, by a name that doesn't depend on where it lies."""
    files = {f"{face_name}.py": face(face_name).read_bytes()}
    files |= {f"golf_impact/{name}": data for name, data in bundled().items()}
    files["fmi2.py"] = Path(__file__).read_bytes()
    files |= {f"documentation/{f.name}": f.read_bytes() for f in (HERE / "documentation").iterdir()}
    files["model.png"] = (HERE / "model.png").read_bytes()
    files["LICENSE"] = _license()
    return dict(sorted(files.items()))


def _license() -> bytes:
    """The project's, beside this file in an installed copy."""
    places = (HERE / "LICENSE", HERE.parents[1] / "LICENSE")
    return next(file for file in places if file.exists()).read_bytes()


def digest() -> str:
    """SHA-256 over the sources and the version of pythonfmu: what decides if a build is current."""
    return digest_of(sources(), "pythonfmu")


def digest_of(files: dict[str, bytes], runtime: str) -> str:
    """SHA-256 over these sources and the version of the package whose runtime goes with them."""
    total = hashlib.sha256(importlib.metadata.version(runtime).encode())
    for name, data in files.items():
        total.update(name.encode() + b"\0" + hashlib.sha256(data).digest())
    return total.hexdigest()


def guid(of_digest: str) -> str:
    """The GUID of the FMU built from sources with this digest."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/{of_digest}"))


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


def sums(files: dict[str, bytes]) -> bytes:
    """The SHA-256 of every file, as `sha256sum -c` reads them."""
    lines = (f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files))
    return "".join(lines).encode()


def is_current(fmu: Path) -> bool:
    """Whether this file was built from the sources as they are now."""
    return guid_of(fmu) == guid(digest())


def build(out: Path) -> Path:
    """Build the FMU.

    Args:
        out: the .fmu file to write; it is written aside and renamed, so it is always whole.

    Returns:
        The file written.

    Raises:
        OSError: the file can't be written.
    """
    from pythonfmu.builder import FmuBuilder

    of_digest = digest()
    with tempfile.TemporaryDirectory(prefix="golf-impact-build-") as scratch:
        raw = package(
            Path(scratch),
            of_digest[:16],
            "club_ball_impact",
            _ENTRY,
            FmuBuilder.build_FMU,
            canGetAndSetFMUstate=True,
            canSerializeFMUstate=True,
        )
        files = unpacked(raw)
    files["modelDescription.xml"] = _model_description(files["modelDescription.xml"], of_digest)
    files |= documents("pythonfmu", _documentation())
    return write(out, files)


def package(
    scratch: Path,
    suffix: str,
    face_name: str,
    entry_text: str,
    build_fmu: Callable[..., Path],
    **capabilities: bool,
) -> Path:
    """The FMU as its packager makes it, the modules under private names.

    Args:
        scratch: an empty folder.
        suffix: what makes the names private.
        face_name: the module of the class.
        entry_text: the module that pythonfmu loads; {package}, {name} are filled in.
        build_fmu: the packager's function.
        capabilities: what it writes into the XML beside its defaults.
    """
    package = scratch / f"golf_impact_{suffix}"
    for name, data in bundled().items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_bytes(data)
    text = face(face_name).read_text("utf-8")
    text = re.sub(r"^from golf_impact", f"from {package.name}", text, flags=re.MULTILINE)
    (package / f"{face_name}.py").write_text(text, "utf-8")
    entry = scratch / f"{face_name}_{suffix}.py"
    entry.write_text(entry_text.format(package=package.name, name=NAME), "utf-8")
    before, modules = list(sys.path), set(sys.modules)
    write_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        return build_fmu(
            entry,
            dest=scratch / "packaged",
            project_files=[package],
            **capabilities,
        )
    finally:
        sys.dont_write_bytecode = write_bytecode
        sys.path[:] = before
        for name in set(sys.modules) - modules:
            if suffix in name:
                del sys.modules[name]


def unpacked(raw: Path) -> dict[str, bytes]:
    """The files in an archive by name."""
    with zipfile.ZipFile(raw) as archive:
        return {info.filename: archive.read(info) for info in archive.infolist()}


def documents(runtime: str, page: bytes) -> dict[str, bytes]:
    """What an FMU has beside its model: pictures, the page of documentation, licences."""
    files = {"model.png": (HERE / "model.png").read_bytes(), "documentation/index.html": page}
    for file in (HERE / "documentation").iterdir():
        if file.suffix != ".jinja":
            files[f"documentation/{file.name}"] = file.read_bytes()
    files["documentation/licenses/license.txt"] = _license()
    for packaged in importlib.metadata.files(runtime) or []:
        if packaged.name == "LICENSE":
            files[f"documentation/licenses/{runtime}.txt"] = packaged.read_binary()
    return files


def write(out: Path, files: dict[str, bytes]) -> Path:
    """Write the final archive: same order, times and attributes whatever the machine."""
    files = files | {SUMS: sums(files)}
    out = out.resolve()
    out.parent.mkdir(parents=True, exist_ok=True)
    aside = out.with_name(f".{uuid.uuid4().hex}.part")
    try:
        with zipfile.ZipFile(aside, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for name in sorted(files, key=lambda name: (name != "modelDescription.xml", name)):
                info = zipfile.ZipInfo(name, _EPOCH)
                info.compress_type = zipfile.ZIP_DEFLATED
                info.create_system = 3
                info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
                archive.writestr(info, files[name])
        aside.replace(out)
    finally:
        aside.unlink(missing_ok=True)
    return out


def _model_description(written: bytes, of_digest: str) -> bytes:
    """Pythonfmu's modelDescription.xml with all that the table of variables knows."""
    root = ElementTree.fromstring(written)
    for element in root.iter():
        element.tail = element.text = None
    root.attrib |= {
        "guid": guid(of_digest),
        "generationDateAndTime": EPOCH_TEXT,
        "version": golf_impact.__version__,
        "author": AUTHOR,
        "license": "MIT",
        "copyright": AUTHOR,
        "description": DESCRIPTION,
        "variableNamingConvention": "flat",
    }
    units = unit_definitions(UNITS)
    types = ElementTree.Element("TypeDefinitions")
    # An Integer, since libcosim and ecos know no Enumeration: they leave such a variable out.
    meanings = "; ".join(f"{number} {name}: {text}" for number, (name, text) in LAWS.items())
    law = ElementTree.SubElement(types, "SimpleType", name="ContactLaw", description=meanings)
    bounds = {"min": str(min(LAWS)), "max": str(max(LAWS))}
    ElementTree.SubElement(law, "Integer", bounds)
    place = list(root).index(child(root, "CoSimulation")) + 1
    root.insert(place, units)
    root.insert(place + 1, types)
    experiment = ElementTree.Element(
        "DefaultExperiment", startTime="0", stopTime="0.001", stepSize="1e-06"
    )
    root.insert(list(root).index(child(root, "ModelVariables")), experiment)
    for variable, row in zip(child(root, "ModelVariables"), VARIABLES, strict=True):
        assert variable.get("name") == row.name
        value = variable[0]
        value.attrib.clear()
        if row.type == "Enumeration":
            value.set("declaredType", "ContactLaw")
            value.attrib |= bounds
        if row.start is not None:
            value.set("start", repr(row.start))
        if row.type != "Real":
            continue
        value.attrib |= real_attributes(row)
    structure = child(root, "ModelStructure")
    # An output read at a communication point belongs to the step before: no direct feedthrough.
    for unknown in child(structure, "Outputs"):
        unknown.set("dependencies", "")
    initial = ElementTree.SubElement(structure, "InitialUnknowns")
    for unknown in child(structure, "Outputs"):
        ElementTree.SubElement(initial, "Unknown", index=unknown.attrib["index"])
    return as_text(root)


def unit_definitions(table: dict) -> ElementTree.Element:
    """The units of the table of variables, as FMI 2.0 and 3.0 write them."""
    units = ElementTree.Element("UnitDefinitions")
    for name, unit in table.items():
        node = ElementTree.SubElement(units, "Unit", name=name)
        ElementTree.SubElement(node, "BaseUnit", {k: str(v) for k, v in unit.base.items()})
        for shown, factor in unit.display.items():
            ElementTree.SubElement(node, "DisplayUnit", name=shown, factor=repr(factor))
    return units


def real_attributes(row) -> dict[str, str]:
    """Unit, range and nominal value of a row of the table, as FMI 2.0 and 3.0 write them."""
    found = {}
    if row.unit:
        found["unit"] = row.unit
    if row.display:
        found["displayUnit"] = row.display
    # FMI's bounds are inclusive: "> 0" is min="0" here, and the FMU refuses 0 itself.
    if row.allowed != "finite":
        found["min"] = repr(row.low if row.low >= 1.0 else 0.0)
    if ".." in row.allowed:
        found["max"] = repr(row.high)
    found["nominal"] = repr(row.nominal)
    return found


def as_text(root: ElementTree.Element) -> bytes:
    """XML as it goes into the archive."""
    text = ElementTree.tostring(root, "utf-8")
    return minidom.parseString(text).toprettyxml(indent="  ", encoding="UTF-8")


def child(parent: ElementTree.Element, tag: str) -> ElementTree.Element:
    """An element that must be there."""
    found = parent.find(tag)
    assert found is not None, tag
    return found


def _documentation() -> bytes:
    return documentation(variables=VARIABLES, fmi=2, runtime="pythonfmu")


def documentation(**values) -> bytes:
    """documentation/index.html, its table made from the one table of variables."""
    import jinja2

    loader = jinja2.FileSystemLoader(HERE / "documentation")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.get_template("index.html.jinja")
    return template.render(laws=LAWS, version=golf_impact.__version__, **values).encode()
