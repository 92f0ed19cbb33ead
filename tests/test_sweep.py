"""Sweeps through the built FMU: contents of the tables, executors, interruptions and errors."""

import csv
import math
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from command import COMMAND, golf_here, run, run_python
from conftest import some

from golf_impact.errors import UserError
from golf_impact.runs import METRICS
from golf_impact.sweeps import Stopped, Study, comparison, run_sweep
from golf_impact.sweeps import run as running
from golf_impact.sweeps.comparison import compare
from golf_impact.sweeps.impacts import impacts, make_plan, run_chunk
from golf_impact.sweeps.pictures import draw, sobol_indices
from golf_impact.sweeps.run import Sweep
from golf_impact.sweeps.study import parse_axis, read_study

STUDIES = Path(__file__).parents[1] / "scenarios" / "studies"


def table(path):
    """Header and rows of a CSV file, as text."""
    with open(path, newline="") as stream:
        header, *rows = csv.reader(stream)
    return header, rows


def leftovers(folder):
    return [path.name for path in folder.iterdir() if path.name.endswith(".part")]


# Axes and studies


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0.5e6:2e6:4", [0.5e6, 1e6, 1.5e6, 2e6]),
        ("log:1e5:1e7:3", [1e5, 1e6, 1e7]),
        ("0, 9,12", [0.0, 9.0, 12.0]),
        (7, [7.0]),
        ([1, 2.5], [1.0, 2.5]),
        ("3:3:1", [3.0]),
        ("-2:-1:2", [-2.0, -1.0]),
    ],
)
def test_rows_of_values(text, values):
    assert parse_axis("k", text).values.tolist() == values


def test_values_of_names():
    assert parse_axis("law", [1, 2]).values.dtype == np.int64
    assert parse_axis("ball", "document, roh-lee").values.tolist() == ["document", "roh-lee"]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("k", "2e6:1e6:5", "above its end"),
        ("k", "log:0:1e6:5", "above 0"),
        ("k", "1:2:0", "1 to 10,000,000"),
        ("k", "1:2:2.5", "whole number"),
        ("k", "1:2:1e9", "1 to 10,000,000"),
        ("k", "1:2", "LO:HI:COUNT"),
        ("k", "1,inf", "finite"),
        ("k", "nan:1:3", "finite"),
        ("k", "1,,2", "write VALUE"),
        ("k", "norm:1:2", "write VALUE, A,B,C, LO:HI:COUNT, log"),
        ("k", "normal:1:0", "> 0"),
        ("k", "uniform:2:1", "above its end"),
        ("law", "1.5", "1 .absolute. or 2"),
        ("law", "normal:1:1", "1 .absolute. or 2"),
        ("law", "-4294967295", "1 .absolute. or 2"),
        ("k", False, "write VALUE"),
        ("ball", "golf", "choose from"),
    ],
)
def test_invalid_axes(name, text, words):
    with pytest.raises(UserError, match=words):
        parse_axis(name, text)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"sets": {}}, "nothing is swept"),
        ({"sets": {"k": "normal:1e6:1"}}, "--samples"),
        ({"sets": {"k": "1"}, "number_of_samples": 5}, "no distribution to draw"),
        ({"sets": {"k": "normal:1e6:1"}, "number_of_samples": 0}, "at least 1"),
        ({"sets": {"k": "1"}, "design": "halton"}, "random, lhs, sobol"),
        ({"sets": {"k": "1"}, "seed": -1}, "--seed"),
        ({"sets": {"k": "1"}, "outputs": ("force", "force")}, "twice"),
        ({"sets": {"k": "1"}, "outputs": ()}, "empty list"),
        (
            {"sets": {"k": "normal:1:2"}, "number_of_samples": 2**30 + 1, "design": "sobol"},
            "at most 1,073,741,824",
        ),
    ],
)
def test_invalid_studies(arguments, words):
    with pytest.raises(UserError, match=words):
        Study.of(**arguments)


def test_the_last_variable_varies_fastest():
    study = Study.of({"k": "1,2", "b": "3,4,5"})
    assert study.cases == 6
    columns = study.columns(np.arange(6))
    assert list(columns) == ["k", "b"]
    assert columns["k"].tolist() == [1, 1, 1, 2, 2, 2]
    assert columns["b"].tolist() == [3, 4, 5, 3, 4, 5]
    assert study.columns(np.array([2, 3]))["b"].tolist() == [5, 3]


@pytest.mark.parametrize("design", ["random", "lhs", "sobol"])
def test_samples(design):
    sets = {"k": "normal:1e6:5e4", "b": "0,9", "club_speed": "uniform:40:50"}
    study = Study.of(sets, None, 1024, 3, design)
    columns = study.columns(np.arange(study.cases))
    # Every point of the grid has the same samples, which vary fastest.
    assert columns["b"].tolist() == [0.0] * 1024 + [9.0] * 1024
    for name in ("k", "club_speed"):
        assert columns[name][:1024].tolist() == columns[name][1024:].tolist()
    k, speed = columns["k"][:1024], columns["club_speed"][:1024]
    # Four standard errors of independent samples.
    assert abs(k.mean() - 1e6) < 4 * 5e4 / 32
    assert abs(k.std() - 5e4) < 4 * 5e4 / math.sqrt(2048)
    assert 40 <= speed.min() < speed.max() < 50
    assert abs(np.corrcoef(k, speed)[0, 1]) < 4 / 32
    if design != "random":
        # Evenly: one in each of 1024 equal parts.
        assert sorted(np.floor((speed - 40.0) * 102.4)) == list(range(1024))
    for seed in (3, 4):
        again = Study.of(sets, None, 1024, seed, design).columns(np.arange(1024))
        assert (again["k"].tolist() == k.tolist()) == (seed == 3)


# Through the FMU


CASES = {
    "inputs under law 1": {"k": "0.5e6:2e6:7", "b": "0,9,300", "club_speed": "20,50"},
    "after a gap": {"club_speed": "10:60:9", "gap": "0.1"},
    "parameters under law 2": {"m_ball": "0.03:0.06:5", "ball_speed": "0,-3,60", "law": 2},
    "both laws": {"law": "1,2", "k": "log:1:1e8:5", "gap": "0,0.2"},
    "power law": {"law": 2, "exponent": "1,1.5,3", "k": "1e5,1e6"},
}


@pytest.mark.parametrize("sets", CASES.values(), ids=CASES)
def test_numbers_are_those_of_one_impact_at_a_time(fmu, fmu_path, tmp_path, sets):
    study = Study.of(sets, METRICS)
    summary = run_sweep(study, tmp_path / "x.csv", fmu=fmu_path, chunk=5)
    header, rows = table(tmp_path / "x.csv")
    assert header == [*sets, *METRICS]
    assert len(rows) == study.cases == summary.cases
    assert summary.refused == 0
    for row in rows:
        expected = fmu.impact(**dict(zip(sets, map(float, row), strict=False)))
        # Text without loss of digits; empty where an impact has no such result.
        texts = ["" if math.isnan(value) else repr(value) for value in expected.values()]
        assert row[len(sets) :] == texts


def test_only_the_requested_outputs(fmu, fmu_path, tmp_path):
    names = ("separated", "max_force", "touched")
    study = Study.of({"k": 1e6, "club_speed": "-5,35"}, names)
    run_sweep(study, tmp_path / "x.csv", fmu=fmu_path)
    header, rows = table(tmp_path / "x.csv")
    assert header == ["k", "club_speed", *names]
    force = repr(fmu.impact()["max_force"])
    assert rows == [["1000000.0", "-5.0", "0", "0.0", "0"], ["1000000.0", "35.0", "1", force, "1"]]


def test_unknown_names(fmu_path, tmp_path):
    for sets, outputs, words in (
        ({"stiffness": "1"}, None, "'stiffness': choose from k, b, club_speed"),
        ({"force": "1"}, None, "no input or parameter 'force'"),
        ({"k": "1"}, ("speed",), "no output 'speed': choose from force"),
        ({"k": "1"}, ("k",), "no output 'k'"),
    ):
        with pytest.raises(UserError, match=words):
            run_sweep(Study.of(sets, outputs), tmp_path / "x.csv", fmu=fmu_path)
    assert list(tmp_path.iterdir()) == []


def test_balls(fmu, fmu_path, tmp_path):
    from golf_impact.facts.balls import BALLS

    study = Study.of({"ball": list(BALLS), "b": "1,2", "club_speed": "30,45"}, METRICS)
    run_sweep(study, tmp_path / "x.csv", fmu=fmu_path)
    header, rows = table(tmp_path / "x.csv")
    assert [row[0] for row in rows] == [name for name in BALLS for _ in range(4)]
    for row in rows:
        values = dict(zip(header[1:], map(float, row[1:]), strict=True))
        # A swept variable overrides the preset.
        case = {**BALLS[row[0]].values, "b": values["b"], "club_speed": values["club_speed"]}
        assert fmu.impact(**case) == {name: values[name] for name in METRICS}


def test_refused_cases_are_empty_rows(fmu, fmu_path, tmp_path):
    sets = {"k": "1e6,-1,2e6", "b": "-3,9"}
    names = ("smash_factor", "separated")
    summary = run_sweep(Study.of(sets, names), tmp_path / "x.csv", fmu=fmu_path)
    _, rows = table(tmp_path / "x.csv")
    assert [row[2] == "" for row in rows] == [True, False, True, True, True, False]
    assert [row[3] for row in rows] == ["", "1", "", "", "", "1"]
    # After a refusal the instance continues as if there had been none.
    assert float(rows[5][2]) == fmu.impact(k=2e6, b=9.0)["smash_factor"]
    assert summary.refused == 4
    row, reason = summary.first_refused
    assert row == 1
    assert "b = -3.0" in reason
    run_sweep(Study.of(sets, names), tmp_path / "x.parquet", fmu=fmu_path, chunk=4)
    columns = pyarrow.parquet.read_table(tmp_path / "x.parquet").to_pydict()
    assert [value is None for value in columns["smash_factor"]] == [not row[2] for row in rows]
    assert columns["separated"] == [None, True, None, None, None, True]


def test_parquet_has_the_numbers_of_csv(fmu_path, tmp_path, monkeypatch):
    """Row groups, and so the bytes, are independent of chunks."""
    monkeypatch.setattr(running, "_ROW_GROUP", 64)
    sets = {"ball": "document,document-old", "law": "1,2", "club_speed": "30:50:40"}
    study = Study.of(sets)
    run_sweep(study, tmp_path / "x.csv", fmu=fmu_path)
    header, rows = table(tmp_path / "x.csv")
    for chunk in (7, 60):
        run_sweep(study, tmp_path / f"{chunk}.parquet", fmu=fmu_path, chunk=chunk)
    assert pyarrow.parquet.ParquetFile(tmp_path / "7.parquet").num_row_groups == 3
    read = pyarrow.parquet.read_table(tmp_path / "7.parquet")
    assert read.column_names == header
    kinds = [str(kind) for kind in read.schema.types]
    assert kinds == ["string", "int64"] + ["double"] * (len(header) - 2)
    for name, column in zip(header, zip(*rows, strict=True), strict=True):
        make = {"ball": str, "law": int}.get(name, float)
        assert read[name].to_pylist() == [make(cell) for cell in column]
    same = [(tmp_path / f"{chunk}.parquet").read_bytes() for chunk in (7, 60)]
    assert same[0] == same[1]


# Executors


MONTE_CARLO = {"k": "normal:1e6:5e4", "b": "0,9", "m_ball": "uniform:0.045:0.046"}


@pytest.fixture(scope="module")
def alone(fmu_path, tmp_path_factory):
    """A Monte Carlo study by one process, as bytes."""
    path = tmp_path_factory.mktemp("alone") / "x.csv"
    run_sweep(monte_carlo(), path, fmu=fmu_path)
    return path.read_bytes()


def monte_carlo():
    return Study.of(MONTE_CARLO, None, 500, 1, "sobol")


@pytest.mark.parametrize(("workers", "chunk"), [(1, 333), (2, 50), (3, 10_000)])
def test_bytes_are_independent_of_workers_and_chunks(alone, fmu_path, tmp_path, workers, chunk):
    run_sweep(monte_carlo(), tmp_path / "x.csv", fmu=fmu_path, workers=workers, chunk=chunk)
    assert (tmp_path / "x.csv").read_bytes() == alone


@pytest.mark.ci
def test_any_executor(alone, fmu_path, tmp_path):
    with ThreadPoolExecutor(3) as threads:
        path = tmp_path / "threads.csv"
        run_sweep(monte_carlo(), path, fmu=fmu_path, executor=threads, chunk=70)
        assert path.read_bytes() == alone
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        path = tmp_path / "processes.csv"
        run_sweep(monte_carlo(), path, fmu=fmu_path, executor=processes, chunk=70)
        assert path.read_bytes() == alone


class Never(Executor):
    """Never done; counts pending calls."""

    waiting = 0

    def submit(self, function, /, *arguments):
        self.waiting += 1
        return Future()


def test_few_chunks_are_under_way(fmu_path, tmp_path):
    """Of 200 chunks the memory never holds more than these."""
    never = Never()
    with pytest.raises(Stopped):
        run_sweep(
            monte_carlo(), tmp_path / "x.csv", fmu=fmu_path, executor=never, chunk=5,
            stop=lambda: never.waiting >= 32,
        )  # fmt: skip
    assert never.waiting == 32


def test_an_fmu_that_was_damaged_on_the_way(fmu):
    study = Study.of({"k": "1e6"})
    damaged = replace(make_plan(study, fmu), data=b"")
    with pytest.raises(UserError, match="damaged"):
        run_chunk(damaged, True, study.columns(np.array([0])))


# Interruptions and errors


def test_a_stopped_sweep_leaves_the_earlier_file(fmu_path, tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("earlier")
    seen = []
    with pytest.raises(Stopped) as stopped:
        run_sweep(
            Study.of({"k": "1e6:2e6:1000"}), path, fmu=fmu_path, chunk=100,
            progress=seen.append, stop=lambda: bool(seen) and seen[-1] >= 300,
        )  # fmt: skip
    assert stopped.value.done == 300
    assert path.read_text() == "earlier"
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize(
    ("workers", "number"),
    [
        (2, signal.SIGINT),
        pytest.param(1, signal.SIGINT, marks=pytest.mark.ci),
        pytest.param(1, signal.SIGTERM, marks=pytest.mark.ci),
        pytest.param(2, signal.SIGTERM, marks=pytest.mark.ci),
    ],
)
def test_ctrl_c(fmu_path, tmp_path, workers, number):
    path = tmp_path / "x.csv"
    path.write_text("earlier")
    process = sweep_in_a_session(path, fmu_path, workers)
    # As a terminal does it: to all processes.
    os.killpg(process.pid, number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    done = int(errors.split(" of 10,000,000 cases were done")[0].replace(",", ""))
    assert 0 < done < 10_000_000
    assert "Traceback" not in errors
    assert path.read_text() == "earlier"
    assert leftovers(tmp_path) == []
    # All processes of its session end soon.
    until = time.monotonic() + 10
    with suppress(ProcessLookupError):
        while time.monotonic() < until:
            os.killpg(process.pid, 0)
            time.sleep(0.05)
    assert time.monotonic() < until


KILLER = """
import multiprocessing, os, sys
from golf_impact import Study, run_sweep
from golf_impact.errors import UserError

def kill(done):
    if done in map(int, sys.argv[3:]):
        os.kill(multiprocessing.active_children()[0].pid, 9)

if __name__ == "__main__":
    study = Study.of({"k": "1e6:2e6:30000"})
    try:
        run_sweep(study, sys.argv[1], fmu=sys.argv[2], workers=2, progress=kill)
    except UserError as error:
        sys.exit(str(error))
"""


@pytest.mark.parametrize("kills", some(1, [2, 3]))
def test_workers_that_are_killed(fmu_path, tmp_path, kills):
    """A new pool computes the missing cases, twice; then it is an error, in one line."""
    path, script = tmp_path / "x.csv", tmp_path / "killer.py"
    path.write_text("earlier")
    script.write_text(KILLER)
    moments = [4_000, 10_000, 20_000][:kills]
    command = (sys.executable, script, path, fmu_path, *moments)
    done = run(*command, code=int(kills == 3), timeout=300)
    if kills == 2:
        assert done.stderr == ""
        run_sweep(Study.of({"k": "1e6:2e6:30000"}), tmp_path / "alone.csv", fmu=fmu_path)
        assert path.read_bytes() == (tmp_path / "alone.csv").read_bytes()
    else:
        (line,) = done.stderr.splitlines()
        assert line.startswith("worker processes ended unexpectedly 3 times")
        assert path.read_text() == "earlier"
    assert leftovers(tmp_path) == []


def processes_of(session):
    """The processes of a session (Linux)."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            name, _, rest = stat.read_text().rpartition(")")
            state, _, _, of = rest.split()[:4]
            if int(of) == session and state != "Z":
                found.append(int(name.split()[0]))
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("scheduler", some(1, [None, "local"]))
def test_a_parent_that_is_killed(fmu_path, tmp_path, scheduler):
    """Its workers end without output, and the file is unchanged."""
    path = tmp_path / "x.csv"
    path.write_text("earlier")
    process = sweep_in_a_session(path, fmu_path, 2, scheduler)
    assert len(processes_of(process.pid)) >= 3
    process.kill()
    process.communicate(timeout=60)
    until = time.monotonic() + 20
    while processes_of(process.pid):
        assert time.monotonic() < until
        time.sleep(0.05)
    assert path.read_text() == "earlier"


def sweep_in_a_session(path, fmu_path, workers, scheduler=None):
    """A sweep that would take minutes in a session of its own, when it has begun to write."""
    where = ["--scheduler", scheduler] if scheduler else []
    process = subprocess.Popen(
        [
            COMMAND, "sweep", "--set", "k=1e6:2e6:10000000", "--out", path, "--fmu", fmu_path,
            "--workers", str(workers), *where,
        ],
        stderr=subprocess.PIPE, text=True, start_new_session=True,
        # A test run in the background ignores Ctrl-C, and so would its children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    until = time.monotonic() + 60
    while not any(part.stat().st_size > 1e5 for part in path.parent.glob(".*.part")):
        assert time.monotonic() < until
        assert process.poll() is None
        time.sleep(0.05)
    return process


@pytest.mark.parametrize("suffix", some(1, ["csv", "parquet"]))
def test_a_full_disk(fmu_path, tmp_path, suffix):
    path = tmp_path / f"x.{suffix}"
    path.write_text("earlier")
    # A limit on the size of files fails in the same call, with another reason.
    code = (
        "import resource, sys\nresource.setrlimit(resource.RLIMIT_FSIZE, (700_000, 700_000))\n"
        f"sys.argv = ['x', 'sweep', '--set', 'k=1e6:2e6:20000', '--out', {str(path)!r}, '--fmu', "
        f"{str(fmu_path)!r}]\nfrom golf_impact.commands.app import main\nmain()"
    )
    done = run_python(code, code=2)
    assert done.stderr.startswith(f"Error: can't write {path}: File too large")
    assert done.stderr.count("\n") == 1
    assert path.read_text() == "earlier"
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize(
    ("sets", "samples", "design"),
    [
        ({"k": "0:1:100000", "b": "0:1:100000"}, None, "random"),
        ({"k": "normal:1e6:1"}, 3 * 10**9, "lhs"),
        ({"k": "normal:1e6:1"}, 2**30, "sobol"),
    ],
)
def test_more_memory_needed_than_free(tmp_path, monkeypatch, sets, samples, design):
    """Rejected before anything starts, with the memory needed and the memory free."""
    monkeypatch.setattr(running, "free_bytes", lambda: 10**9)
    study = Study.of(sets, None, samples, 0, design)
    # The FMU doesn't exist, but is not needed yet.
    with pytest.raises(UserError, match=r"cases need [0-9.]+ GB of memory, and 1.0 GB are free"):
        run_sweep(study, tmp_path / "x.csv", fmu=tmp_path / "none.fmu")
    assert list(tmp_path.iterdir()) == []


def test_files_that_cannot_be_written(fmu_path, tmp_path):
    (tmp_path / "folder.csv").mkdir()
    study = Study.of({"k": "1e6"})
    for name, options, words in (
        ("x.txt", {}, r"\.csv or \.parquet"),
        ("folder.csv", {}, "is a folder"),
        ("x.csv", {"chunk": 0}, "--chunk 0"),
        ("x.csv", {"workers": -2, "scheduler": "local"}, "--workers -2"),
        ("x.csv", {"workers": 100_000}, "--workers 100000 is refused: it must be 1 to 256"),
    ):
        with pytest.raises(UserError, match=words):
            run_sweep(study, tmp_path / name, fmu=fmu_path, **options)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.csv"]


# The command, studies, pictures


def sweep(fmu_path, *arguments, **sets):
    options = [f"--set={name}={values}" for name, values in sets.items()]
    done = golf_here("sweep", *arguments, *options, "--fmu", fmu_path)
    assert done.returncode == 0, done.stderr


def test_the_command(fmu_path, tmp_path):
    done = golf_here(
        *("sweep", "--set", "k=1e6,2e6,-1", "--set", "b=9,0", "--out", "x.csv", "--compare"),
        *("--outputs", "smash_factor,max_force", "--fmu", fmu_path),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert done.stdout.startswith("x.csv: 6 cases in ")
    assert "Refused by the FMU: 2 cases" in done.stdout
    assert "row 5: k = -1.0 N/m" in done.stdout
    assert "the same numbers to the last bit" in done.stdout
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv", "x.png", "x.html"}
    assert "data:image/png" in (tmp_path / "x.html").read_text()


def test_the_club_fitting_study(fmu_path, tmp_path):
    out = tmp_path / "fit.csv"
    sweep(fmu_path, STUDIES / "club_fitting.toml", "--out", out, club_speed="40,50")
    header, rows = table(out)
    assert header[:4] == ["ball", "club_speed", "m_club", "contact_time"]
    assert len(rows) == 12
    assert all(cell for row in rows for cell in row)
    assert (tmp_path / "fit.png").is_file()


def test_the_tolerance_study(fmu_path, tmp_path):
    """Options override the keys of a study; a variable of both keeps its place."""
    out = tmp_path / "new" / "x.csv"
    study = STUDIES / "tolerance.toml"
    sweep(fmu_path, study, "--out", out, "--samples", 64, "--seed", 2, ball_speed=-1, law=1)
    header, rows = table(out)
    assert header[:7] == ["club_speed", "law", "k", "b", "m_ball", "ball_speed", "ball_velocity"]
    assert len(rows) == 64
    assert {row[1] for row in rows} == {"1"}
    assert "first-order Sobol index" in out.with_suffix(".html").read_text()
    assert out.with_suffix(".png").is_file()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("stuff = 1", "no key stuff: choose from out, design"),
        ("samples = 'many'", "samples = 'many' is refused: it must be a whole number"),
        ("samples = true", "whole number"),
        ("outputs = 'force'", "it must be a list of names"),
        ("set = 1", r"table \[set\]"),
        (f"samples = {'9' * 5000}", "no TOML file"),
        (f"out = {'[' * 5000}", "no TOML file"),
        ('out = "a\\u0000.csv"', "it must be a text"),
    ],
)
def test_studies_that_cannot_be_read(tmp_path, text, words):
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(UserError, match=words):
        read_study(path)


PICTURES = {
    "line": {"k": "log:1e5:1e7:30"},
    "map": {"k": "0.5e6:2e6:12", "b": "0,-1,1,2,3,4,5,6"},
    "balls": {"ball": "document,roh-lee", "club_speed": "30,40"},
    "samples": {"k": "normal:1e6:5e4", "b": "uniform:0:9"},
    "a law that is none": {"law": "1,3", "k": "1e6,2e6"},
    "samples, some refused": {"k": "normal:0:1e6"},
    "line in falling order": {"b": "12,9,0"},
    "more than two": {"k": "0.5e6:2e6:12", "b": "0,9,12", "club_speed": "30,40"},
    "one ball beside another": {"ball": "document,roh-lee"},
    "samples of balls": {"ball": "document,roh-lee", "k": "normal:1e6:5e4"},
    "samples over a grid": {"k": "normal:1e6:5e4", "club_speed": "30,40,50"},
    "samples that change nothing": {"gap": "uniform:0:1", "b": 0, "law": 2},
    # S doesn't depend on club speed but for rounding.
    "one distribution": {"club_speed": "normal:45:2", "law": 1},
}


@pytest.mark.parametrize("sets", some(6, PICTURES))
def test_pictures(fmu_path, tmp_path, sets):
    random = any(":" in str(text) and text[0] in "nu" for text in sets.values())
    samples = ("--samples", 40) if random else ()
    out = tmp_path / "x.csv"
    sweep(fmu_path, "--out", out, "--outputs", "smash_factor", *samples, **sets)
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
    assert "data:image/png" in (tmp_path / "x.html").read_text()


def drawn_axes(fmu, sets, values):
    study = Study.of(sets, ("max_force",))
    return draw(study, np.asarray(values, float), fmu.variables, None).axes


def test_few_values_are_lines_and_many_a_map_with_contours(fmu):
    """Between few values a map would interpolate."""
    for b, lines, collections in (("0,9,12", 3, 0), ("0:14:8", 0, 2)):
        sets = {"k": "0.5e6:2e6:12", "b": b}
        axes = drawn_axes(fmu, sets, np.linspace(1.0, 2.0, Study.of(sets).cases))[0]
        assert (len(axes.lines), len(axes.collections)) == (lines, collections)
        labels = [line.get_label() for line in axes.lines]
        assert labels == [f"b = {value} N·s/m" for value in b.split(",")][:lines]


def test_numbers_at_axes_have_units_with_a_prefix(fmu):
    axes = drawn_axes(fmu, {"k": "0.5e6:2e6:4"}, [5e3, 6e3, 7e3, 8e3])[0]
    assert axes.get_xlabel() == "k (MN/m)"
    assert axes.get_ylabel() == "max force (kN)"
    axes.figure.draw_without_rendering()
    for along in (axes.xaxis, axes.yaxis):
        assert along.get_offset_text().get_text() == ""
        assert all(0.0 < float(text.get_text()) < 10.0 for text in along.get_ticklabels())
    logarithmic = drawn_axes(fmu, {"k": "log:1e5:1e7:3"}, [1e3, 2e3, 3e3])[0]
    assert (logarithmic.get_xlabel(), logarithmic.get_xscale()) == ("k (N/m)", "log")


def test_nothing_to_draw(fmu_path, tmp_path):
    sweep(fmu_path, "--out", tmp_path / "x.csv", k=1e6)
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv", "x.html"}
    sweep(fmu_path, "--out", tmp_path / "y.csv", "--no-figures", k="1e6,2e6")
    assert not (tmp_path / "y.png").exists()


def test_sobol_indices_of_a_sum():
    sets = {"k": "normal:1:2", "m_ball": "7", "b": "uniform:0:1"}
    study = Study.of(sets, None, 256)
    columns = study.columns(np.arange(256))

    def total(columns):
        assert (columns["m_ball"] == 7.0).all()
        return columns["k"] + 6.0 * columns["b"]

    # Variances 4 and 36 / 12.
    indices = sobol_indices(study, total(columns), total)
    assert indices == pytest.approx({"k": 4 / 7, "b": 3 / 7}, abs=0.01)
    # Where no design is possible: a refused case, there or in the design; a constant; a grid.
    refused = np.where(columns["k"] < 0.0, math.nan, 1.0)
    for other, drawn, model in (
        (study, refused, total),
        (study, columns["k"], lambda columns: np.sqrt(columns["k"])),
        (study, np.full(256, 3.0), total),
        (Study.of({**sets, "gap": "0,1"}, None, 256), np.arange(512.0), total),
    ):
        with np.errstate(invalid="ignore"):
            assert sobol_indices(other, drawn, model) is None


@pytest.mark.ci
def test_the_comparison_compares(fmu_path, monkeypatch):
    study = Study.of({"k": "1e6:2e6:50", "gap": "0,0.1"})
    with Sweep(study, fmu_path) as sweep:
        measured = compare(sweep, rounds=1)
        assert measured.same
        assert measured.ratio > 1.0

        def wrong(*arguments):
            right = impacts(*arguments)
            return right._replace(outputs=right.outputs + 1e-15)

        monkeypatch.setattr(comparison, "impacts", wrong)
        assert not compare(sweep, rounds=1).same
    with (
        pytest.raises(UserError, match="nothing to compare"),
        Sweep(Study.of({"k": "-1"}), fmu_path) as sweep,
    ):
        compare(sweep)


def test_a_step_long_enough_for_any_exponent(fmu):
    # A stiffening ball is soft to a slow club: its contact may last for seconds.
    values = {"exponent": np.array([1.0, 1.5, 12.0]), "club_speed": np.array([1e-3, 1e-3, 1e-3])}
    steps = fmu.horizon({"law": 2, **values})
    for n in range(3):
        fmu.impact(law=2, **{name: values[name][n].item() for name in values})
        assert fmu.read_flag("separated")
    assert steps[2] > 1.0
