"""modelDescription.xml: what the FMUs have in common, from the tables that say what they show."""

from collections.abc import Iterable, Mapping
from typing import Any
from xml.dom import minidom
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

from golf_impact import __version__
from golf_impact.variables import LAWS

from golf_build.archive import EPOCH_TEXT

AUTHOR = "The golf-impact developers"
DESCRIPTION = "A golf club hits a ball: contact force, smash factor, restitution, energy"

#: The range of an Integer that stands for a law.
LAW_BOUNDS = {"min": str(min(LAWS)), "max": str(max(LAWS))}


def parsed(written: bytes, **attributes: str) -> Element:
    """What the packager wrote, without white space, with these attributes and the common ones."""
    root = fromstring(written)
    for element in root.iter():
        element.tail = element.text = None
    root.attrib |= {
        "generationDateAndTime": EPOCH_TEXT,
        "version": __version__,
        "author": AUTHOR,
        "license": "MIT",
        "copyright": AUTHOR,
        "variableNamingConvention": "flat",
        **attributes,
    }
    return root


def impact(
    written: bytes, rows: Iterable[Any], units: Mapping[str, Any], law: Element, **attributes: str
) -> Element:
    """The description of ClubBallImpact with all that both versions of FMI say in the same way.

    Args:
        written: what the packager wrote.
        rows: of golf_impact's table.
        units: of golf_impact.
        law: the type of the variable `law`.
        attributes: of the root.
    """
    root = parsed(written, description=DESCRIPTION, **attributes)
    insert_units(root, units, law)
    # The run that tools propose: one contact.
    times = {"startTime": "0", "stopTime": "0.001", "stepSize": "1e-06"}
    variables = child(root, "ModelVariables")
    root.insert(list(root).index(variables), Element("DefaultExperiment", times))
    for variable, row in zip(variables, rows, strict=True):
        assert variable.get("name") == row.name
        value = variable
        if len(variable):
            # FMI 2.0: the type is an element of its own, in which pythonfmu rounds.
            value = variable[0]
            value.attrib.clear()
        if row.type == "Enumeration":
            value.attrib |= {"declaredType": "ContactLaw", **LAW_BOUNDS}
        if row.start is not None:
            value.set("start", repr(row.start))
        if row.type == "Real":
            value.attrib |= _real_attributes(row)
    return root


def _real_attributes(row: Any) -> dict[str, str]:
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
    return attributes | {"nominal": repr(row.nominal)}


def insert_units(root: Element, units: Mapping[str, Any], *types: Element) -> None:
    """Put units (and types) where the standard wants them.

    Args:
        root: of the description.
        units: exponents of base units by name; or of golf_impact, with display units.
        types: definitions of types.
    """
    node = Element("UnitDefinitions")
    for name, unit in units.items():
        one = SubElement(node, "Unit", name=name)
        base = getattr(unit, "base", unit)
        SubElement(one, "BaseUnit", {key: str(power) for key, power in base.items()})
        for shown, factor in getattr(unit, "display", {}).items():
            SubElement(one, "DisplayUnit", name=shown, factor=repr(factor))
    place = list(root).index(child(root, "CoSimulation")) + 1
    root.insert(place, node)
    if types:
        definitions = Element("TypeDefinitions")
        definitions.extend(types)
        root.insert(place + 1, definitions)


def list_initial_unknowns(root: Element) -> None:
    """FMI 2.0: every output, none of which depends on an input of the same instant."""
    structure = child(root, "ModelStructure")
    unknowns = list(child(structure, "Outputs"))
    initial = SubElement(structure, "InitialUnknowns")
    for unknown in unknowns:
        # A value read at a communication point belongs to the step before: no direct feedthrough.
        unknown.set("dependencies", "")
        SubElement(initial, "Unknown", index=unknown.attrib["index"])


def as_text(root: Element) -> bytes:
    """XML as it goes into the archive."""
    return minidom.parseString(tostring(root)).toprettyxml(indent="  ", encoding="UTF-8")


def child(parent: Element, tag: str) -> Element:
    """An element that must be there."""
    element = parent.find(tag)
    assert element is not None, tag
    return element
