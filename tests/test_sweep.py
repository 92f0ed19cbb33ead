"""Sweeps: contents of the tables, their check, executors, interruptions and errors."""

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

from golf_build import VERSION
from golf_impact import run_impact
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError
from golf_impact.runs import METRICS
from golf_impact.sweeps import Stopped, Study, run_sweep, tables
from golf_impact.sweeps import impacts as by_arrays
from golf_impact.sweeps import run as running
from golf_impact.sweeps.checks import deviations
from golf_impact.sweeps.comparison import compare
from golf_impact.sweeps.impacts import PHYSICS, impacts, make_plan
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


# Contents


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
    for name, options in {"fmu": {"fmu": fmu_path}, "arrays": {}}.items():
        summary = run_sweep(study, tmp_path / f"{name}.csv", chunk=5, **options)
        header, rows = table(tmp_path / f"{name}.csv")
        assert header == [*sets, *METRICS]
        assert len(rows) == study.cases == summary.cases
        assert summary.refused == 0
        assert (summary.checked > 0) == (name == "arrays")
        for row in rows:
            expected = fmu.impact(**dict(zip(sets, map(float, row), strict=False)))
            # Text without loss of digits; empty where an impact has no such result.
            texts = ["" if math.isnan(value) else repr(value) for value in expected.values()]
            assert [not cell for cell in row[len(sets) :]] == [not text for text in texts]
            if name == "fmu":
                assert row[len(sets) :] == texts
    columns = zip(*([float(cell or "nan") for cell in row[len(sets) :]] for row in rows))
    outputs = dict(zip(METRICS, map(np.array, columns), strict=True))
    values = study.columns(np.arange(study.cases))
    # Worst measured: 6e-16.
    assert max(deviations(values, outputs, np.zeros(study.cases, bool))).error <= 1e-13


def test_only_the_requested_outputs(tmp_path):
    names = ("separated", "max_force", "touched")
    study = Study.of({"k": 1e6, "club_speed": "-5,35"}, names)
    run_sweep(study, tmp_path / "x.csv")
    header, rows = table(tmp_path / "x.csv")
    assert header == ["k", "club_speed", *names]
    force = float(rows[1].pop(3))
    assert force == pytest.approx(run_impact()["max_force"], rel=1e-13)
    assert rows == [["1000000.0", "-5.0", "0", "0.0", "0"], ["1000000.0", "35.0", "1", "1"]]


def test_unknown_names(tmp_path):
    for sets, outputs, words in (
        ({"stiffness": "1"}, None, "'stiffness': choose from k, b, club_speed"),
        ({"force": "1"}, None, "no input or parameter 'force'"),
        ({"k": "1"}, ("speed",), "no output 'speed': choose from force"),
        ({"k": "1"}, ("k",), "no output 'k'"),
    ):
        with pytest.raises(UserError, match=words):
            run_sweep(Study.of(sets, outputs), tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []


def test_balls(tmp_path):
    from golf_impact.facts.balls import BALLS

    study = Study.of({"ball": list(BALLS), "b": "1,2", "club_speed": "30,45"}, METRICS)
    run_sweep(study, tmp_path / "x.csv")
    header, rows = table(tmp_path / "x.csv")
    assert [row[0] for row in rows] == [name for name in BALLS for _ in range(4)]
    for row in rows:
        values = dict(zip(header[1:], map(float, row[1:]), strict=True))
        # A swept variable overrides the preset.
        case = {**BALLS[row[0]].values, "b": values["b"], "club_speed": values["club_speed"]}
        assert run_impact(**case) == pytest.approx({n: values[n] for n in METRICS}, rel=1e-13)


def test_refused_cases_are_empty_rows(tmp_path):
    sets = {"k": "1e6,-1,2e6", "b": "-3,9"}
    names = ("smash_factor", "separated")
    summary = run_sweep(Study.of(sets, names), tmp_path / "x.csv")
    _, rows = table(tmp_path / "x.csv")
    assert [row[2] == "" for row in rows] == [True, False, True, True, True, False]
    assert [row[3] for row in rows] == ["", "1", "", "", "", "1"]
    expected = run_impact(k=2e6, b=9.0)["smash_factor"]
    assert float(rows[5][2]) == pytest.approx(expected, rel=1e-13)
    assert summary.refused == 4
    row, reason = summary.first_refused
    assert row == 1
    assert "b = -3.0" in reason
    run_sweep(Study.of(sets, names), tmp_path / "x.parquet", chunk=4)
    columns = pyarrow.parquet.read_table(tmp_path / "x.parquet").to_pydict()
    assert [value is None for value in columns["smash_factor"]] == [not row[2] for row in rows]
    assert columns["separated"] == [None, True, None, None, None, True]


def test_parquet_has_the_numbers_of_csv(tmp_path, monkeypatch):
    """Row groups, and so the bytes, are independent of chunks."""
    monkeypatch.setattr(tables, "_ROW_GROUP", 64)
    sets = {"ball": "document,document-old", "law": "1,2", "club_speed": "30:50:40"}
    study = Study.of(sets)
    run_sweep(study, tmp_path / "x.csv")
    header, rows = table(tmp_path / "x.csv")
    for chunk in (7, 60):
        run_sweep(study, tmp_path / f"{chunk}.parquet", chunk=chunk)
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
def alone(tmp_path_factory):
    """A Monte Carlo study by one process, as bytes."""
    path = tmp_path_factory.mktemp("alone") / "x.csv"
    run_sweep(monte_carlo(), path)
    return path.read_bytes()


def monte_carlo():
    return Study.of(MONTE_CARLO, None, 500, 1, "sobol")


@pytest.mark.parametrize(("workers", "chunk"), [(1, 333), (2, 50), (3, 10_000)])
def test_bytes_are_independent_of_workers_and_chunks(alone, tmp_path, workers, chunk):
    run_sweep(monte_carlo(), tmp_path / "x.csv", workers=workers, chunk=chunk)
    assert (tmp_path / "x.csv").read_bytes() == alone


@pytest.mark.ci
def test_any_executor(alone, tmp_path):
    with ThreadPoolExecutor(3) as threads:
        path = tmp_path / "threads.csv"
        run_sweep(monte_carlo(), path, executor=threads, chunk=70)
        assert path.read_bytes() == alone
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        path = tmp_path / "processes.csv"
        run_sweep(monte_carlo(), path, executor=processes, chunk=70)
        assert path.read_bytes() == alone


class Never(Executor):
    """Never done; counts pending calls."""

    waiting = 0

    def submit(self, function, /, *arguments):
        self.waiting += 1
        return Future()


def test_few_chunks_are_under_way(tmp_path):
    """Of 200 chunks the memory never holds more than these."""
    never = Never()
    with pytest.raises(Stopped):
        run_sweep(
            monte_carlo(), tmp_path / "x.csv", executor=never, chunk=5,
            stop=lambda: never.waiting >= 32,
        )  # fmt: skip
    assert never.waiting == 32


def test_a_worker_with_another_physics():
    study = Study.of({"k": "1e6"})
    other = replace(make_plan(study, PHYSICS), identity="golf-impact 0.1")
    with pytest.raises(
        UserError, match=r"a worker has golf-impact .* install the same golf-impact"
    ):
        impacts(other, study.columns(np.array([0])))


# The check


@pytest.mark.parametrize(
    ("case", "output", "factor"),
    [
        (0, "ball_velocity", 1.0 + 1e-12),  # a case that is chosen by its number
        (4_000, "contact_time", 1.0 + 1e-12),  # by no number: the greatest value
        (2_500, "contact_time", 0.5),  # the least
        (0, "contact_time", math.nan),
        (0, "refused", None),
    ],
)
def test_a_wrong_number_ends_the_sweep(tmp_path, monkeypatch, case, output, factor):
    right = by_arrays.impacts_by_arrays
    # Neither the first nor the last case has the longest contact.
    k = [*np.linspace(1e6, 2e6, 4_000), 0.9e6, *np.linspace(1.1e6, 2.1e6, 999)]
    study = Study.of({"k": k})

    def wrong(outputs, values, shape):
        outcome = right(outputs, values, shape)
        place = np.flatnonzero(values["k"] == k[case])
        if output == "refused":
            outcome.refused[place] = True
        else:
            outcome.columns[output][place] *= factor
        return outcome

    run_sweep(study, tmp_path / "x.csv")
    before = (tmp_path / "x.csv").read_bytes()
    monkeypatch.setattr(by_arrays, "impacts_by_arrays", wrong)
    with pytest.raises(
        UserError, match=rf"^row {case + 1:,} \(k = .*{output}.*Nothing was written"
    ):
        run_sweep(study, tmp_path / "x.csv")
    assert (tmp_path / "x.csv").read_bytes() == before
    assert leftovers(tmp_path) == []


def test_how_many_cases_are_checked(tmp_path):
    for sets, least, most, scalar in (
        ({"k": "1e6:2e6:3"}, 3, 9, 0),
        ({"k": "1e6:2e6:50000"}, 50, 70, 0),
        ({"law": 2, "b": "9,2000,-1"}, 3, 9, 1),
    ):
        summary, again = (run_sweep(Study.of(sets), tmp_path / "x.csv", chunk=n) for n in (7, 999))
        assert least <= summary.checked <= most
        assert summary.scalar == scalar
        assert 0.0 <= summary.worst_error < 2e-15
        assert (again.checked, again.worst_error) == (summary.checked, summary.worst_error)


@pytest.mark.parametrize("ball", ["document", 'b".toml'])
def test_lines_are_the_same_with_and_without_pyarrow(ball):
    number, rng = 20_000, np.random.default_rng(1)
    bits = rng.integers(0, 2**64, number, np.uint64).view(float)
    special = [1e16, 1e15, 1e10, 9999999999.5, 1e-4, 1e-5, 1e22, -0.0, 0.0, 5e-324, math.nan]
    doubles = {
        "k": np.where(np.isnan(bits), math.nan, bits),
        "b": 10.0 ** rng.uniform(-12, 24, number),
        "gap": rng.integers(-(2**40), 2**40, number) / 4.0,
        "club_speed": np.resize([*special, *np.nextafter(special, 0.0)], number),
        "smash_factor": rng.uniform(1.0, 1.5, number),
    }
    cells = {"ball": np.array([ball] * number, object), "law": np.resize([1, 2], number)}
    cells |= doubles | {"touched": rng.uniform(size=number) < 0.5}
    refused = rng.uniform(size=number) < 0.1
    lines = tables.csv_lines(cells, refused)
    assert lines == tables.plain_lines(cells, refused)
    names, laws, *columns, flags = zip(*csv.reader(lines.decode().splitlines()), strict=True)
    assert (set(names), set(laws), set(flags)) == ({ball}, {"1", "2"}, {"", "0", "1"})
    for column, values in zip(columns, doubles.values(), strict=True):
        assert [*column] == ["" if math.isnan(value) else repr(value) for value in values.tolist()]


# Interruptions and errors


def test_a_stopped_sweep_leaves_the_earlier_file(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("earlier")
    seen = []
    with pytest.raises(Stopped) as stopped:
        run_sweep(
            Study.of({"k": "1e6:2e6:1000"}), path, chunk=100,
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
def test_ctrl_c(tmp_path, workers, number):
    path = tmp_path / "x.csv"
    path.write_text("earlier")
    process = sweep_in_a_session(path, workers)
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
    if done in map(int, sys.argv[2:]):
        os.kill(multiprocessing.active_children()[0].pid, 9)

if __name__ == "__main__":
    # Heavily damped, so that the workers are busy.
    study = Study.of({"law": 2, "b": 2000, "k": "1e6:2e6:3000"})
    try:
        run_sweep(study, sys.argv[1], workers=2, chunk=100, progress=kill)
    except UserError as error:
        sys.exit(str(error))
"""


@pytest.mark.parametrize("kills", some(1, [2, 3]))
def test_workers_that_are_killed(tmp_path, kills):
    """A new pool computes the missing cases, twice; then it is an error, in one line."""
    path, script = tmp_path / "x.csv", tmp_path / "killer.py"
    path.write_text("earlier")
    script.write_text(KILLER)
    moments = [400, 1_000, 2_000][:kills]
    command = (sys.executable, script, path, *moments)
    done = run(*command, code=int(kills == 3), timeout=300)
    if kills == 2:
        assert done.stderr == ""
        run_sweep(Study.of({"law": 2, "b": 2000, "k": "1e6:2e6:3000"}), tmp_path / "alone.csv")
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
def test_a_parent_that_is_killed(tmp_path):
    """Its workers end without output, and the file is unchanged."""
    path = tmp_path / "x.csv"
    path.write_text("earlier")
    process = sweep_in_a_session(path, 2)
    assert len(processes_of(process.pid)) >= 3
    process.kill()
    process.communicate(timeout=60)
    until = time.monotonic() + 20
    while processes_of(process.pid):
        assert time.monotonic() < until
        time.sleep(0.05)
    assert path.read_text() == "earlier"


def sweep_in_a_session(path, workers):
    """A sweep that would take minutes in a session of its own, when it has begun to write."""
    process = subprocess.Popen(
        [
            COMMAND, "sweep", "--set", "k=1e6:2e6:10000000", "--out", path,
            "--workers", str(workers),
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
def test_a_full_disk(tmp_path, suffix):
    path = tmp_path / f"x.{suffix}"
    path.write_text("earlier")
    # A limit on the size of files fails in the same call, with another reason.
    code = (
        "import resource, sys\nresource.setrlimit(resource.RLIMIT_FSIZE, (700_000, 700_000))\n"
        f"sys.argv = ['x', 'sweep', '--set', 'k=1e6:2e6:20000', '--out', {str(path)!r}]\n"
        "from golf_impact.commands.app import main\nmain()"
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
    with pytest.raises(UserError, match=r"cases need [0-9.]+ GB of memory, and 1.0 GB are free"):
        run_sweep(study, tmp_path / "x.csv")
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
        ("x.csv", {"fmu": fmu_path, "workers": 2}, "leave out --fmu, or --workers and --scheduler"),
        ("x.csv", {"fmu": fmu_path, "scheduler": "local"}, "leave out --fmu"),
    ):
        with pytest.raises(UserError, match=words):
            run_sweep(study, tmp_path / name, **options)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.csv"]


# The command, studies, pictures


def sweep(*arguments, **sets):
    options = [f"--set={name}={values}" for name, values in sets.items()]
    done = golf_here("sweep", *arguments, *options)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("through", ["arrays", "fmu"])
def test_the_command(fmu_path, tmp_path, through):
    options = ["--fmu", fmu_path] if through == "fmu" else []
    done = golf_here(
        *("sweep", "--set", "k=1e6,2e6,-1", "--set", "b=9,0", "--out", "x.csv", "--compare"),
        *("--outputs", "smash_factor,max_force", *options),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    # --compare needs the FMU of the current sources.
    assert all(line.startswith("Built ") for line in done.stderr.splitlines())
    assert done.stdout.startswith("x.csv: 6 cases in ")
    assert "Refused: 2 cases" in done.stdout
    assert ("Computed again without arrays: 6 cases" in done.stdout) == (through == "arrays")
    assert "row 5: k = -1.0 N/m" in done.stdout
    assert "the same numbers (largest error " in done.stdout
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv", "x.png", "x.html"}
    page = (tmp_path / "x.html").read_text()
    assert "data:image/png" in page
    assert (f"golf-impact {VERSION}, FMU" in page) == (through == "fmu")


def test_the_club_fitting_study(tmp_path):
    out = tmp_path / "fit.csv"
    sweep(STUDIES / "club_fitting.toml", "--out", out, club_speed="40,50")
    header, rows = table(out)
    assert header[:4] == ["ball", "club_speed", "m_club", "contact_time"]
    assert len(rows) == 12
    assert all(cell for row in rows for cell in row)
    assert (tmp_path / "fit.png").is_file()


def test_the_tolerance_study(tmp_path):
    """Options override the keys of a study; a variable of both keeps its place."""
    out = tmp_path / "new" / "x.csv"
    study = STUDIES / "tolerance.toml"
    sweep(study, "--out", out, "--samples", 64, "--seed", 2, ball_speed=-1, law=1)
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
def test_pictures(tmp_path, sets):
    random = any(":" in str(text) and text[0] in "nu" for text in sets.values())
    samples = ("--samples", 40) if random else ()
    out = tmp_path / "x.csv"
    sweep("--out", out, "--outputs", "smash_factor", *samples, **sets)
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
    assert "data:image/png" in (tmp_path / "x.html").read_text()


def drawn_axes(sets, values):
    study = Study.of(sets, ("max_force",))
    return draw(
        study, np.asarray(values, float), {name: v.unit for name, v in PHYSICS.items()}, None
    ).axes


def test_few_values_are_lines_and_many_a_map_with_contours():
    """Between few values a map would interpolate."""
    for b, lines, collections in (("0,9,12", 3, 0), ("0:14:8", 0, 2)):
        sets = {"k": "0.5e6:2e6:12", "b": b}
        axes = drawn_axes(sets, np.linspace(1.0, 2.0, Study.of(sets).cases))[0]
        assert (len(axes.lines), len(axes.collections)) == (lines, collections)
        labels = [line.get_label() for line in axes.lines]
        assert labels == [f"b = {value} N·s/m" for value in b.split(",")][:lines]


def test_numbers_at_axes_have_units_with_a_prefix():
    axes = drawn_axes({"k": "0.5e6:2e6:4"}, [5e3, 6e3, 7e3, 8e3])[0]
    assert axes.get_xlabel() == "k (MN/m)"
    assert axes.get_ylabel() == "max force (kN)"
    axes.figure.draw_without_rendering()
    for along in (axes.xaxis, axes.yaxis):
        assert along.get_offset_text().get_text() == ""
        assert all(0.0 < float(text.get_text()) < 10.0 for text in along.get_ticklabels())
    logarithmic = drawn_axes({"k": "log:1e5:1e7:3"}, [1e3, 2e3, 3e3])[0]
    assert (logarithmic.get_xlabel(), logarithmic.get_xscale()) == ("k (N/m)", "log")


def test_nothing_to_draw(tmp_path):
    sweep("--out", tmp_path / "x.csv", k=1e6)
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv", "x.html"}
    sweep("--out", tmp_path / "y.csv", "--no-figures", k="1e6,2e6")
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
    with Sweep(study) as sweep:
        measured = compare(sweep, fmu_path, rounds=1)
        assert measured.error <= 1e-13
        assert measured.rate > 0.0
        # As if the FMU ended within the contact, where the numbers are others.
        monkeypatch.setattr(ScalarImpacts, "horizon", lambda self, values: np.array(1e-4))
        assert compare(sweep, fmu_path, rounds=1).error > 1e-3
    with (
        pytest.raises(UserError, match="nothing to compare"),
        Sweep(Study.of({"k": "-1"})) as sweep,
    ):
        compare(sweep, fmu_path)


def test_a_step_long_enough_for_any_exponent(fmu):
    # A stiffening ball is soft to a slow club: its contact may last for seconds.
    values = {"exponent": np.array([1.0, 1.5, 12.0]), "club_speed": np.array([1e-3, 1e-3, 1e-3])}
    steps = fmu.horizon({"law": 2, **values})
    for n in range(3):
        fmu.impact(law=2, **{name: values[name][n].item() for name in values})
        assert fmu.read_flag("separated")
    assert steps[2] > 1.0
