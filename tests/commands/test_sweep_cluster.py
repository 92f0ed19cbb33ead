"""Sweeps on a Dask cluster of two local worker processes: the cases are those of one process."""

import logging

import distributed
import numpy as np
import pyarrow.parquet
import pytest

import golf_impact
from golf_impact import sweep_cluster
from golf_impact.errors import UserError
from golf_impact.sweep_cluster import sweep_on_cluster
from golf_impact.sweeps import Design

#: A few of them have k < 0, which is refused.
SETS = {"k": "normal:1e6:5e5", "b": "0,9", "law": "1,2"}
OUTPUTS = ("smash_factor", "contact_time")
DESIGN = Design(SETS, OUTPUTS, 2000, 1)


@pytest.fixture(scope="module")
def address():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=logging.CRITICAL
    ) as cluster:
        yield cluster.scheduler_address


@pytest.mark.parametrize("block", [100_000, 300])
def test_a_table_of_parts(address, tmp_path, monkeypatch, block):
    monkeypatch.setattr(sweep_cluster, "BLOCK", block)
    path, seen = tmp_path / "x.parquet", []
    for _ in range(2):  # the second one replaces the first
        summary = sweep_on_cluster(address, path, DESIGN, seen.append)
    assert len([*path.iterdir()]) == max(8, -(-8000 // block))
    assert [one.name for one in tmp_path.iterdir()] == ["x.parquet"]
    assert seen[-1] == 8000
    found = pyarrow.parquet.read_table(path)
    expected = golf_impact.sweep(SETS, OUTPUTS, samples=2000, seed=1)
    assert found.column_names == [*expected]
    for name, column in expected.items():
        same = {"rtol": 1e-13 if name in OUTPUTS else 0.0}
        np.testing.assert_allclose(found[name].to_numpy(), column, **same)
    assert summary.refused == expected.refused.sum() > 0
    assert summary.first == (expected.refused.argmax() + 1, expected.reason)
    np.testing.assert_allclose(summary.drawn, expected["smash_factor"], rtol=1e-13)


def test_what_is_refused(address, tmp_path, monkeypatch):
    path = tmp_path / "x.parquet"

    def words(to=address, path=path):
        with pytest.raises(UserError) as caught:
            sweep_on_cluster(to, path, DESIGN, print)
        return str(caught.value)

    monkeypatch.setattr(sweep_cluster, "_PATIENCE", "0.5s")
    for nowhere in ("tcp://127.0.0.1:1", "nonsense"):
        assert f"the Dask cluster at {nowhere} can't do it" in words(nowhere)
    monkeypatch.undo()
    assert "must be a folder FILE.parquet" in words(path=tmp_path / "x.csv")
    (tmp_path / "file.parquet").touch()
    assert "must be a folder" in words(path=tmp_path / "file.parquet")
    # To the workers this process has another version.
    monkeypatch.setattr(sweep_cluster, "VERSION", "0.0.9")
    assert "not 0.0.9" in words()
    monkeypatch.undo()
    # What they are to look at isn't there.
    monkeypatch.setattr(sweep_cluster.Path, "touch", lambda self: None)
    assert f"doesn't share the folder {tmp_path}" in words()
    assert [one.name for one in tmp_path.iterdir()] == ["file.parquet"]
