"""Whether a file is an FMU that runs here."""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import fmpy
from fmpy.model_description import ModelDescription
from fmpy.util import read_csv

from golf_build.archive import SUMS, checksums, scratch, unpack
from golf_build.fmi2 import BUILDER
from golf_build.native import binaries_of, this_machine
from golf_impact.data.errors import UserError, first_line
from golf_impact.data.runs import FLAGS, METRICS, PATH

#: Of a reference result, relative to the largest value. Measured: 5.3e-16; another C library may
#: have other last digits.
TOLERANCE = 1e-12


def check_temporary_folder() -> None:
    """UserError if pythonfmu would crash in the temporary folder.

    Of the URI of the resources pythonfmu 0.7 decodes %20 only.
    """
    folder = tempfile.gettempdir()
    if re.sub(r"[A-Za-z0-9/._~ \\:-]", "", folder):
        raise UserError(
            f"pythonfmu can't load an FMU from {folder}: set TMPDIR to a folder whose name has "
            "letters, digits, spaces and . _ ~ - only"
        )


def read_fmu(path: Path) -> tuple[dict[str, bytes], ModelDescription]:
    """The files of an FMU that can be run here, and its description.

    A file that has a list of its members with their digests must have these members and no others,
    except binaries that an importer has compiled from the sources in it.

    Raises:
        UserError: it is missing, damaged, no FMU, or has no binary for this machine.
    """
    # Not Path.is_file, which raises without permission to read.
    if not os.path.isfile(path):
        raise UserError(f"there is no FMU file at {path}: run `golf-impact build`")
    try:
        files = unpack(path)  # which checks sizes and CRCs
        files = {name: data for name, data in files.items() if not name.endswith("/")}
        there = checksums({name: files[name] for name in files if name != SUMS})
        changed = set(there.splitlines()) ^ set(files.get(SUMS, there).splitlines())
        compiled = "sources/all.c" in files and all(b"  binaries/" in line for line in changed)
        if changed and not compiled:
            raise ValueError("it has been changed since it was built")
        if "SystemStructure.ssd" in files:
            raise UserError(f"{path} is an SSP, not an FMU: its FMUs are in its folder resources/")
        if "modelDescription.xml" not in files:
            raise ValueError("modelDescription.xml is missing")
        about = fmpy.read_model_description(str(path))
    except UserError:
        raise
    except Exception as error:  # zipfile, XML and fmpy raise many types for damaged files
        text = f"{path} is not a readable FMU ({first_line(error)}): run `golf-impact build`"
        raise UserError(text) from error
    machine, machines = this_machine(), binaries_of(files)
    if machine not in machines:
        others = " and ".join(sorted(machines)) or "none"
        raise UserError(
            f"{path} has no binary for this machine, {machine}, but for {others}: use it there"
        )
    return files, about


def check_fmu(path: Path) -> Path:
    """Check a file that a user names: it must be a ClubBallImpact.fmu that runs here.

    Raises:
        UserError: it is missing, damaged, another FMU, or can't be run here.
    """
    _, about = read_fmu(path)
    known = {variable.name for variable in about.modelVariables}
    if missing := [name for name in (*METRICS, *PATH, *FLAGS) if name not in known]:
        raise UserError(f"{path} is another FMU ({about.modelName}): it lacks {missing[0]}")
    if about.fmiVersion != "2.0" or about.coSimulation is None:
        why = "is not an FMI 2.0 co-simulation FMU"
        raise UserError(f"{path} {why}: run `golf-impact build`")
    if not BUILDER.is_current(path):
        try:
            run_here(path)
        except UserError as error:
            raise UserError(f"{error}: run `golf-impact build`") from error
    return path


def run_here(fmu: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Run an FMU in a process of its own, which it may crash: `step` and `deviations`.

    Modules are imported from the same folders as here, never from the working folder; what the
    process leaves behind is removed.

    Raises:
        UserError: it can't be run here.
    """
    program = (
        f"import json, sys; sys.path[:] = {sys.path!r}; from golf_impact.fmu import file as here; "
        "print(json.dumps([here.step(sys.argv[1]), here.deviations(sys.argv[1])]))"
    )
    with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
        done = subprocess.run(
            [sys.executable, "-c", program, str(fmu)],
            capture_output=True,
            text=True,
            errors="replace",
            env={**os.environ, "TMPDIR": folder, "TEMP": folder, "TMP": folder},
        )
    if code := done.returncode:
        ended = f"signal {-code}" if code < 0 else f"exit {code}"
        why = (done.stderr.strip() or "no message").splitlines()[-1]
        raise UserError(f"{fmu} can't be run here ({ended}: {why})")
    outputs, found = json.loads(done.stdout.splitlines()[-1])
    return outputs, found


def step(path: str) -> dict[str, float]:
    """Outputs of an FMU after a step of 5 ms by name (SI units): S and COR, or another one."""
    end = fmpy.simulate_fmu(path, stop_time=5e-3, output_interval=5e-3)[-1]
    _, *outputs = end.dtype.names
    shown = ("smash_factor", "coefficient_of_restitution")
    names = [name for name in shown if name in outputs] or outputs[:1]
    return {name: float(end[name]) for name in names}


def deviations(path: str) -> dict[str, float]:
    """The largest deviation from the reference results in an FMU by case.

    Relative to the largest value of the output; the files are named as in the Reference FMUs.
    """
    found: dict[str, float] = {}
    files = unpack(Path(path))
    with scratch({name: files[name] for name in files if name.endswith(".csv")}) as folder:
        for file in folder.rglob("extra/**/*_ref.csv"):
            case, expected = str(file).removesuffix("_ref.csv"), read_csv(str(file))
            start, inputs = Path(f"{case}_start.csv"), f"{case}_in.csv"
            values = start.read_text().split()[1:] if start.exists() else []
            names = expected.dtype.names[1:]
            rows = fmpy.simulate_fmu(
                path,
                start_values=dict(value.split(",") for value in values),
                input=read_csv(inputs) if os.path.exists(inputs) else None,
                output=names,
                output_interval=expected["time"][1],
                stop_time=expected["time"][-1],
            )
            errors = [
                abs(rows[name] - expected[name]).max() / abs(expected[name]).max() for name in names
            ]
            found[Path(case).name.partition("_")[2]] = float(max(errors))
    return found
