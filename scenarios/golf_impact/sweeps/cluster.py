"""The same chunks on a Dask cluster: an existing one by its address, or one made here.

Its workers need this package with its extra `cluster`; the FMU travels to them once and is checked
there. A worker that dies gives its chunks back: Dask runs them elsewhere.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import ExitStack, contextmanager, suppress
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from golf_impact.errors import UserError, lacking
from golf_impact.fmu.loaded import in_a_line
from golf_impact.sweeps.chunk import FmuFile, release
from golf_impact.sweeps.pool import interrupts_held_back

if TYPE_CHECKING:
    from distributed import Client

#: How long a cluster may take to answer, and to have a worker.
_PATIENCE = "20s"


@contextmanager
def executor_of(
    scheduler: str, workers: int | None, fmu: FmuFile
) -> Iterator[tuple[Executor, Any]]:
    """An executor whose calls the workers of a Dask cluster run, and what the FMU is to them.

    `scheduler` is the address of an existing one ("tcp://host:8786"), or "local": of so many
    workers, or as many as there are processors. UserError if Dask is missing, or the cluster can't
    be reached or gives up.
    """
    with connected(scheduler, workers) as client, ExitStack() as stack:
        from distributed import KilledWorker

        # A task of its own: Dask brings it to each worker once, and again to one that is new.
        sent = client.submit(FmuFile, fmu.digest, fmu.data, key=f"golf-impact-fmu-{fmu.digest}")
        # So often more a chunk is tried that fails without its worker dying.
        executor = client.get_executor(retries=2)
        stack.callback(executor.shutdown, wait=False)
        try:
            yield executor, sent
        except KilledWorker as error:
            raise UserError(
                f"the cluster at {scheduler} gave up: a chunk lost its worker again and again "
                f"({in_a_line(error)})"
            ) from error
        except (CancelledError, OSError) as error:
            raise UserError(f"the cluster at {scheduler} went away ({in_a_line(error)})") from error
        except ImportError as error:
            raise UserError(
                f"a worker of {scheduler} lacks {error.name}: install this package with its extra "
                "cluster there, in the same version"
            ) from error


@contextmanager
def connected(scheduler: str, workers: int | None = None) -> Iterator[Client]:
    """A client of a cluster that has workers; they free their instances at the end of the block.

    UserError if Dask is missing, or no cluster answers.
    """
    try:
        import distributed
    except ImportError as error:
        also = ", and the same on the cluster's workers"
        raise lacking("--scheduler", "Dask", "cluster", also) from error
    # What happens to its connections is told by our own lines.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        try:
            if scheduler == "local":
                scratch = stack.enter_context(TemporaryDirectory(prefix="golf-impact-workers-"))
                with interrupts_held_back():
                    cluster = distributed.LocalCluster(
                        n_workers=workers or os.cpu_count(), threads_per_worker=1,
                        silence_logs=logging.CRITICAL,
                        # None would take port 8787, and warn if somebody has it.
                        dashboard_address=":0", scheduler_kwargs={"dashboard": False},
                        # Removed here, whatever happens to the workers.
                        env={"TMPDIR": scratch},
                    )  # fmt: skip
                    client = distributed.Client(stack.enter_context(cluster))
            else:
                client = distributed.Client(scheduler, timeout=_PATIENCE)
            stack.enter_context(client).wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError) as error:
            raise UserError(
                f"no Dask cluster with workers at {scheduler} ({in_a_line(error)}): start "
                "`dask scheduler` and `dask worker`, or use --scheduler local"
            ) from error
        try:
            yield client
        finally:
            # Whatever happened to workers and scheduler: there is nothing left to free there then.
            with suppress(Exception):
                client.run(release)
