"""Running a sweep: its chunks through an executor, in order into a file."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.errors import UserError
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.sweeps.chunk import FmuFile, instance_of, release, run_chunk
from golf_impact.sweeps.executors import opened
from golf_impact.sweeps.impacts import Results, impacts, plan
from golf_impact.sweeps.study import Study
from golf_impact.sweeps.table_file import table_file
from golf_impact.timing import free_bytes

#: Cases of a chunk: some 40 ms of work.
CHUNK = 2000
#: A larger one would take too long to stop.
_LARGEST_CHUNK = 10_000
#: Each takes some 50 MB; beyond one machine there are clusters.
_MOST_WORKERS = 256
#: A worker that is killed ends its pool of processes: so many pools may be used up.
_POOLS = 3
#: Chunks that may be under way or waiting to be written: what bounds the memory.
_IN_FLIGHT = 32


class Stopped(Exception):  # noqa: N818 (not an error: the user asked for it)
    """The user stopped a sweep after so many cases."""

    def __init__(self, done: int) -> None:
        super().__init__(f"stopped after {done:,} cases")
        self.done = done


@dataclass(frozen=True)
class Summary:
    """What a sweep did."""

    path: Path  # the file
    cases: int  # rows in it
    refused: int  # cases that the FMU refused: rows with empty outputs
    first_refused: tuple[int, str] | None  # row (from 1, without the header) of the first, and why
    seconds: float  # with the start of workers
    drawn: np.ndarray  # the first output of all cases, shape (cases,); NaN without a value


#: The values of swept variables by name, arrays of shape (cases,).
Columns = dict[str, np.ndarray]


class Sweep:
    """A study and the FMU that it runs through, loaded into this process in a `with` block.

    UserError if the study doesn't fit the FMU, or into memory.
    """

    def __init__(self, study: Study, fmu: Path | str | None = None) -> None:
        need, free = study.memory, free_bytes()
        if free is not None and need > free:
            raise UserError(
                f"{study.cases:,} cases need {need / 1e9:,.1f} GB of memory, and {free / 1e9:,.1f} "
                "GB are free: use fewer values, or a study for each part"
            )
        self.study = study
        self.fmu = ImpactFmu(current_fmu()[0] if fmu is None else Path(fmu))
        self.file = FmuFile.read(self.fmu.path)
        self.plan = plan(study, self.fmu.variables)

    def __enter__(self) -> Sweep:
        self.study.columns(np.array([0]))  # draws the samples
        instance_of(self.file)
        return self

    def __exit__(self, *_: object) -> None:
        release()

    def first_output(self, columns: Columns) -> np.ndarray:
        """The first output of these cases, shape (cases,); NaN without a value."""
        values = self.plan.values(columns)
        return impacts(instance_of(self.file), self.plan, values).outputs[:, 0]

    def run(
        self,
        out: Path | str,
        *,
        executor: Executor | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        chunk: int = CHUNK,
        progress: Callable[[int], None] = lambda done: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> Summary:
        """Write one row a case; arguments, result and errors as of `run_sweep`."""
        out, cases = Path(out), self.study.cases
        for option, number, most in (
            ("--chunk", chunk, _LARGEST_CHUNK),
            ("--workers", 1 if workers is None else workers, _MOST_WORKERS),
        ):
            if not 1 <= number <= most:
                raise UserError(f"{option} {number} is refused: it must be 1 to {most:,}")
        pools = (opened(executor, scheduler, workers) for _ in range(_POOLS))
        drawn = np.empty(cases)
        refused, first, done = 0, None, 0
        begin = time.perf_counter()
        with (
            table_file(out, self.study, self.plan) as write,
            closing(self._chunks(pools, chunk, out.suffix.lower() == ".csv", stop)) as chunks,
        ):
            for columns, text, (outputs, unusable, reason) in chunks:
                write(columns, text, outputs)
                drawn[done : done + len(outputs)] = outputs[:, 0]
                if reason and first is None:
                    first = done + int(unusable.argmax()) + 1, reason
                refused += int(unusable.sum())
                done += len(outputs)
                progress(done)
        return Summary(out, cases, refused, first, time.perf_counter() - begin, drawn)

    def _chunks(
        self,
        pools: Iterable[AbstractContextManager[Executor]],
        size: int,
        as_text: bool,
        stop: Callable[[], bool],
    ) -> Generator[tuple[Columns, bytes, Results], None, None]:
        """Columns and results of all chunks in order, those of a broken pool by the next one."""
        done, cases = 0, self.study.cases
        for pool in pools:
            starts = iter(range(done, cases, size))
            #: Begun some time before it is their turn.
            under_way: deque[tuple[Columns, Future[tuple[bytes, Results]]]] = deque()
            try:
                with pool as executor:
                    while done < cases:
                        for start in starts:
                            columns = self.study.columns(np.arange(start, min(start + size, cases)))
                            call = partial(run_chunk, self.file, self.plan, as_text, columns)
                            under_way.append((columns, executor.submit(call)))
                            if under_way[0][1].done() or len(under_way) >= _IN_FLIGHT:
                                break
                        columns, future = under_way[0]
                        while not future.done() and not stop():
                            wait([future], timeout=0.1)
                        if stop():
                            raise Stopped(done)
                        text, results = future.result()
                        under_way.popleft()
                        done += len(results.outputs)
                        yield columns, text, results
                return
            except BrokenExecutor as error:
                broken = error
            finally:
                for _, future in under_way:
                    future.cancel()
        raise UserError(
            f"worker processes ended unexpectedly {_POOLS} times (killed, out of memory, or a "
            'script without `if __name__ == "__main__":`?): nothing was written'
        ) from broken


def run_sweep(
    study: Study,
    out: Path | str,
    *,
    fmu: Path | str | None = None,
    **options: Any,
) -> Summary:
    """Run a study through the FMU and write one row a case.

    The file is the same to the last bit whatever runs the chunks, and however large they are.

    Args:
        study: what to compute; see `Study.of`.
        out: a .csv or .parquet file. It gets its name when it is whole.
        fmu: the .fmu file; by default that of the present sources, built if need be.
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
            stop: called between chunks; returns whether to end.

    Raises:
        UserError: the study doesn't fit the FMU, the file can't be written, workers died again
            and again; Dask is missing, or the cluster can't be reached or gives up.
        Stopped: `stop` returned True. No file was written, one that was there is whole.
    """
    with Sweep(study, fmu) as sweep:
        return sweep.run(out, **options)
