"""`golf-impact sweep`: axes, samples, tables, indices, pictures, and a cluster of two workers."""

import csv
import logging
import math
import re
import sys

import numpy as np
import pyarrow.parquet
import pytest
from command import golf_here, refused
from matplotlib.figure import Figure

import golf_impact
from golf_build import VERSION
from golf_impact.data.balls import BALLS
from golf_impact.data.runs import ImpactArrays
from golf_impact.report.results import plotting
from golf_impact.studies.sweep import cluster as sweep_cluster
from golf_impact.studies.sweep import table as sweep_table
from golf_impact.studies.sweep.picture import draw, draw_indices
from golf_impact.studies.sweep.sweep import OUTPUTS, Design, parse_axis, sobol_indices

# Axes and samples

MPH = 0.44704
AXES = [
    ("k", "0.5e6:2e6:4", [0.5e6, 1e6, 1.5e6, 2e6]),
    ("k", "log:1e5:1e7:3", [1e5, 1e6, 1e7]),
    ("b", "0, 9,12", [0.0, 9.0, 12.0]),
    ("k", "3:3:1", [3.0]),
    ("k", 7, [7.0]),
    ("k", (1, 2.5), [1.0, 2.5]),
    # Units of each number, or of the last for all.
    ("k", "500:2000N/mm:4", [5e5, 1e6, 1.5e6, 2e6]),
    ("club_speed", "90,95 mph", [90 * MPH, 95 * MPH]),
    ("club_speed", "95mph,40 m/s", [95 * MPH, 40.0]),
]


@pytest.mark.parametrize(("name", "given", "values"), AXES)
def test_values_of_an_axis(name, given, values):
    found = golf_impact.sweep({name: given}, ["impulse"])[name]
    assert found.tolist() == pytest.approx(values, rel=1e-15)


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


def test_arguments_that_are_refused():
    sets = {"k": "normal:1e6:1"}
    for wrong in ({"samples": 2.5}, {"samples": 3, "seed": 1.5}, {"samples": 3, "method": ["lhs"]}):
        with pytest.raises(golf_impact.UserError):
            golf_impact.sweep(sets, **wrong)


# Contents

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
def test_numbers_are_those_of_single_impacts(fmu_path, tmp_path, monkeypatch, sets, form):
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


# Sobol indices


def design_of(function, sets, samples=None):
    """A design with outputs of a function of its variables instead of impacts."""
    design = Design(sets, function(**dict.fromkeys(sets, np.zeros(1))), samples)
    design.impacts = lambda outputs, **columns: ImpactArrays(
        function(**columns), np.zeros(len(columns["k"]), bool), ""
    )
    return design


def ishigami(k, b, gap):
    """sin x + 7 sin² y + 0.1 z⁴ sin x, without a value on a part of the design; and a constant."""
    found = np.sin(k) + 7.0 * np.sin(b) ** 2 + 0.1 * gap**4 * np.sin(k)
    found[::1000] = math.nan
    return {"impulse": found, "smash_factor": 1.5 + 1e-15 * np.sin(k)}


def test_sobol_indices_of_a_known_function():
    angles = f"uniform:{-math.pi}:{math.pi}"
    design = design_of(ishigami, dict.fromkeys(("k", "b", "gap"), angles), samples=1)
    found = sobol_indices(design)
    exact = {"first_order": (0.3139, 0.4424, 0.0), "total": (0.5576, 0.4424, 0.2437)}
    for kind, values in exact.items():
        indices = found[kind]["impulse"].values()
        assert [value for value, _, _ in indices] == pytest.approx(values, abs=0.02)
        for (_, low, high), value in zip(indices, values):
            assert low < value < high
            assert 0.02 < high - low < 0.15
        assert np.isnan([*found[kind]["smash_factor"].values()]).all()


# Pictures


@pytest.fixture
def axes():
    with plotting():
        yield Figure().subplots()


#: Axes, the first output that varies, points of a line, labels.
LINES = [
    ({"k": "log:1e5:1e7:12"}, "smash factor", 12, []),
    ({"k": "1e5:1e7:13", "b": "0:9:8", "law": "1,2"}, "contact time (µs)", 13, ["law 1", "law 2"]),
    ({"k": "1e5:1e7:4001"}, "smash factor", 1000, []),
    ({"ball": "tour,document"}, "smash factor", 2, []),
    # All of them: a name isn't between two others.
    ({"m_club": "0.2:0.3:5", "ball": [*BALLS]}, "smash factor", 5, [f"ball {b}" for b in BALLS]),
    # In law 1 S and COR depend on k, not on speed.
    ({"club_speed": "30:50:100000", "b": "9"}, "ball velocity (m/s)", 1000, []),
    # Not in the first of the cases.
    ({"law": "1,2", "club_speed": "30:50:9"}, "smash factor", 9, ["law 1", "law 2"]),
    ({"gap": "0,0.1"}, "smash factor", 2, []),
    ({"b": "0,5000"}, "separated", 2, []),
]


@pytest.mark.parametrize(("sets", "drawn", "points", "labels"), LINES)
def test_lines(axes, sets, drawn, points, labels):
    outputs = ("smash_factor", "touched", "separated", "contact_time", "ball_velocity")
    assert draw(Design(sets, outputs), axes)
    assert axes.get_ylabel() == drawn
    assert axes.get_xscale() == ("log" if "log:1e5:1e7:12" in sets.values() else "linear")
    assert [len(line.get_xdata()) for line in axes.lines] == [points] * max(1, len(labels))
    texts = axes.get_legend().get_texts() if labels else []
    assert [text.get_text() for text in texts] == labels
    assert bool(axes.get_legend()) == bool(labels)


@pytest.mark.parametrize("k", ["-2,-1", "1e6"])
def test_fewer_than_two_values_are_not_drawn(axes, k):
    assert not draw(Design({"k": k}), axes)


def total(k, b=0.0, club_speed=0.0, gap=None):
    """A sum of variables; with a gap, NaN in a third of the samples."""
    found = k + b + 1e8 * (club_speed == 30.0)
    if gap is not None:
        found[::3], found[1::3] = math.nan, found[1::3] - 1e3
    return {"max_force": found}


def test_lines_of_some_values(axes):
    """From left to right, of seven of eight values of b; other axes stand at their first value."""
    sets = {"k": [*range(9, 0, -1)], "club_speed": "40,30", "b": [*range(7, -1, -1)]}
    assert draw(design_of(total, sets | {"gap": "uniform:0:1"}, 3), axes)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("k (N/m)", "max force (N)")
    assert axes.get_title("left").endswith("\nclub speed = 40 m/s, law 1")
    chosen = (7, 6, 5, 3, 2, 1, 0)
    assert [line.get_label() for line in axes.lines] == [f"b = {b} N·s/m" for b in chosen]
    assert len({(*line.get_color(), line.get_linestyle()) for line in axes.lines}) == 7
    for line, b in zip(axes.lines, chosen):
        np.testing.assert_allclose(line.get_ydata(), np.arange(1, 10) + b - 500.0)


def test_samples_over_a_grid_and_alone(axes):
    design = design_of(total, {"k": "normal:1e6:1e5", "b": "0,9e5"}, 201)
    assert draw(design, axes)
    (line,), (band,) = axes.lines, axes.collections
    low, middle, high = np.percentile(design.columns(np.arange(201))["k"], (5, 50, 95))
    assert line.get_ydata() == pytest.approx([middle, middle + 9e5])
    assert tuple(band.get_datalim(axes.transData).intervaly) == pytest.approx((low, high + 9e5))
    # A histogram of all samples; also of values that are equal but for rounding, or nearly.
    for spread, bars in ((1e5, 10), (1e-9, 2), (1e-2, 10)):
        axes.clear()
        assert draw(design_of(total, {"k": f"normal:1e6:{spread}"}, 100), axes)
        heights = [bar.get_height() for bar in axes.patches]
        assert (sum(heights), len(heights)) == (100, 10)
        assert sum(map(bool, heights)) <= bars
        assert axes.get_title("left") == "100 samples\nlaw 1, b = 9 N·s/m"
    # The title counts those that are shown.
    axes.clear()
    assert draw(design_of(total, {"k": "normal:1e6:1e5"}, 150_000), axes)
    assert sum(bar.get_height() for bar in axes.patches) == 100_000
    assert axes.get_title("left").startswith("100,000 samples")


def test_bars_of_indices(axes):
    index = {"k": [0.2, 0.1, 0.3], "b": [0.8, 0.7, 0.9]}
    draw_indices({"total": {"impulse": index, "max_force": index}}, axes)
    assert [bar.get_height() for bar in axes.patches] == [0.2, 0.2, 0.8, 0.8]
    texts = axes.get_legend().get_texts() + axes.get_xticklabels()
    assert [text.get_text() for text in texts] == ["k", "b", "impulse", "max force"]


# On a Dask cluster: the cases are those of one process

#: A few of them have k < 0, which is refused.
ON_CLUSTER = {"k": "normal:1e6:5e5", "b": "0,9", "law": "1,2"}
LINE = [
    "sweep", *(f"--set={name}={text}" for name, text in ON_CLUSTER.items()), "--samples=2000",
    "--seed=1", "--outputs=smash_factor,contact_time", "--no-figures", "--scheduler",
]  # fmt: skip


@pytest.fixture(scope="module")
def address():
    import distributed  # takes a second, which tests without --ci needn't

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=logging.CRITICAL
    ) as cluster:
        yield cluster.scheduler_address


@pytest.mark.ci
def test_a_table_of_parts(address, tmp_path, monkeypatch):
    path = tmp_path / "x.parquet"
    expected = golf_impact.sweep(ON_CLUSTER, ["smash_factor", "contact_time"], samples=2000, seed=1)
    for block in (100_000, 300):  # the second one replaces the first
        monkeypatch.setattr(sweep_cluster, "BLOCK", block)
        done = golf_here(*LINE, address, "--out", path, code=0)
        assert len([*path.iterdir()]) == max(8, -(-8000 // block))
        assert [one.name for one in tmp_path.iterdir()] == ["x.parquet"]
        found = pyarrow.parquet.read_table(path).to_pydict()
        assert [*found] == [*expected]
        for name, column in expected.items():
            rtol = 0.0 if name in ON_CLUSTER else 1e-13
            np.testing.assert_allclose(np.array(found[name], float), column, rtol)
        first = f"the first is row {expected.refused.argmax() + 1}: {expected.reason}"
        assert f"Refused: {expected.refused.sum()} of them; {first}" in done.stdout


@pytest.mark.ci
@pytest.mark.parametrize(
    ("scheduler", "out", "changed", "words"),
    [
        ("tcp://127.0.0.1:1", "x.parquet", {}, "the Dask cluster at tcp://127.0.0.1:1 can't do it"),
        ("nonsense", "x.parquet", {}, "the Dask cluster at nonsense can't do it"),
        ("", "x.csv", {}, "must be a folder FILE.parquet"),
        ("", "file.parquet", {}, "must be a folder FILE.parquet"),
        # To the workers this process has another version.
        ("", "x.parquet", {"VERSION": "0.0.9"}, "not 0.0.9"),
        # What they are to look at isn't there.
        ("", "x.parquet", {"Path.mkdir": lambda self, **_: None}, "doesn't share the folder ."),
    ],
)
def test_a_cluster_that_is_refused(address, tmp_path, monkeypatch, scheduler, out, changed, words):
    (tmp_path / "file.parquet").write_text("")
    for name, value in changed.items():
        monkeypatch.setattr(f"golf_impact.studies.sweep.cluster.{name}", value)
    if scheduler:
        monkeypatch.setattr(sweep_cluster, "_PATIENCE", "0.5s")
    refused(golf_here(*LINE, scheduler or address, "--out", out, cwd=tmp_path), words)
    assert [one.name for one in tmp_path.iterdir()] == ["file.parquet"]
