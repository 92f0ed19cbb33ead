"""Builds ClubBallImpact.fmu: pythonfmu packages it, this script makes it complete and reproducible.

pythonfmu 0.7.0 writes no units, ranges or initial unknowns, a random GUID and the time of day; its
modules are found by name, so that a second build in one process would silently run the code of the
first. Here every build carries its modules under a name that contains the digest of its sources.

    python build/build_fmu.py [FILE]
"""

import hashlib
import importlib.metadata
import re
import shutil
import sys
import tempfile
import uuid
import zipfile
from pathlib import Path
from xml.dom import minidom
from xml.etree import ElementTree

HERE = Path(__file__).resolve().parent
NAME = "ClubBallImpact"

#: Everything in the archive is of this time: two builds of the same sources are the same bytes.
_EPOCH = (1980, 1, 1, 0, 0, 0)
_EPOCH_TEXT = "1980-01-01T00:00:00Z"

_ENTRY = '''"""The entry point of the FMU; pythonfmu compiles this file anew for every instance."""

import {package}.club_ball_impact as face


class {name}(face.{name}):
    # pythonfmu 0.7.0 crashes on the second instance of a class that has no method of its own.
    def terminate(self):
        face.{name}.terminate(self)
'''


def source_folder() -> Path:
    """The folder with golf_impact and club_ball_impact.py: of the checkout, else as installed."""
    checkout = HERE.parent / "fmu_src"
    if checkout.is_dir():
        return checkout
    import golf_impact

    return Path(golf_impact.__file__).resolve().parent.parent


def _sources() -> dict[str, Path]:
    """Every file that the FMU is made from, by a name that doesn't depend on where it lies."""
    fmu_src = source_folder()
    files = {"club_ball_impact.py": fmu_src / "club_ball_impact.py"}
    files |= {f"golf_impact/{f.name}": f for f in (fmu_src / "golf_impact").glob("*.py")}
    files["build_fmu.py"] = Path(__file__).resolve()
    files |= {f"documentation/{f.name}": f for f in (HERE / "documentation").iterdir()}
    files["model.png"] = HERE / "model.png"
    files["LICENSE"] = next(f for f in (HERE / "LICENSE", HERE.parent / "LICENSE") if f.exists())
    return dict(sorted(files.items()))


def digest() -> str:
    """SHA-256 over the sources and the version of pythonfmu: what decides if a build is current."""
    total = hashlib.sha256(importlib.metadata.version("pythonfmu").encode())
    for name, file in _sources().items():
        total.update(name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return total.hexdigest()


def guid(of_digest: str) -> str:
    """The GUID of the FMU built from sources with this digest."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/{of_digest}"))


def guid_of(fmu: Path) -> str | None:
    """The GUID inside an FMU file, or None if it can't be read."""
    try:
        with zipfile.ZipFile(fmu) as archive:
            return ElementTree.fromstring(archive.read("modelDescription.xml")).get("guid")
    except (OSError, KeyError, zipfile.BadZipFile, ElementTree.ParseError):
        return None


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
    out = out.resolve()
    out.parent.mkdir(parents=True, exist_ok=True)
    of_digest = digest()
    with tempfile.TemporaryDirectory(prefix="golf-impact-build-") as scratch:
        raw = _package(Path(scratch), of_digest[:16])
        aside = out.with_name(f".{out.name}.{uuid.uuid4().hex}.part")
        try:
            _complete(raw, aside, of_digest)
            aside.replace(out)
        finally:
            aside.unlink(missing_ok=True)
    return out


def _package(scratch: Path, suffix: str) -> Path:
    """The FMU as pythonfmu packages it, the modules under private names."""
    from pythonfmu.builder import FmuBuilder

    fmu_src = source_folder()
    package = scratch / f"golf_impact_{suffix}"
    package.mkdir()
    for file in (fmu_src / "golf_impact").glob("*.py"):
        shutil.copyfile(file, package / file.name)
    face = (fmu_src / "club_ball_impact.py").read_text("utf-8")
    face = re.sub(r"^from golf_impact", f"from {package.name}", face, flags=re.MULTILINE)
    (package / "club_ball_impact.py").write_text(face, "utf-8")
    entry = scratch / f"club_ball_impact_{suffix}.py"
    entry.write_text(_ENTRY.format(package=package.name, name=NAME), "utf-8")
    before, modules = list(sys.path), set(sys.modules)
    write_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        return FmuBuilder.build_FMU(
            entry,
            dest=scratch / "packaged",
            project_files=[package],
            canGetAndSetFMUstate=True,
            canSerializeFMUstate=True,
        )
    finally:
        sys.dont_write_bytecode = write_bytecode
        sys.path[:] = before
        for name in set(sys.modules) - modules:
            if suffix in name:
                del sys.modules[name]


def _complete(raw: Path, out: Path, of_digest: str) -> None:
    """Write the final archive: same order, times and attributes whatever the machine."""
    with zipfile.ZipFile(raw) as archive:
        files = {info.filename: archive.read(info) for info in archive.infolist()}
    files["modelDescription.xml"] = _model_description(files["modelDescription.xml"], of_digest)
    files["model.png"] = (HERE / "model.png").read_bytes()
    files["documentation/index.html"] = _documentation()
    for file in (HERE / "documentation").iterdir():
        if file.suffix != ".jinja":
            files[f"documentation/{file.name}"] = file.read_bytes()
    files["documentation/licenses/license.txt"] = _sources()["LICENSE"].read_bytes()
    for packaged in importlib.metadata.files("pythonfmu") or []:
        if packaged.name == "LICENSE":
            files["documentation/licenses/pythonfmu.txt"] = packaged.read_binary()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(files, key=lambda name: (name != "modelDescription.xml", name)):
            info = zipfile.ZipInfo(name, _EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.create_system = 3
            info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(info, files[name])


def _model_description(written: bytes, of_digest: str) -> bytes:
    """Pythonfmu's modelDescription.xml with all that the table of variables knows."""
    sys.path.insert(0, str(source_folder()))
    try:
        from golf_impact import __version__
        from golf_impact.variables import LAWS, UNITS, VARIABLES
    finally:
        sys.path.pop(0)
    root = ElementTree.fromstring(written)
    for element in root.iter():
        element.tail = element.text = None
    root.attrib |= {
        "guid": guid(of_digest),
        "generationDateAndTime": _EPOCH_TEXT,
        "version": __version__,
        "author": "The golf-impact developers",
        "license": "MIT",
        "copyright": "The golf-impact developers",
        "description": "A golf club hits a ball: contact force, smash factor, restitution, energy",
        "variableNamingConvention": "flat",
    }
    units = ElementTree.Element("UnitDefinitions")
    for name, unit in UNITS.items():
        node = ElementTree.SubElement(units, "Unit", name=name)
        ElementTree.SubElement(node, "BaseUnit", {k: str(v) for k, v in unit.base.items()})
        for shown, factor in unit.display.items():
            ElementTree.SubElement(node, "DisplayUnit", name=shown, factor=repr(factor))
    types = ElementTree.Element("TypeDefinitions")
    # An Integer, since libcosim and ecos know no Enumeration: they leave such a variable out.
    meanings = "; ".join(f"{number} {name}: {text}" for number, (name, text) in LAWS.items())
    law = ElementTree.SubElement(types, "SimpleType", name="ContactLaw", description=meanings)
    bounds = {"min": str(min(LAWS)), "max": str(max(LAWS))}
    ElementTree.SubElement(law, "Integer", bounds)
    place = list(root).index(_child(root, "CoSimulation")) + 1
    root.insert(place, units)
    root.insert(place + 1, types)
    experiment = ElementTree.Element(
        "DefaultExperiment", startTime="0", stopTime="0.001", stepSize="1e-06"
    )
    root.insert(list(root).index(_child(root, "ModelVariables")), experiment)
    for variable, row in zip(_child(root, "ModelVariables"), VARIABLES, strict=True):
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
        value.set("unit", row.unit)
        if row.display:
            value.set("displayUnit", row.display)
        # FMI's bounds are inclusive: "> 0" is min="0" here, and the FMU refuses 0 itself.
        if row.allowed != "finite":
            value.set("min", repr(row.low if row.low >= 1.0 else 0.0))
        if ".." in row.allowed:
            value.set("max", repr(row.high))
        value.set("nominal", repr(row.nominal))
    structure = _child(root, "ModelStructure")
    # An output read at a communication point belongs to the step before: no direct feedthrough.
    for unknown in _child(structure, "Outputs"):
        unknown.set("dependencies", "")
    initial = ElementTree.SubElement(structure, "InitialUnknowns")
    for unknown in _child(structure, "Outputs"):
        ElementTree.SubElement(initial, "Unknown", index=unknown.attrib["index"])
    text = ElementTree.tostring(root, "utf-8")
    return minidom.parseString(text).toprettyxml(indent="  ", encoding="UTF-8")


def _child(parent: ElementTree.Element, tag: str) -> ElementTree.Element:
    found = parent.find(tag)
    assert found is not None, tag
    return found


def _documentation() -> bytes:
    """documentation/index.html, its table made from the one table of variables."""
    import jinja2

    sys.path.insert(0, str(source_folder()))
    try:
        from golf_impact import __version__
        from golf_impact.variables import LAWS, VARIABLES
    finally:
        sys.path.pop(0)
    loader = jinja2.FileSystemLoader(HERE / "documentation")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.get_template("index.html.jinja")
    page = template.render(variables=VARIABLES, laws=LAWS, version=__version__)
    return page.encode()


if __name__ == "__main__":
    print(build(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / f"{NAME}.fmu"))
