"""Sweeps: axes and samples, contents of the tables, Sobol indices, interruptions and errors."""

import csv
import json
import math
import re
import signal
import sys
import time

import numpy as np
import pyarrow.parquet
import pytest
from command import golf_here, golf_started, refused

import golf_impact
from golf_build import VERSION
from golf_impact import sweep_table
from golf_impact.ball import BALLS
from golf_impact.sweep_picture import draw
from golf_impact.sweep_table import write_table
from golf_impact.sweeps import OUTPUTS, Design, parse_axis, sobol_indices


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
    assert parse_axis("k", given).tolist() == AXES[given]


@pytest.mark.parametrize(
    ("sets", "arguments", "words"),
    [
        ({"k": "2e6:1e6:5"}, {}, "above its end"),
        ({"k": "log:0:1e6:5"}, {}, "above 0"),
        ({"k": "1:2:0"}, {}, "1 to 10,000,000"),
        ({"k": "1:2"}, {}, "write VALUE"),
        ({"k": "1,inf"}, {}, "finite"),
        ({"k": "norm:1:2"}, {}, "write VALUE"),
        ({"k": "normal:1:0"}, {"samples": 1}, "> 0"),
        ({"law": "1,-4294967295"}, {}, "1 .absolute. or 2"),
        ({"law": "1.5"}, {}, "law=1.5 is refused: law is 1"),
        ({"ball": "golf"}, {}, "choose from"),
        ({"stiffness": "1"}, {}, "'stiffness': choose from k, b, club_speed"),
        ({}, {}, "nothing is swept"),
        ({"k": "normal:1e6:1"}, {}, "--samples"),
        ({"k": "normal:1e6:1"}, {"samples": 0}, "at least 1"),
        ({"k": "1"}, {"samples": 5}, "no distribution"),
        ({"k": "1"}, {"method": "halton"}, "random, lhs, sobol"),
        ({"k": "1"}, {"seed": -1}, "seed = -1"),
        ({"k": "1"}, {"outputs": ("force", "force")}, "twice"),
        ({"k": "1"}, {"outputs": ("k",)}, "no output 'k'"),
        ({"k": "1:2:100000", "b": "1:2:100000"}, {}, "10,000,000,000 cases are refused"),
    ],
)
def test_what_is_refused(sets, arguments, words):
    with pytest.raises(golf_impact.UserError, match=words):
        golf_impact.sweep(sets, **arguments)


@pytest.mark.parametrize("method", ["random", "lhs", "sobol"])
def test_samples(method):
    sets = {"k": "normal:1e6:5e4", "b": "0,9", "club_speed": "uniform:40:50"}

    def samples(seed):
        found = golf_impact.sweep(sets, ["impulse"], samples=1024, seed=seed, method=method)
        assert list(found) == [*sets, "impulse"]
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


@pytest.fixture(scope="module")
def impact(fmu_path):
    with golf_impact.Impact(fmu_path) as impact:
        yield impact


CASES = {
    "law 1": {"k": "0.5e6:2e6:7", "b": "0,9,300", "club_speed": "20,50,-1"},
    "both laws": {"law": "1,2", "k": "log:1:1e8:5", "gap": "0,0.2"},
    # A swept variable overrides the preset.
    "balls": {"ball": ",".join(BALLS), "b": "1,2,-2", "club_speed": "30,45"},
}


@pytest.mark.parametrize("through", ["arrays", "FMU"])
@pytest.mark.parametrize("form", ["csv", "parquet", "csv without pyarrow"])
@pytest.mark.parametrize("sets", CASES.values(), ids=CASES)
def test_numbers_are_those_of_single_impacts(impact, tmp_path, monkeypatch, sets, form, through):
    monkeypatch.setattr(sweep_table, "BLOCK", 3)
    suffix, _, without = form.partition(" without ")
    if without:
        monkeypatch.setitem(sys.modules, without, None)
    path, outputs = tmp_path / f"x.{suffix}", (*OUTPUTS, "separated")
    design, seen = Design(sets, outputs), []
    cases = range(design.cases)
    fmu = impact if through == "FMU" else None
    summary = write_table(path, design, cases, fmu, seen.append)
    assert seen == [*range(3, design.cases, 3), design.cases]
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
    assert header == [*sets, *outputs]
    assert len(rows) == design.cases
    refusals = []
    for number, row in enumerate(rows, 1):
        given = dict(zip(sets, row))
        ball = BALLS[given.pop("ball")].values if "ball" in given else {}
        values = {**ball, **{name: float(value) for name, value in given.items()}}
        cells = row[len(sets) :]
        try:
            expected = golf_impact.run_impact(OUTPUTS, **values)
        except golf_impact.UserError as error:
            refusals.append((number, str(error)))
            assert {*cells} == {""}
            continue
        found = [float("nan" if cell == "" else cell) for cell in cells[:-1]]
        same = {"rel": 1e-13 if fmu is None else 0.0, "abs": 0.0, "nan_ok": True}
        assert found == pytest.approx([*expected.values()], **same)
        assert int(cells[-1]) == (not math.isnan(expected["contact_time"]))
    assert summary[:2] == (len(refusals), refusals[0] if refusals else None)
    assert [math.isnan(v) for v in summary.drawn] == [row[len(sets)] == "" for row in rows]


# Sobol indices


class Ishigami(Design):
    """sin x + 7 sin² y + 0.1 z⁴ sin x, without a value on a part of the design."""

    def run(self, columns, impact=None):
        x, y, z = columns.values()
        found = super().run({"k": np.ones(len(x))})
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
    options = ("--samples=64", "--seed=2", "--design=sobol", "--no-figures", "--out")
    # With a grid, whose points have different indices, there is none.
    golf_here("sweep", *sets, "--set=gap=0,1", *options, tmp_path / "x.csv", code=0)
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv"}
    golf_here("sweep", *sets, *options, tmp_path / "x.csv", code=0)
    assert {path.name for path in tmp_path.iterdir()} == {"x.csv", "x.json"}
    found = json.loads((tmp_path / "x.json").read_text())
    assert {**found, "first_order": 0, "total": 0} == {
        "first_order": 0, "total": 0, "samples": 4096, "seed": 2, "version": VERSION
    }  # fmt: skip
    # T ~ k^(-1/2), hardly depends on b; COR is a function of b/√k.
    for output, (k, b) in {"contact_time": (0.99, 0.01), "smash_factor": (0.02, 0.98)}.items():
        shares = [found["total"][output][name][0] for name in ("k", "b")]
        assert shares == pytest.approx([k, b], abs=0.02)


# The command


def test_the_command(fmu_path, tmp_path):
    sets = ("--set", "k=1e6,2e6,-1", "--set", "b=9,0", "--outputs", "smash_factor, max_force")
    for options in ([], ["--fmu", fmu_path]):
        done = golf_here("sweep", *sets, "--out", "new/x.csv", *options, cwd=tmp_path, code=0)
        assert re.search(r"^6 cases in .*\nRefused: 2 .* row 5: k = -1\.0 N/m", done.stdout)
        assert {path.name for path in (tmp_path / "new").iterdir()} == {"x.csv", "x.png"}
        header, rows = rows_of(tmp_path / "new" / "x.csv")
        assert header == ["k", "b", "smash_factor", "max_force"]
        assert float(rows[0][2]) == pytest.approx(1.5641431548673967, rel=1e-13)
    done = golf_here("sweep", "--set=club_speed=95", "--out", tmp_path / "x.csv", code=0)
    assert "42.4688 for 95 mph" in done.stderr


def test_a_ball_with_conditions(tmp_path):
    """Those of its measurement hold for all balls, unless they are swept."""
    (tmp_path / "mine.toml").write_text("law = 2\nk = 8e5\n[conditions]\nclub_speed = 40\n")
    options = ("--set=ball=mine.toml,document", "--outputs=ball_velocity,touched", "--out=x.csv")
    for more, speed in ([], 40.0), (["--set=club_speed=30"], 30.0):
        golf_here("sweep", *options, *more, "--no-figures", cwd=tmp_path, code=0)
        _, rows = rows_of(tmp_path / "x.csv")
        mine, document = (float(row[-2]) for row in rows)
        assert mine == pytest.approx(
            golf_impact.run_impact(law=2, k=8e5, club_speed=speed)["ball_velocity"], rel=1e-13
        )
        assert document == pytest.approx(
            golf_impact.run_impact(club_speed=speed)["ball_velocity"], rel=1e-13
        )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--out", "."], "its name must end in .csv or .parquet"),
        (["--out", "folder.csv"], "is a folder"),
        ([], "--out FILE.csv"),
        (["study.toml", "--out", "x.csv"], "write a study as options"),
        (["--out", "x.csv", "--fmu", "x.fmu", "--scheduler", "tcp://x"], "leave out --fmu"),
        (["--out", "x.csv", "--workers", "2"], "No such option: --workers"),
    ],
)
def test_refused_options(tmp_path, options, words):
    (tmp_path / "folder.csv").mkdir()
    refused(golf_here("sweep", "--set", "k=1e6", *options, cwd=tmp_path), words)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.csv"]


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_ctrl_c_leaves_the_earlier_file(tmp_path, suffix):
    path = tmp_path / f"x.{suffix}"
    path.write_text("earlier")
    process = golf_started("sweep", "--set", "k=1e6:2e6:10000000", "--out", path)
    until = time.monotonic() + 60
    while not any(part.stat().st_size > 1e6 for part in tmp_path.glob(".*.part")):
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "earlier"


# Pictures


@pytest.fixture
def axes():
    from matplotlib.figure import Figure

    return Figure().subplots()


#: Axes, the scale, labels and the number of points of a line.
LINES = [
    ({"k": "log:1e5:1e7:12"}, "log", [], 12),
    ({"k": "2e6,1e6"}, "linear", [], 2),
    ({"k": "1e5:1e7:13", "b": "0:9:8", "law": "1,2"}, "linear", ["law 1", "law 2"], 13),
    ({"k": "1e5:1e7:4001"}, "linear", [], 1334),
    ({"ball": "tour,document"}, "linear", [], 2),
]


@pytest.mark.parametrize(("sets", "scale", "labels", "points"), LINES)
def test_lines(axes, sets, scale, labels, points):
    table = golf_impact.sweep(sets, ["max_force"])
    draw(Design(sets, ["max_force"]), table["max_force"], axes)
    assert axes.get_xscale() == scale
    assert [len(line.get_xdata()) for line in axes.lines] == [points] * max(1, len(labels))
    legend = axes.get_legend()
    assert [text.get_text() for text in (legend.get_texts() if legend else [])] == labels
    x, y = axes.lines[0].get_data()
    first = np.argmin(table["k"]) if "k" in sets else 0
    assert y[0] == table["max_force"][first]
    assert "ball" in sets or (np.diff(x) > 0.0).all()


def test_lines_of_some_values(axes):
    """Seven of eight values of b; further axes stand at their first value."""
    sets = {"k": "1e6:3e6:9", "club_speed": "40,30", "b": "7,6,5,4,3,2,1,0", "gap": "uniform:0:1"}
    design = Design(sets, ("max_force",), 3)
    columns = design.columns(0, design.cases)
    force = columns["k"] + columns["b"] + 1e8 * (columns["club_speed"] == 30.0)
    samples = np.tile([-1e3, 0.0, math.nan], len(force) // 3)
    draw(design, force + samples, axes)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("k (N/m)", "max force (N)")
    assert "(club speed 40.0)" in axes.get_title()
    labels = [f"b {b}.0" for b in (7, 6, 5, 3, 2, 1, 0)]
    assert [line.get_label() for line in axes.lines] == labels
    for line, b in zip(axes.lines, (7, 6, 5, 3, 2, 1, 0)):
        np.testing.assert_allclose(line.get_ydata(), np.linspace(1e6, 3e6, 9) + b - 500.0)


def test_samples_over_a_grid_and_alone(axes):
    force = np.linspace(5e3, 7e3, 201)
    design = Design({"k": "normal:1e6:1e5", "b": "0,9"}, ("max_force",), 201)
    draw(design, np.append(force, force + 1e3), axes)
    (line,), (band,) = axes.lines, axes.collections
    assert line.get_ydata() == pytest.approx([6e3, 7e3])
    low, high = band.get_datalim(axes.transData).intervaly
    assert (low, high) == pytest.approx((5.1e3, 7.9e3))
    # Values that are equal but for rounding are a histogram, too.
    axes.clear()
    draw(Design({"k": "normal:1e6:1e5"}, ("max_force",), 40), np.full(40, 3.0), axes)
    assert sum(bar.get_height() for bar in axes.patches) == 40
