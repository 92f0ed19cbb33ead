"""The same chunks on a Dask cluster: an existing one by its address, or one made here.

Its workers need this package (`pip install 'golf-impact[cluster]'`); the FMU travels to them once
and is checked there. A worker that dies gives its chunks back: Dask runs them elsewhere.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from golf_scenarios.errors import UserError
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.sweeps.chunk import FmuFile, release, run_chunk
from golf_scenarios.sweeps.plan import plan
from golf_scenarios.sweeps.pool import interrupts_held_back
from golf_scenarios.sweeps.run import CHUNK, Summary, write_sweep
from golf_scenarios.sweeps.study import Study
from golf_scenarios.sweeps.target import Target

if TYPE_CHECKING:
    from distributed import Client

#: How long a cluster may take to answer, and to have a worker.
_PATIENCE = "20s"

#: A chunk that fails without its worker dying is tried so many times more.
_RETRIES = 2


def run_on_cluster(
    study: Study,
    out: Path | str,
    scheduler: str,
    *,
    fmu: Path | str,
    workers: int | None = None,
    chunk: int = CHUNK,
    progress: Callable[[int], None] = lambda done: None,
    stop: Callable[[], bool] = lambda: False,
) -> Summary:
    """As `run_sweep`, with chunks run by the workers of a Dask cluster.

    Args:
        study: what to compute.
        out: a .csv or .parquet file.
        scheduler: the address of an existing one ("tcp://host:8786"), or "local".
        fmu: the .fmu file.
        workers: of a local cluster; as many as there are processors by default.
        chunk: see `run_sweep`.
        progress: see there.
        stop: see there.

    Raises:
        UserError: also if Dask is missing, or the cluster can't be reached or gives up.
        Stopped: as there.
    """
    made = plan(study, ImpactFmu(Path(fmu)).variables)
    with ExitStack() as stack:
        target = stack.enter_context(Target(Path(out), study, made))
        client = stack.enter_context(connected(scheduler, workers))
        file = FmuFile.read(Path(fmu))
        # A task of its own: Dask brings it to each worker once, and again to one that is new.
        sent = client.submit(FmuFile, file.digest, file.data, key=f"golf-impact-fmu-{file.digest}")
        executor = client.get_executor(retries=_RETRIES)
        stack.callback(executor.shutdown, wait=False)
        submit = partial(executor.submit, run_chunk, sent)
        with _lines_for_errors(scheduler):
            return write_sweep(study, made, target, submit, chunk, progress, stop)


@contextmanager
def connected(scheduler: str, workers: int | None = None) -> Iterator[Client]:
    """A client of a cluster that has workers; they free their instances at the end of the block.

    Raises:
        UserError: Dask is missing, or no cluster answers.
    """
    try:
        import distributed
    except ImportError as error:
        raise UserError(
            "--scheduler needs Dask: run `pip install 'golf-impact[cluster]'`, here and "
            "on the cluster's workers"
        ) from error
    # What happens to its connections is told by our own lines.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        try:
            if scheduler == "local":
                scratch = stack.enter_context(TemporaryDirectory(prefix="golf-impact-workers-"))
                with interrupts_held_back():
                    cluster = stack.enter_context(
                        distributed.LocalCluster(
                            n_workers=workers or os.cpu_count(),
                            threads_per_worker=1,
                            dashboard_address=None,
                            silence_logs=logging.CRITICAL,
                            # Removed here, whatever happens to the workers.
                            env={"TMPDIR": scratch},
                        )
                    )
                    client = stack.enter_context(distributed.Client(cluster))
            else:
                client = stack.enter_context(distributed.Client(scheduler, timeout=_PATIENCE))
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError) as error:
            raise UserError(
                f"no Dask cluster with workers at {scheduler} ({_in_a_line(error)}): start "
                "`dask scheduler` and `dask worker`, or use --scheduler local"
            ) from error
        client.register_plugin(_releasing(distributed.WorkerPlugin))
        stack.callback(_unregistered, client)
        yield client


_PLUGIN = "golf-impact-release"


def _releasing(base: type) -> Any:
    """A plugin for workers: when it goes, so does the FMU's instance."""

    class Releasing(base):
        name = _PLUGIN

        def teardown(self, worker: Any) -> None:
            release()

    return Releasing()


def _unregistered(client: Client) -> None:
    # Whatever happened to workers and scheduler: there is nothing left to free there then.
    with suppress(Exception):
        client.unregister_worker_plugin(_PLUGIN)


@contextmanager
def _lines_for_errors(scheduler: str) -> Iterator[None]:
    """What Dask raises, as one line."""
    from concurrent.futures import CancelledError

    from distributed import KilledWorker

    try:
        yield
    except KilledWorker as error:
        raise UserError(
            f"the cluster at {scheduler} gave up: a chunk lost its worker again and again "
            f"({_in_a_line(error)})"
        ) from error
    except (CancelledError, OSError) as error:
        raise UserError(f"the cluster at {scheduler} went away ({_in_a_line(error)})") from error
    except ImportError as error:
        raise UserError(
            f"a worker of {scheduler} lacks {error.name}: install golf-impact[cluster] there, in "
            "the same version"
        ) from error


def _in_a_line(error: BaseException) -> str:
    return (str(error) or type(error).__name__).strip().splitlines()[0]
