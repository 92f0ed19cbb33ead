"""Running a sweep: its chunks through one process or any executor, in order into a file."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from golf_scenarios.errors import UserError
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.sweeps.chunk import Chunk, FmuFile, Form, computed, release, run_chunk
from golf_scenarios.sweeps.plan import Plan, plan
from golf_scenarios.sweeps.pool import WorkerProcesses
from golf_scenarios.sweeps.study import Study
from golf_scenarios.sweeps.target import Target

#: Cases of a chunk: some 40 ms of work.
CHUNK = 2000

#: A larger one would take too long to stop.
LARGEST_CHUNK = 10_000

#: Each takes some 50 MB; beyond one machine there are clusters.
MOST_WORKERS = 256

#: Chunks that may be under way or waiting to be written: what bounds the memory.
_IN_FLIGHT = 32


class Stopped(Exception):  # noqa: N818 (not an error: the user asked for it)
    """The user stopped a sweep: so many cases had been done, and whether the file was written."""

    def __init__(self, done: int, written: bool = False) -> None:
        super().__init__(f"stopped after {done:,} cases")
        self.done = done
        self.written = written


@dataclass(frozen=True)
class Summary:
    """What a sweep did.

    Attributes:
        path: the file.
        cases: rows in it.
        refused: cases that the FMU refused: rows with empty outputs.
        first_refused: the row (from 1, without the header) of the first of them, and why.
        seconds: from the first case to the last.
        drawn: the first output of all cases, shape (cases,); NaN where refused.
    """

    path: Path
    cases: int
    refused: int
    first_refused: tuple[int, str] | None
    seconds: float
    drawn: np.ndarray


def run_sweep(
    study: Study,
    out: Path | str,
    *,
    fmu: Path | str | None = None,
    executor: Executor | None = None,
    workers: int = 1,
    chunk: int = CHUNK,
    progress: Callable[[int], None] = lambda done: None,
    stop: Callable[[], bool] = lambda: False,
) -> Summary:
    """Run a study through the FMU and write one row a case.

    The file is the same to the last bit whatever runs the chunks, and however large they are.

    Args:
        study: what to compute; see `Study.of`.
        out: a .csv or .parquet file. It gets its name when it is whole.
        fmu: the .fmu file; by default that of the present sources, built if need be.
        executor: anything that has the interface of concurrent.futures: its processes need this
            package, and get the FMU with each chunk. By default worker processes of our own.
        workers: how many of those; 1 computes in this process.
        chunk: cases that a worker gets at a time, at most 10,000.
        progress: called with the number of cases done.
        stop: asked between chunks whether to end.

    Returns:
        What was done.

    Raises:
        UserError: the study doesn't fit the FMU, the file can't be written, a worker died.
        Stopped: `stop` said so. No file was written, one that was there is whole.
    """
    if fmu is None:
        from golf_scenarios.fmu.file import current_fmu

        fmu, _ = current_fmu()
    if not 1 <= workers <= MOST_WORKERS:
        raise UserError(f"--workers {workers} is refused: it must be 1 to {MOST_WORKERS}")
    # One that gets no chunk would only cost its start.
    workers = min(workers, -(-study.cases // max(1, chunk)))
    source = Path(fmu)
    with _lines_for_errors(), ExitStack() as stack:
        if executor is None and workers == 1:
            instance = ImpactFmu(source)
            made = plan(study, instance.variables)
            target = stack.enter_context(Target(Path(out), study, made))
            stack.enter_context(instance)
            submit: Submit = partial(at_once, partial(computed, instance))
            return write_sweep(study, made, target, submit, chunk, progress, stop)
        made = plan(study, ImpactFmu(source).variables)
        target = stack.enter_context(Target(Path(out), study, made))
        file = FmuFile.read(source)
        if executor is None:
            executor = stack.enter_context(WorkerProcesses(workers, file))
            file = file.name_only
        else:
            # An executor of threads has loaded it here.
            stack.callback(release)
        submit = partial(executor.submit, run_chunk, file)  # type: ignore[call-arg]
        return write_sweep(study, made, target, submit, chunk, progress, stop)


@contextmanager
def _lines_for_errors() -> Iterator[None]:
    try:
        yield
    except BrokenExecutor as error:
        raise UserError(
            "a worker process ended unexpectedly (killed, or out of memory?): nothing was written"
        ) from error


#: Begins a chunk: (plan, form, columns) to a future of what it gives.
Submit = Callable[[Plan, Form, dict[str, np.ndarray]], "Future[Chunk]"]


def at_once(compute: Callable[..., Chunk], *arguments: Any) -> Future[Chunk]:
    """A chunk computed here and now, as an executor would return it."""
    future: Future[Chunk] = Future()
    future.set_result(compute(*arguments))
    return future


def write_sweep(
    study: Study,
    made: Plan,
    target: Target,
    submit: Submit,
    chunk: int,
    progress: Callable[[int], None],
    stop: Callable[[], bool],
) -> Summary:
    """Run all chunks and write them in order; arguments and errors as of `run_sweep`."""
    if not 1 <= chunk <= LARGEST_CHUNK:
        raise UserError(f"--chunk {chunk} is refused: it must be 1 to {LARGEST_CHUNK:,}")
    drawn = np.empty(study.cases)
    refused, first, done = 0, None, 0
    # Draws the samples, if there are any.
    study.columns(0, 1)
    begin = time.perf_counter()
    chunks = _in_order(study, partial(submit, made, target.format.form(made)), chunk, stop)
    for columns, found in chunks:
        target.write(columns, found)
        drawn[done : done + found.cases] = found.kept[:, 0]
        if found.first is not None and first is None:
            first = done + found.first[0] + 1, found.first[1]
        refused += found.refused
        done += found.cases
        progress(done)
    seconds = time.perf_counter() - begin
    return Summary(target.path, done, refused, first, seconds, drawn)


def _in_order(
    study: Study,
    submit: Callable[[dict[str, np.ndarray]], Future[Chunk]],
    size: int,
    stop: Callable[[], bool],
) -> Iterator[tuple[dict[str, np.ndarray], Chunk]]:
    """The chunks with their columns as they follow each other, a bounded number of them begun."""
    waiting: deque[tuple[dict[str, np.ndarray], Future[Chunk]]] = deque()
    starts = iter(range(0, study.cases, size))
    done = 0
    try:
        while True:
            for start in starts:
                columns = study.columns(start, min(start + size, study.cases))
                waiting.append((columns, submit(columns)))
                if waiting[0][1].done() or len(waiting) >= _IN_FLIGHT:
                    break
            if not waiting:
                return
            while not waiting[0][1].done() and not stop():
                wait([waiting[0][1]], timeout=0.1)
            if stop():
                raise Stopped(done)
            columns, future = waiting.popleft()
            found = future.result()
            done += found.cases
            yield columns, found
    finally:
        for _, future in waiting:
            future.cancel()
