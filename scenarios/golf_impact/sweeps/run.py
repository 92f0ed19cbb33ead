"""Running a sweep: its chunks through an executor, in order into a file."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from contextlib import AbstractContextManager, ExitStack, closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.errors import UserError
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.sweeps.chunk import Chunk, FmuFile, instance_of, release, run_chunk
from golf_impact.sweeps.executors import opened
from golf_impact.sweeps.impacts import impacts, plan
from golf_impact.sweeps.study import Study
from golf_impact.sweeps.table_file import check_path, table_file
from golf_impact.timing import free_bytes

#: Cases of a chunk: some 40 ms of work.
CHUNK = 2000
#: A larger one would take too long to stop.
LARGEST_CHUNK = 10_000
#: Each takes some 50 MB; beyond one machine there are clusters.
MOST_WORKERS = 256
#: A worker that is killed ends its pool of processes: so many pools may be used up.
_POOLS = 3
#: Chunks that may be under way or waiting to be written: what bounds the memory.
_IN_FLIGHT = 32


class Stopped(Exception):  # noqa: N818 (not an error: the user asked for it)
    """The user stopped a sweep: so many cases had been done, and whether the file was written."""

    def __init__(self, done: int, written: bool = False) -> None:
        super().__init__(f"stopped after {done:,} cases")
        self.done, self.written = done, written


@dataclass(frozen=True)
class Summary:
    """What a sweep did."""

    path: Path  # the file
    cases: int  # rows in it
    refused: int  # cases that the FMU refused: rows with empty outputs
    first_refused: tuple[int, str] | None  # row (from 1, without the header) of the first, and why
    seconds: float  # from the first case to the last
    drawn: np.ndarray  # the first output of all cases, shape (cases,); NaN without a value


#: The values of swept variables by name, arrays of shape (cases,).
Columns = dict[str, np.ndarray]


class Sweep(ExitStack):
    """A study and the FMU that it runs through, for use in a `with` block.

    Its arguments are those of `run_sweep`; UserError if the study doesn't fit the FMU.
    """

    def __init__(
        self,
        study: Study,
        fmu: Path | str | None = None,
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__()
        self.study, self.stop = study, stop
        self.fmu = ImpactFmu(current_fmu()[0] if fmu is None else Path(fmu))
        self.file = FmuFile.read(self.fmu.path)
        self.plan = plan(study, self.fmu.variables)
        self._begin = 0.0
        self.callback(release)

    @property
    def instance(self) -> ImpactFmu:
        """The FMU loaded into this process, when first needed."""
        return instance_of(self.file)

    def go_on(self) -> None:
        """Raise Stopped if the user has requested it since the table was written."""
        if self.stop():
            raise Stopped(self.study.cases, written=True)

    def first_output(self, columns: Columns) -> np.ndarray:
        """The first output of these cases, shape (cases,), NaN without a value; or Stopped."""
        parts = []
        for start in range(0, len(next(iter(columns.values()))), CHUNK):
            self.go_on()
            part = {name: column[start : start + CHUNK] for name, column in columns.items()}
            parts.append(impacts(self.instance, self.plan, self.plan.values(part)).outputs[:, 0])
        return np.concatenate(parts)

    def run(
        self,
        out: Path | str,
        *,
        executor: Executor | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        chunk: int = CHUNK,
        progress: Callable[[int], None] = lambda done: None,
    ) -> Summary:
        """Write one row a case; arguments, result and errors as of `run_sweep`."""
        out, cases = Path(out), self.study.cases
        check_size(self.study, workers, chunk)
        check_path(out)
        if scheduler is None:
            # A process that gets no chunk would only cost its start.
            workers = min(workers or 1, -(-cases // chunk))
        executors = partial(opened, executor, scheduler, workers)
        self._draw_samples()
        self.instance  # noqa: B018 (loaded before the clock starts; what can't be is refused here)
        drawn = np.empty(cases)
        refused, first, done = 0, None, 0
        with (
            table_file(out, self.study, self.plan) as table,
            closing(self._chunks(executors, chunk, table.as_text)) as chunks,
        ):
            for columns, part in chunks:
                table.write(columns, part)
                outputs, unusable, reason = part.results
                drawn[done : done + len(outputs)] = outputs[:, 0]
                if reason and first is None:
                    first = done + int(unusable.argmax()) + 1, reason
                refused += int(unusable.sum())
                done += len(outputs)
                progress(done)
            seconds = time.perf_counter() - self._begin
        return Summary(out, cases, refused, first, seconds, drawn)

    def _chunks(
        self, executors: Callable[[], AbstractContextManager[Executor]], size: int, as_text: bool
    ) -> Generator[tuple[Columns, Chunk], None, None]:
        """Columns and results of all chunks in order, those of a broken executor by a new one."""
        done = 0
        for used_up in range(_POOLS):
            try:
                with executors() as executor:
                    if not used_up:
                        self._begin = time.perf_counter()
                    for columns, future in self._submitted(executor, done, size, as_text):
                        part = self._result(future, done)
                        done += len(part.results.outputs)
                        yield columns, part
                return
            except BrokenExecutor as error:
                broken = error
        raise UserError(
            f"worker processes ended unexpectedly {_POOLS} times (killed, out of memory, or a "
            'script without `if __name__ == "__main__":`?): nothing was written'
        ) from broken

    def _submitted(
        self, executor: Executor, start: int, size: int, as_text: bool
    ) -> Iterator[tuple[Columns, Future[Chunk]]]:
        """The chunks from this case on, each begun some time before it is its turn."""
        cases = self.study.cases
        starts = iter(range(start, cases, size))
        begun: deque[tuple[Columns, Future[Chunk]]] = deque()
        try:
            while True:
                for first in starts:
                    columns = self.study.columns(first, min(first + size, cases))
                    call = partial(run_chunk, self.file, self.plan, as_text, columns)
                    begun.append((columns, executor.submit(call)))
                    if begun[0][1].done() or len(begun) >= _IN_FLIGHT:
                        break
                if not begun:
                    return
                yield begun[0]
                begun.popleft()
        finally:
            for _, future in begun:
                future.cancel()

    def _draw_samples(self) -> None:
        """Before the clock starts, in a thread beside this one, which checks whether to stop."""
        drawn: Future = Future()

        def draw() -> None:
            try:
                drawn.set_result(self.study.columns(0, 1))
            except BaseException as error:
                drawn.set_exception(error)

        # It isn't waited for when the process ends.
        threading.Thread(target=draw, daemon=True).start()
        self._result(drawn, 0)

    def _result(self, future: Future, done: int) -> Any:
        """What a future gives, or Stopped after so many cases."""
        while not future.done() and not self.stop():
            wait([future], timeout=0.1)
        if self.stop():
            raise Stopped(done)
        return future.result()


def check_size(
    study: Study, workers: int | None = None, chunk: int = CHUNK, figures: bool = False
) -> None:
    """UserError, before anything starts, for options out of range or too little free memory.

    With `figures` the study needs more.
    """
    if not 1 <= chunk <= LARGEST_CHUNK:
        raise UserError(f"--chunk {chunk} is refused: it must be 1 to {LARGEST_CHUNK:,}")
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise UserError(f"--workers {workers} is refused: it must be 1 to {MOST_WORKERS}")
    need, free = study.memory(figures), free_bytes()
    if free is not None and need > free:
        less = " or --no-figures" if figures else ""
        raise UserError(
            f"{study.cases:,} cases need {need / 1e9:,.1f} GB of memory, and {free / 1e9:,.1f} GB "
            f"are free: use fewer values{less}, or a study for each part"
        )


def run_sweep(
    study: Study,
    out: Path | str,
    *,
    fmu: Path | str | None = None,
    stop: Callable[[], bool] = lambda: False,
    **options: Any,
) -> Summary:
    """Run a study through the FMU and write one row a case.

    The file is the same to the last bit whatever runs the chunks, and however large they are.

    Args:
        study: what to compute; see `Study.of`.
        out: a .csv or .parquet file. It gets its name when it is whole.
        fmu: the .fmu file; by default that of the present sources, built if need be.
        stop: called between chunks; returns whether to end.
        options:
            executor: any executor of the interface of concurrent.futures, such as that of a Dask
                client or an MPI pool; its processes need this package, and get the FMU with each
                chunk.
            workers: without an executor, the number of processes on this machine; 1 by default,
                which computes in this process. A script that uses more needs the usual
                `if __name__ == "__main__":`, since the processes import it.
            scheduler: in their place a Dask cluster: its address ("tcp://host:8786"), or "local",
                of so many workers or as many as there are processors.
            chunk: cases that a worker gets at a time, at most 10,000.
            progress: called with the number of cases done.

    Raises:
        UserError: the study doesn't fit the FMU, the file can't be written, workers died again
            and again; Dask is missing, or the cluster can't be reached or gives up.
        Stopped: `stop` returned True. No file was written, one that was there is whole.
    """
    with Sweep(study, fmu, stop) as sweep:
        return sweep.run(out, **options)
