"""The system of four FMUs: built, run by fmpy.ssp, and run by steps of any sizes."""

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from itertools import chain
from pathlib import Path

import fmpy
import numpy as np

from golf_build import system
from golf_build.standalone import Pythons
from golf_impact.fmu.file import building
from golf_impact.fmu.loaded import LoadedFmu


def build_system(
    folder: Path, standalone: bool = False, pythons: Pythons = None
) -> dict[str, Path]:
    """Build the companion FMUs and the .ssp: their files by name, Swing to GolfSwing.

    UserError: a file can't be written.
    """
    with building(f"into {folder}"):
        return system.build(folder, standalone, pythons)


def extract_fmus(ssp: Path, folder: Path) -> dict[str, Path]:
    """The FMUs of an .ssp file, extracted into a folder: paths by the names of the components."""
    fmpy.extract(ssp, folder)
    return {fmu.stem: fmu for fmu in sorted(folder.rglob("*.fmu"))}


def run_ssp(ssp: Path, step: float, stop: float) -> dict[str, np.ndarray]:
    """Run a system's .ssp file in fmpy.ssp by a communication step size to a stop time, s.

    Returns `time` (s, end of each step) and every connector by "Component.variable".
    """
    from fmpy.ssp.simulation import simulate_ssp

    # fmpy adds up its steps: half a step less, and it ends at the stop time.
    rows = simulate_ssp(str(ssp), stop_time=stop - 0.5 * step, step_size=step)
    columns = {name: np.asarray(rows[name], dtype=float) for name in rows.dtype.names[1:]}
    return {"time": step * np.arange(1, len(rows) + 1), **columns}


def run_system(
    fmus: Mapping[str, Path],
    steps: Iterable[float],
    values: Mapping[str, Mapping[str, float]] | None = None,
    rollback: bool = False,
) -> dict[str, np.ndarray]:
    """Run components of the system in parallel: an output reaches the others in the next step.

    Args:
        fmus: files by the names of the components: Swing, ClubBallImpact, perhaps the others.
        steps: communication step sizes, s, of any sizes.
        values: parameters by component, where they aren't the start values.
        rollback: whether the Swing's part of a step is repeated, from the state before it,
            whenever the impulse at its end differs from the one that the Swing has used.

    Returns:
        `time` (s, end of each step) and every Real output by "Component.variable".

    Raises:
        UserError: a component refuses a value or a step.
    """
    with ExitStack() as stack:
        loaded = {name: stack.enter_context(LoadedFmu(path)) for name, path in fmus.items()}
        for name, fmu in loaded.items():
            fmu.start(**(values or {}).get(name, {}))
        wires = [wire for wire in system.CONNECTIONS if wire[0] in loaded and wire[2] in loaded]
        swing, impact = loaded["Swing"], loaded["ClubBallImpact"]
        # Its own start value is a speed at which it would touch the ball at once.
        impact.set(swing.read(["club_speed"]))
        time, rows = 0.0, []
        for size in steps:
            used = swing.read(["impulse"])
            before = swing.slave.getFMUstate() if rollback else None
            for fmu in loaded.values():
                fmu.step(time, size)
            if rollback:
                known = impact.read(["impulse"])
                if known != used:
                    swing.slave.setFMUstate(before)
                    swing.set(known)
                    swing.step(time, size)
                swing.slave.freeFMUstate(before)
            for start, output, end, name in wires:
                source = loaded[start]
                flag = source.variables[output].type == "Boolean"
                value = source.read_flag(output) if flag else source.read([output])[output]
                loaded[end].set({name: value})
            time += size
            read = (fmu.read(fmu.real_outputs).values() for fmu in loaded.values())
            rows.append([time, *chain.from_iterable(read)])
        names = (f"{name}.{output}" for name, fmu in loaded.items() for output in fmu.real_outputs)
        return dict(zip(("time", *names), np.array(rows).T, strict=True))
