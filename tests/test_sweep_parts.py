"""Parts of a sweep: Parquet's row groups, cases by an instance, what pictures say."""

import math

import numpy as np
import pyarrow.parquet
import pytest

from golf_impact import run_impact
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.sweeps import Study, run_sweep, tables
from golf_impact.sweeps.impacts import one_by_one
from golf_impact.sweeps.pictures import draw


@pytest.mark.parametrize("chunks", [[7, 25, 3], [35], [10, 10, 10, 5]])
def test_row_groups_are_independent_of_chunks(tmp_path, monkeypatch, chunks):
    monkeypatch.setattr(tables, "_ROW_GROUP", 10)
    path, first = tmp_path / "x.parquet", 0
    with tables.table(path, ["k"]) as write:
        for size in chunks:
            column = np.arange(first, first + size, dtype=float)
            write({"k": column}, np.zeros(size, bool), b"")
            first += size
    file = pyarrow.parquet.ParquetFile(path)
    groups = [file.metadata.row_group(n).num_rows for n in range(file.num_row_groups)]
    assert groups == [10, 10, 10, 5]
    assert file.read()["k"].to_pylist() == list(range(35))


def test_cases_by_an_instance():
    """Refused ones have no numbers, and the first one's sentence is kept."""
    values = {"law": 2, "k": np.array([1e6, -1.0, 2e6, -2.0]), "b": np.array([9.0, 9.0, 1e3, 9.0])}
    found = one_by_one(ScalarImpacts(), ("smash_factor", "max_force", "touched"), values, 4)
    assert found.refused.tolist() == [False, True, False, True]
    assert found.scalar.tolist() == [True, False, True, False]
    assert "k = -1.0" in found.reason
    assert np.isnan(found.columns["max_force"]).tolist() == [False, True, False, True]
    assert found.columns["touched"].tolist() == [True, False, True, False]
    one = ScalarImpacts().impact(("max_force",), law=2, k=2e6, b=1e3)
    assert found.columns["max_force"][2] == one["max_force"]


def test_the_first_output_is_drawn(tmp_path):
    study = Study.of({"k": "1e6,2e6,-1"}, outputs=("max_force", "smash_factor"))
    drawn = run_sweep(study, tmp_path / "x.csv").drawn
    forces = [run_impact(("max_force",), k=k)["max_force"] for k in (1e6, 2e6)]
    assert drawn[:2] == pytest.approx(forces, rel=1e-13)
    assert math.isnan(drawn[2])


UNITS = {"k": "N/m", "b": "N.s/m", "law": None, "max_force": "N", "club_speed": "m/s"}


@pytest.mark.parametrize(
    ("axes", "scale", "title", "legend"),
    [
        ({"k": "log:1e5:1e7:5"}, "log", "Max force over k", []),
        ({"k": "1e5:1e7:5"}, "linear", "Max force over k", []),
        ({"k": "1e5:1e7:5", "law": "1,2"}, "linear", "Max force over k", ["law 1", "law 2"]),
        (
            {"b": "0:9:4", "k": "1e6,2e6"},
            "linear",
            "Max force over b and k",
            ["k = 1 MN/m", "k = 2 MN/m"],
        ),
    ],
)
def test_lines_of_a_study(axes, scale, title, legend):
    study = Study.of(axes, outputs=("max_force",))
    figure = draw(study, np.linspace(1e3, 9e3, study.cases), UNITS, None)
    (shown,) = figure.axes
    assert shown.get_xscale() == scale
    assert title in shown.get_title("left")
    labels = [text.get_text() for text in shown.get_legend().get_texts()] if legend else []
    assert labels == legend
    assert len(shown.lines) == max(1, len(legend))
    # The last variable varies fastest.
    first = shown.lines[0].get_ydata()
    assert first[1] - first[0] == pytest.approx(
        8e3 / (study.cases - 1) * (len(legend) or 1), rel=1e-9
    )
    assert math.isclose(first[0], 1e3)
