"""ClubBallImpact.fmu: FMI 2.0, co-simulation."""

from xml.etree.ElementTree import Element, SubElement

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
    # An Integer, since libcosim and ecos know no Enumeration: they leave such a variable out.
    meanings = "; ".join(f"{number} {name}: {text}" for number, (name, text) in LAWS.items())
    law = Element("SimpleType", name="ContactLaw", description=meanings)
    SubElement(law, "Integer", xml.LAW_BOUNDS)
    root = xml.impact(written, VARIABLES, UNITS, law, guid=guid)
    xml.list_initial_unknowns(root)
    return xml.as_text(root)


_SHOWN = {"variables": VARIABLES}
BUILDER = Builder(2, "ClubBallImpact", "club_ball_impact", _ENTRY, _described, _SHOWN)
