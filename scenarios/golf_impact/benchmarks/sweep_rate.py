"""Impacts per second of a sweep into CSV: by arrays, by workers, through the FMU, by simulate_fmu.

Law 1, S, COR and E over k: what the other benchmarks of an impact read. Workers compute cases that
have no closed form. They are started beforehand; every way writes its file in every round.
"""

import tempfile
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from statistics import median

from golf_impact.benchmarks.impact import METRICS, impact_of, repeated
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.sweeps.comparison import LOOPED, Loop
from golf_impact.sweeps.executors import process_pool
from golf_impact.sweeps.run import Sweep
from golf_impact.sweeps.study import Study
from golf_impact.timing import Job, measure_seconds, median_ratio, run_interleaved


def rates(fmu: Path, quick: bool) -> dict[str, float]:
    """Rates (1/s) and ratios by key, medians of rounds."""
    cases, damped, rounds = (400_000, 500, 3) if quick else (400_000, 2000, 7)
    # At damping ratios of about 5.
    heavy = {"law": 2, "k": f"0.9e6:1.1e6:{damped}", "b": 2000}
    with ExitStack() as stack:
        sweep, scalar = (
            stack.enter_context(Sweep(Study.of(sets, METRICS)))
            for sets in ({"law": 1, "k": f"0.9e6:1.1e6:{cases}"}, heavy)
        )
        # In a folder of its own each, so that neither library is loaded by the other's instances.
        loaded, simulated = (stack.enter_context(LoadedFmu(fmu)) for _ in range(2))
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-"))
        jobs: dict[str, Job] = {
            "arrays": partial(measure_seconds, partial(sweep.run, f"{folder}/arrays.csv"), cases),
            "fmu": repeated(impact_of(loaded, METRICS, law=1), 2000),
            "simulate_fmu": partial(measure_seconds, Loop(sweep, simulated).run, LOOPED),
        }
        ways = {"one_process": None, "two_workers": stack.enter_context(process_pool(2))}
        for name, executor in ways.items():
            # The chunks are small enough that both workers end at nearly the same time.
            work = partial(scalar.run, f"{folder}/{name}.csv", executor=executor, chunk=100)
            jobs[name] = partial(measure_seconds, work, damped)
        times = run_interleaved(jobs, rounds)
    return {
        **{f"sweep_impacts_per_second_{name}": 1.0 / median(times[name]) for name in jobs},
        "sweep_speedup_over_fmu": median_ratio(times["fmu"], times["arrays"]),
        "sweep_speedup_over_simulate_fmu": median_ratio(times["simulate_fmu"], times["arrays"]),
        "sweep_two_workers_over_one": median_ratio(times["one_process"], times["two_workers"]),
    }
