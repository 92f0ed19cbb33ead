"""Running a sweep: its chunks through an executor, in order into a file."""

import math
import time
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from contextlib import ExitStack, closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from golf_build import VERSION
from golf_impact.arrays.impacts import Outcome
from golf_impact.errors import UserError
from golf_impact.sweeps.checks import Check
from golf_impact.sweeps.executors import opened
from golf_impact.sweeps.impacts import PHYSICS, impacts, make_plan
from golf_impact.sweeps.study import Columns, Study
from golf_impact.sweeps.tables import csv_lines, table
from golf_impact.timing import free_bytes

#: Cases of the first chunk and of the largest. Those between take some 0.1 s, by which a stop is
#: delayed.
_FIRST_CHUNK, _LARGEST_CHUNK, _SECONDS = 500, 32_000, 0.1
#: Each takes some 50 MB; beyond one machine there are clusters.
_MOST_WORKERS = 256
#: A worker that is killed ends its pool of processes: at most so many pools are used.
_POOLS = 3
#: Chunks and cases that may be under way or waiting to be written: a bound of the memory.
_CHUNKS_IN_FLIGHT, _CASES_IN_FLIGHT = 32, 200_000


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
    refused: int  # cases that the physics or the FMU refused: rows with empty outputs
    first_refused: tuple[int, str] | None  # row (from 1, without the header) of the first, and why
    seconds: float  # with the start of workers
    drawn: np.ndarray  # the first output of all cases, shape (cases,); NaN without a value
    scalar: int  # cases that aren't in closed form, computed one by one
    checked: int  # cases that the scalar physics computed again; none of an FMU
    worst_error: float  # their largest error without unit, in `golf_impact.scales.Scales`


class Chunk(NamedTuple):
    """Results of a chunk of cases."""

    outcome: Outcome
    lines: bytes  # of CSV, if the file is one
    seconds: float  # that it took


def run_chunk(compute: Callable[[Columns], Outcome], as_text: bool, columns: Columns) -> Chunk:
    """Compute some cases, in any process."""
    begin = time.perf_counter()
    outcome = compute(columns)
    lines = csv_lines({**columns, **outcome.columns}, outcome.refused) if as_text else b""
    return Chunk(outcome, lines, time.perf_counter() - begin)


class Sweep:
    """A study, and the physics or the FMU that it runs through, for use in a `with` block.

    UserError if the study doesn't fit these, or into memory.
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
        self.study, self.fmu, self._blocks = study, None, ExitStack()
        if fmu is not None:
            from golf_impact.fmu.impact_fmu import ImpactFmu

            self.fmu = ImpactFmu(Path(fmu))
        variables = PHYSICS if self.fmu is None else self.fmu.variables
        self.plan = make_plan(study, variables)
        self.units = {name: variable.unit for name, variable in variables.items()}

    def __enter__(self) -> "Sweep":
        self.study.columns(np.array([0]))  # draws the samples
        fmu = None if self.fmu is None else self._blocks.enter_context(self.fmu)
        self.compute = partial(impacts, self.plan, fmu=fmu)
        return self

    def __exit__(self, *error: Any) -> None:
        self._blocks.__exit__(*error)

    @property
    def source(self) -> str:
        """What decides the numbers: the version and digest of the physics, or the FMU's GUID."""
        if self.fmu is None:
            return self.plan.identity
        return f"golf-impact {VERSION}, FMU {self.fmu.description.guid}"

    def first_output(self, columns: Columns) -> np.ndarray:
        """The first output of these cases, shape (cases,); NaN without a value."""
        return self.compute(columns).columns[self.study.outputs[0]].astype(float)

    def run(
        self,
        out: Path | str,
        *,
        executor: Executor | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        chunk: int | None = None,
        progress: Callable[[int], None] = lambda done: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> Summary:
        """Write one row a case; arguments, result and errors as of `run_sweep`."""
        out, cases, first_output = Path(out), self.study.cases, self.study.outputs[0]
        limits = ("--chunk", chunk, _LARGEST_CHUNK), ("--workers", workers, _MOST_WORKERS)
        for option, number, most in limits:
            if number is not None and not 1 <= number <= most:
                raise UserError(f"{option} {number} is refused: it must be 1 to {most:,}")
        if self.fmu is not None and (executor or scheduler or (workers or 1) > 1):
            raise UserError(
                "an FMU computes one case after another in this process: leave out --fmu, or "
                "--workers and --scheduler"
            )
        # Two compute and format chunks, while this one checks and writes those before. An FMU has
        # one instance.
        threads = 2 if self.fmu is None else 1
        open_executor = partial(opened, executor, scheduler, workers, threads)
        chunks = self._chunks(open_executor, chunk, out.suffix.lower() == ".csv", stop)
        drawn, check = np.empty(cases), Check(self.study, self.plan)
        refused, scalar, first, done = 0, 0, None, 0
        begin = time.perf_counter()
        with table(out, (*self.study.names, *self.study.outputs)) as write, closing(chunks):
            for columns, (outcome, lines, _) in chunks:
                write({**columns, **outcome.columns}, outcome.refused, lines)
                if self.fmu is None:
                    check.add(done, outcome)
                number = len(outcome.refused)
                of_first = outcome.columns[first_output].astype(float)
                drawn[done : done + number] = np.where(outcome.refused, math.nan, of_first)
                if outcome.reason and first is None:
                    first = done + int(outcome.refused.argmax()) + 1, outcome.reason
                refused += int(outcome.refused.sum())
                scalar += int((outcome.scalar & ~outcome.refused).sum())
                done += number
                progress(done)
            check.finish()
        seconds = time.perf_counter() - begin
        return Summary(
            out, cases, refused, first, seconds, drawn, scalar, check.number, check.worst
        )

    def _chunks(
        self, open_executor: Callable, size: int | None, as_text: bool, stop: Callable[[], bool]
    ) -> Generator[tuple[Columns, Chunk], None, None]:
        """Columns and results of all chunks in order, those of a broken pool by the next one."""
        done, cases, next_size = 0, self.study.cases, size or _FIRST_CHUNK
        at_once = _CHUNKS_IN_FLIGHT if size else 1
        for _ in range(_POOLS):
            begun = done
            #: Begun some time before it is their turn.
            under_way: deque[tuple[Columns, Future[Chunk]]] = deque()
            try:
                with open_executor() as executor:
                    while done < cases:
                        while begun < cases:
                            end = min(begun + next_size, cases)
                            columns = self.study.columns(np.arange(begun, end))
                            future = executor.submit(run_chunk, self.compute, as_text, columns)
                            under_way.append((columns, future))
                            begun = end
                            if len(under_way) >= at_once or begun - done >= _CASES_IN_FLIGHT:
                                break
                        columns, future = under_way[0]
                        while not future.done() and not stop():
                            wait([future], timeout=0.1)
                        if stop():
                            raise Stopped(done)
                        chunk = future.result()
                        under_way.popleft()
                        number, at_once = len(chunk.outcome.refused), _CHUNKS_IN_FLIGHT
                        done += number
                        if size is None:
                            fitting = int(number * _SECONDS / chunk.seconds)
                            next_size = min(max(1, fitting), _LARGEST_CHUNK)
                        yield columns, chunk
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
    study: Study, out: Path | str, *, fmu: Path | str | None = None, **options: Any
) -> Summary:
    """Compute a study by the physics, in arrays, and write one row a case.

    The file is the same to the last bit whatever executor runs the chunks, and whatever their size.
    One case in a thousand, and those of the least and greatest outputs, are computed again by the
    scalar physics, which also computes the cases that have no closed form.

    Args:
        study: what to compute; see `Study.of`.
        out: a .csv or .parquet file. It gets its name when it is complete.
        fmu: an .fmu file to run the cases through instead, one after another in this process.
        options:
            executor: any executor of the interface of concurrent.futures, such as that of a Dask
                client or an MPI pool; its processes need this package in the same version.
            workers: without an executor, the number of processes on this machine; 1 by default,
                which computes in this process. A script that uses more needs
                `if __name__ == "__main__":`, since the processes import it. More are faster only
                where many cases have no closed form.
            scheduler: instead, the address of a Dask cluster ("tcp://host:8786").
            chunk: cases that are computed at a time, at most 32,000; by default so many that they
                take some 0.1 s.
            progress: called with the number of cases done.
            stop: called between chunks; returns whether to end.

    Raises:
        UserError: the study has no such variable, the file can't be written, a check fails,
            workers died again and again or have another version; Dask is missing, or the cluster
            can't be reached or gives up; an FMU together with workers.
        Stopped: `stop` returned True. No file was written; an earlier one is unchanged.
    """
    with Sweep(study, fmu) as sweep:
        return sweep.run(out, **options)
