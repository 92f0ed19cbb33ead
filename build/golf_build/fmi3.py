"""ClubBallImpact.fmi3.fmu: the same sources with pythonfmu3, FMI 3.0.

Co-simulation and Model Exchange in one file.
"""

from golf_physics import variables as tables

from golf_build.fmi2 import ZERO_AT_START
from golf_build.packaging import Builder

_ENTRY = '''"""The entry point; pythonfmu3 finds the class by the text Fmi3Slave in this file."""

import {package}.club_ball_impact_fmi3 as face
from pythonfmu3 import Fmi3Slave


class ClubBallImpact(face.ClubBallImpact, Fmi3Slave):
    pass
'''

_ROWS = tables.VARIABLES + tables.MORE_VARIABLES
_OUTPUTS = [row.name for row in _ROWS if row.causality == "output"]
_TABLES = {
    "rows": _ROWS,
    "units": tables.UNITS | tables.MORE_UNITS,
    "unsolved": tables.CO_SIMULATION_ONLY,
    "constant": ZERO_AT_START,
    "derivatives": dict(zip(tables.DERIVATIVES, tables.STATES, strict=True)),
    "structure": {
        "Output": _OUTPUTS,
        "ContinuousStateDerivative": tables.DERIVATIVES,
        "InitialUnknown": dict.fromkeys((*_OUTPUTS, *tables.DERIVATIVES)),
        "EventIndicator": tables.INDICATORS,
    },
}

BUILDER = Builder(3, "ClubBallImpact.fmi3", "club_ball_impact_fmi3", _ENTRY, _TABLES)
