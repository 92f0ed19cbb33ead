"""What goes around ClubBallImpact.fmu: two companion FMUs, and a system of all three as SSP 1.0."""

import hashlib
import importlib.metadata
import re
import sys
import uuid
import zipfile
from pathlib import Path
from types import ModuleType

import golf_physics
from golf_physics import variables
from golf_physics.variables import Unit, Variable

from golf_build import standalone as alone
from golf_build.archive import unpacked, write_archive
from golf_build.description import HERE, described, rendered
from golf_build.packaging import fmu_source, packaged

#: The system's file, and in it the folder of the FMUs (SSP 1.0, section 5).
NAME = "GolfSwing.ssp"
_RESOURCES = "resources"

#: Module of each companion by the name of its FMU.
COMPANIONS = {"Swing": "swing", "BallFlight": "ball_flight"}

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

#: From component.variable to component.variable: every connected input, and nothing else, since
#: fmpy.ssp stumbles over an input that is listed but not connected.
CONNECTIONS = (
    ("Swing.club_speed", "ClubBallImpact.club_speed"),
    ("ClubBallImpact.mean_force", "Swing.reaction_force"),
    ("ClubBallImpact.ball_velocity", "BallFlight.ball_velocity"),
    ("ClubBallImpact.separated", "BallFlight.separated"),
    ("ClubBallImpact.touch_time", "BallFlight.touch_time"),
    ("ClubBallImpact.contact_time", "BallFlight.contact_time"),
)

#: The components, and outputs that are listed to be seen, though nothing is connected to them.
OBSERVED = {
    "Swing": ("head_speed", "energy", "work", "reaction_work", "reaction_impulse"),
    "ClubBallImpact": (
        *("force", "impulse", "club_position", "ball_position", "club_velocity", "smash_factor"),
    ),
    "BallFlight": ("carry", "apex", "flight_time", "distance", "height", "landed"),
}

_BOOLEANS = ("separated", "landed")

#: The system's own experiment: long enough for the swing, the impact and the launch.
STOP_TIME = 1.0
STEP_SIZE = 1e-4


def build(folder: Path, impact: Path, standalone: bool = False) -> list[Path]:
    """Build the system.

    Args:
        folder: where the companions and the .ssp go.
        impact: ClubBallImpact.fmu.
        standalone: whether the companions bring a Python of their own.

    Returns:
        The files written, the .ssp last.

    Raises:
        OSError: one of them can't be written.
        StandaloneError: this machine can't build standalone ones.
    """
    folder, suffix = folder.resolve(), alone.SUFFIX if standalone else ""
    companions = {f"{name}.fmu": folder / f"{name}{suffix}.fmu" for name in COMPANIONS}
    for name, out in companions.items():
        build_companion(name.removesuffix(".fmu"), out, standalone)
    fmus = companions | {"ClubBallImpact.fmu": impact}
    files = {f"{_RESOURCES}/{name}": file.read_bytes() for name, file in fmus.items()}
    files["SystemStructure.ssd"] = _system_structure()
    ssp = (folder / NAME).with_suffix(f"{suffix}.ssp")
    # FMUs are compressed already.
    return [*companions.values(), write_archive(ssp, files, zipfile.ZIP_STORED)]


# The companions


def build_companion(name: str, out: Path, standalone: bool = False) -> Path:
    """Build a companion.

    Args:
        name: one of COMPANIONS.
        out: the file to write.
        standalone: whether it brings a Python of its own.

    Returns:
        The file written.

    Raises:
        OSError: it can't be written.
        StandaloneError: this machine can't build a standalone one.
    """
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
    return write_archive(out, alone.standalone(files) if standalone else files)


def _sources(module: str) -> dict[str, bytes]:
    """A companion's modules by name: its class, and what of ours that imports, and so on."""
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
            rows.append(Variable(one, causality, *of_type, 0, 0, "", None, None, text))
    used = {row.unit for row in rows}
    units = {unit: Unit(base, {}) for unit, base in UNITS.items() if unit in used}
    return described(2, rows, name=name, token=guid, description=tables.DESCRIPTION, units=units)


# The system


def _system_structure() -> bytes:
    """SystemStructure.ssd: SSP 1.0, with the annotation that libcosim takes its step from."""
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
        stop_time=STOP_TIME,
        step_size=STEP_SIZE,
    )
