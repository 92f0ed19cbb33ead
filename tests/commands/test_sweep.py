"""`golf-impact sweep`: axes, samples, tables, indices, pictures, and a cluster of two workers."""

import csv
import json
import logging
import math
import re
import sys

import numpy as np
import pyarrow.parquet
import pytest
from command import golf_here, refused
from compare import to_15_digits
from matplotlib.figure import Figure

import golf_impact
from golf_build import VERSION
from golf_impact.data.balls import BALLS
from golf_impact.data.quantities import START
from golf_impact.report.results import plotting
from golf_impact.studies.sweep import cluster as sweep_cluster
from golf_impact.studies.sweep import table as sweep_table
from golf_impact.studies.sweep.picture import draw, draw_indices
from golf_impact.studies.sweep.sweep import OUTPUTS, Design, parse_axis, sobol_indices


def rows_of(path):
    with open(path, newline="") as stream:
        header, *rows = csv.reader(stream)
    return header, rows


# Axes and samples

AXES = {
    "0.5e6:2e6:4": [0.5e6, 1e6, 1.5e6, 2e6],
    "log:1e5:1e7:3": [1e5, 1e6, 1e7],
    "0, 9,12": [0.0, 9.0, 12.0],
    "500:2000N/mm:4": [5e5, 1e6, 1.5e6, 2e6],
    "3:3:1": [3.0],
    7: [7.0],
    (1, 2.5): [1.0, 2.5],
}


@pytest.mark.parametrize("given", AXES, ids=str)
def test_values_of_an_axis(given):
    assert golf_impact.sweep({"k": given}, ["impulse"])["k"].tolist() == AXES[given]


def test_units_of_an_axis():
    """Of each number, or of the last for all."""
    axis = parse_axis("club_speed", "90,95 mph")
    assert axis == pytest.approx([90 * 0.44704, 95 * 0.44704], rel=1e-15)
    assert parse_axis("club_speed", "95mph,40 m/s")[1] == 40.0
    assert parse_axis("club_speed", "normal:95mph:2mph").std() == pytest.approx(2 * 0.44704)


@pytest.mark.parametrize("method", ["random", "lhs", "sobol"])
def test_samples(method):
    sets = {"k": "normal:1e6:5e4", "b": "0,9", "club_speed": "uniform:40:50"}

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


# Contents


CASES = {
    "law 1": {"k": "0.5e6:2e6:7", "b": "0,9,300", "club_speed": "20,50,-1"},
    "both laws": {"law": "1,2", "k": "log:1:1e8:5", "gap": "0,0.2"},
    # A swept variable overrides the preset.
    "balls": {"ball": ",".join(BALLS), "b": "1,2,-2", "club_speed": "30,45"},
}


@pytest.mark.parametrize("form", ["csv", "parquet", "csv without pyarrow", "csv through the FMU"])
@pytest.mark.parametrize("sets", CASES.values(), ids=CASES)
def test_numbers_are_those_of_single_impacts(fmu_path, tmp_path, monkeypatch, sets, form):
    monkeypatch.setattr(sweep_table, "BLOCK", 3)
    suffix, through_fmu = form.split()[0], form.endswith("FMU")
    if form.endswith("without pyarrow"):
        monkeypatch.setitem(sys.modules, "pyarrow", None)
    path, outputs = tmp_path / "new" / f"x.{suffix}", (*OUTPUTS, "separated")
    options = [f"--set={name}={text}" for name, text in sets.items()]
    options += ["--no-figures", "--outputs", ", ".join(outputs), "--out", path]
    done = golf_here("sweep", *options, *["--fmu", fmu_path] * through_fmu, code=0)
    assert [file.name for file in path.parent.iterdir()] == [path.name]
    if suffix == "csv":
        header, rows = rows_of(path)
    else:
        table = pyarrow.parquet.read_table(path)
        header = table.column_names
        columns = (
            ["" if v is None else v for v in column] for column in table.to_pydict().values()
        )
        rows = [*zip(*columns)]
        assert table.schema.metadata[b"version"].decode() == VERSION
        assert table.schema.field("club_velocity").metadata == {b"unit": b"m/s"}
    # Law, k and b are named in every table.
    shown = [*dict.fromkeys([*sets, "law", "k", "b"])]
    assert header == [*shown, *outputs]
    assert ("This is law 1" in done.stdout) == (not {"law", "ball"} & {*sets})
    # Without a rate: the time of so few is that of the start.
    assert re.search(rf"^{len(rows)} cases in [\d.]+ s$", done.stdout, re.MULTILINE)
    refusals = []
    for number, row in enumerate(rows, 1):
        contact = {name: float(x) for name, x in zip(shown, row) if name in ("law", "k", "b")}
        given = dict(zip(sets, row))
        ball = BALLS[given.pop("ball")].values if "ball" in given else {}
        values = {**ball, **{name: float(value) for name, value in given.items()}}
        assert contact == {name: ({**START, **values})[name] for name in contact}
        cells = row[len(shown) :]
        try:
            expected = golf_impact.run_impact(OUTPUTS, **values)
        except golf_impact.UserError as error:
            refusals.append(f"the first is row {number}: {error}\n")
            assert {*cells} == {""}
            continue
        found = [float("nan" if cell == "" else cell) for cell in cells[:-1]]
        assert found == pytest.approx([*expected.values()], rel=1e-13, abs=0.0, nan_ok=True)
        assert int(cells[-1]) == (not math.isnan(expected["contact_time"]))
    assert len(rows) == math.prod(len(parse_axis(*one)) for one in sets.items())
    expected = f"Refused: {len(refusals)} of them; {refusals[0]}" if refusals else ""
    assert to_15_digits(expected) in to_15_digits(done.stdout)
    assert ("Refused" in done.stdout) == bool(refusals)


def test_a_ball_with_conditions(tmp_path):
    """Those of its measurement hold for all balls, unless they are swept."""
    (tmp_path / "mine.toml").write_text("law = 2\nk = 8e5\n[conditions]\nclub_speed = 40\n")
    options = ("--set=ball=mine.toml,document", "--outputs=ball_velocity,touched", "--out=x.csv")
    for more, speed in ([], 40.0), (["--set=club_speed=30"], 30.0):
        golf_here("sweep", *options, *more, "--no-figures", cwd=tmp_path, code=0)
        _, rows = rows_of(tmp_path / "x.csv")
        for row, ball in zip(rows, ({"law": 2, "k": 8e5}, {}), strict=True):
            expected = golf_impact.run_impact(club_speed=speed, **ball)["ball_velocity"]
            assert float(row[-2]) == pytest.approx(expected, rel=1e-13)


# Sobol indices


class Ishigami(Design):
    """sin x + 7 sin² y + 0.1 z⁴ sin x, without a value on a part of the design."""

    def run(self, columns, impact=None):
        x, y, z = columns.values()
        found = super().run({"k": np.full(len(x), 1e6)})
        found["impulse"] = np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)
        found["impulse"][::1000] = math.nan
        found["smash_factor"] = 1.5 + 1e-15 * np.sin(x)
        return found


def test_sobol_indices_of_a_known_function():
    design = Ishigami(
        dict.fromkeys(("k", "b", "gap"), f"uniform:{-math.pi}:{math.pi}"),
        ["impulse", "smash_factor"],
        samples=1,
    )
    found = sobol_indices(design)
    exact = {"first_order": (0.3139, 0.4424, 0.0), "total": (0.5576, 0.4424, 0.2437)}
    for kind, values in exact.items():
        indices = found[kind]["impulse"].values()
        assert [value for value, _, _ in indices] == pytest.approx(values, abs=0.02)
        for (_, low, high), value in zip(indices, values):
            assert low < value < high
            assert 0.02 < high - low < 0.15
        assert np.isnan([*found[kind]["smash_factor"].values()]).all()


def test_the_indices_file(tmp_path):
    sets = ("--set=law=2", "--set=k=normal:1e6:3e4", "--set=b=normal:9:0.9")
    options = ("--samples=64", "--seed=2", "--method=sobol", "--no-figures", "--out")
    # With a grid, whose points have different indices, there is none.
    # Nor for a single distribution.
    for others in ((*sets, "--set=gap=0,1"), sets[:2]):
        golf_here("sweep", *others, *options, tmp_path / "x.csv", code=0)
        assert {path.name for path in tmp_path.iterdir()} == {"x.csv"}
    done = golf_here("sweep", *sets, *options, tmp_path / "x.csv", code=0)
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv", "x.json"}
    row = r"contact_time +│ +total │ (0\.9|1\.0)\d+ ± 0\.0\d\d │ 0\.0"
    assert re.search(row, done.stdout), done.stdout
    found = json.loads((tmp_path / "x.json").read_text())
    assert {**found, "first_order": 0, "total": 0} == {
        "first_order": 0, "total": 0, "samples": 4096, "seed": 2, "version": VERSION
    }  # fmt: skip
    # T ~ k^(-1/2), hardly depends on b; COR is a function of b/√k.
    for output, (k, b) in {"contact_time": (0.99, 0.01), "smash_factor": (0.02, 0.98)}.items():
        shares = [found["total"][output][name][0] for name in ("k", "b")]
        assert shares == pytest.approx([k, b], abs=0.02)


# Pictures


@pytest.fixture
def axes():
    with plotting():
        yield Figure().subplots()


#: Axes, the scale, labels and the number of points of a line.
LINES = [
    ({"k": "log:1e5:1e7:12"}, "log", [], 12),
    ({"k": "2e6,1e6"}, "linear", [], 2),
    ({"k": "1e5:1e7:13", "b": "0:9:8", "law": "1,2"}, "linear", ["law 1", "law 2"], 13),
    ({"k": "1e5:1e7:4001"}, "linear", [], 1000),
    ({"ball": "tour,document"}, "linear", [], 2),
    # All of them: a name isn't between two others.
    ({"m_club": "0.2:0.3:5", "ball": ",".join(BALLS)}, "linear", [f"ball {b}" for b in BALLS], 5),
]


@pytest.mark.parametrize(("sets", "scale", "labels", "points"), LINES)
def test_lines(axes, sets, scale, labels, points):
    assert draw(Design(sets, ["max_force"]), axes)
    assert axes.get_xscale() == scale
    assert [len(line.get_xdata()) for line in axes.lines] == [points] * max(1, len(labels))
    legend = axes.get_legend()
    assert [text.get_text() for text in (legend.get_texts() if legend else [])] == labels
    table = golf_impact.sweep(sets, ["max_force"])
    x, y = axes.lines[0].get_data()
    assert y[0] == table["max_force"][np.argmin(table["k"]) if "k" in sets else 0]
    assert "ball" in sets or (np.diff(x) > 0.0).all()


class Sum(Design):
    """Without an impact: a sum of variables, and NaN in a third of the samples."""

    def run(self, columns, impact=None):
        found = super().run({"k": np.full(len(columns["k"]), 1e6)})
        found["max_force"] = columns["k"] + columns.get("b", 0.0)
        found["max_force"] += 1e8 * (columns.get("club_speed", 0.0) == 30.0)
        if "gap" in columns:
            found["max_force"][::3] = math.nan
            found["max_force"][1::3] -= 1e3
        return found


def test_lines_of_some_values(axes):
    """Seven of eight values of b, which differ; further axes stand at their first value."""
    sets = {"k": "1e6:3e6:9", "club_speed": "40,30", "b": "7,6,5,4,3,2,1,0", "gap": "uniform:0:1"}
    assert draw(Sum(sets, ["max_force"], 3), axes)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("k (N/m)", "max force (N)")
    assert axes.get_title("left").endswith("\nclub speed = 40 m/s, law 1")
    chosen = (7, 6, 5, 3, 2, 1, 0)
    assert [line.get_label() for line in axes.lines] == [f"b = {b} N·s/m" for b in chosen]
    assert len({(*line.get_color(), line.get_linestyle()) for line in axes.lines}) == 7
    for line, b in zip(axes.lines, chosen):
        np.testing.assert_allclose(line.get_ydata(), np.linspace(1e6, 3e6, 9) + b - 500.0)


def test_samples_over_a_grid_and_alone(axes):
    design = Sum({"k": "normal:1e6:1e5", "b": "0,9e5"}, ["max_force"], 201)
    assert draw(design, axes)
    (line,), (band,) = axes.lines, axes.collections
    low, middle, high = np.percentile(design.columns(np.arange(201))["k"], (5, 50, 95))
    assert line.get_ydata() == pytest.approx([middle, middle + 9e5])
    assert tuple(band.get_datalim(axes.transData).intervaly) == pytest.approx((low, high + 9e5))
    # A histogram of all samples; also of values that are equal but for rounding, or nearly.
    for spread, bars in ((1e5, 10), (1e-9, 2), (1e-2, 10)):
        axes.clear()
        assert draw(Sum({"k": f"normal:1e6:{spread}"}, ["max_force"], 100), axes)
        heights = [bar.get_height() for bar in axes.patches]
        assert (sum(heights), len(heights)) == (100, 10)
        assert sum(map(bool, heights)) <= bars
        assert axes.get_title("left") == "100 samples\nlaw 1, b = 9 N·s/m"
    # The title counts those that are shown.
    axes.clear()
    assert draw(Sum({"k": "normal:1e6:1e5"}, ["max_force"], 150_000), axes)
    assert sum(bar.get_height() for bar in axes.patches) == 100_000
    assert axes.get_title("left").startswith("100,000 samples")


@pytest.mark.parametrize(
    ("sets", "drawn"),
    [
        # In law 1 S and COR depend on k, not on speed.
        ({"club_speed": "30:50:100000", "b": "9"}, "ball velocity (m/s)"),
        # Not in the first of the cases.
        ({"k": "1e6,2e6", "club_speed": "30:50:100000"}, "smash factor"),
        ({"gap": "0,0.1"}, "smash factor"),
        ({"k": "-2,-1"}, None),
        ({"k": "1e6"}, None),
    ],
)
def test_the_first_output_that_varies(axes, sets, drawn):
    names = ("smash_factor", "coefficient_of_restitution", "contact_time", "ball_velocity")
    assert draw(Design(sets, names), axes) == bool(drawn)
    assert not drawn or axes.get_ylabel() == drawn


def test_flags_are_drawn(axes):
    assert draw(Design({"b": "0,5000"}, ["touched", "separated"]), axes)
    assert axes.get_ylabel() == "separated"


def test_bars_of_indices(axes):
    index = {"k": [0.2, 0.1, 0.3], "b": [0.8, 0.7, 0.9]}
    draw_indices({"total": {"impulse": index, "max_force": index}}, axes)
    assert [bar.get_height() for bar in axes.patches] == [0.2, 0.2, 0.8, 0.8]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["k", "b"]


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
        found = pyarrow.parquet.read_table(path)
        assert found.column_names == [*expected]
        for name, column in expected.items():
            same = {"rtol": 0.0 if name in ON_CLUSTER else 1e-13}
            np.testing.assert_allclose(found[name].to_numpy(), column, **same)
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
        ("", "x.parquet", {"Path.touch": lambda self: None}, "doesn't share the folder ."),
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
