"""Sweeps on a Dask cluster of two local worker processes: the bytes are those of one process."""

import logging
import os

import distributed
import pytest

from golf_build import VERSION
from golf_impact.errors import UserError
from golf_impact.sweeps import Study, executors, impacts, run_sweep

SETS = {"k": "normal:1e6:5e5", "b": "0,9", "law": "1,2"}


def study():
    # A few of them have k < 0, which is refused.
    return Study.of(SETS, None, 2000, 1)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    path = tmp_path_factory.mktemp("alone") / "x.csv"
    summary = run_sweep(study(), path)
    assert summary.refused > 0
    return path.read_bytes()


@pytest.fixture(scope="module")
def workers():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=logging.CRITICAL
    ) as cluster:
        yield cluster


@pytest.mark.ci
def test_a_cluster_whose_worker_dies(alone, tmp_path, workers):
    before = {worker.pid for worker in workers.workers.values()}
    victim = min(before)
    seen = []

    def kill(done):
        if not seen:
            os.kill(victim, 9)
        seen.append(done)

    out = tmp_path / "x.csv"
    address = workers.scheduler_address
    run_sweep(study(), out, scheduler=address, chunk=100, progress=kill)
    assert out.read_bytes() == alone
    assert seen == list(range(100, 8001, 100))
    # The other one continues, whether or not Dask has started a new one yet.
    run_sweep(study(), tmp_path / "y.csv", scheduler=address, chunk=100)
    assert (tmp_path / "y.csv").read_bytes() == alone
    assert victim not in {worker.pid for worker in workers.workers.values()}


def test_the_executor_of_a_client(alone, tmp_path, workers):
    """That of a user's cluster, not made for sweeps."""
    with distributed.Client(workers) as client:
        executor = client.get_executor()
        run_sweep(study(), tmp_path / "x.csv", executor=executor, chunk=500)
    assert (tmp_path / "x.csv").read_bytes() == alone


def test_workers_of_another_version(tmp_path, workers, monkeypatch):
    """To them this process has another one."""
    monkeypatch.setattr(impacts, "identity", lambda: "golf-impact 0.0.9, physics 0123456789ab")
    words = f"^a worker has golf-impact {VERSION}, .* install the same golf-impact for all of them"
    with pytest.raises(UserError, match=words):
        run_sweep(study(), tmp_path / "x.csv", scheduler=workers.scheduler_address)
    assert list(tmp_path.iterdir()) == []


def test_no_cluster(tmp_path, monkeypatch):
    monkeypatch.setattr(executors, "_PATIENCE", "0.5s")
    for address in ("tcp://127.0.0.1:1", "nonsense"):
        with pytest.raises(UserError, match=f"no Dask cluster with workers at {address}"):
            run_sweep(study(), tmp_path / "x.csv", scheduler=address)
    assert list(tmp_path.iterdir()) == []
