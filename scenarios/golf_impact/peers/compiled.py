"""Stepping methods compiled from C and packed as FMUs 2.0: `compiled.c`.

What a modeller who writes C would ship: all steps of an impact inside one communication step. The
arithmetic is that of the document's FMU (masses divide; with reciprocals it would be a quarter
faster).
"""

import shutil
import subprocess
from pathlib import Path

import fmpy

from golf_build.archive import write_archive
from golf_impact.errors import UserError

#: Sub-steps, s, by method: the document's, and one whose error is far below a measurement's.
SUB_STEP = {"euler": 0.5e-6, "rk4": 5e-6}

_ORDER = {"euler": 1, "rk4": 4}
_GUID = "{golf-impact-compiled-peer}"

#: The Real variables in the order of their references, with the start values of the inputs.
_INPUTS = {"k": 1e6, "b": 9.0, "m_club": 0.210, "m_ball": 0.04593, "club_speed": 35.0}
_INPUTS |= {"ball_speed": 0.0, "dt": 5e-7}
_OUTPUTS = (
    *("club_position", "ball_position", "club_velocity", "ball_velocity", "contact_time"),
    *("max_force", "smash_factor", "coefficient_of_restitution", "energy_efficiency"),
)


def compiler() -> str | None:
    """A C compiler of this machine, or None."""
    return shutil.which("cc") or shutil.which("gcc")


def compiled_fmu(method: str, folder: Path) -> Path:
    """The FMU of a method of `SUB_STEP`, built in a folder.

    Raises:
        UserError: the compiler is missing or fails.
    """
    command, name = compiler(), f"compiled_{method}"
    if command is None:
        raise UserError("there is no C compiler (cc, gcc): install one")
    library = folder / f"{name}.so"
    headers = Path(fmpy.__file__).with_name("c-code")
    flags = [
        "-O2",
        "-ffp-contract=off",
        "-shared",
        "-fPIC",
        f"-I{headers}",
        f"-DORDER={_ORDER[method]}",
    ]
    source = str(Path(__file__).with_name("compiled.c"))
    done = subprocess.run(
        [
            command,
            *flags,
            f"-DORDER={_ORDER[method]}",
            f'-DGUID="{_GUID}"',
            source,
            "-o",
            str(library),
        ],
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise UserError(f"{source} can't be compiled: {done.stderr.strip()}")
    files = {
        "modelDescription.xml": _description(name).encode(),
        f"binaries/linux64/{name}.so": library.read_bytes(),
    }
    return write_archive(folder / f"{name}.fmu", files)


def _description(name: str) -> str:
    variables = [
        (variable, f'causality="{"input" if n < 2 else "parameter"}" variability='
         f'"{"continuous" if n < 2 else "fixed"}"', f'Real start="{start!r}"')
        for n, (variable, start) in enumerate(_INPUTS.items())
    ]  # fmt: skip
    variables += [(variable, 'causality="output"', "Real") for variable in _OUTPUTS]
    variables.append(("law", 'causality="parameter" variability="fixed"', 'Integer start="1"'))
    rows = (
        f'<ScalarVariable name="{variable}" valueReference="{n}" {role}><{kind}/></ScalarVariable>'
        for n, (variable, role, kind) in enumerate(variables)
    )
    unknowns = "".join(f'<Unknown index="{n}"/>' for n in range(len(_INPUTS) + 1, len(variables)))
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{_GUID}">'
        f'<CoSimulation modelIdentifier="{name}" canGetAndSetFMUstate="true" '
        'canHandleVariableCommunicationStepSize="true"/>'
        f"<ModelVariables>{''.join(rows)}</ModelVariables><ModelStructure><Outputs>{unknowns}"
        f"</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>"
        "</fmiModelDescription>\n"
    )
