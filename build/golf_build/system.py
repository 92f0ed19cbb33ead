"""Builds what goes around ClubBallImpact.fmu: two companion FMUs, a system of all three as SSP 1.0,
and the files that the FMI cross-check rules ask for.
"""

import csv
import hashlib
import importlib.metadata
import io
import re
import sys
import tempfile
import uuid
import zipfile
from pathlib import Path
from types import ModuleType
from xml.dom import minidom
from xml.etree import ElementTree

from golf_build import fmi2

#: The system's file, and in it the folder of the FMUs (SSP 1.0, section 5).
NAME = "GolfSwing.ssp"
_RESOURCES = "resources"

#: Module of each companion by the name of its FMU.
COMPANIONS = {"Swing": "swing", "BallFlight": "ball_flight"}

#: From component.variable to component.variable: every connected input, and nothing else, since
#: fmpy.ssp stumbles over an input that is listed but not connected.
CONNECTIONS = (
    ("Swing.club_speed", "ClubBallImpact.club_speed"),
    ("ClubBallImpact.ball_velocity", "BallFlight.ball_velocity"),
    ("ClubBallImpact.separated", "BallFlight.separated"),
    ("ClubBallImpact.touch_time", "BallFlight.touch_time"),
    ("ClubBallImpact.contact_time", "BallFlight.contact_time"),
)

#: Outputs that are listed to be seen, though nothing is connected to them.
OBSERVED = (
    "ClubBallImpact.force",
    "ClubBallImpact.mean_force",
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
STOP_TIME = 0.06
STEP_SIZE = 1e-4

_SSP = "http://ssp-standard.org/SSP1/"
_OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"

#: What the cross-check's reference records: at most 10 variables are recommended.
REFERENCE = (
    "force",
    "club_velocity",
    "ball_velocity",
    "compression",
    "smash_factor",
    "coefficient_of_restitution",
    "energy_efficiency",
    "contact_time",
    "max_force",
    "impulse",
)
_REFERENCE_STOP, _REFERENCE_STEP = 0.001, 2e-6

_README_TITLE = "# Cross-check files of the golf club–ball impact FMU"


def build(folder: Path, impact: Path | None = None) -> list[Path]:
    """Build the system.

    Args:
        folder: where the companions and the .ssp go.
        impact: ClubBallImpact.fmu; built into the folder if None.

    Returns:
        The files written, the .ssp last.

    Raises:
        OSError: one of them can't be written.
    """
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    if impact is None:
        impact = fmi2.build(folder / f"{fmi2.NAME}.fmu")
        written.append(impact)
    written += [build_companion(name, folder / f"{name}.fmu") for name in COMPANIONS]
    files = {"SystemStructure.ssd": _system_structure()}
    fmus = {"ClubBallImpact.fmu": impact} | {f"{n}.fmu": folder / f"{n}.fmu" for n in COMPANIONS}
    files |= {f"{_RESOURCES}/{name}": file.read_bytes() for name, file in sorted(fmus.items())}
    # FMUs are compressed already.
    written.append(_write(folder / NAME, _archive(files, zipfile.ZIP_STORED)))
    return written


def _write(path: Path, data: bytes) -> Path:
    """Write a file aside and rename it, so that it is always whole."""
    aside = path.with_name(f".{uuid.uuid4().hex}.part")
    try:
        aside.write_bytes(data)
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)
    return path


def _archive(files: dict[str, bytes], method: int) -> bytes:
    """A zip file in the order given; the same files make the same bytes."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", method) as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            info.compress_type = method
            info.create_system = 3
            info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(info, content)
    return data.getvalue()


# The companions


def build_companion(name: str, out: Path) -> Path:
    """Build Swing.fmu or BallFlight.fmu.

    Args:
        name: "Swing" or "BallFlight".
        out: the file to write.

    Returns:
        The file written.

    Raises:
        OSError: it can't be written.
    """
    from pythonfmu.builder import FmuBuilder

    text = fmi2.face(COMPANIONS[name]).read_bytes()
    # The one module that each of them has of golf_impact.
    (imported,) = re.findall(rb"^from golf_impact\.([\w.]+) import", text, re.MULTILINE)
    shared = fmi2.bundled()[f"{imported.decode().replace('.', '/')}.py"]
    digest = hashlib.sha256(
        importlib.metadata.version("pythonfmu").encode() + text + shared
    ).hexdigest()
    # Modules are found by name: one with a digest can't be taken for another build's.
    module = f"{COMPANIONS[name]}_{digest[:16]}"
    private = f"{imported.decode().rpartition('.')[2]}_{digest[:16]}"
    text = text.replace(b"from golf_impact.%s " % imported, f"from {private} ".encode())
    before, write_bytecode = list(sys.path), sys.dont_write_bytecode
    with tempfile.TemporaryDirectory(prefix="golf-impact-build-") as scratch:
        script = Path(scratch) / f"{module}.py"
        script.write_bytes(text)
        beside = Path(scratch) / f"{private}.py"
        beside.write_bytes(shared)
        sys.dont_write_bytecode = True
        try:
            raw = FmuBuilder.build_FMU(
                script,
                dest=Path(scratch) / "packaged",
                project_files=[beside],
                canGetAndSetFMUstate=True,
                canSerializeFMUstate=True,
            )
            tables = sys.modules[module]
        finally:
            sys.path[:] = before
            sys.dont_write_bytecode = write_bytecode
            for loaded in (module, private):
                sys.modules.pop(loaded, None)
        with zipfile.ZipFile(raw) as archive:
            files = {info.filename: archive.read(info) for info in archive.infolist()}
    description = "modelDescription.xml"
    files[description] = _model_description(files[description], tables, digest)
    ordered = {n: files[n] for n in sorted(files, key=lambda n: (n != description, n))}
    return _write(out, _archive(ordered, zipfile.ZIP_DEFLATED))


def _model_description(written: bytes, tables: ModuleType, digest: str) -> bytes:
    """What pythonfmu wrote, with units, initial unknowns and nothing that changes."""
    root = ElementTree.fromstring(written)
    for element in root.iter():
        element.tail = element.text = None
    root.attrib |= {
        "guid": str(uuid.uuid5(uuid.NAMESPACE_URL, f"golf-impact/companion/{digest}")),
        "generationDateAndTime": "1980-01-01T00:00:00Z",
        "author": "The golf-impact developers",
        "license": "MIT",
        "description": tables.DESCRIPTION,
        "variableNamingConvention": "flat",
    }
    units = ElementTree.Element("UnitDefinitions")
    for name, base in tables.UNITS.items():
        node = ElementTree.SubElement(units, "Unit", name=name)
        ElementTree.SubElement(node, "BaseUnit", {k: str(v) for k, v in base.items()})
    tags = [element.tag for element in root]
    root.insert(tags.index("CoSimulation") + 1, units)
    rows = (*tables.PARAMETERS, *getattr(tables, "INPUTS", ()), *tables.OUTPUTS)
    unit_of = {row[0]: row[1] for row in rows}
    for variable in root.iterfind("ModelVariables/ScalarVariable"):
        unit = unit_of[variable.attrib["name"]]
        if unit is not None:
            variable[0].set("unit", unit)
    structure = root.find("ModelStructure")
    assert structure is not None
    initial = ElementTree.SubElement(structure, "InitialUnknowns")
    for unknown in structure.iterfind("Outputs/Unknown"):
        # A value read at a communication point belongs to the step before: no direct feedthrough.
        unknown.set("dependencies", "")
        ElementTree.SubElement(initial, "Unknown", index=unknown.attrib["index"])
    return _pretty(root)


def _pretty(root: ElementTree.Element) -> bytes:
    text = ElementTree.tostring(root, "utf-8")
    return minidom.parseString(text).toprettyxml(indent="  ", encoding="UTF-8")


# The system


def _system_structure() -> bytes:
    """SystemStructure.ssd: SSP 1.0, with the annotation that libcosim takes its step from."""
    root = ElementTree.Element(
        "ssd:SystemStructureDescription",
        {
            "xmlns:ssd": f"{_SSP}SystemStructureDescription",
            "xmlns:ssc": f"{_SSP}SystemStructureCommon",
            "xmlns:osp": _OSP,
            "name": "GolfSwing",
            "version": "1.0",
        },
    )
    system = ElementTree.SubElement(root, "ssd:System", name="GolfSwing")
    elements = ElementTree.SubElement(system, "ssd:Elements")
    outputs = [start for start, _ in CONNECTIONS] + list(OBSERVED)
    for component in ("Swing", "ClubBallImpact", "BallFlight"):
        node = ElementTree.SubElement(
            elements,
            "ssd:Component",
            name=component,
            type="application/x-fmu-sharedlibrary",
            source=f"{_RESOURCES}/{component}.fmu",
        )
        connectors = ElementTree.SubElement(node, "ssd:Connectors")
        for kind, paths in (("input", [end for _, end in CONNECTIONS]), ("output", outputs)):
            for path in paths:
                owner, name = path.split(".")
                if owner == component:
                    connector = ElementTree.SubElement(
                        connectors, "ssd:Connector", name=name, kind=kind
                    )
                    type_ = "ssc:Boolean" if name in _BOOLEANS else "ssc:Real"
                    ElementTree.SubElement(connector, type_)
    connections = ElementTree.SubElement(system, "ssd:Connections")
    for start, end in CONNECTIONS:
        (from_, output), (to, input_) = start.split("."), end.split(".")
        ElementTree.SubElement(
            connections,
            "ssd:Connection",
            startElement=from_,
            startConnector=output,
            endElement=to,
            endConnector=input_,
        )
    experiment = ElementTree.SubElement(
        root, "ssd:DefaultExperiment", startTime="0", stopTime=repr(STOP_TIME)
    )
    annotations = ElementTree.SubElement(experiment, "ssd:Annotations")
    annotation = ElementTree.SubElement(
        annotations, "ssc:Annotation", type="com.opensimulationplatform"
    )
    algorithm = ElementTree.SubElement(annotation, "osp:Algorithm")
    ElementTree.SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=repr(STEP_SIZE))
    return _pretty(root)


# Cross-check files


def write_cross_check(fmu: Path) -> list[Path]:
    """Write _ref.csv, _ref.opt, _in.csv and README.md next to ClubBallImpact.fmu.

    The rules: github.com/modelica/fmi-cross-check, FMI-CROSS-CHECK-RULES.md, sections 9.1.4 and 10.
    A README.md that isn't one of these is left alone.

    Args:
        fmu: the FMU, which is run for the reference.

    Returns:
        The files written.

    Raises:
        OSError: one of them can't be written.
    """
    import fmpy

    result = fmpy.simulate_fmu(
        str(fmu),
        stop_time=_REFERENCE_STOP,
        step_size=_REFERENCE_STEP,
        output_interval=_REFERENCE_STEP,
        output=list(REFERENCE),
    )
    rows = [[repr(float(value)) for value in row] for row in result.tolist()]
    description = fmpy.read_model_description(str(fmu))
    inputs = {v.name: float(v.start) for v in description.modelVariables if v.causality == "input"}
    stem = fmu.with_suffix("")
    files = {
        Path(f"{stem}_ref.csv"): _csv(["time", *REFERENCE], rows),
        Path(f"{stem}_in.csv"): _csv(
            ["time", *inputs],
            [[repr(time), *map(repr, inputs.values())] for time in (0.0, _REFERENCE_STOP)],
        ),
        Path(f"{stem}_ref.opt"): (
            f"StartTime, 0.0\nStopTime, {_REFERENCE_STOP}\nStepSize, {_REFERENCE_STEP}\n"
            f"RelTol, 1e-09\nOutputIntervalLength, {_REFERENCE_STEP}\n"
        ).encode(),
    }
    readme = fmu.with_name("README.md")
    if not readme.exists() or readme.read_text("utf-8", "replace").startswith(_README_TITLE):
        files[readme] = _readme(fmu.stem).encode()
    return [_write(path, data) for path, data in files.items()]


def _csv(header: list[str], rows: list[list[str]]) -> bytes:
    """As the cross-check rules want it: quoted names, bare numbers."""
    text = io.StringIO()
    csv.writer(text, quoting=csv.QUOTE_ALL, lineterminator="\n").writerow(header)
    text.writelines(",".join(row) + "\n" for row in rows)
    return text.getvalue().encode()


def _readme(name: str) -> str:
    return f"""{_README_TITLE}

A golf club hits a ball: the contact force, the velocities and the measures of the impact.
FMI 2.0 co-simulation, packaged by pythonfmu; platforms linux64 and win64.

- `{name}.fmu`: the FMU, with its start values.
- `{name}_in.csv`: the inputs, constant at their start values.
- `{name}_ref.csv`: ten outputs from touch at t = 0 until after the bodies have parted.
- `{name}_ref.opt`: start, stop, step and tolerance.

The FMU needs a Python 3.10 or later with its standard library, nothing else. A tool that isn't
Python itself needs libpython loaded before it; `golf-impact doctor` prints the line for a machine.
Each value is the exact solution at its time, whatever the communication step; the reference was
computed with steps of {_REFERENCE_STEP} s and can be met to 1e-12 of each variable's largest value.
Contact ends inside a step: there force and compression go to 0 with a kink.
"""
