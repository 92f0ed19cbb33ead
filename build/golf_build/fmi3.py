"""ClubBallImpact.fmi3.fmu: FMI 3.0, co-simulation and Model Exchange, by pythonfmu3."""

from golf_physics import variables as tables

from golf_build.fmi2 import TABLES
from golf_build.packaging import Builder

_ENTRY = '''"""The entry point; pythonfmu3 finds the class by the text Fmi3Slave in this file."""

import {package}.{module} as adapter
from pythonfmu3 import Fmi3Slave


class {model}(adapter.{model}, Fmi3Slave):
    pass
'''

_ROWS = tables.VARIABLES + tables.MORE_VARIABLES

_OUTPUTS = [row.name for row in _ROWS if row.causality == "output"]
_TABLES = TABLES | {
    "rows": _ROWS,
    "units": tables.UNITS | tables.MORE_UNITS,
    "unsolved": tables.CO_SIMULATION_ONLY,
    "derivatives": dict(zip(tables.DERIVATIVES, tables.STATES, strict=True)),
    # Flags and touch_time change in event mode only; what is NaN in Model Exchange belongs in
    # co-simulation to the step before, as in FMI 2.0: without dependencies.
    "dependencies": {row.name: row.dependencies for row in _ROWS if row.dependencies is not None},
    "structure": {
        "Output": _OUTPUTS,
        "ContinuousStateDerivative": tables.DERIVATIVES,
        "InitialUnknown": dict.fromkeys((*_OUTPUTS, *tables.DERIVATIVES)),
        "EventIndicator": tables.INDICATORS,
    },
}

_SOURCES = ("club_ball_impact_fmi3.py", "golf_physics", "host")
BUILDER = Builder(3, "ClubBallImpact.fmi3", _SOURCES, _ENTRY, _TABLES)
