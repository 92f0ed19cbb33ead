"""Sweeps on a Dask cluster: workers write parts of a Parquet file, which is a folder."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Callable
from concurrent.futures import CancelledError
from itertools import pairwise
from pathlib import Path

import numpy as np

from golf_build import VERSION
from golf_impact.errors import UserError, first_line, missing_package
from golf_impact.sweep_table import BLOCK, Summary, write_table
from golf_impact.sweeps import Design

#: How long to wait for a scheduler and a worker.
_PATIENCE = "30s"


def sweep_on_cluster(
    address: str, path: Path, design: Design, progress: Callable[[int], object]
) -> Summary:
    """Compute a sweep on the cluster of the scheduler at an address.

    Args:
        address: of the scheduler, "tcp://HOST:PORT".
        path: FILE.parquet, a folder on storage that this machine and all workers share; its files
            in the order of their names are the cases in their order.
        design: the sweep.
        progress: called with the number of cases done.

    Raises:
        UserError: Dask is missing; there is no cluster, or it gives up; its workers have another
            version of this package, or don't share the folder; an earlier file has this name.
    """
    try:
        import distributed
    except ImportError as error:
        raise missing_package("--scheduler", "Dask", "cluster") from error
    if path.suffix != ".parquet" or path.is_file():
        raise UserError(f"--out {path} is refused: on a cluster it must be a folder FILE.parquet")
    folder = path.absolute().with_name(f".{secrets.token_hex(6)}.part")
    try:
        folder.mkdir(parents=True)
        (folder / "shared").touch()
        with distributed.Client(address, timeout=_PATIENCE) as client:
            client.wait_for_workers(1, timeout=_PATIENCE)
            for worker, (version, shared) in client.run(_inspect, folder / "shared").items():
                if version != VERSION:
                    raise UserError(f"the worker {worker} has golf-impact {version}, not {VERSION}")
                if not shared:
                    raise UserError(f"the worker {worker} doesn't share the folder {path.parent}")
            (folder / "shared").unlink()
            threads = sum(client.nthreads().values())
            count = min(design.cases, max(-(-design.cases // BLOCK), 4 * threads))
            ends = np.linspace(0, design.cases, count + 1).astype(int).tolist()
            shared_design = client.scatter(design, broadcast=True)
            futures = [
                client.submit(
                    write_table, folder / f"{n:06}.parquet", shared_design, range(*part), retries=2
                )
                for n, part in enumerate(pairwise(ends))
            ]
            done = 0
            for _, summary in distributed.as_completed(futures, with_results=True):
                done += len(summary.drawn)
                progress(done)
            parts = client.gather(futures)
        for unfinished in folder.glob(".*.part"):  # of a worker that was killed
            unfinished.unlink()
        if path.is_dir():
            shutil.rmtree(path)
        folder.rename(path)
    # Workers of an earlier version lack an attribute or a module.
    except (
        distributed.KilledWorker, distributed.TimeoutError, CancelledError, OSError, ValueError,
        ImportError, AttributeError,
    ) as error:  # fmt: skip
        raise UserError(
            f"the Dask cluster at {address} can't do it ({first_line(error)}): start `dask "
            "scheduler` and `dask worker` with this version of golf-impact and its extra cluster"
        ) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return Summary(
        sum(part.refused for part in parts),
        next((part.first for part in parts if part.first), None),
        np.concatenate([part.drawn for part in parts]),
    )


def _inspect(file: Path) -> tuple[str, bool]:
    """Of a worker: the version, and whether it has a file."""
    return VERSION, file.exists()
