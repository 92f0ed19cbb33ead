"""ClubBallImpact.fmi3.fmu: the same sources through pythonfmu3, for FMI 3.0.

Co-simulation and Model Exchange in one file. pythonfmu3 0.3.4 writes no ranges, display units or
derivatives that are states as well.
"""

from xml.etree.ElementTree import Element, SubElement

from golf_impact import variables as tables

from golf_build import description as xml
from golf_build.packaging import Builder

_ENTRY = '''"""The entry point; pythonfmu3 finds the class by the text Fmi3Slave in this file."""

import {package}.club_ball_impact_fmi3 as face
from pythonfmu3 import Fmi3Slave


class ClubBallImpact(face.ClubBallImpact, Fmi3Slave):
    pass
'''

_ROWS = tables.VARIABLES + tables.MORE_VARIABLES


def _described(written: bytes, token: str) -> bytes:
    """Pythonfmu3's modelDescription.xml with all that the table of variables knows."""
    meaning = "The force between the bodies"
    law = Element("EnumerationType", name="ContactLaw", description=meaning)
    for number, (name, text) in tables.LAWS.items():
        SubElement(law, "Item", name=name, value=str(number), description=text)
    units = tables.UNITS | tables.MORE_UNITS
    root = xml.impact(written, _ROWS, units, law, instantiationToken=token)
    able = xml.child(root, "CoSimulation").attrib
    able |= {"canHandleVariableCommunicationStepSize": "true", "hasEventMode": "true"}
    references = tables.ALL_REFERENCES
    variables = {one.attrib["name"]: one for one in xml.child(root, "ModelVariables")}
    for name in tables.CO_SIMULATION_ONLY:
        variables[name].attrib["description"] += " (NaN in Model Exchange)"
    # Of its attributes FMI 3.0 allows an independent variable few.
    del variables["time"].attrib["nominal"]
    for name, state in zip(tables.DERIVATIVES, tables.STATES, strict=True):
        variables[name].set("derivative", str(references[state]))
    structure = xml.child(root, "ModelStructure")
    structure.clear()
    outputs = [row.name for row in _ROWS if row.causality == "output"]
    for tag, names in (
        ("Output", outputs),
        ("ContinuousStateDerivative", tables.DERIVATIVES),
        ("InitialUnknown", dict.fromkeys((*outputs, *tables.DERIVATIVES))),
        ("EventIndicator", tables.INDICATORS),
    ):
        for name in names:
            SubElement(structure, tag, valueReference=str(references[name]))
    return xml.as_text(root)


_SHOWN = {"variables": _ROWS, "unsolved": tables.CO_SIMULATION_ONLY}
BUILDER = Builder(3, "ClubBallImpact.fmi3", "club_ball_impact_fmi3", _ENTRY, _described, _SHOWN)
