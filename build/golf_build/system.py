"""The system around ClubBallImpact: its companion FMUs, and the system of all four as SSP 1.0."""

import zipfile
from math import pi
from pathlib import Path
from typing import Any

from golf_physics import variables
from golf_physics.variables import Unit, Variable

from golf_build import fmi2
from golf_build import standalone as alone
from golf_build.archive import pack, write_archive
from golf_build.description import HERE, render
from golf_build.packaging import Builder

#: The system's file, and in it the folder of the FMUs (SSP 1.0, section 5).
NAME = "GolfSwing.ssp"
_RESOURCES = "resources"

#: Those of ClubBallImpact, in SI alone, and the companions' own.
UNITS = {
    name: unit._replace(display={})
    for name, unit in (variables.UNITS | variables.MORE_UNITS).items()
} | {
    "rad": Unit({"rad": 1}, {"deg": 180.0 / pi}),
    "rad/s": Unit({"rad": 1, "s": -1}, {"rpm": 30.0 / pi}),
    "m2/s": Unit({"m": 2, "s": -1}, {}),
    "kg/m3": Unit({"kg": 1, "m": -3}, {}),
    "kg.m": Unit({"kg": 1, "m": 1}, {}),
    "kg.m2": Unit({"kg": 1, "m": 2}, {}),
    "N.m": Unit({"kg": 1, "m": 2, "s": -2}, {}),
}

#: From component and variable to component and variable: every connected input, and nothing else,
#: since fmpy.ssp fails at an input that is listed but not connected.
CONNECTIONS = (
    ("Swing", "club_speed", "ClubBallImpact", "club_speed"),
    ("ClubBallImpact", "impulse", "Swing", "impulse"),
    ("ClubBallImpact", "separated", "Launch", "separated"),
    ("ClubBallImpact", "ball_velocity", "Launch", "ball_velocity"),
    ("ClubBallImpact", "club_velocity", "Launch", "club_velocity"),
    ("ClubBallImpact", "smash_factor", "Launch", "smash_factor"),
    ("ClubBallImpact", "coefficient_of_restitution", "Launch", "coefficient_of_restitution"),
    ("Launch", "launched", "BallFlight", "separated"),
    ("Launch", "ball_speed", "BallFlight", "ball_velocity"),
    ("Launch", "launch_angle", "BallFlight", "launch_angle"),
    ("Launch", "backspin", "BallFlight", "backspin"),
    ("ClubBallImpact", "touch_time", "BallFlight", "touch_time"),
    ("ClubBallImpact", "contact_time", "BallFlight", "contact_time"),
)

#: The components, and unconnected outputs that are listed to be recorded.
OBSERVED: dict[str, tuple[str, ...]] = {
    "Swing": ("head_speed", "energy", "work", "reaction_work", "reaction_impulse"),
    "ClubBallImpact": ("force", "mean_force", "club_position", "ball_position"),
    "Launch": ("tangential_impulse",),
    "BallFlight": ("carry", "apex", "flight_time", "distance", "height", "landed"),
}

_BOOLEANS = ("separated", "launched", "landed")

_LOFT, _ATTACK = 14.0 * pi / 180.0, 0.0067710723040632775
_STRIKE_HEIGHT, _INERTIA = 0.010, 2.7e-4
_HEAD = 0.21483410609721446

#: A drive: start values in the .ssp where they differ from those of the FMUs beside it.
#:
#: The ball with a driver's flexible face has stiffness and exponent of the preset `tour` (113 mph,
#: S 1.478, 475 us). Its COR, 0.801 at 113 mph, falls with the approach speed as Penner's does.
#: The head has the swing's effective mass, the attack angle its direction at the ball. Depth of
#: centre of mass and inertia are those that D. Tutelman, All about Gear Effect (2009), has for
#: drivers: 38 mm, the average of 17 measured, and 0.59 of 4575 g cm2, between a half and two thirds
#: of the measured inertia about the vertical axis. Dynamic loft and strike height are chosen.
DRIVE: dict[str, dict[str, float]] = {
    "Swing": {"spin_loft": _LOFT - _ATTACK},
    "ClubBallImpact": {
        "law": 2,
        "k": 1241578.1199332434,
        "exponent": 1.5,
        "restitution_at_rest": 0.9476,
        "restitution_slope": 0.0029,
        "m_club": 1.0 / (1.0 / _HEAD + _STRIKE_HEIGHT**2 / _INERTIA),
    },
    "Launch": {
        "dynamic_loft": _LOFT,
        "attack_angle": _ATTACK,
        "m_club": _HEAD,
        "strike_height": _STRIKE_HEIGHT,
        "centre_depth": 0.038,
        "head_inertia": _INERTIA,
    },
    "BallFlight": {},
}

#: The system's own experiment: long enough for the swing, the impact and the launch.
STOP_TIME, STEP_SIZE = 1.0, 1e-4


def _tables(module: Any) -> dict[str, Any]:
    """The tables of a companion's module as arguments of `write_description`."""
    groups = {"parameter": module.PARAMETERS, "input": module.INPUTS, "output": module.OUTPUTS}
    rows = []
    for causality, group in groups.items():
        for one, unit, *values, text in group:
            of_type = "Real" if unit else "Boolean", unit or "", values[0] if values else None
            display = next(iter(UNITS[unit].display), None) if unit else None
            rows.append(Variable(one, causality, *of_type, 0, 0, "", None, display, text))
    used = {row.unit for row in rows}
    units = {name: unit for name, unit in UNITS.items() if name in used}
    return {"rows": rows, "description": module.DESCRIPTION, "units": units}


def _companion(name: str, *sources: str) -> Builder:
    return Builder(2, name, (*sources, "companion.py", "host"), fmi2.ENTRY, _tables)


_SWING = _companion("Swing", "swing.py", "double_pendulum.py", "taylor.py")
_LAUNCH = _companion("Launch", "launch.py", "taylor.py")
_FLIGHT = _companion("BallFlight", "ball_flight.py", "taylor.py")

#: The companions by name.
COMPANIONS = {builder.name: builder for builder in (_SWING, _LAUNCH, _FLIGHT)}


def build(folder: Path, standalone: bool = False) -> list[Path]:
    """Build the companions and the .ssp (the last one) in a folder, standalone or plain.

    OSError: one can't be written. StandaloneError: this machine can't build standalone ones.
    """

    def files(builder: Builder) -> dict[str, bytes]:
        return alone.standalone(builder.files()) if standalone else builder.files()

    suffix = alone.SUFFIX if standalone else ""
    made = [
        write_archive(folder / f"{name}{suffix}.fmu", files(builder))
        for name, builder in COMPANIONS.items()
    ]
    system = {"SystemStructure.ssd": _system_structure()}
    for name, start in DRIVE.items():
        # An importer that sets nothing, such as fmpy.ssp, which ignores parameter bindings, has
        # these start values too.
        builder = COMPANIONS.get(name, fmi2.BUILDER)._replace(start=start)
        system[f"{_RESOURCES}/{name}.fmu"] = pack(files(builder))
    ssp = (folder / NAME).with_suffix(f"{suffix}.ssp")
    # FMUs are compressed already.
    return [*made, write_archive(ssp, system, zipfile.ZIP_STORED)]


def _system_structure() -> bytes:
    """SystemStructure.ssd: SSP 1.0, with the annotation from which libcosim takes its step."""
    components = {}
    for one, observed in OBSERVED.items():
        connectors = [(name, "input") for _, _, component, name in CONNECTIONS if component == one]
        outputs = [name for component, name, _, _ in CONNECTIONS if component == one]
        components[one] = connectors + [(name, "output") for name in (*outputs, *observed)]
    return render(
        HERE / "SystemStructure.ssd.jinja",
        components=components,
        connections=CONNECTIONS,
        booleans=_BOOLEANS,
        parameters=DRIVE,
        stop_time=STOP_TIME,
        step_size=STEP_SIZE,
    )
