"""`golf-impact sweep`: tables, indices, and a cluster of two workers.

Axes, samples, pictures and what is refused: transcripts/sweep.md.
"""

import csv
import logging
import math
import re
import sys
from contextlib import nullcontext

import numpy as np
import pyarrow.parquet
import pytest
from command import golf_here, refused

import golf_impact
from golf_build import VERSION
from golf_impact.data.balls import BALLS
from golf_impact.data.runs import ImpactArrays
from golf_impact.studies.sweep import cluster as sweep_cluster
from golf_impact.studies.sweep import table as sweep_table
from golf_impact.studies.sweep.sweep import OUTPUTS, Design, parse_axis, sobol_indices


@pytest.fixture
def moved(monkeypatch):
    """To which numbers of cases the progress bar moves."""
    moved = []
    bar = nullcontext(moved.append)
    monkeypatch.setattr("golf_impact.commands.sweep.progress", lambda name, total: bar)
    return moved


CASES = {
    "law 1": {"k": "0.5e6:2e6:7", "b": "0,9,300", "club_speed": "20,50,-1"},
    "both laws": {"law": "1,2", "k": "log:1:1e8:5", "gap": "0,0.2"},
    # A swept variable overrides the preset.
    "balls": {"ball": ",".join(BALLS), "b": "1,2,-2", "club_speed": "30,45"},
}


def read(path):
    """Columns of a table, and its rows, in which nothing is an empty text."""
    if path.suffix == ".csv":
        with open(path, newline="") as stream:
            header, *rows = csv.reader(stream)
        return header, rows
    table = pyarrow.parquet.read_table(path)
    assert table.schema.metadata[b"version"].decode() == VERSION
    assert table.schema.field("club_velocity").metadata == {b"unit": b"m/s"}
    rows = [["" if cell is None else cell for cell in row.values()] for row in table.to_pylist()]
    return table.column_names, rows


@pytest.mark.parametrize("form", ["csv", "parquet", "csv without pyarrow", "csv through the FMU"])
@pytest.mark.parametrize("sets", CASES.values(), ids=CASES)
def test_numbers_are_those_of_single_impacts(fmu_path, tmp_path, monkeypatch, moved, sets, form):
    monkeypatch.setattr(sweep_table, "BLOCK", 3)
    if form == "csv without pyarrow":
        monkeypatch.setitem(sys.modules, "pyarrow", None)
    path, outputs = tmp_path / "new" / f"x.{form.split()[0]}", (*OUTPUTS, "separated")
    options = [f"--set={name}={text}" for name, text in sets.items()]
    options += ["--no-figures", "--outputs", ", ".join(outputs), "--out", path]
    done = golf_here("sweep", *options, *["--fmu", fmu_path] * ("FMU" in form), code=0)
    assert [file.name for file in path.parent.iterdir()] == [path.name]
    header, rows = read(path)
    # Law, k and b are named in every table.
    shown = [*dict.fromkeys([*sets, "law", "k", "b"])]
    assert header == [*shown, *outputs]
    assert ("This is law 1" in done.stdout) == (not {"law", "ball"} & {*sets})
    # Without a rate: the time of so few is that of the start.
    assert re.search(rf"^{len(rows)} cases in [\d.]+ s$", done.stdout, re.MULTILINE)
    assert len(rows) == math.prod(len(parse_axis(*one)) for one in sets.items())
    refusals = []
    for number, row in enumerate(rows, 1):
        given, cells = dict(zip(shown, row)), row[len(shown) :]
        ball = BALLS[given.pop("ball")].values if "ball" in given else {}
        values = {**ball, **{name: float(value) for name, value in given.items()}}
        try:
            expected = golf_impact.run_impact(OUTPUTS, **values)
        except golf_impact.UserError as error:
            refusals.append(f"the first is row {number}: {error}\n")
            assert {*cells} == {""}
            continue
        found = [float("nan" if cell == "" else cell) for cell in cells[:-1]]
        assert found == pytest.approx([*expected.values()], rel=1e-13, abs=0.0, nan_ok=True)
        assert int(cells[-1]) == (not math.isnan(expected["contact_time"]))
    expected = f"Refused: {len(refusals)} of them; {refusals[0]}" if refusals else ""
    assert expected in done.stdout
    assert ("Refused" in done.stdout) == bool(refusals)
    assert moved == [*range(3, len(rows), 3), len(rows)]


@pytest.mark.parametrize("method", ["random", "lhs", "sobol"])
def test_samples(method):
    sets = {"k": "normal:1000:50N/mm", "b": "0,9", "club_speed": "uniform:40:50"}

    def samples(seed):
        found = golf_impact.sweep(sets, ["impulse"], samples=1024, seed=seed, method=method)
        assert list(found) == [*sets, "law", "impulse"]
        # Every point of the grid has the same samples, which vary fastest.
        assert found["b"].tolist() == [0.0] * 1024 + [9.0] * 1024
        assert all((found[name][:1024] == found[name][1024:]).all() for name in sets if name != "b")
        return found["k"][:1024], found["club_speed"][:1024]

    k, speed = samples(3)
    # Four standard errors of independent samples.
    assert abs(k.mean() - 1e6) < 4 * 5e4 / 32
    assert abs(k.std() - 5e4) < 4 * 5e4 / math.sqrt(2048)
    assert 40 <= speed.min() < speed.max() < 50
    # One in each of 1024 equal parts, or not.
    even = sorted(np.floor((speed - 40.0) * 102.4)) == list(range(1024))
    assert even == (method != "random")
    assert (samples(3)[0] == k).all()
    assert (samples(4)[0] != k).all()


def test_sobol_indices_of_a_known_function():
    """Of sin x + 7 sin² y + 0.1 z⁴ sin x, without a value on a part of the design; a constant."""
    angles = dict.fromkeys(("k", "b", "gap"), f"uniform:{-math.pi}:{math.pi}")
    design = Design(angles, ("impulse", "smash_factor"), samples=1)

    def impacts(outputs, k, b, gap):
        found = np.sin(k) + 7.0 * np.sin(b) ** 2 + 0.1 * gap**4 * np.sin(k)
        found[::1000] = math.nan
        results = {"impulse": found, "smash_factor": 1.5 + 1e-15 * np.sin(k)}
        return ImpactArrays(results, np.zeros(len(k), bool), "")

    design.impacts = impacts
    found = sobol_indices(design)
    exact = {"first_order": (0.3139, 0.4424, 0.0), "total": (0.5576, 0.4424, 0.2437)}
    for kind, values in exact.items():
        indices = found[kind]["impulse"].values()
        assert [value for value, _, _ in indices] == pytest.approx(values, abs=0.02)
        for (_, low, high), value in zip(indices, values):
            assert low < value < high
            assert 0.02 < high - low < 0.15
        assert np.isnan([*found[kind]["smash_factor"].values()]).all()


# On a Dask cluster: the cases are those of one process

#: A few of them have k < 0, which is refused.
ON_CLUSTER = {"k": "normal:1e6:5e5", "b": "0,9", "law": "1,2"}
LINE = [
    "sweep", *(f"--set={name}={text}" for name, text in ON_CLUSTER.items()), "--samples=500",
    "--seed=1", "--outputs=smash_factor,contact_time", "--no-figures", "--scheduler",
]  # fmt: skip


@pytest.fixture(
    scope="module", params=[False, pytest.param(True, marks=pytest.mark.ci)], ids=["here", "apart"]
)
def address(request):
    """Dask's scheduler, with two workers in this process or, with --ci, in their own."""
    import distributed  # takes half a second

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=request.param, dashboard_address=":0",
        silence_logs=logging.CRITICAL,
    ) as cluster:  # fmt: skip
        yield cluster.scheduler_address


def test_a_table_of_parts(address, tmp_path, monkeypatch, moved):
    path = tmp_path / "x.parquet"
    expected = golf_impact.sweep(ON_CLUSTER, ["smash_factor", "contact_time"], samples=500, seed=1)
    for block in (100_000, 100):  # the second one replaces the first
        monkeypatch.setattr(sweep_cluster, "BLOCK", block)
        done = golf_here(*LINE, address, "--out", path, code=0)
        parts = max(8, 2000 // block)
        assert len([*path.iterdir()]) == parts
        assert moved[-parts:] == [2000 * n // parts for n in range(1, parts + 1)]
        assert [one.name for one in tmp_path.iterdir()] == ["x.parquet"]
        found = pyarrow.parquet.read_table(path).to_pydict()
        assert [*found] == [*expected]
        for name, column in expected.items():
            rtol = 0.0 if name in ON_CLUSTER else 1e-13
            np.testing.assert_allclose(np.array(found[name], float), column, rtol)
        first = f"the first is row {expected.refused.argmax() + 1}: {expected.reason}"
        assert f"Refused: {expected.refused.sum()} of them; {first}" in done.stdout


@pytest.mark.parametrize(
    ("out", "changed", "words"),
    [
        ("x.csv", {}, "must be a folder FILE.parquet"),
        ("file.parquet", {}, "must be a folder FILE.parquet"),
        # To the workers this process has another version.
        ("x.parquet", {"VERSION": "0.0.9", "_about": lambda _: (VERSION, True)}, "not 0.0.9"),
        # What they are to look at isn't there.
        ("x.parquet", {"Path.mkdir": lambda self, **_: None}, "doesn't share the folder ."),
    ],
)
def test_a_sweep_that_no_cluster_can_do(address, tmp_path, monkeypatch, out, changed, words):
    (tmp_path / "file.parquet").write_text("")
    for name, value in changed.items():
        monkeypatch.setattr(f"golf_impact.studies.sweep.cluster.{name}", value)
    refused(golf_here(*LINE, address, "--out", out, cwd=tmp_path), words)
    assert [one.name for one in tmp_path.iterdir()] == ["file.parquet"]


@pytest.mark.ci
@pytest.mark.parametrize("scheduler", ["tcp://127.0.0.1:1", "nonsense"])
def test_a_cluster_that_is_not_there(tmp_path, monkeypatch, scheduler):
    monkeypatch.setattr(sweep_cluster, "_PATIENCE", "0.5s")
    done = golf_here(*LINE, scheduler, "--out", "x.parquet", cwd=tmp_path)
    refused(done, f"the Dask cluster at {scheduler} can't do it")
    assert not [*tmp_path.iterdir()]
