"""Sweeps on a Dask cluster: workers write parts of a Parquet file, which is a folder."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Callable
from concurrent.futures import CancelledError
from itertools import chain
from pathlib import Path

from golf_build import VERSION
from golf_impact.data.errors import UserError, first_line, missing_package
from golf_impact.studies.sweep.sweep import Design
from golf_impact.studies.sweep.table import BLOCK, write_table

#: How long to wait for a scheduler and a worker.
_PATIENCE = "30s"


def sweep_on_cluster(
    address: str, path: Path, design: Design, progress: Callable[[int], object]
) -> list[tuple[int, str]]:
    """As `write_table`, by the workers of the Dask scheduler at an address.

    FILE.parquet is a folder on storage that all share; its files, in the order of their names, have
    the cases in their order. UserError also: there is no such cluster, or it isn't fit for it.
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
        with distributed.Client(address, timeout=_PATIENCE) as client:
            client.wait_for_workers(1, timeout=_PATIENCE)
            for worker, (version, shares) in client.run(_about, folder).items():
                if version != VERSION:
                    raise UserError(f"the worker {worker} has golf-impact {version}, not {VERSION}")
                if not shares:
                    raise UserError(f"the worker {worker} doesn't share the folder {path.parent}")
            least = 4 * sum(client.nthreads().values())
            count = min(design.cases, max(-(-design.cases // BLOCK), least))
            ends = [design.cases * n // count for n in range(count + 1)]
            files = [folder / f"{n:06}.parquet" for n in range(count)]
            sent = [client.scatter(design, broadcast=True)] * count
            cases = [*map(range, ends, ends[1:])]
            futures = client.map(write_table, files, sent, cases, retries=2)
            for done, _ in enumerate(distributed.as_completed(futures), 1):
                progress(done * design.cases // count)
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
    return [*chain(*parts)]


def _about(folder: Path) -> tuple[str, bool]:
    """Of a worker: its version, and whether it has this folder."""
    return VERSION, folder.exists()
