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

#: What force and accelerations follow from in contact; b counts in both laws, velocities in the
#: damper of law 2 and the drag of law 1.
_CONTACT = ("k", "b", *tables.STATES)

#: What the outputs, derivatives and event indicators depend on at one instant of Model Exchange,
#: among inputs, states and time. Until first touch the club has the speed of the input, whatever
#: its state is. Flags and touch_time change in event mode only; what is NaN in Model Exchange
#: belongs in co-simulation to the step before, as in FMI 2.0.
_DEPENDENCIES: dict[str, tuple[str, ...]] = {
    "force": _CONTACT,
    "club_position": ("club_position",),
    "ball_position": ("ball_position",),
    "club_velocity": ("club_speed", "club_velocity"),
    "ball_velocity": ("ball_velocity",),
    "compression": ("club_position", "ball_position"),
    "smash_factor": ("ball_velocity",),
    "coefficient_of_restitution": ("club_velocity", "ball_velocity"),
    "energy_efficiency": ("club_velocity", "ball_velocity"),
    "contact_time": ("time",),
    "contact_displacement": ("ball_position",),
    "impulse": ("ball_position", "ball_velocity"),  # through the drag, and as the ball's momentum
    "momentum": ("club_speed", "club_velocity", "ball_velocity"),
    "kinetic_energy": ("club_speed", "club_velocity", "ball_velocity"),
    "club_acceleration": ("k", "b", "club_force", *tables.STATES),
    "ball_acceleration": _CONTACT,
    "touch_indicator": ("club_speed", "club_position", "ball_position", "ball_velocity"),
    "separation_indicator": _CONTACT,
}

_OUTPUTS = [row.name for row in _ROWS if row.causality == "output"]
_TABLES = TABLES | {
    "rows": _ROWS,
    "units": tables.UNITS | tables.MORE_UNITS,
    "unsolved": tables.CO_SIMULATION_ONLY,
    "derivatives": dict(zip(tables.DERIVATIVES, tables.STATES, strict=True)),
    "dependencies": _DEPENDENCIES,
    "structure": {
        "Output": _OUTPUTS,
        "ContinuousStateDerivative": tables.DERIVATIVES,
        "InitialUnknown": dict.fromkeys((*_OUTPUTS, *tables.DERIVATIVES)),
        "EventIndicator": tables.INDICATORS,
    },
}

_SOURCES = ("club_ball_impact_fmi3.py", "golf_physics", "host")
BUILDER = Builder(3, "ClubBallImpact.fmi3", _SOURCES, _ENTRY, _TABLES)
