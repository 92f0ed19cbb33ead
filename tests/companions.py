"""Fixtures for the companion FMUs: Swing, Launch and BallFlight, built once and loaded by fmpy."""

from itertools import chain

import fmpy
import numpy as np
import pytest
from fmus import begin, discard, get, is_set, make_instance, put

from golf_build import system


@pytest.fixture(scope="session")
def files(system_files):
    """Swing.fmu, Launch.fmu, BallFlight.fmu and GolfSwing.ssp."""
    return system_files()


@pytest.fixture(scope="session")
def ssp(files):
    return files[-1]


@pytest.fixture(scope="session")
def drive(ssp, tmp_path_factory):
    """The four FMUs inside the .ssp by the names of the components."""
    return extract_fmus(ssp, tmp_path_factory.mktemp("drive"))


@pytest.fixture
def made():
    """Instances of extracted FMUs, terminated and freed at the end."""
    slaves = []

    def made(folder, kind=None, **options):
        slaves.append(make_instance(folder, f"instance {len(slaves)}", kind, **options))
        return slaves[-1]

    yield made
    discard(*slaves)


@pytest.fixture
def instance(made, tmp_path_factory):
    """Initialized instances of FMUs by path."""

    def instance(path, **values):
        return begin(
            made(fmpy.extract(str(path), str(tmp_path_factory.mktemp(path.stem)))), **values
        )

    return instance


@pytest.fixture
def companion(files, instance):
    """Instances of a companion by the name of its FMU."""

    def made(name, **values):
        return instance(next(file for file in files if file.stem == name), **values)

    return made


def extract_fmus(ssp, folder):
    """The FMUs of an .ssp file, extracted into a folder: paths by the names of the components."""
    fmpy.extract(ssp, folder)
    return {fmu.stem: fmu for fmu in sorted(folder.rglob("*.fmu"))}


def run_ssp(ssp, step, stop):
    """Run a system's .ssp file in fmpy.ssp by a communication step size to a stop time, s.

    Returns `time` (s, end of each step) and every connector by "Component.variable".
    """
    from fmpy.ssp.simulation import simulate_ssp

    # fmpy adds up its steps: half a step less, and it ends at the stop time.
    rows = simulate_ssp(str(ssp), stop_time=stop - 0.5 * step, step_size=step)
    columns = {name: np.asarray(rows[name], dtype=float) for name in rows.dtype.names[1:]}
    return {"time": step * np.arange(1, len(rows) + 1), **columns}


def run_system(fmus, steps, values=None, rollback=False):
    """Run components of the system in parallel: an output reaches the others in the next step.

    Args:
        fmus: files by the names of the components: Swing, ClubBallImpact, perhaps the others.
        steps: communication step sizes, s, of any sizes.
        values: parameters by component, where they aren't the start values.
        rollback: whether the Swing's part of a step is repeated, from the state before it,
            whenever the impulse at its end differs from the one that the Swing has used.

    Returns:
        `time` (s, end of each step) and every Real output by "Component.variable".
    """
    slaves = {name: make_instance(fmpy.extract(str(path)), name) for name, path in fmus.items()}
    for name, slave in slaves.items():
        begin(slave, **(values or {}).get(name, {}))
    wires = [wire for wire in system.CONNECTIONS if wire[0] in slaves and wire[2] in slaves]
    swing, impact = slaves["Swing"], slaves["ClubBallImpact"]
    # Its own start value is a speed at which it would touch the ball at once.
    put(impact, club_speed=get(swing, "club_speed")[0])
    outputs = {
        name: [n for n, v in slave.variables.items() if (v.causality, v.type) == ("output", "Real")]
        for name, slave in slaves.items()
    }
    time, rows = 0.0, []
    for size in steps:
        used = get(swing, "impulse")
        before = swing.getFMUstate() if rollback else None
        for slave in slaves.values():
            slave.doStep(time, size)
        if rollback:
            known = get(impact, "impulse")
            if known != used:
                swing.setFMUstate(before)
                put(swing, impulse=known[0])
                swing.doStep(time, size)
            swing.freeFMUstate(before)
        for start, output, end, name in wires:
            source = slaves[start]
            flag = source.types[output] == "Boolean"
            put(slaves[end], **{name: is_set(source, output) if flag else get(source, output)[0]})
        time += size
        rows.append([time, *chain(*(get(slaves[name], *outputs[name]) for name in slaves))])
    discard(*slaves.values())
    names = (f"{name}.{output}" for name in slaves for output in outputs[name])
    return dict(zip(("time", *names), np.array(rows).T, strict=True))
