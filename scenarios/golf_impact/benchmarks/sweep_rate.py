"""Impacts per second of a sweep into CSV: one process, two, a Dask cluster here, and simulate_fmu.

Law 1, S, COR and E over k: what the other benchmarks of an impact read. Processes and cluster are
started beforehand; every way writes its file in every round, in turns.
"""

import tempfile
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from statistics import median

from golf_impact.benchmarks.impact import METRICS
from golf_impact.sweeps.comparison import compare
from golf_impact.sweeps.executors import Here, dask_executor, process_pool
from golf_impact.sweeps.run import Sweep
from golf_impact.sweeps.study import Study
from golf_impact.timing import measure_seconds, median_ratio, run_interleaved


def rates(fmu: Path, quick: bool) -> dict[str, float]:
    """Rates (1/s) and ratios by key, medians of rounds."""
    cases, rounds = (10_000, 3) if quick else (40_000, 9)
    study = Study.of({"law": 1, "k": f"0.9e6:1.1e6:{cases}"}, METRICS)
    with ExitStack() as stack:
        sweep = stack.enter_context(Sweep(study, fmu))
        beside_loop = compare(sweep, rounds)
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-"))
        ways = {
            "one_process": Here(),
            "two_workers": stack.enter_context(process_pool(2)),
            "dask_local": stack.enter_context(dask_executor("local", 2)),
        }
        jobs = {}
        for name, executor in ways.items():
            # The chunks are small enough that both workers end at nearly the same time.
            work = partial(sweep.run, f"{folder}/{name}.csv", executor=executor, chunk=1000)
            jobs[name] = partial(measure_seconds, work, cases)
        times = run_interleaved(jobs, rounds)
    return {
        **{f"sweep_impacts_per_second_{name}": 1.0 / median(times[name]) for name in ways},
        "sweep_impacts_per_second_simulate_fmu": beside_loop.simulate_fmu,
        "sweep_speedup_over_simulate_fmu": beside_loop.ratio,
        "sweep_two_workers_over_one": median_ratio(times["one_process"], times["two_workers"]),
        "sweep_dask_local_over_one": median_ratio(times["one_process"], times["dask_local"]),
    }
