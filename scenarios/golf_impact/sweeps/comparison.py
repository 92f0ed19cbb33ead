"""Rates of a sweep and of a loop over fmpy.simulate_fmu, measured in turns in one run."""

from __future__ import annotations

import csv
import tempfile
from itertools import cycle, islice
from pathlib import Path
from statistics import median
from typing import NamedTuple

import fmpy
import numpy as np

from golf_impact.errors import UserError
from golf_impact.sweeps.impacts import impacts, run_chunk
from golf_impact.sweeps.run import Sweep
from golf_impact.timing import measure_seconds, median_ratio, run_interleaved

#: Cases of the sweep per round, and of the loop, which takes about as long for them.
_CASES, _LOOPED = 2000, 25


class Comparison(NamedTuple):
    """Impacts per second of both, medians of rounds."""

    sweep: float  # in one process, with the file as CSV
    simulate_fmu: float  # the loop, with the FMU extracted and its description read beforehand
    ratio: float  # of the two in the same round
    same: bool  # whether their numbers were the same to the last bit


def compare(sweep: Sweep, rounds: int = 7) -> Comparison:
    """Measure both on cases of a study: the same cases, outputs and communication step.

    UserError if the FMU refuses all cases tried.
    """
    study, plan = sweep.study, sweep.plan
    # Evenly spaced; if there are fewer, some are repeated.
    columns = study.columns(np.linspace(0, study.cases - 1, _CASES).astype(int))
    values = plan.values(columns)
    expected, _, reason = impacts(plan, columns)
    usable = np.flatnonzero(~np.isnan(expected).any(axis=1)).tolist()
    if not usable:
        raise UserError(f"there is nothing to compare: no case has all outputs {reason}".strip())
    steps = np.broadcast_to(sweep.fmu.horizon({**plan.fixed, **values}), _CASES)
    cases = cycle(usable[:: max(1, len(usable) // (4 * _LOOPED))])
    same = True
    with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
        fmpy.extract(str(sweep.fmu.path), f"{folder}/fmu")

        def run_sweep() -> None:
            with sweep.table(Path(folder, "sweep.csv")) as write:
                text, results = run_chunk(plan, True, columns)
                write(columns, text, results.outputs)

        def run_loop() -> None:
            nonlocal same
            with open(f"{folder}/loop.csv", "w", newline="") as stream:
                writer = csv.writer(stream)
                writer.writerow((*study.names, *plan.outputs))
                for n in islice(cases, _LOOPED):
                    start = plan.fixed | {name: row[n].item() for name, row in values.items()}
                    result = fmpy.simulate_fmu(
                        f"{folder}/fmu",
                        stop_time=steps[n],
                        output_interval=steps[n],
                        start_values=start,
                        output=plan.outputs,
                        model_description=sweep.fmu.description,
                    )
                    row = [result[name][-1].item() for name in plan.outputs]
                    writer.writerow((*start.values(), *row))
                    same &= row == expected[n].tolist()

        jobs = {
            "sweep": lambda: measure_seconds(run_sweep, _CASES),
            "loop": lambda: measure_seconds(run_loop, _LOOPED),
        }
        times = run_interleaved(jobs, rounds)
    ratio = median_ratio(times["loop"], times["sweep"])
    return Comparison(1.0 / median(times["sweep"]), 1.0 / median(times["loop"]), ratio, same)
