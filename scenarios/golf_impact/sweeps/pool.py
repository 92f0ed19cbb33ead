"""Worker processes on this machine, which end when they should: at the end, on Ctrl-C, with us.

Like a ProcessPoolExecutor, but each process has a pipe of its own instead of a part in common
queues: one that is killed, even in the middle of a result, ends its pipe and nothing else.
"""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from golf_impact.stopping import SIGNALS
from golf_impact.sweeps.chunk import FmuFile, instance_of, release


class WorkerProcesses(Executor):
    """So many processes, each with an instance of the FMU, for use in a `with` block.

    If the block is left by an exception they are killed, in the middle of their work.
    """

    def __init__(self, number: int, fmu: FmuFile) -> None:
        self._scratch = tempfile.mkdtemp(prefix="golf-impact-workers-")
        path = Path(self._scratch, "ClubBallImpact.fmu")
        path.write_bytes(fmu.data)
        with interrupts_held_back():
            self._workers = [_Worker(path) for _ in range(number)]
        # Each process has one call under way and one that waits in its pipe.
        self._free: SimpleQueue[_Worker] = SimpleQueue()
        for worker in self._workers * 2:
            self._free.put(worker)
        self._threads = ThreadPoolExecutor(2 * number)

    def submit(self, function: Callable, /, *arguments: Any) -> Future:  # type: ignore[override]
        """See `Executor.submit`; BrokenExecutor if the process that has it ends."""
        return self._threads.submit(self._call, function, arguments)

    def _call(self, *call: Any) -> Any:
        worker = self._free.get()
        try:
            with worker.sending:
                worker.connection.send(call)
                # Before the next one may send: answers come in the order of the calls.
                worker.receiving.acquire()
            try:
                succeeded, result = worker.connection.recv()
            finally:
                worker.receiving.release()
        except (EOFError, OSError) as error:
            raise BrokenExecutor("a worker process ended") from error
        finally:
            self._free.put(worker)
        if succeeded:
            return result
        raise result

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if kind is not None:
            for worker in self._workers:
                worker.process.kill()
        self.shutdown(cancel_futures=True)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all processes, each after what it has begun."""
        self._threads.shutdown(cancel_futures=cancel_futures)
        for worker in self._workers:
            worker.connection.close()
            worker.process.join()
        shutil.rmtree(self._scratch, ignore_errors=True)


class _Worker:
    """A process and the way to it."""

    def __init__(self, fmu: Path) -> None:
        # A forked process would inherit threads' locks, and an FMU that has been loaded.
        context = get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, fmu), daemon=True)
        self.process.start()
        theirs.close()
        self.sending, self.receiving = threading.Lock(), threading.Lock()


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Processes started here don't see Ctrl-C and the like: it is us who end them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Python's own helper would unblock the signals when it is started.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(connection: Connection, fmu: Path) -> None:
    """A worker process: until the other end of the pipe is closed, also by its death."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    # Removed by the process that started this one, whatever happens to this one.
    tempfile.tempdir = str(fmu.parent)
    with suppress(EOFError, OSError):
        file = FmuFile.read(fmu)
        while True:
            function, arguments = connection.recv()
            try:
                instance_of(file)
                answer = True, function(*arguments)
            except Exception as error:
                answer = False, error
            connection.send(answer)
    release()
    shutil.rmtree(fmu.parent, ignore_errors=True)
    # See golf_impact.commands.app about ending a process that has loaded an FMU.
    os._exit(0)
