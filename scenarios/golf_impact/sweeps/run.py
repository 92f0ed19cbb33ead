"""Running a sweep: its chunks through an executor, in order into a file."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from golf_build.archive import whole
from golf_impact.errors import UserError, missing_package
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.sweeps.executors import opened
from golf_impact.sweeps.impacts import Plan, Results, impacts, load, make_plan, release, run_chunk
from golf_impact.sweeps.study import Study
from golf_impact.timing import free_bytes

#: Cases of a chunk: some 40 ms of work.
CHUNK = 2000
#: A larger one would take too long to stop.
_LARGEST_CHUNK = 10_000
#: Each takes some 50 MB; beyond one machine there are clusters.
_MOST_WORKERS = 256
#: A worker that is killed ends its pool of processes: at most so many pools are used.
_POOLS = 3
#: Chunks that may be under way or waiting to be written: a bound of the memory.
_IN_FLIGHT = 32
#: Rows of a Parquet row group: independent of chunks, so that the file is too.
_ROW_GROUP = 2**16


class Stopped(Exception):  # noqa: N818 (not an error: the user asked for it)
    """The user stopped a sweep after so many cases."""

    def __init__(self, done: int) -> None:
        super().__init__(f"stopped after {done:,} cases")
        self.done = done


@dataclass(frozen=True)
class Summary:
    """Results of a sweep."""

    path: Path  # the file
    cases: int  # rows in it
    refused: int  # cases that the FMU refused: rows with empty outputs
    first_refused: tuple[int, str] | None  # row (from 1, without the header) of the first, and why
    seconds: float  # with the start of workers
    drawn: np.ndarray  # the first output of all cases, shape (cases,); NaN without a value


class Sweep:
    """A study and the FMU that it runs through, loaded into this process in a `with` block.

    UserError if the study doesn't fit the FMU, or into memory.
    """

    def __init__(self, study: Study, fmu: Path | str | None = None) -> None:
        # An estimate of the largest memory, with the figure but without chunks.
        need = 40 * study.cases + 64 * study.number_of_samples * len(study.distributions)
        free = free_bytes() or math.inf
        if need > free:
            raise UserError(
                f"{study.cases:,} cases need {need / 1e9:,.1f} GB of memory, and {free / 1e9:,.1f} "
                "GB are free: use fewer values, or a study for each part"
            )
        self.study = study
        self.fmu = ImpactFmu(current_fmu()[0] if fmu is None else Path(fmu))
        self.plan = make_plan(study, self.fmu)

    def __enter__(self) -> Sweep:
        self.study.columns(np.array([0]))  # draws the samples
        load(self.plan)
        return self

    def __exit__(self, *_: object) -> None:
        release()

    def first_output(self, columns: dict[str, np.ndarray]) -> np.ndarray:
        """The first output of these cases, shape (cases,); NaN without a value."""
        return impacts(self.plan, columns).outputs[:, 0]

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
        open_executor = partial(opened, executor, scheduler, workers)
        chunks = self._chunks(open_executor, chunk, out.suffix.lower() == ".csv", stop)
        drawn = np.empty(cases)
        refused, first, done = 0, None, 0
        begin = time.perf_counter()
        with self.table(out) as write, closing(chunks):
            for text, (outputs, unusable, reason) in chunks:
                index = np.arange(done, done + len(outputs))
                write(self.study.columns(index), text, outputs)
                drawn[index] = outputs[:, 0]
                if reason and first is None:
                    first = done + int(unusable.argmax()) + 1, reason
                refused += int(unusable.sum())
                done += len(outputs)
                progress(done)
        return Summary(out, cases, refused, first, time.perf_counter() - begin, drawn)

    def _chunks(
        self, open_executor: Callable, size: int, as_text: bool, stop: Callable[[], bool]
    ) -> Generator[tuple[bytes, Results], None, None]:
        """Results of all chunks in order, those of a broken pool by the next one."""
        done, cases = 0, self.study.cases
        for _ in range(_POOLS):
            starts = iter(range(done, cases, size))
            #: Begun some time before it is their turn.
            under_way: deque[Future[tuple[bytes, Results]]] = deque()
            try:
                with open_executor() as executor:
                    while done < cases:
                        for start in starts:
                            columns = self.study.columns(np.arange(start, min(start + size, cases)))
                            future = executor.submit(run_chunk, self.plan, as_text, columns)
                            under_way.append(future)
                            if under_way[0].done() or len(under_way) >= _IN_FLIGHT:
                                break
                        while not under_way[0].done() and not stop():
                            wait([under_way[0]], timeout=0.1)
                        if stop():
                            raise Stopped(done)
                        text, results = under_way.popleft().result()
                        done += len(results.outputs)
                        yield text, results
                return
            except BrokenExecutor as error:
                broken = error
            finally:
                for future in under_way:
                    future.cancel()
        raise UserError(
            f"worker processes ended unexpectedly {_POOLS} times (killed, out of memory, or a "
            'script without `if __name__ == "__main__":`?): nothing was written'
        ) from broken

    @contextmanager
    def table(self, path: Path) -> Iterator[Callable]:
        """Write the file in a `with` block; afterwards it is complete, or as it was.

        Yields a function that writes some cases: columns of swept variables, lines of CSV (unused
        in other files), and outputs of shape (cases, outputs). UserError: it can't be written.
        """
        suffix, names = path.suffix.lower(), (*self.study.names, *self.plan.outputs)
        if suffix not in (".csv", ".parquet"):
            raise UserError(f"--out {path} is refused: its name must end in .csv or .parquet")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole(path) as stream:
                if suffix == ".csv":
                    stream.write((",".join(names) + "\n").encode())
                    yield lambda columns, text, outputs: stream.write(text)
                else:
                    with _parquet(stream, names, self.plan) as write:
                        yield write
        except OSError as error:
            raise UserError(
                f"can't write {path}: {error.strerror or error}; a file there stays as it was"
            ) from error


@contextmanager
def _parquet(stream: BinaryIO, names: tuple[str, ...], plan: Plan) -> Iterator[Callable]:
    """Columns in row groups of one size; outputs without a value are null."""
    try:
        import pyarrow
        from pyarrow.parquet import ParquetWriter
    except ImportError as error:
        raise missing_package("Parquet", "pyarrow", "sweep", ", or name a .csv file") from error
    kinds = {"ball": pyarrow.string(), "law": pyarrow.int64()}
    kinds |= dict.fromkeys(plan.booleans, pyarrow.bool_())
    schema = pyarrow.schema([(name, kinds.get(name, pyarrow.float64())) for name in names])
    waiting, rows = [schema.empty_table()], 0

    def write(columns: dict[str, np.ndarray], text: bytes, outputs: np.ndarray) -> None:
        nonlocal rows
        arrays = [pyarrow.array(column) for column in columns.values()]
        arrays += [pyarrow.array(column, mask=np.isnan(column)) for column in outputs.T]
        waiting.append(pyarrow.table(arrays, names=names).cast(schema))
        rows += len(outputs)
        if rows >= _ROW_GROUP:
            write_group()

    def write_group() -> None:
        nonlocal waiting, rows
        table = pyarrow.concat_tables(waiting)
        waiting, rows = [table.slice(_ROW_GROUP)], max(0, rows - _ROW_GROUP)
        writer.write_table(table.slice(0, _ROW_GROUP).combine_chunks(), row_group_size=_ROW_GROUP)

    with ParquetWriter(stream, schema) as writer:
        yield write
        if rows:
            write_group()
    # Later steps need the memory.
    pyarrow.default_memory_pool().release_unused()


def run_sweep(
    study: Study, out: Path | str, *, fmu: Path | str | None = None, **options: Any
) -> Summary:
    """Run a study through the FMU and write one row a case.

    The file is the same to the last bit whatever executor runs the chunks, and whatever their size.

    Args:
        study: what to compute; see `Study.of`.
        out: a .csv or .parquet file. It gets its name when it is complete.
        fmu: the .fmu file; by default that of the present sources, built if necessary.
        options:
            executor: any executor of the interface of concurrent.futures, such as that of a Dask
                client or an MPI pool; its processes need this package, and get the FMU with each
                chunk.
            workers: without an executor, the number of processes on this machine; 1 by default,
                which computes in this process. A script that uses more needs
                `if __name__ == "__main__":`, since the processes import it.
            scheduler: instead, a Dask cluster: its address ("tcp://host:8786"), or "local",
                of so many workers or as many as there are processors.
            chunk: cases that a worker gets at a time, at most 10,000.
            progress: called with the number of cases done.
            stop: called between chunks; returns whether to end.

    Raises:
        UserError: the study doesn't fit the FMU, the file can't be written, workers died again
            and again; Dask is missing, or the cluster can't be reached or gives up.
        Stopped: `stop` returned True. No file was written; an earlier one is unchanged.
    """
    with Sweep(study, fmu) as sweep:
        return sweep.run(out, **options)
