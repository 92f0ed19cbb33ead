"""Every host runs the same tasks with our FMUs: a table, and what a host has of its own.

fmusim and a host on FMI Library are found in the folder that GOLF_IMPACT_HOSTS names, or where
fmusim is on PATH. test_native.py has native FMUs on other platforms and without Python.
"""

import csv
import multiprocessing
import os
import re
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, nullcontext
from functools import partial
from itertools import pairwise, product, repeat
from pathlib import Path

import fmpy
import pytest
from command import run
from compare import assert_close
from conftest import CRITERIA, EXPECTED, FILES, LAW_2_CONTACT, holds_c, repeated, some
from programs import require, run_importer
from ways import InFmu

from golf_impact.commands import doctor
from golf_impact.data.errors import UserError
from golf_impact.fmu.file import check_temporary_folder, run_here

#: s; the first is longer than the whole contact.
STEPS = (1e-3, 1e-4, 1e-6)


@pytest.fixture(scope="module")
def exact(way_of):
    """Outputs by case: each law, and law 2 with a k that falls in contact."""
    way = way_of("in process")
    way.path({"law": 2}, [(3e-4, {}), (7e-4, {"k": 8e5})])
    return {**EXPECTED, "k": way.read(CRITERIA)}


# Hosts: functions of a fixture's name, an FMU and a task, which yield cases and what they find


def by_fmpy(fixture, fmu, task):
    early = fmpy.read_model_description(fmu).coSimulation.mightReturnEarlyFromDoStep
    for law, step in product((1, 2), STEPS):
        rows = fmpy.simulate_fmu(
            str(fmu), stop_time=0.005, step_size=step, output_interval=step, output=CRITERIA,
            start_values={"law": law}, use_event_mode="fmi3" in fmu.name, early_return_allowed=True,
        )  # fmt: skip
        yield law, {name: rows[name][-1] for name in CRITERIA}
        # A row before and after each event.
        assert (len(rows) == round(0.005 / step) + 1) == (not early)


def one_run(folder, law):
    with closing(InFmu(folder)) as way:
        way.begin({"law": law})
        for n in range(500):
            assert way.step(1e-5, n * 1e-5)
        return law, way.read(CRITERIA)


def by_instances(fixture, fmu, task):
    """Many at once by fmpy, in threads or in processes."""
    folder, laws = fmpy.extract(str(fmu)), [1, 2] * 6
    if task == "several":
        with ThreadPoolExecutor(4) as pool:
            yield from pool.map(one_run, repeat(folder), laws)
        return
    yield one_run(folder, 1)  # a fork then has a loaded FMU in it
    with multiprocessing.get_context(task).Pool(2) as pool:
        yield from pool.starmap(one_run, zip(repeat(folder), laws))


def by_importer(tool, code, fmu):
    # Of an Enumeration, as law is in FMI 3.0, ecos keeps the start value.
    for law, step in product((1,) if "fmi3" in fmu.name else (1, 2), STEPS):
        given = str(fmu), step, round(0.005 / step), law
        program = f"fmu, step, steps, law = given\n{code}"
        yield law, run_importer(tool, program, CRITERIA, *given)


def by_libcosim(fixture, fmu, task):
    return by_importer("libcosimpy", _LIBCOSIM, fmu)


_LIBCOSIM = """
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
execution = CosimExecution.from_step_size(round(step * 1e9))
index = execution.add_local_slave(CosimLocalSlave(fmu, "impact"))
variables = {v.name.decode(): v for v in execution.slave_variables(index)}
if law != 1:
    assert execution.integer_initial_value(index, variables["law"].reference, law)
observer = CosimObserver.create_last_value()
assert execution.add_observer(observer) and execution.step(steps)
values = observer.last_real_values(index, [variables[name].reference for name in names])
"""


def by_ecos(fixture, fmu, task):
    return by_importer("ecospy", _ECOS, fmu)


_ECOS = """
from ecospy.EcosSimulation import EcosSimulation
from ecospy.EcosSimulationStructure import EcosSimulationStructure
with EcosSimulationStructure() as structure:
    structure.add_model("impact", fmu)
    structure.add_parameter_set("case", {"impact::law": law})
    with EcosSimulation(structure=structure, step_size=step) as simulation:
        assert simulation.init(parameter_set="case")
        simulation.step(steps)
        values = [simulation.get_real(f"impact::{name}") for name in names]
"""


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
def with_python(libpython):
    """The environment in which a native host can load a plain FMU."""
    return os.environ | {"LD_PRELOAD": str(libpython), "PYTHONHOME": sys.base_prefix}


@pytest.fixture
def simulate(with_python, tmp_path):
    """Runs an FMU in fmusim; its output as rows by name, and the process."""
    program = tool("fmusim")

    def simulate(fmu, *options, kind="cs", code=0, **start):
        words = [word for name, value in start.items() for word in ("--start-value", name, value)]
        words += [word for name in CRITERIA for word in ("--output-variable", name)]
        out = tmp_path / "out.csv"
        words += ["--interface-type", kind, "--output-file", out, *options, fmu]
        done = run(program, *words, env=os.environ if holds_c(fmu) else with_python, code=code)
        rows = csv.DictReader(out.read_text().splitlines())
        return [{name: float(row[name]) for name in row} for row in rows], done

    return simulate


# CVODE must start anew at touch, at separation and with inputs, or the COR is 1.52.
CVODE = ("--solver", "cvode", "--tolerance", "1e-10")


def by_fmusim(fixture, fmu, task):
    simulate, tmp_path = fixture("simulate"), fixture("tmp_path")
    options, kind = (CVODE, "me") if task == "model exchange" else ((), "cs")
    if task == "state":
        state = tmp_path / "state"
        simulate(fmu, "--stop-time", "3e-4", "--final-fmu-state-file", state, law=2)
        options = "--start-time", "3e-4", "--stop-time", "1e-3"
        yield 2, simulate(fmu, *options, "--initial-fmu-state-file", state)[0][-1]
        return
    if task in ("k", "model exchange"):
        (file := tmp_path / "k.csv").write_text("time,k\n0,1e6\n3e-4,1e6\n3e-4,8e5\n1,8e5\n")
        yield "k", simulate(fmu, *options, "--input-file", file, kind=kind, law=2)[0][-1]
    if task == "events":
        for early in ((), ("--early-return-allowed",)):
            rows, _ = simulate(fmu, "--event-mode-used", *early, law=2, gap=0.005)
            yield 2, rows[-1]
            # An event has a row before it and one after.
            times, touch = [row["time"] for row in rows], 0.005 / 35.0
            found = [now for now, then in pairwise(times) if now == then]
            expected = [touch, touch + LAW_2_CONTACT] if early else []
            assert found == pytest.approx(expected, rel=1e-15)
    elif task != "k":
        for law, gap in (1, 0.0), (2, 0.005):
            rows, _ = simulate(fmu, *options, kind=kind, law=law, gap=gap)
            yield law, rows[-1]
            # The proposed experiment: fmusim takes times that differ by 1e-5 s for equal, and
            # its last step must not be left out.
            assert kind == "me" or (len(rows), rows[-1]["time"]) == (51, 1e-3)


@pytest.fixture
def host(with_python):
    """Runs a task of the host on FMI Library; its lines."""
    program = tool("host")

    def host(task, *words):
        alone = all(holds_c(word) for word in words if isinstance(word, Path))
        # Two threads that start Python at once by pythonfmu are a race: the first plain instances
        # are made one after the other.
        env = os.environ if alone else with_python | {"SERIAL_FIRST": "1"}
        *lines, last = run(program, task, *words, env=env, timeout=300).stdout.splitlines()
        assert last == "done"
        return lines

    return host


def as_results(lines):
    """Law and S by lines of the host, which prints the difference to its own S of each law."""
    for line in lines:
        error = float(re.search(r"(?:error|error of S|worst|after reset) (\S+)$", line)[1])
        law = int(found[1]) if (found := re.search(r"law (\d)", line)) else 1
        yield law, {"smash_factor": EXPECTED[law]["smash_factor"] + error}


def by_fmi_library(fixture, fmu, task):
    host = fixture("host")
    if task == "k":
        yield "k", {"smash_factor": float(host("k", fmu)[0].rpartition(" ")[2])}
        return
    name = {"impact": ("run",), "several": ("threads", 1, fmu)}.get(task, (task,))
    lines = host(*name, fmu)
    assert len(lines) == {"impact": 6, "state": 1, "several": 2}[task]
    assert task != "state" or "same 1," in lines[0]
    yield from as_results(lines)


def by_c(fixture, fmu, task):
    """A small one of ours; or instances that move between threads, whose thread ends."""
    preloaded = f"{fixture('libpython')}:{fixture('freed')}"
    env = {} if holds_c(fmu) else {"LD_PRELOAD": preloaded}
    tasks = [("impact", step) for step in STEPS] if task == "impact" else [("threads", 50)]
    for law, words in zip((2, 1, 1), tasks):
        yield law, fixture("c_host")(fmu, *words, law, **env)


# The table

#: Host, FMUs, tasks, tolerance (measured: 3e-16 where it is 1e-12), marks. Of fmusim's
#: state files the plain FMUs get a state's value as its address.
TABLE = [
    (by_fmpy, FILES, ("impact",), 1e-12),
    (by_instances, FILES, ("several",), 1e-12),
    (by_instances, ("fmu_path",), multiprocessing.get_all_start_methods(), 1e-12, pytest.mark.ci),
    (by_libcosim, ("fmu_path", "native_path"), ("impact",), 1e-12, pytest.mark.importers),
    (by_ecos, FILES, ("impact",), 1e-12, pytest.mark.importers),
    (by_fmusim, FILES, ("impact", "k"), 1e-12),
    (by_fmusim, FILES[1:], ("state",), 1e-12),
    (by_fmusim, FILES[2:], ("events",), 1e-12),
    (by_fmusim, FILES[1:], ("model exchange",), 1e-6),  # measured: 5e-8
    (by_fmi_library, FILES, ("impact", "k", "state", "several"), 1e-14),
    (by_c, FILES, ("impact", "several"), 1e-12),
]


@pytest.mark.parametrize(
    ("play", "path", "task", "tolerance"),
    [
        pytest.param(play, path, task, tolerance, marks=marks)
        for play, paths, tasks, tolerance, *marks in TABLE
        for path, task in product(paths, tasks)
    ],
)
def test_task(request, exact, play, path, task, tolerance):
    fixture, cases = request.getfixturevalue, 0
    for case, found in play(fixture, fixture(path), task):
        expected = {name: exact[case][name] for name in CRITERIA if name in found}
        assert_close(found, expected, tolerance=tolerance, case=case)
        cases += 1
    assert cases


# What a host has of its own: fmu-manipulation-toolbox


def _toolbox(command, *arguments):
    require("fmu_manipulation_toolbox")
    program = shutil.which(command, path=str(Path(sys.executable).parent))
    done = run(program, *arguments)
    return done.stdout + done.stderr


@pytest.mark.importers
@pytest.mark.parametrize("path", FILES)
def test_fmutool_finds_it_compliant(request, path):
    output = _toolbox("fmutool", "-check", "-input", request.getfixturevalue(path))
    assert f"seems to be compliant with FMI-{3 if 'fmi3' in path else 2}.0" in output
    assert "No semantic error" in output


@pytest.mark.importers
@pytest.mark.parametrize("step", some(1, STEPS[:2]))
def test_a_container_with_another_fmu(fmu_path, files, tmp_path, step):
    shutil.copy(fmu_path, tmp_path / "ClubBallImpact.fmu")
    shutil.copy(files[2], tmp_path / "BallFlight.fmu")
    links = ("ball_velocity", "separated", "touch_time", "contact_time")
    lines = [
        "rule;from_fmu;from_port;to_fmu;to_port",
        *(f"FMU;{name}.fmu;;;" for name in ("ClubBallImpact", "BallFlight")),
        *(f"LINK;ClubBallImpact.fmu;{name};BallFlight.fmu;{name}" for name in links),
        *(f"OUTPUT;ClubBallImpact.fmu;{name};;{name}" for name in CRITERIA),
        "OUTPUT;BallFlight.fmu;carry;;carry",
    ]
    (tmp_path / "both.csv").write_text("\n".join(lines) + "\n")
    _toolbox("fmucontainer", "-fmu-directory", tmp_path, "-container", f"both.csv:{step}")
    program = """
import fmpy
fmu, step = given
rows = fmpy.simulate_fmu(fmu, stop_time=0.01, step_size=step, output_interval=step, output=names)
values = [float(rows[name][-1]) for name in names]
"""
    names = [*CRITERIA, "carry"]
    results = run_importer("fmpy", program, names, str(tmp_path / "both.fmu"), step)
    # The carry differs by the rounding of the launch's time: 1.7e-13.
    assert_close(results, EXPECTED[1] | {"carry": 158.79718480716062}, tolerance=1e-12)


# fmusim


@pytest.mark.parametrize("path", FILES)
def test_fmusim_shows_a_refused_start_value(request, simulate, path):
    fmu = request.getfixturevalue(path)
    # Error from the native ones; fmusim takes the Discard of FMI 2.0 for the end of the simulation.
    code = 3 if holds_c(fmu) else 0
    _, done = simulate(fmu, code=code, k=-1)
    message = "k = -1 N/m is refused: it must be between 0.001 and 1e+15"
    assert message in done.stderr + done.stdout
    assert path != "fmu_path" or done.stderr.count("k = -1 ") == 1
    _, done = simulate(fmu, k=2e6)
    assert done.stderr + done.stdout == ""


# FMI Library


@pytest.mark.parametrize("times", repeated(1, 5, 20))
def test_several_fmus_at_once_and_reloaded(request, files, host, times):
    """Two plain ones need a hook that runs before pythonfmu's pointers are gone: C's own."""
    companions, (plain, *native) = files[:-1], map(request.getfixturevalue, FILES)
    for _ in range(times):
        for ours, others in (native, ()), ((plain, plain, *native), companions):
            *lines, last = host("mix", *others, *ours, *others)
            assert last == "closed"
            found = [*as_results(line for line in lines if "law" in line)]
            assert len(found) == len(ours)
            for law, results in found:
                expected = {"smash_factor": EXPECTED[law]["smash_factor"]}
                assert_close(results, expected, tolerance=1e-14)
    lines = host("reload", 2 * times, plain, *native, *companions)
    (left,) = (line for line in lines if "mappings" in line)
    # Those of the library that started Python; the host extracts each FMU anew.
    assert int(left.split()[-1]) <= 8


# The C host


@pytest.mark.plain
def test_how_a_c_host_supplies_libpython(c_host, fmu_path, libpython, capsys):
    """It loads the library itself, or as `golf-impact doctor` prints."""
    with pytest.raises(AssertionError, match="undefined symbol"):
        c_host(fmu_path, "impact", 1e-4)
    assert_close(c_host(fmu_path, "impact", 1e-4, LIBPYTHON=str(libpython)), EXPECTED[1])
    assert doctor.doctor([fmu_path]) == 0
    shown = capsys.readouterr().out.splitlines()
    (line,) = (text for text in shown if "native hosts: LD_PRELOAD=" in text)
    settings = dict(part.split("=", 1) for part in line.split() if "=" in part)
    assert_close(c_host(fmu_path, "impact", 1e-3, **settings), EXPECTED[1])


@pytest.mark.plain
def test_a_call_makes_no_thread_state(c_host, fmu_path, libpython):
    """Making one at every call would cost ten times the call."""
    found = c_host(fmu_path, "state", 1000, LD_PRELOAD=str(libpython))
    assert found == {"states_made": 0.0, "states_left": 0.0}


@pytest.mark.plain
@pytest.mark.parametrize("folder", some(1, ["ü", "a#+(%41)", "a space-b_c.d~"]))
def test_folders_that_pythonfmu_crashes_in(folder, fmu_path, tmp_path, monkeypatch):
    (tmp_path / folder).mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / folder))
    monkeypatch.setattr("tempfile.tempdir", None)
    for call, why in (
        (check_temporary_folder, "set TMPDIR"),
        (partial(run_here, fmu_path), r"can't be run here \(signal"),
    ):
        with nullcontext() if "space" in folder else pytest.raises(UserError, match=why):
            call()
