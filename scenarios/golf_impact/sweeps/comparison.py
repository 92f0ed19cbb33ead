"""Rates of a sweep and of a loop over fmpy.simulate_fmu, measured in turns in one run."""

from __future__ import annotations

from itertools import cycle, islice
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np

from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.sweeps.checks import deviations
from golf_impact.sweeps.run import Sweep, run_chunk
from golf_impact.sweeps.tables import table
from golf_impact.timing import measure_seconds, median_ratio, run_interleaved

#: Cases of the sweep per round, if all are in closed form and otherwise; and of the loop.
_CASES, _SLOW, _LOOPED = 100_000, 500, 25


class Comparison(NamedTuple):
    """Impacts per second of both, medians of rounds."""

    sweep: float  # in one process, with the file as CSV
    simulate_fmu: float  # the loop, with the FMU extracted and its description read beforehand
    ratio: float  # of the two in the same round
    error: float  # the loop's largest deviation from the physics, without unit, in `Scales`


def compare(sweep: Sweep, fmu: Path, rounds: int = 7) -> Comparison:
    """Measure both on cases of a study: the same cases, outputs and communication step.

    UserError if all cases tried are refused.
    """
    study, outputs = sweep.study, sweep.plan.outputs
    for number in (_SLOW, _CASES):
        # Evenly spaced; if there are fewer, some are repeated.
        columns = study.columns(np.linspace(0, study.cases - 1, number).astype(int))
        outcome = sweep.compute(columns)
        if outcome.scalar.any():
            break
    usable = np.all([column == column for column in outcome.columns.values()], axis=0)
    cases = np.flatnonzero(usable & ~outcome.refused)
    if not len(cases):
        raise UserError(f"there is nothing to compare: no case has all outputs {outcome.reason}")
    # The loop's cases, the same in each round.
    cases = np.array([*islice(cycle(cases[:: max(1, len(cases) // _LOOPED)]), _LOOPED)])
    looped = sweep.plan.values({name: column[cases] for name, column in columns.items()})
    looped = {name: np.broadcast_to(value, _LOOPED).tolist() for name, value in looped.items()}
    steps = np.broadcast_to(ScalarImpacts().horizon(looped), _LOOPED).tolist()
    results = {name: np.empty(_LOOPED) for name in outputs}
    with LoadedFmu(fmu) as loaded:

        def run_sweep() -> None:
            with table(Path(loaded.folder, "sweep.csv"), (*study.names, *outputs)) as write:
                outcome, lines, _ = run_chunk(sweep.compute, True, columns)
                write({**columns, **outcome.columns}, outcome.refused, lines)

        def run_loop() -> None:
            for n, (step, *row) in enumerate(zip(steps, *looped.values())):
                times = {"stop_time": step, "output_interval": step}
                values = dict(zip(looped, row))
                for name, value in loaded.simulate(outputs, start_values=values, **times).items():
                    results[name][n] = value

        jobs = {
            "sweep": lambda: measure_seconds(run_sweep, number),
            "loop": lambda: measure_seconds(run_loop, _LOOPED),
        }
        times = run_interleaved(jobs, rounds)
    error = max(case.error for case in deviations(looped, results, np.zeros(_LOOPED, bool)))
    ratio = median_ratio(times["loop"], times["sweep"])
    return Comparison(1.0 / median(times["sweep"]), 1.0 / median(times["loop"]), ratio, error)
