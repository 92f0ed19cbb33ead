"""Impacts per second of a sweep into CSV: one process, two, a Dask cluster here, and simulate_fmu.

Law 1, S, COR and E over k: what the other benchmarks of an impact read. Processes and cluster are
started beforehand; every way writes its file in every round, in turns.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

from golf_scenarios.benchmarks.speedup import METRICS
from golf_scenarios.benchmarks.timing import Job, interleaved, median_ratio, undisturbed
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.sweeps.chunk import FmuFile, computed, run_chunk
from golf_scenarios.sweeps.cluster import connected
from golf_scenarios.sweeps.comparison import compare
from golf_scenarios.sweeps.plan import plan
from golf_scenarios.sweeps.pool import WorkerProcesses
from golf_scenarios.sweeps.run import Submit, at_once, write_sweep
from golf_scenarios.sweeps.study import Study
from golf_scenarios.sweeps.target import Target

#: Small enough that both workers end at nearly the same time.
_CHUNK = 1000


def measure(fmu: Path, quick: bool, tick: Callable[[], None]) -> dict[str, float]:
    """Rates (1/s) and ratios by key, medians of rounds.

    Args:
        fmu: ClubBallImpact.fmu.
        quick: fewer cases and rounds.
        tick: called after each round.
    """
    cases, rounds = (10_000, 3) if quick else (40_000, 9)
    study = Study.of({"law": 1, "k": f"0.9e6:1.1e6:{cases}"}, METRICS)
    beside_loop = compare(study, fmu, rounds, tick)
    file = FmuFile.read(fmu)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-")))
        instance = stack.enter_context(ImpactFmu(fmu))
        pool = stack.enter_context(WorkerProcesses(2, file))
        client = stack.enter_context(connected("local", 2))
        executor = client.get_executor()
        stack.callback(executor.shutdown, wait=False)
        sent = client.submit(FmuFile, file.digest, file.data)
        ways: dict[str, Submit] = {
            "one_process": partial(at_once, partial(computed, instance)),
            "two_workers": _through(pool, file.name_only),
            "dask_local": _through(executor, sent),
        }
        jobs = {
            name: _job(study, instance, folder / f"{name}.csv", submit)
            for name, submit in ways.items()
        }
        for job in jobs.values():
            # Until every worker has an instance.
            job()
        with undisturbed():
            times = interleaved(jobs, rounds, tick)
    found = {
        f"sweep_impacts_per_second_{name}": 1.0 / sorted(seconds)[len(seconds) // 2]
        for name, seconds in times.items()
    }
    return found | {
        "sweep_impacts_per_second_simulate_fmu": beside_loop.simulate_fmu,
        "sweep_speedup_over_simulate_fmu": beside_loop.ratio,
        "sweep_two_workers_over_one": median_ratio(times["one_process"], times["two_workers"]),
        "sweep_dask_local_over_one": median_ratio(times["one_process"], times["dask_local"]),
    }


def _through(executor: Executor, fmu: Any) -> Submit:
    return partial(executor.submit, run_chunk, fmu)  # type: ignore[call-arg]


def _job(study: Study, instance: ImpactFmu, path: Path, submit: Submit) -> Job:
    made = plan(study, instance.variables)

    def job() -> float:
        begin = perf_counter()
        with Target(path, study, made) as target:
            write_sweep(study, made, target, submit, _CHUNK, lambda done: None, lambda: False)
        return (perf_counter() - begin) / study.cases

    return job
