"""Executors (concurrent.futures) for the chunks of a sweep: processes here, or a Dask cluster."""

import logging
import os
import pickle
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import (
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from functools import partial
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from golf_impact.errors import UserError, first_line, missing_package
from golf_impact.stopping import SIGNALS

#: How long a cluster may take to respond, and to have a worker.
_PATIENCE = "20s"


def opened(
    executor: Executor | None, scheduler: str | None, workers: int | None, threads: int
) -> AbstractContextManager[Executor]:
    """The given executor, or that of a cluster, of so many processes, or of threads."""
    if executor is not None:
        return nullcontext(executor)
    if scheduler is not None:
        return dask_executor(scheduler)
    return process_pool(workers) if workers and workers > 1 else ThreadPoolExecutor(threads)


@contextmanager
def process_pool(workers: int) -> Iterator[Executor]:
    """So many worker processes on this machine.

    At the end of the block they finish their calls. They ignore Ctrl-C, and end with this process,
    however it ends.
    """
    with tempfile.TemporaryDirectory(prefix="golf-impact-workers-") as folder:
        # A forked process would inherit threads' locks.
        pool = _Pool(workers, get_context("spawn"), _begin_worker, (folder,))
        pool.folder = folder
        try:
            # A pool ends its workers by SIGTERM when one of them has died.
            with _blocked({*SIGNALS} - {signal.SIGTERM}):
                for _ in range(workers):
                    pool.submit(os.getpid)  # starts a worker
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)


class _Pool(ProcessPoolExecutor):
    """Its pipes carry short messages only.

    A process that is killed in the middle of one that doesn't fit into a pipe would block the
    others forever, and this one too. Longer messages go through files of a folder.
    """

    folder: str

    def submit(self, fn: Callable, /, *args: Any, **kwargs: Any) -> Future:
        call: Any = _InFile(partial(fn, *args, **kwargs), self.folder)
        return super().submit(_call, call)


class _InFile:
    """Pickled as the name of a file that holds the value, and unpickled as the value."""

    def __init__(self, value: Any, folder: str | None = None) -> None:
        self.value, self.folder = value, folder

    def __reduce__(self) -> tuple[Callable, tuple[str]]:
        handle, name = tempfile.mkstemp(dir=self.folder)
        with open(handle, "wb") as stream:
            pickle.dump(self.value, stream)
        return _read_value, (name,)


def _read_value(name: str) -> Any:
    data = Path(name).read_bytes()
    os.unlink(name)
    return pickle.loads(data)


def _call(call: Callable[[], Any]) -> Any:
    return _InFile(call())


def _begin_worker(folder: str) -> None:
    """In a new worker: temporary files go to a folder that its parent removes."""
    tempfile.tempdir = folder
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Windows has no blocked signals
    threading.Thread(target=_end_with, args=(parent_process(),), daemon=True).start()


def _end_with(process: BaseProcess) -> None:
    process.join()
    os._exit(1)


@contextmanager
def _blocked(signals: set[signal.Signals]) -> Iterator[None]:
    """Processes started within the block never receive these signals."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Python's own helper process would unblock them when it is started.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def dask_executor(scheduler: str) -> Iterator[Executor]:
    """That of the Dask cluster at an address; Dask runs the chunks of a dead worker elsewhere.

    UserError: Dask is missing, or the cluster can't be reached or gives up.
    """
    try:
        import distributed
    except ImportError as error:
        also = ", and the same on the cluster's workers"
        raise missing_package("--scheduler", "Dask", "cluster", also) from error
    # Lost connections are reported by the lines below.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        try:
            client = stack.enter_context(distributed.Client(scheduler, timeout=_PATIENCE))
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError) as error:
            raise UserError(
                f"no Dask cluster with workers at {scheduler} ({first_line(error)}): start "
                "`dask scheduler` and `dask worker`, or use --workers"
            ) from error
        executor = client.get_executor(retries=2)
        stack.callback(executor.shutdown, wait=False)
        try:
            yield executor
        # Workers of an earlier version lack an attribute or a module.
        except (
            distributed.KilledWorker, CancelledError, OSError, ImportError, AttributeError,
        ) as error:  # fmt: skip
            raise UserError(
                f"the cluster at {scheduler} gave up or is lost ({first_line(error)}); its workers "
                "need this package with its extra cluster, in the same version"
            ) from error
