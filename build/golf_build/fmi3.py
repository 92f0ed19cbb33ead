"""Builds ClubBallImpact.fmi3.fmu: the same sources through pythonfmu3, for FMI 3.0.

Co-simulation and Model Exchange in one file. pythonfmu3 0.3.4 writes no ranges, display units or
derivatives that are states as well; what FMI 2.0 and 3.0 share is in fmi2.py.
"""

import tempfile
from pathlib import Path
from xml.etree import ElementTree

import golf_impact
from golf_impact import variables as tables

from golf_build import fmi2 as _shared

NAME = "ClubBallImpact.fmi3"

_FACE = "club_ball_impact_fmi3"

_ENTRY = '''"""The entry point; pythonfmu3 finds the class by the text Fmi3Slave in this file."""

import {package}.club_ball_impact_fmi3 as face
from pythonfmu3 import Fmi3Slave


class {name}(face.{name}, Fmi3Slave):
    pass
'''


def digest() -> str:
    """SHA-256 over the sources and the version of pythonfmu3: decides if a build is current."""
    files = {**_shared.sources(_FACE), "fmi3.py": Path(__file__).read_bytes()}
    return _shared.digest_of(files, "pythonfmu3")


def guid_of(fmu: Path) -> str | None:
    """The instantiation token inside an FMU file, or None if it can't be read."""
    return _shared.guid_of(fmu)


def is_current(fmu: Path) -> bool:
    """Whether this file was built from the sources as they are now."""
    return guid_of(fmu) == _shared.guid(digest())


def build(out: Path) -> Path:
    """Build the FMU.

    Args:
        out: the .fmu file to write; it is written aside and renamed, so it is always whole.

    Returns:
        The file written.

    Raises:
        OSError: the file can't be written.
    """
    from pythonfmu3.builder import FmuBuilder

    of_digest = digest()
    with tempfile.TemporaryDirectory(prefix="golf-impact-build-") as scratch:
        raw = _shared.package(
            Path(scratch),
            of_digest[:16],
            _FACE,
            _ENTRY,
            FmuBuilder.build_FMU,
            canGetAndSetFMUState=True,
            canSerializeFMUState=True,
        )
        files = _shared.unpacked(raw)
    files["modelDescription.xml"] = _model_description(files["modelDescription.xml"], of_digest)
    files |= _shared.documents("pythonfmu3", _documentation())
    return _shared.write(out, files)


def _model_description(written: bytes, of_digest: str) -> bytes:
    """Pythonfmu3's modelDescription.xml with all that the table of variables knows."""
    root = ElementTree.fromstring(written)
    for element in root.iter():
        element.tail = element.text = None
    root.attrib |= {
        "instantiationToken": _shared.guid(of_digest),
        "generationDateAndTime": _shared.EPOCH_TEXT,
        "version": golf_impact.__version__,
        "author": _shared.AUTHOR,
        "license": "MIT",
        "copyright": _shared.AUTHOR,
        "description": _shared.DESCRIPTION,
        "variableNamingConvention": "flat",
    }
    stepping = _shared.child(root, "CoSimulation")
    stepping.attrib |= {"canHandleVariableCommunicationStepSize": "true", "hasEventMode": "true"}
    place = list(root).index(stepping) + 1
    root.insert(place, _shared.unit_definitions(tables.UNITS | tables.MORE_UNITS))
    root.insert(place + 1, _type_definitions(tables.LAWS))
    experiment = ElementTree.Element(
        "DefaultExperiment", startTime="0", stopTime="0.001", stepSize="1e-06"
    )
    root.insert(list(root).index(_shared.child(root, "ModelVariables")), experiment)
    references = tables.ALL_REFERENCES
    derivative_of = dict(zip(tables.DERIVATIVES, tables.STATES, strict=True))
    rows = tables.VARIABLES + tables.MORE_VARIABLES
    for variable, row in zip(_shared.child(root, "ModelVariables"), rows, strict=True):
        assert variable.get("name") == row.name
        if row.name in tables.CO_SIMULATION_ONLY:
            variable.set("description", f"{row.description} (NaN in Model Exchange)")
        if row.start is not None:
            variable.set("start", repr(row.start))
        if row.type == "Enumeration":
            variable.set("declaredType", "ContactLaw")
            variable.attrib |= {"min": str(min(tables.LAWS)), "max": str(max(tables.LAWS))}
        if row.type == "Real":
            variable.attrib |= _shared.real_attributes(row)
        if row.causality == "independent":
            # Of its attributes FMI 3.0 allows an independent variable few.
            del variable.attrib["nominal"]
        if row.name in derivative_of:
            variable.set("derivative", str(references[derivative_of[row.name]]))
    structure = _shared.child(root, "ModelStructure")
    structure.clear()
    outputs = [row.name for row in rows if row.causality == "output"]
    unknown = dict.fromkeys((*outputs, *tables.DERIVATIVES))
    for tag, names in (
        ("Output", outputs),
        ("ContinuousStateDerivative", tables.DERIVATIVES),
        ("InitialUnknown", unknown),
        ("EventIndicator", tables.INDICATORS),
    ):
        for name in names:
            ElementTree.SubElement(structure, tag, valueReference=str(references[name]))
    return _shared.as_text(root)


def _type_definitions(laws: dict) -> ElementTree.Element:
    types = ElementTree.Element("TypeDefinitions")
    law = ElementTree.SubElement(
        types, "EnumerationType", name="ContactLaw", description="The force between the bodies"
    )
    for number, (name, text) in laws.items():
        ElementTree.SubElement(law, "Item", name=name, value=str(number), description=text)
    return types


def _documentation() -> bytes:
    return _shared.documentation(
        variables=tables.VARIABLES + tables.MORE_VARIABLES,
        unsolved=tables.CO_SIMULATION_ONLY,
        fmi=3,
        runtime="pythonfmu3",
    )
