"""ClubBallImpact.fmi3.fmu: the same sources through pythonfmu3, for FMI 3.0.

Co-simulation and Model Exchange in one file. pythonfmu3 0.3.4 writes no ranges, display units or
derivatives that are states as well.
"""

from xml.etree import ElementTree

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
    root = xml.parsed(written, instantiationToken=token, description=xml.DESCRIPTION)
    xml.child(root, "CoSimulation").attrib |= {
        "canHandleVariableCommunicationStepSize": "true",
        "hasEventMode": "true",
    }
    meaning = "The force between the bodies"
    law = ElementTree.Element("EnumerationType", name="ContactLaw", description=meaning)
    for number, (name, text) in tables.LAWS.items():
        ElementTree.SubElement(law, "Item", name=name, value=str(number), description=text)
    xml.insert_units(root, tables.UNITS | tables.MORE_UNITS, law)
    xml.insert_experiment(root)
    references = tables.ALL_REFERENCES
    derivative_of = dict(zip(tables.DERIVATIVES, tables.STATES, strict=True))
    for variable, row in zip(xml.child(root, "ModelVariables"), _ROWS, strict=True):
        assert variable.get("name") == row.name
        if row.name in tables.CO_SIMULATION_ONLY:
            variable.set("description", f"{row.description} (NaN in Model Exchange)")
        if row.start is not None:
            variable.set("start", repr(row.start))
        if row.type == "Enumeration":
            variable.attrib |= {"declaredType": "ContactLaw", **xml.bounds(tables.LAWS)}
        if row.type == "Real":
            variable.attrib |= xml.real_attributes(row)
        if row.causality == "independent":
            # Of its attributes FMI 3.0 allows an independent variable few.
            del variable.attrib["nominal"]
        if row.name in derivative_of:
            variable.set("derivative", str(references[derivative_of[row.name]]))
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
            ElementTree.SubElement(structure, tag, valueReference=str(references[name]))
    return xml.as_text(root)


BUILDER = Builder(
    name="ClubBallImpact.fmi3",
    fmi=3,
    runtime="pythonfmu3",
    face="club_ball_impact_fmi3",
    entry=_ENTRY,
    capabilities={"canGetAndSetFMUState": True, "canSerializeFMUState": True},
    described=_described,
    variables={"variables": _ROWS, "unsolved": tables.CO_SIMULATION_ONLY},
)
