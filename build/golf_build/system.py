"""The system around ClubBallImpact: its companion FMUs, and the system of all four as SSP 1.0."""

import hashlib
import importlib.metadata
import json
import re
import sys
import uuid
import zipfile
from collections.abc import Mapping
from math import pi
from pathlib import Path
from types import ModuleType

import golf_physics
from golf_physics import variables
from golf_physics.variables import Unit, Variable

from golf_build import fmi2
from golf_build import standalone as alone
from golf_build.archive import SUMS, scratch, sums, unpacked, write_archive
from golf_build.description import HERE, described, rendered
from golf_build.packaging import fmu_source, packaged

#: The system's file, and in it the folder of the FMUs (SSP 1.0, section 5).
NAME = "GolfSwing.ssp"
_RESOURCES = "resources"

#: Module of each companion by the name of its FMU.
COMPANIONS = {"Swing": "swing", "Launch": "launch", "BallFlight": "ball_flight"}

#: Exponents of base units by the name of a unit: those of ClubBallImpact, and the companions'.
UNITS = {name: unit.base for name, unit in (variables.UNITS | variables.MORE_UNITS).items()} | {
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "m2/s": {"m": 2, "s": -1},
    "kg/m3": {"kg": 1, "m": -3},
    "kg.m": {"kg": 1, "m": 1},
    "kg.m2": {"kg": 1, "m": 2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
}

#: Display unit of a companion's variables by their unit, and its factor.
DISPLAY = {"rad": ("deg", 180.0 / pi), "rad/s": ("rpm", 30.0 / pi)}

#: From component.variable to component.variable: every connected input, and nothing else, since
#: fmpy.ssp fails at an input that is listed but not connected.
CONNECTIONS = (
    ("Swing.club_speed", "ClubBallImpact.club_speed"),
    ("ClubBallImpact.impulse", "Swing.impulse"),
    ("ClubBallImpact.separated", "Launch.separated"),
    ("ClubBallImpact.ball_velocity", "Launch.ball_velocity"),
    ("ClubBallImpact.club_velocity", "Launch.club_velocity"),
    ("ClubBallImpact.smash_factor", "Launch.smash_factor"),
    ("ClubBallImpact.coefficient_of_restitution", "Launch.coefficient_of_restitution"),
    ("Launch.launched", "BallFlight.separated"),
    ("Launch.ball_speed", "BallFlight.ball_velocity"),
    ("Launch.launch_angle", "BallFlight.launch_angle"),
    ("Launch.backspin", "BallFlight.backspin"),
    ("ClubBallImpact.touch_time", "BallFlight.touch_time"),
    ("ClubBallImpact.contact_time", "BallFlight.contact_time"),
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
STOP_TIME = 1.0
STEP_SIZE = 1e-4


def build(folder: Path, standalone: bool = False) -> list[Path]:
    """Build the companions and the .ssp (the last one) in a folder, standalone or plain.

    OSError: one can't be written. StandaloneError: this machine can't build standalone ones.
    """
    folder, suffix = folder.resolve(), alone.SUFFIX if standalone else ""
    plain = {name: _companion_files(name) for name in COMPANIONS}
    made = [
        write_archive(folder / f"{name}{suffix}.fmu", alone.standalone(fmu) if standalone else fmu)
        for name, fmu in plain.items()
    ]
    plain["ClubBallImpact"] = fmi2.BUILDER.files()
    files = {"SystemStructure.ssd": _system_structure()}
    for name, values in DRIVE.items():
        fmu = with_start_values(plain[name], values) if values else plain[name]
        whole = alone.standalone(fmu) if standalone else fmu
        files[f"{_RESOURCES}/{name}.fmu"] = _archived(whole)
    ssp = (folder / NAME).with_suffix(f"{suffix}.ssp")
    # FMUs are compressed already.
    return [*made, write_archive(ssp, files, zipfile.ZIP_STORED)]


def _archived(files: dict[str, bytes]) -> bytes:
    with scratch({}) as folder:
        return write_archive(folder / "packed.fmu", files).read_bytes()


def with_start_values(files: Mapping[str, bytes], values: Mapping[str, float]) -> dict[str, bytes]:
    """A plain FMU with other start values: in its description, and set by every new instance.

    An importer that sets nothing, such as fmpy.ssp, which ignores parameter bindings, has them too.
    """
    changed = json.dumps([files["modelDescription.xml"].decode(), dict(values)]).encode()
    digest = hashlib.sha256(changed).hexdigest()
    text = files["modelDescription.xml"].decode()
    given: dict[str, dict[int, float]] = {"Real": {}, "Integer": {}}
    for name, number in values.items():
        variable = rf'(<ScalarVariable name="{name}" valueReference="(\d+)"[^>]*>\s*'
        variable += r'<(\w+)[^>]*start=")[^"]*'
        (found,) = re.finditer(variable, text)
        given[found[3]][int(found[2])] = number
        text = text[: found.start()] + found[1] + repr(number) + text[found.end() :]
    token = uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/start-values/{digest}")
    text = re.sub(r'guid="[^"]*"', f'guid="{token}"', text, count=1)
    (model,) = re.findall(r'modelIdentifier="(\w+)"', text)
    entry = files["resources/slavemodule.txt"].decode().strip()
    # A module of its own: another instance of the FMU in the same process keeps its start values.
    module = f"{entry}_{digest[:16]}"
    source = _ENTRY.format(entry=entry, model=model, reals=given["Real"], whole=given["Integer"])
    made = {name: data for name, data in files.items() if name != SUMS} | {
        "modelDescription.xml": text.encode(),
        "resources/slavemodule.txt": module.encode(),
        f"resources/{module}.py": source.encode(),
    }
    return made | {SUMS: sums(made)} if SUMS in files else made


_ENTRY = '''"""The FMU with other start values."""

import {entry} as original


class {model}(original.{model}):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for assign, values in ((self.set_real, {reals}), (self.set_integer, {whole})):
            if values:
                assign(list(values), list(values.values()))
'''


# The companions


def build_companion(name: str, out: Path, standalone: bool = False) -> Path:
    """Build a companion (of COMPANIONS), standalone or plain; errors as of `build`."""
    files = _companion_files(name)
    return write_archive(out, alone.standalone(files) if standalone else files)


def _companion_files(name: str) -> dict[str, bytes]:
    """The files of a plain companion by name."""
    sources = _sources(COMPANIONS[name])
    versions = f"{importlib.metadata.version('pythonfmu')} {golf_physics.__version__}".encode()
    digest = hashlib.sha256(versions + b"\0".join(sources.values())).hexdigest()
    # Modules are found by name: one with a digest can't be taken for another build's.
    names = {module: f"{module.rpartition('.')[2]}_{digest[:16]}" for module in sources}
    texts = {}
    for module, text in sources.items():
        for used, private in names.items():
            text = text.replace(f"from {used} ".encode(), f"from {private} ".encode())
        texts[names[module]] = text
    face = names[COMPANIONS[name]]
    beside = {f"{module}.py": text for module, text in texts.items() if module != face}
    guid = str(uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/companion/{digest}"))
    with packaged(2, face, texts[face], beside) as raw:
        files = unpacked(raw)
        files["modelDescription.xml"] = _described(name, sys.modules[face], guid)
    return files


def _sources(module: str) -> dict[str, bytes]:
    """A companion's modules by name: that of its class, and all of ours that are imported."""
    found: dict[str, bytes] = {}
    todo = [module]
    while todo:
        name = todo.pop()
        file = fmu_source(f"{name.replace('.', '/')}.py")
        if name not in found and file.exists():
            found[name] = file.read_bytes()
            todo += re.findall(r"(?m)^from ([\w.]+) import", found[name].decode())
    return found


def _described(name: str, tables: ModuleType, guid: str) -> bytes:
    groups = {"parameter": tables.PARAMETERS, "input": tables.INPUTS, "output": tables.OUTPUTS}
    rows = []
    for causality, group in groups.items():
        for one, unit, *values, text in group:
            of_type = "Real" if unit else "Boolean", unit or "", values[0] if values else None
            display = DISPLAY.get(unit, (None,))[0]
            rows.append(Variable(one, causality, *of_type, 0, 0, "", None, display, text))
    used = {row.unit for row in rows}
    units = {
        unit: Unit(base, dict([DISPLAY[unit]] if unit in DISPLAY else []))
        for unit, base in UNITS.items()
        if unit in used
    }
    return described(2, rows, name=name, token=guid, description=tables.DESCRIPTION, units=units)


# The system


def _system_structure() -> bytes:
    """SystemStructure.ssd: SSP 1.0, with the annotation from which libcosim takes its step."""
    wires = [(*start.split("."), *end.split(".")) for start, end in CONNECTIONS]
    components = {}
    for one, observed in OBSERVED.items():
        inputs = [name for _, _, component, name in wires if component == one]
        outputs = [name for component, name, _, _ in wires if component == one]
        connectors = [(name, "input") for name in inputs]
        components[one] = connectors + [(name, "output") for name in (*outputs, *observed)]
    return rendered(
        HERE / "SystemStructure.ssd.jinja",
        components=components,
        connections=wires,
        booleans=_BOOLEANS,
        parameters=DRIVE,
        stop_time=STOP_TIME,
        step_size=STEP_SIZE,
    )
