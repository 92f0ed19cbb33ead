"""What goes around ClubBallImpact.fmu: two companion FMUs, and a system of all three as SSP 1.0."""

import hashlib
import importlib.metadata
import re
import sys
import uuid
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import golf_impact

from golf_build import description as xml
from golf_build.archive import packed, unpacked, whole
from golf_build.packaging import HERE, bundled, face_file, packaged, rendered

#: The system's file, and in it the folder of the FMUs (SSP 1.0, section 5).
NAME = "GolfSwing.ssp"
_RESOURCES = "resources"

#: Module of each companion by the name of its FMU.
COMPANIONS = {"Swing": "swing", "BallFlight": "ball_flight"}

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

#: Outputs that are listed to be seen, though nothing is connected to them.
OBSERVED = (
    "Swing.head_speed",
    "Swing.energy",
    "Swing.work",
    "Swing.reaction_work",
    "Swing.reaction_impulse",
    "ClubBallImpact.force",
    "ClubBallImpact.impulse",
    "ClubBallImpact.club_position",
    "ClubBallImpact.ball_position",
    "ClubBallImpact.club_velocity",
    "ClubBallImpact.smash_factor",
    "BallFlight.carry",
    "BallFlight.apex",
    "BallFlight.flight_time",
    "BallFlight.distance",
    "BallFlight.height",
    "BallFlight.landed",
)

_BOOLEANS = ("separated", "landed")

#: The system's own experiment: long enough for the swing, the impact and the launch.
STOP_TIME = 1.0
STEP_SIZE = 1e-4


Files = dict[str, bytes]


def _as_they_are(files: Files) -> Files:
    return files


def build(
    folder: Path,
    impact: Path,
    finished: Callable[[Files], Files] = _as_they_are,
    suffix: str = "",
) -> list[Path]:
    """Build the system.

    Args:
        folder: where the companions and the .ssp go.
        impact: ClubBallImpact.fmu.
        finished: what becomes of the files of a companion, by name.
        suffix: comes behind the files' names.

    Returns:
        The files written, the .ssp last.

    Raises:
        OSError: one of them can't be written.
    """
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    companions = {name: folder / f"{name}{suffix}.fmu" for name in COMPANIONS}
    written = [build_companion(name, out, finished) for name, out in companions.items()]
    files = {"SystemStructure.ssd": _system_structure()}
    fmus = {"ClubBallImpact.fmu": impact} | {f"{n}.fmu": out for n, out in companions.items()}
    files |= {f"{_RESOURCES}/{name}": file.read_bytes() for name, file in sorted(fmus.items())}
    # FMUs are compressed already.
    name = Path(NAME).with_suffix(f"{suffix}.ssp").name
    written.append(_written(folder / name, packed(files, zipfile.ZIP_STORED)))
    return written


def _written(path: Path, data: bytes) -> Path:
    with whole(path) as stream:
        stream.write(data)
    return path


# The companions


def build_companion(
    name: str, out: Path, finished: Callable[[Files], Files] = _as_they_are
) -> Path:
    """Build a companion.

    Args:
        name: one of COMPANIONS.
        out: the file to write.
        finished: what becomes of its files, by name.

    Returns:
        The file written.

    Raises:
        OSError: it can't be written.
    """
    sources = _sources(COMPANIONS[name])
    versions = f"{importlib.metadata.version('pythonfmu')} {golf_impact.__version__}".encode()
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
    states = {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True}
    with packaged("pythonfmu", face, texts[face], beside, states) as raw:
        files = unpacked(raw)
        guid = str(uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/companion/{digest}"))
        description = _described(files["modelDescription.xml"], sys.modules[face], guid)
    return _written(out, packed(finished(files | {"modelDescription.xml": description})))


def _sources(module: str) -> dict[str, bytes]:
    """A companion's modules by name: its class, and what of ours that imports, and so on."""
    found: dict[str, bytes] = {}
    todo = [module]
    while todo:
        name = todo.pop()
        if name in found:
            continue
        within = name.partition("golf_impact.")[2]
        file = f"{within.replace('.', '/')}.py"
        found[name] = bundled()[file] if within else face_file(name).read_bytes()
        imported = re.findall(r"(?m)^from ([\w.]+) import", found[name].decode())
        todo += [
            one for one in imported if one.startswith("golf_impact.") or face_file(one).exists()
        ]
    return found


def _described(written: bytes, tables: ModuleType, guid: str) -> bytes:
    """What pythonfmu wrote, with units, initial unknowns and nothing that changes."""
    root = xml.parsed(written, guid=guid, description=tables.DESCRIPTION)
    xml.insert_units(root, tables.UNITS)
    rows = (*tables.PARAMETERS, *getattr(tables, "INPUTS", ()), *tables.OUTPUTS)
    unit_of = {row[0]: row[1] for row in rows}
    for variable in xml.child(root, "ModelVariables"):
        unit = unit_of[variable.attrib["name"]]
        if unit is not None:
            variable[0].set("unit", unit)
    xml.list_initial_unknowns(root)
    return xml.as_text(root)


# The system


def _system_structure() -> bytes:
    """SystemStructure.ssd: SSP 1.0, with the annotation that libcosim takes its step from."""
    inputs = [(end, "input") for _, end in CONNECTIONS]
    outputs = [(start, "output") for start, _ in CONNECTIONS]
    observed = [(path, "output") for path in OBSERVED]
    components: dict[str, list[tuple[str, str]]] = {
        name: [] for name in ("Swing", "ClubBallImpact", "BallFlight")
    }
    for path, kind in (*inputs, *outputs, *observed):
        component, name = path.split(".")
        components[component].append((name, kind))
    return rendered(
        HERE / "SystemStructure.ssd.jinja",
        components=components,
        connections=[(*start.split("."), *end.split(".")) for start, end in CONNECTIONS],
        booleans=_BOOLEANS,
        stop_time=STOP_TIME,
        step_size=STEP_SIZE,
    )
