"""Sweeps: contents of the tables, their check, executors, interruptions and errors."""

import csv
import itertools
import math
import os
import signal
import sys
import time
from concurrent.futures import Executor, Future
from contextlib import suppress
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from command import golf_here, golf_started, refused, run, run_python
from conftest import some

from golf_build import VERSION
from golf_impact import run_impact
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.ball import BALLS
from golf_impact.errors import UserError
from golf_impact.runs import METRICS
from golf_impact.sweeps import Stopped, Study, run_sweep, tables
from golf_impact.sweeps import impacts as by_arrays
from golf_impact.sweeps import run as running
from golf_impact.sweeps.checks import deviations
from golf_impact.sweeps.comparison import compare
from golf_impact.sweeps.impacts import PHYSICS, make_plan
from golf_impact.sweeps.pictures import draw, sobol_indices
from golf_impact.sweeps.run import Sweep
from golf_impact.sweeps.study import parse_axis, read_study

pytestmark = pytest.mark.usefixtures("no_figure_stays_open")

STUDIES = Path(__file__).parents[1] / "scenarios" / "studies"


def table(path):
    """Header and rows of a CSV file, as text."""
    with open(path, newline="") as stream:
        header, *rows = csv.reader(stream)
    return header, rows


def leftovers(folder):
    return [path.name for path in folder.iterdir() if path.name.endswith(".part")]


# Axes and studies


AXES = {
    "0.5e6:2e6:4": [0.5e6, 1e6, 1.5e6, 2e6],
    "log:1e5:1e7:3": [1e5, 1e6, 1e7],
    "0, 9,12": [0.0, 9.0, 12.0],
    "-2:-1:2": [-2.0, -1.0],
    "3:3:1": [3.0],
    7: [7.0],
    (1, 2.5): [1.0, 2.5],
}


@pytest.mark.parametrize("text", AXES, ids=str)
def test_values_of_an_axis(text):
    values = parse_axis("k", list(text) if isinstance(text, tuple) else text).values
    assert values.tolist() == AXES[text]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("k", "2e6:1e6:5", "above its end"),
        ("k", "log:0:1e6:5", "above 0"),
        ("k", "1:2:0", "1 to 10,000,000"),
        ("k", "1:2:1e9", "1 to 10,000,000"),
        ("k", "1,inf", "finite"),
        ("k", "1,,2", "write VALUE"),
        ("k", "norm:1:2", "write VALUE"),
        ("k", "normal:1:0", "> 0"),
        ("k", "uniform:2:1", "above its end"),
        ("k", False, "write VALUE"),
        ("law", "1,-4294967295", "1 .absolute. or 2"),
        ("law", "1.5", "law=1.5 is refused: law is 1"),
        ("ball", "golf", "choose from"),
    ],
)
def test_invalid_axes(name, text, words):
    with pytest.raises(UserError, match=words):
        parse_axis(name, text)


DRAWN = {"sets": {"k": "normal:1e6:1"}}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"sets": {}}, "nothing is swept"),
        (DRAWN, "--samples"),
        ({"number_of_samples": 5}, "no distribution"),
        ({**DRAWN, "number_of_samples": 0}, "at least 1"),
        ({"design": "halton"}, "random, lhs, sobol"),
        ({"seed": -1}, "--seed"),
        ({"outputs": ("force", "force")}, "twice"),
        ({"outputs": ()}, "empty list"),
        ({**DRAWN, "number_of_samples": 2**30 + 1, "design": "sobol"}, "at most 1,073,741,824"),
        ({"sets": {"stiffness": "1"}}, "'stiffness': choose from k, b, club_speed"),
        ({"sets": {"force": "1"}}, "no input or parameter 'force'"),
        ({"outputs": ("k",)}, "no output 'k'"),
    ],
)
def test_invalid_studies(tmp_path, arguments, words):
    with pytest.raises(UserError, match=words):
        run_sweep(Study.of(**{"sets": {"k": "1"}} | arguments), tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []


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
    # A swept variable overrides the preset.
    "balls": {"ball": ",".join(BALLS), "b": "1,2", "club_speed": "30,45"},
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
            case = dict(zip(sets, row, strict=False))
            preset = BALLS[case.pop("ball")].values if "ball" in case else {}
            expected = fmu.impact(**{**preset, **{name: float(v) for name, v in case.items()}})
            # Text without loss of digits; empty where an impact has no such result.
            texts = ["" if math.isnan(value) else repr(value) for value in expected.values()]
            assert [not cell for cell in row[len(sets) :]] == [not text for text in texts]
            if name == "fmu":
                assert row[len(sets) :] == texts
    columns = zip(*([float(cell or "nan") for cell in row[len(sets) :]] for row in rows))
    outputs = dict(zip(METRICS, map(np.array, columns), strict=True))
    values = make_plan(study, PHYSICS).values(study.columns(np.arange(study.cases)))
    # Worst measured: 6e-16.
    assert max(deviations(values, outputs, np.zeros(study.cases, bool))).error <= 1e-13


@pytest.mark.parametrize("through", ["arrays", "fmu"])
def test_refused_cases_are_empty_rows(fmu_path, tmp_path, through):
    study = Study.of({"k": "1e6,-1,2e6", "b": "-3,9"}, ("smash_factor", "separated"))
    options = {"fmu": fmu_path} if through == "fmu" else {}
    summary = run_sweep(study, tmp_path / "x.csv", **options)
    _, rows = table(tmp_path / "x.csv")
    assert [row[3] for row in rows] == ["", "1", "", "", "", "1"]
    first, last = (run_impact(k=k, b=9.0)["smash_factor"] for k in (1e6, 2e6))
    expected = [math.nan, first, math.nan, math.nan, math.nan, last]
    assert [row[2] == "" for row in rows] == [math.isnan(value) for value in expected]
    for found in (summary.drawn, [float(row[2] or "nan") for row in rows]):
        assert found == pytest.approx(expected, rel=1e-13, nan_ok=True)
    assert (summary.refused, summary.scalar) == (4, 2 if options else 0)
    row, reason = summary.first_refused
    assert row == 1
    assert "b = -3.0" in reason
    run_sweep(study, tmp_path / "x.parquet", chunk=4, **options)
    columns = pyarrow.parquet.read_table(tmp_path / "x.parquet").to_pydict()
    assert [value is None for value in columns["smash_factor"]] == [not row[2] for row in rows]
    assert columns["separated"] == [None, True, None, None, None, True]


def test_parquet_has_the_numbers_of_csv(tmp_path, monkeypatch):
    """Row groups, and so the bytes, are independent of chunks, which may hold several groups."""
    monkeypatch.setattr(tables, "_ROW_GROUP", 64)
    study = Study.of({"ball": "document,document-old", "law": "1,2", "club_speed": "30:50:40"})
    run_sweep(study, tmp_path / "x.csv")
    header, rows = table(tmp_path / "x.csv")
    paths = [tmp_path / f"{chunk}.parquet" for chunk in (7, 60, 160)]
    for path in paths:
        run_sweep(study, path, chunk=int(path.stem))
    assert len({path.read_bytes() for path in paths}) == 1
    file = pyarrow.parquet.ParquetFile(paths[0])
    assert [file.metadata.row_group(n).num_rows for n in range(3)] == [64, 64, 32]
    read = file.read()
    assert read.column_names == header
    kinds = [str(kind) for kind in read.schema.types]
    assert kinds == ["string", "int64"] + ["double"] * (len(header) - 2)
    for name, column in zip(header, zip(*rows, strict=True), strict=True):
        make = {"ball": str, "law": int}.get(name, float)
        assert read[name].to_pylist() == [make(cell) for cell in column]


def test_the_first_output_of_a_study():
    study = Study.of({"k": "1e6,2e6"}, ("contact_time", "smash_factor"))
    with Sweep(study) as sweep:
        columns = study.columns(np.arange(2))
        expected = sweep.compute(columns).columns["contact_time"]
        assert sweep.first_output(columns).tolist() == expected.tolist()


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


@pytest.mark.parametrize(("workers", "chunk"), [(1, 333), (3, 50)])
def test_bytes_are_independent_of_workers_and_chunks(alone, tmp_path, workers, chunk):
    run_sweep(monte_carlo(), tmp_path / "x.csv", workers=workers, chunk=chunk)
    assert (tmp_path / "x.csv").read_bytes() == alone
    # Ctrl-C, which workers don't receive, still reaches this process.
    assert not signal.pthread_sigmask(signal.SIG_BLOCK, ())


class Never(Executor):
    """Never done; counts pending calls."""

    waiting = 0

    def submit(self, function, /, *arguments):
        self.waiting += 1
        return Future()


def test_few_chunks_are_under_way(tmp_path):
    """Of 200 chunks the memory never holds more than these."""
    never = Never()
    options = {"executor": never, "chunk": 5, "stop": lambda: never.waiting >= 32}
    with pytest.raises(Stopped):
        run_sweep(monte_carlo(), tmp_path / "x.csv", **options)
    assert never.waiting == 32


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
    with pytest.raises(UserError, match=rf"^row {case + 1:,} \(k = .*{output}"):
        run_sweep(study, tmp_path / "x.csv")
    assert (tmp_path / "x.csv").read_bytes() == before
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize(
    ("sets", "chunks", "least", "most", "scalar"),
    [
        ({"k": "1e6:2e6:3"}, (1, 999), 3, 9, 0),
        ({"k": "1e6:2e6:50000"}, (777, 9999), 50, 70, 0),
        ({"law": 2, "b": "9,2000,-1"}, (1, 999), 3, 9, 1),
    ],
)
def test_how_many_cases_are_checked(tmp_path, sets, chunks, least, most, scalar):
    study = Study.of(sets, ("smash_factor", "contact_time"))
    one, other = (run_sweep(study, tmp_path / "x.csv", chunk=chunk) for chunk in chunks)
    assert least <= one.checked <= most
    assert one.scalar == scalar
    assert 0.0 <= one.worst_error < 2e-15
    assert (other.checked, other.worst_error) == (one.checked, one.worst_error)


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


@pytest.fixture
def earlier(tmp_path, request):
    """The path of an earlier table, which must be unchanged at the end, with nothing beside it."""
    path = tmp_path / f"x.{getattr(request, 'param', 'csv')}"
    path.write_text("earlier")
    yield path
    assert path.read_text() == "earlier"
    assert leftovers(tmp_path) == []


def test_a_stopped_sweep_leaves_the_earlier_file(earlier):
    seen = []
    options = {"progress": seen.append, "stop": lambda: bool(seen) and seen[-1] >= 300}
    with pytest.raises(Stopped) as stopped:
        run_sweep(Study.of({"k": "1e6:2e6:1000"}), earlier, chunk=100, **options)
    assert stopped.value.done == 300


@pytest.mark.parametrize("case", some(1, itertools.product((2, 1), ("SIGINT", "SIGTERM"))))
def test_ctrl_c(earlier, case):
    workers, name = case
    process = sweep_in_a_session(earlier, workers)
    # As a terminal does it: to all processes.
    os.killpg(process.pid, signal.Signals[name])
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    done = int(errors.split(" of 10,000,000 cases were done")[0].replace(",", ""))
    assert 0 < done < 10_000_000
    assert "Traceback" not in errors
    wait_for(lambda: not processes_of(process.pid), 10)


KILLER = """
import multiprocessing, os, sys
from golf_impact import Study, run_sweep
from golf_impact.errors import UserError

moments, before = [*map(int, sys.argv[2:])], set()

def kill(done):
    # A worker of a new pool: the last one's may be ending.
    workers = {worker.pid for worker in multiprocessing.active_children()}
    if moments and done >= moments[0] and workers - before:
        os.kill(min(workers - before), 9)
        before.update(workers)
        moments.pop(0)

if __name__ == "__main__":
    # Heavily damped, and many, so that the workers are busy until the last kill.
    study = Study.of({"law": 2, "b": 2000, "k": "1e6:2e6:2000"})
    try:
        run_sweep(study, sys.argv[1], workers=2, chunk=25, progress=kill)
    except UserError as error:
        sys.exit(str(error))
"""


@pytest.mark.ci
@pytest.mark.parametrize("kills", [2, 3])
def test_workers_that_are_killed(tmp_path, kills):
    """A new pool computes the missing cases, twice; then it is an error, in one line."""
    path, script = tmp_path / "x.csv", tmp_path / "killer.py"
    path.write_text("earlier")
    script.write_text(KILLER)
    moments = [100, 250, 400][:kills]
    done = run(sys.executable, script, path, *moments, code=int(kills == 3), timeout=300)
    if kills == 2:
        assert done.stderr == ""
        run_sweep(Study.of({"law": 2, "b": 2000, "k": "1e6:2e6:2000"}), tmp_path / "alone.csv")
        assert path.read_bytes() == (tmp_path / "alone.csv").read_bytes()
    else:
        (line,) = done.stderr.splitlines()
        assert line.startswith("worker processes ended unexpectedly 3 times")
        assert path.read_text() == "earlier"
    assert leftovers(tmp_path) == []


def wait_for(condition, seconds):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.05)


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
    wait_for(lambda: not processes_of(process.pid), 20)
    assert path.read_text() == "earlier"


def sweep_in_a_session(path, workers):
    """A sweep that would take minutes in a session of its own, when it has begun to write."""
    options = ["--set", "k=1e6:2e6:10000000", "--out", path, "--workers", workers]
    process = golf_started("sweep", *options, start_new_session=True)

    def writes():
        assert process.poll() is None
        return any(part.stat().st_size > 1e5 for part in path.parent.glob(".*.part"))

    wait_for(writes, 60)
    return process


@pytest.mark.parametrize("earlier", some(1, ["csv", "parquet"]), indirect=True)
def test_a_full_disk(earlier):
    # A limit on the size of files fails in the same call, with another reason.
    code = (
        "import resource, sys\nresource.setrlimit(resource.RLIMIT_FSIZE, (700_000, 700_000))\n"
        f"sys.argv = ['x', 'sweep', '--set', 'k=1e6:2e6:20000', '--out', {str(earlier)!r}]\n"
        "from golf_impact.commands.app import main\nmain()"
    )
    done = run_python(code, code=2)
    refused(done, f"can't write {earlier}: File too large")


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
    golf_here("sweep", *arguments, *options, code=0)


@pytest.mark.parametrize("through", ["arrays", "fmu"])
def test_the_command(fmu_path, tmp_path, through):
    options = ["--fmu", fmu_path] if through == "fmu" else ["--compare"]
    sets = ("--set", "k=1e6,2e6,-1", "--set", "b=9,0", "--outputs", "smash_factor,max_force")
    done = golf_here("sweep", *sets, "--out", "x.csv", *options, cwd=tmp_path, code=0)
    # --compare needs the FMU of the current sources.
    assert all(line.startswith("Built ") for line in done.stderr.splitlines())
    words = ["x.csv: 6 cases in ", "Refused: 2 cases", "row 5: k = -1.0 N/m"]
    if through == "arrays":
        words += ["Computed again without arrays: 6 cases", "the same numbers (largest error "]
    assert [word for word in words if word not in done.stdout] == []
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv", "x.png", "x.html"}
    page = (tmp_path / "x.html").read_text()
    assert "data:image/png" in page
    assert (f"golf-impact {VERSION}, FMU" in page) == (through == "fmu")


@pytest.mark.parametrize(
    ("name", "options", "columns", "number"),
    [
        ("club_fitting", ["--set=club_speed=40,50"], ["ball", "club_speed", "m_club"], 12),
        # Options override the keys of a study; a variable of both keeps its place.
        (
            "tolerance",
            ["--samples=64", "--seed=2", "--set=ball_speed=-1", "--set=law=1"],
            ["club_speed", "law", "k", "b", "m_ball", "ball_speed", "ball_velocity"],
            64,
        ),
    ],
)
def test_the_studies(tmp_path, name, options, columns, number):
    out = tmp_path / "new" / "x.csv"
    sweep(STUDIES / f"{name}.toml", "--out", out, *options)
    header, rows = table(out)
    assert header[: len(columns)] == columns
    assert len(rows) == number
    assert all(cell for row in rows for cell in row)
    assert ("first-order Sobol index" in out.with_suffix(".html").read_text()) == (number == 64)
    assert out.with_suffix(".png").is_file()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("stuff = 1", "no key 'stuff': choose from out, design"),
        ("samples = true", "whole number"),
        ("outputs = 'force'", "it must be a list of names"),
        ("set = 1", r"table \[set\]"),
        (f"samples = {'9' * 5000}", "no TOML file"),
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
    "samples": {"k": "normal:0:1e6", "b": "uniform:0:9"},
    "samples of balls": {"ball": "document,roh-lee", "k": "normal:1e6:5e4"},
    "more than two": {"k": "0.5e6:2e6:12", "b": "12,9,0", "club_speed": "30,40"},
    "samples over a grid": {"k": "normal:1e6:5e4", "club_speed": "30,40,50"},
    "samples that change nothing": {"gap": "uniform:0:1", "b": 0, "law": 2},
    # S doesn't depend on club speed but for rounding.
    "one distribution": {"club_speed": "normal:45:2", "law": 1},
}


@pytest.mark.parametrize("sets", some(4, PICTURES))
def test_pictures(tmp_path, sets):
    random = any(":" in str(text) and text[0] in "nu" for text in sets.values())
    samples = ("--samples", 40) if random else ()
    out = tmp_path / "x.csv"
    sweep("--out", out, "--outputs", "smash_factor", *samples, **sets)
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
    assert "data:image/png" in (tmp_path / "x.html").read_text()


UNITS = {"k": "N/m", "b": "N.s/m", "law": None, "max_force": "N", "club_speed": "m/s"}


@pytest.mark.parametrize(
    ("axes", "every", "scale", "title", "legend", "marker"),
    [
        ({"k": "log:1e5:1e7:12"}, 1, "log", "k", [], "o"),
        # Laws are lines, whatever has more values.
        (
            {"k": "1e5:1e7:13", "b": "0:9:8", "law": "1,2"},
            *(8, "linear", "k", ["law 1", "law 2"], "None"),
        ),
        ({"k": "1e5:1e7:2001"}, 2, "linear", "k", [], "None"),
        (
            {"b": "0:9:8", "k": "1e6:7e6:7"},
            *(1, "linear", "b and k", [f"k = {n} MN/m" for n in range(1, 8)], "v"),
        ),
    ],
)
def test_lines_of_a_study(axes, every, scale, title, legend, marker):
    """Of at most 2000 points; up to twelve have markers."""
    study = Study.of(axes, outputs=("max_force",))
    figure = draw(study, np.arange(float(study.cases)), UNITS, None)
    (shown,) = figure.axes
    assert shown.get_xscale() == scale
    assert shown.get_title("left").startswith(f"Max force over {title}")
    labels = [text.get_text() for text in shown.get_legend().get_texts()] if legend else []
    assert labels == legend
    # The last variable varies fastest; the first value of one that isn't drawn.
    columns = np.arange(float(study.cases)).reshape(-1, max(1, len(legend)))[::every].T
    assert np.array_equal([line.get_ydata() for line in shown.lines], columns)
    assert shown.lines[0].get_marker() == marker


def test_a_map_of_a_study():
    """The last variable upwards, from eight values on; contours and axes have the same prefixes."""
    axes = {"k": "1e6:3e6:9", "club_speed": "40,30", "b": "7,6,5,4,3,2,1,0"}
    study = Study.of(axes, outputs=("max_force",))
    columns = study.columns(np.arange(study.cases))
    force = 1e-3 * columns["k"] + columns["b"] + 1e5 * (columns["club_speed"] == 30.0)
    figure = draw(study, force, UNITS, None)
    shown, colours = figure.axes
    figure.canvas.draw()
    labels = shown.get_xlabel(), shown.get_ylabel(), colours.get_ylabel()
    assert labels == ("k (MN/m)", "b (N·s/m)", "max force (kN)")
    assert shown.get_title("left") == "Max force over k and b (club speed = 40 m/s)"
    mesh, *_ = shown.collections
    assert np.array_equal(mesh.get_array(), force.reshape(9, 2, 8)[:, 0, ::-1].T)
    levels = {float(text.get_text()) for text in shown.texts}
    assert 1.0 <= min(levels) < max(levels) <= 3.0


def test_samples_of_a_study():
    """A histogram with percentiles, beside Sobol indices; over a grid, a line with a band."""
    force = np.random.default_rng(1).permutation(np.linspace(5e3, 7e3, 201))
    study = Study.of({"k": "normal:1e6:1e5", "b": "uniform:0:9"}, ("max_force",), 201)
    figure = draw(study, force, UNITS, {"k": 0.75, "b": 0.25})
    histogram, bars = figure.axes
    labels = [text.get_text() for text in histogram.get_legend().get_texts()]
    assert labels == ["5 %: 5.1 kN", "50 %: 6 kN", "95 %: 6.9 kN"]
    assert [line.get_xdata()[0] for line in histogram.lines] == pytest.approx([5.1e3, 6e3, 6.9e3])
    assert sum(bar.get_height() for bar in histogram.patches) == 201
    assert len(histogram.patches) == 14
    assert [bar.get_width() for bar in bars.patches] == [0.25, 0.75]
    assert [text.get_text() for text in bars.get_yticklabels()] == ["b", "k"]
    # Few that are equal but for rounding: within a thousandth.
    figure = draw(study, np.full(40, 3.0), UNITS, None)
    first, *_, last = figure.axes[0].patches
    assert (first.get_x(), last.get_x()) == pytest.approx((2.997, 2.997 + 7 * 0.00075))
    study = Study.of({"k": "normal:1e6:1e5", "b": "0,9"}, ("max_force",), 201)
    figure = draw(study, np.append(force, force + 1e3), UNITS, None)
    (shown,) = figure.axes
    (line,), (band,) = shown.lines, shown.collections
    assert line.get_ydata() == pytest.approx([6e3, 7e3])
    low, high = band.get_datalim(shown.transData).intervaly
    assert (low, high) == pytest.approx((5.1e3, 7.9e3))
    labels = [text.get_text() for text in shown.get_legend().get_texts()]
    assert labels == ["median", "5 to 95 % of the samples"]
    # Two are many, too.
    study = Study.of({"k": "normal:1e6:1e5", "b": "0,9"}, ("max_force",), 2)
    figure = draw(study, np.array([1.0, 3.0, 2.0, 4.0]), UNITS, None)
    assert figure.axes[0].lines[0].get_ydata() == pytest.approx([2.0, 3.0])
    assert len(figure.axes[0].collections) == 1


def test_nothing_to_draw(tmp_path):
    sweep("--out", tmp_path / "x.csv", k=1e6)
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv", "x.html"}
    (tmp_path / "x.png").write_bytes(b"of an earlier sweep")
    sweep("--out", tmp_path / "x.csv", k="-1,-2")
    assert not (tmp_path / "x.png").exists()
    sweep("--out", tmp_path / "y.csv", "--no-figures", k="1e6,2e6")
    assert not (tmp_path / "y.png").exists()
    study = Study.of({"k": "1e6,2e6,3e6"}, ("max_force",))
    assert draw(study, np.array([1.0, math.nan, math.nan]), UNITS, None) is None
    assert draw(study, np.array([1.0, math.nan, 2.0]), UNITS, None) is not None


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
        (Study.of({"k": sets["k"]}, None, 256), columns["k"], lambda columns: columns["k"]),
    ):
        with np.errstate(invalid="ignore"):
            assert sobol_indices(other, drawn, model) is None


@pytest.mark.ci
def test_the_comparison_compares(fmu_path, monkeypatch):
    # A run with a force on the head ends at separation.
    study = Study.of({"k": "1e6:2e6:50", "gap": "0,0.1", "club_force": "0,500"})
    with Sweep(study) as sweep:
        rate, error = compare(sweep, fmu_path, rounds=1)
        assert error <= 1e-13
        assert rate > 0.0
        # As if the FMU ended within the contact, where the numbers are others.
        monkeypatch.setattr(ScalarImpacts, "horizon", lambda self, values: np.array(1e-4))
        assert compare(sweep, fmu_path, rounds=1)[1] > 1e-3
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
