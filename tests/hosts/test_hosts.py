"""Native hosts that are not ours: fmusim of the Reference FMUs, and a host on FMI Library.

They are found in the folder that GOLF_IMPACT_HOSTS names, or where fmusim is on PATH.
"""

import csv
import os
import re
import shutil
import sys
from itertools import pairwise
from pathlib import Path

import fmpy
import pytest
from command import run as run_process
from compare import assert_close
from conftest import CRITERIA, EXPECTED, FILES, LAW_2_CONTACT, holds_c, repeated


def tool(name):
    """The path of a native host; skips if it isn't there."""
    fmusim = shutil.which("fmusim")
    folder = os.environ.get("GOLF_IMPACT_HOSTS") or (fmusim and Path(fmusim).parent)
    path = folder and Path(folder).resolve() / name
    if not (path and path.is_file()):
        pytest.skip(
            f"native host {name} isn't found: put it and fmusim into one folder, and name that in "
            "GOLF_IMPACT_HOSTS or PATH (tests/README.md has how they are built)"
        )
    return path


@pytest.fixture(scope="module")
def run(libpython):
    """Runs a command with libpython preloaded, as the plain FMU needs it."""
    preloaded = {"LD_PRELOAD": str(libpython), "PYTHONHOME": sys.base_prefix}

    def run(*command, alone=False, code=0, **environment):
        env = {**os.environ, **environment, **({} if alone else preloaded)}
        return run_process(*command, env=env, code=code, timeout=300)

    return run


@pytest.fixture(scope="module")
def companions(system_files):
    """Swing, Launch and BallFlight."""
    tool("fmusim")
    return system_files()[:-1]


# fmusim


@pytest.fixture
def simulate(run, tmp_path):
    """Runs an FMU in fmusim; its output as rows by name."""
    program = tool("fmusim")

    def simulate(fmu, *options, kind="cs", outputs=(), code=0, **start):
        words = [word for name, value in start.items() for word in ("--start-value", name, value)]
        words += [word for name in outputs for word in ("--output-variable", name)]
        out = tmp_path / "out.csv"
        words += ["--interface-type", kind, "--output-file", out, *options, fmu]
        done = run(program, *words, alone=holds_c(fmu), code=code)
        rows = csv.DictReader(out.read_text().splitlines())
        return [{name: float(row[name]) for name in row} for row in rows], done

    return simulate


@pytest.fixture
def inputs(tmp_path):
    """An input file: k falls in mid-contact."""
    file = tmp_path / "k.csv"
    file.write_text("time,k\n0,1e6\n3e-4,1e6\n3e-4,8e5\n1,8e5\n")
    return file


@pytest.fixture
def changed_k(fmu):
    """The same run through fmpy: law 2."""
    fmu.begin({"law": 2})
    fmu.step(3e-4)
    fmu.set(k=8e5)
    fmu.step(7e-4)
    return fmu.read(CRITERIA)


CVODE = ("--solver", "cvode", "--tolerance", "1e-10")


@pytest.mark.parametrize(
    ("kind", "path", "options", "tolerance"),
    [
        *(("cs", path, (), 1e-12) for path in FILES),  # measured: 2e-16
        # CVODE must start anew at touch, at separation and with inputs, or the COR is 1.52.
        ("me", "fmi3_path", CVODE, 1e-6),  # measured: 5e-8
    ],
)
def test_fmusim(request, simulate, inputs, changed_k, kind, path, options, tolerance):
    fmu = request.getfixturevalue(path)
    for law, expected in EXPECTED.items():
        for gap in (0.0, 0.005):
            rows, _ = simulate(fmu, *options, kind=kind, law=law, gap=gap, outputs=CRITERIA)
            assert_close(rows[-1], expected, tolerance=tolerance, law=law, gap=gap)
            # The proposed experiment: fmusim takes times that differ by 1e-5 s for equal, and its
            # last step must not be left out.
            assert kind == "me" or (len(rows), rows[-1]["time"]) == (51, 1e-3)
    rows, _ = simulate(fmu, *options, "--input-file", inputs, kind=kind, law=2, outputs=CRITERIA)
    assert_close(rows[-1], changed_k, tolerance=tolerance)


@pytest.mark.parametrize("path", FILES[1::2])
@pytest.mark.parametrize("early", [False, True])
def test_fmusim_event_mode(request, simulate, path, early):
    fmu = request.getfixturevalue(path)
    options = ["--event-mode-used", *["--early-return-allowed"] * early]
    rows, _ = simulate(fmu, *options, law=2, gap=0.005, outputs=CRITERIA)
    assert_close(rows[-1], EXPECTED[2], tolerance=1e-12)
    times = [row["time"] for row in rows]
    events = [now for now, then in pairwise(times) if now == then]
    # pythonfmu3 drops early return; an event has a row before it and one after.
    touch = 0.005 / 35.0
    expected = [touch, touch + LAW_2_CONTACT] if early and holds_c(fmu) else []
    assert events == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("path", FILES)
def test_fmusim_shows_a_refused_start_value(request, simulate, path):
    fmu = request.getfixturevalue(path)
    message = "k = -1.0 N/m is refused: it must be a finite number > 0"
    # Error from the native ones, Discard from the plain one for FMI 3.0; fmusim takes the
    # Discard of FMI 2.0 for the end of the simulation.
    code = 3 if holds_c(fmu) else 2 if path == "fmi3_path" else 0
    _, done = simulate(fmu, code=code, k=-1)
    assert message in done.stderr + done.stdout
    if path == "fmu_path":
        assert done.stderr.count("k = -1.0") == 1
    _, done = simulate(fmu, k=2e6)
    assert done.stderr + done.stdout == ""


@pytest.mark.parametrize("path", FILES[2:])
def test_fmusim_goes_on_from_a_state_file(request, simulate, tmp_path, path):
    """Not the plain ones: fmusim passes a state to FreeFMUState instead of its address."""
    fmu, state = request.getfixturevalue(path), tmp_path / "state"
    simulate(fmu, "--stop-time", "3e-4", "--final-fmu-state-file", state, law=2)
    options = ("--start-time", "3e-4", "--stop-time", "1e-3", "--initial-fmu-state-file", state)
    rows, _ = simulate(fmu, *options, outputs=CRITERIA)
    assert_close(rows[-1], EXPECTED[2], tolerance=1e-12)


def test_fmusim_runs_the_companions(companions, simulate):
    for fmu in companions:
        rows, _ = simulate(fmu, "--stop-time", "1", "--output-interval", "1e-3")
        assert len(rows) == 1001
        # Another sum of steps: the same to rounding error.
        last = fmpy.simulate_fmu(str(fmu), stop_time=1.0, step_size=1e-3, output_interval=1e-3)[-1]
        for name, value in rows[-1].items():
            assert value == pytest.approx(float(last[name]), rel=1e-9, abs=1e-12), name


# A host on FMI Library


@pytest.fixture(scope="module")
def host(run):
    program = tool("host")

    def host(*words, alone=False, **environment):
        done = run(program, *words, alone=alone, **environment)
        *lines, last = done.stdout.splitlines()
        assert last == "done"
        return lines

    return host


def files(request, names=FILES):
    return [request.getfixturevalue(name) for name in names]


def errors(lines):
    """The errors of S in lines of the host."""
    return [
        float(found[1]) for line in lines if (found := re.search(r"(?:error|worst).* (\S+)$", line))
    ]


def test_one_after_the_other(request, host, changed_k):
    lines = host("run", *files(request))
    assert len(errors(lines)) == 24
    assert max(map(abs, errors(lines))) <= 1e-14
    results = [float(line.rpartition(" ")[2]) for line in host("k", *files(request))]
    assert results == pytest.approx([changed_k["smash_factor"]] * 4, rel=1e-13)


def test_state(request, host):
    lines = host("state", *files(request))
    assert len(lines) == 4
    assert all("same 1," in line and line.endswith("after reset 0.0e+00") for line in lines)


#: FMUs in one process, all at once. Two plain ones need a hook at the end of the process that runs
#: before pythonfmu's pointers are gone: C's own.
PAIRS = {
    "FMI 2.0": ("fmu_path", "fmu_path"),
    "FMI 3.0": ("fmi3_path", "fmi3_path"),
    "both": ("fmu_path", "fmi3_path"),
    "native": ("native_path", "native_fmi3_path"),
    "plain and native": ("native_path", "fmu_path", "fmi3_path", "native_fmi3_path"),
}


@pytest.mark.parametrize("names", PAIRS.values(), ids=PAIRS)
@pytest.mark.parametrize("times", repeated(2, 6, 20))
def test_several_at_once(request, host, names, times):
    for _ in range(times):
        lines = host("mix", *files(request, names))
        assert len(errors(lines)) == len(names)
        assert max(map(abs, errors(lines))) <= 1e-14
        assert lines[-1] == "closed"


@pytest.mark.parametrize("times", repeated(1, 5, 20))
def test_companions_at_once(companions, fmu_path, native_path, host, times):
    for _ in range(times):
        for fmu in (fmu_path, native_path):
            assert host("mix", *companions, fmu, *companions)[-1] == "closed"


def test_threads(request, host):
    # Two threads that start Python at once by pythonfmu are a race: the first plain instances are
    # made one after the other.
    lines = host("threads", 2, *files(request), SERIAL_FIRST="1")
    assert errors(lines) == pytest.approx([0.0] * 4, abs=1e-14)
    lines = host("threads", 3, *files(request, FILES[2:]), alone=True)
    assert errors(lines) == pytest.approx([0.0] * 2, abs=1e-14)


@pytest.mark.parametrize("times", repeated(3, 15, 50))
def test_reload(request, host, companions, times):
    host("reload", times, *files(request), *companions)


def test_in_a_host_without_python(request, host):
    for task in ("run", "state"):
        host(task, *files(request, FILES[2:]), alone=True)
    host("mix", *files(request, FILES[2:]), alone=True)
