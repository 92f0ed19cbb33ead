"""modelDescription.xml: what the FMUs have in common, from the tables that say what they show."""

from collections.abc import Iterable, Mapping
from typing import Any
from xml.dom import minidom
from xml.etree import ElementTree

import golf_impact

from golf_build.archive import EPOCH_TEXT

AUTHOR = "The golf-impact developers"
DESCRIPTION = "A golf club hits a ball: contact force, smash factor, restitution, energy"


def parsed(written: bytes, **attributes: str) -> ElementTree.Element:
    """What the packager wrote, without white space, with these attributes and the common ones."""
    root = ElementTree.fromstring(written)
    for element in root.iter():
        element.tail = element.text = None
    root.attrib |= {
        "generationDateAndTime": EPOCH_TEXT,
        "version": golf_impact.__version__,
        "author": AUTHOR,
        "license": "MIT",
        "copyright": AUTHOR,
        "variableNamingConvention": "flat",
        **attributes,
    }
    return root


def insert_units(
    root: ElementTree.Element, units: Mapping[str, Any], *types: ElementTree.Element
) -> None:
    """Put units (and types) where the standard wants them.

    Args:
        root: of the description.
        units: exponents of base units by name; or of golf_impact, with display units.
        types: definitions of types.
    """
    node = ElementTree.Element("UnitDefinitions")
    for name, unit in units.items():
        one = ElementTree.SubElement(node, "Unit", name=name)
        base = getattr(unit, "base", unit)
        ElementTree.SubElement(one, "BaseUnit", {key: str(power) for key, power in base.items()})
        for shown, factor in getattr(unit, "display", {}).items():
            ElementTree.SubElement(one, "DisplayUnit", name=shown, factor=repr(factor))
    place = list(root).index(child(root, "CoSimulation")) + 1
    root[place:place] = [node]
    if types:
        definitions = ElementTree.Element("TypeDefinitions")
        definitions.extend(types)
        root.insert(place + 1, definitions)


def insert_experiment(root: ElementTree.Element) -> None:
    """The run that tools propose: one contact."""
    times = {"startTime": "0", "stopTime": "0.001", "stepSize": "1e-06"}
    place = list(root).index(child(root, "ModelVariables"))
    root.insert(place, ElementTree.Element("DefaultExperiment", times))


def list_initial_unknowns(root: ElementTree.Element) -> None:
    """FMI 2.0: every output, none of which depends on an input of the same instant."""
    structure = child(root, "ModelStructure")
    unknowns = list(child(structure, "Outputs"))
    initial = ElementTree.SubElement(structure, "InitialUnknowns")
    for unknown in unknowns:
        # A value read at a communication point belongs to the step before: no direct feedthrough.
        unknown.set("dependencies", "")
        ElementTree.SubElement(initial, "Unknown", index=unknown.attrib["index"])


def real_attributes(row: Any) -> dict[str, str]:
    """Unit, range and nominal value of a row of the table, as FMI 2.0 and 3.0 write them."""
    attributes = {}
    if row.unit:
        attributes["unit"] = row.unit
    if row.display:
        attributes["displayUnit"] = row.display
    # FMI's bounds are inclusive: "> 0" is min="0" here, and the FMU refuses 0 itself.
    if row.allowed != "finite":
        attributes["min"] = repr(row.low if row.low >= 1.0 else 0.0)
    if ".." in row.allowed:
        attributes["max"] = repr(row.high)
    attributes["nominal"] = repr(row.nominal)
    return attributes


def bounds(numbers: Iterable[int]) -> dict[str, str]:
    """The range of an Integer that takes these values."""
    values = list(numbers)
    return {"min": str(min(values)), "max": str(max(values))}


def as_text(root: ElementTree.Element) -> bytes:
    """XML as it goes into the archive."""
    text = ElementTree.tostring(root, "utf-8")
    return minidom.parseString(text).toprettyxml(indent="  ", encoding="UTF-8")


def child(parent: ElementTree.Element, tag: str) -> ElementTree.Element:
    """An element that must be there."""
    element = parent.find(tag)
    assert element is not None, tag
    return element
