"""ClubBallImpact.fmu: FMI 2.0, co-simulation."""

from xml.etree import ElementTree

from golf_impact.variables import LAWS, UNITS, VARIABLES

from golf_build import description as xml
from golf_build.packaging import Builder

_ENTRY = '''"""The entry point of the FMU; pythonfmu compiles this file anew for every instance."""

import {package}.club_ball_impact as face


class ClubBallImpact(face.ClubBallImpact):
    # What a host calls most is looked up by name, in this class first.
    _set_fmu_state = face.ClubBallImpact._set_fmu_state
    do_step = face.ClubBallImpact.do_step
    get_real = face.ClubBallImpact.get_real
    set_real = face.ClubBallImpact.set_real

    # pythonfmu 0.7.0 crashes on the second instance of a class that has no method of its own.
    def terminate(self):
        face.ClubBallImpact.terminate(self)
'''


def _described(written: bytes, guid: str) -> bytes:
    """Pythonfmu's modelDescription.xml with all that the table of variables knows."""
    root = xml.parsed(written, guid=guid, description=xml.DESCRIPTION)
    # An Integer, since libcosim and ecos know no Enumeration: they leave such a variable out.
    meanings = "; ".join(f"{number} {name}: {text}" for number, (name, text) in LAWS.items())
    law = ElementTree.Element("SimpleType", name="ContactLaw", description=meanings)
    ElementTree.SubElement(law, "Integer", xml.bounds(LAWS))
    xml.insert_units(root, UNITS, law)
    xml.insert_experiment(root)
    for variable, row in zip(xml.child(root, "ModelVariables"), VARIABLES, strict=True):
        assert variable.get("name") == row.name
        value = variable[0]
        value.attrib.clear()
        if row.type == "Enumeration":
            value.attrib |= {"declaredType": "ContactLaw", **xml.bounds(LAWS)}
        if row.start is not None:
            value.set("start", repr(row.start))
        if row.type == "Real":
            value.attrib |= xml.real_attributes(row)
    xml.list_initial_unknowns(root)
    return xml.as_text(root)


BUILDER = Builder(
    name="ClubBallImpact",
    fmi=2,
    runtime="pythonfmu",
    face="club_ball_impact",
    entry=_ENTRY,
    capabilities={"canGetAndSetFMUstate": True, "canSerializeFMUstate": True},
    described=_described,
    variables={"variables": VARIABLES},
)
