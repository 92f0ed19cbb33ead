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

from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError
from golf_impact.facts.scales import TOLERANCE
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.runs import HORIZON
from golf_impact.sweeps.checks import deviation
from golf_impact.sweeps.run import Sweep, run_chunk
from golf_impact.sweeps.tables import table
from golf_impact.timing import measure_seconds, median_ratio, run_interleaved

#: Cases of the loop per round.
_LOOPED = 25


class Comparison(NamedTuple):
    """Impacts per second of both, medians of rounds."""

    sweep: float  # in one process, with the file as CSV
    simulate_fmu: float  # the loop, with the FMU extracted and its description read beforehand
    ratio: float  # of the two in the same round
    error: float  # the largest of the loop's numbers beside the physics, without unit

    @property
    def same(self) -> bool:
        """Whether their numbers were the same, but for rounding."""
        return self.error <= TOLERANCE


def compare(sweep: Sweep, fmu: Path, rounds: int = 7, cases: int = 20_000) -> Comparison:
    """Measure both on cases of a study: the same cases, outputs and communication step.

    UserError if all cases tried are refused.
    """
    study, plan = sweep.study, sweep.plan
    # Evenly spaced; if there are fewer, some are repeated.
    number = cases if sweep.fmu is None else 10 * _LOOPED
    columns = study.columns(np.linspace(0, study.cases - 1, number).astype(int))
    values = {name: np.broadcast_to(v, number) for name, v in plan.values(columns).items()}
    outcome = sweep.compute(columns)
    complete = [~np.isnan(column.astype(float)) for column in outcome.columns.values()]
    usable = np.flatnonzero(np.all([~outcome.refused, *complete], axis=0)).tolist()
    if not usable:
        why = f"no case has all outputs {outcome.reason}"
        raise UserError(f"there is nothing to compare: {why}".strip())
    looped = cycle(usable[:: max(1, len(usable) // (4 * _LOOPED))])
    physics, errors = ScalarImpacts(), [0.0]
    description = ImpactFmu(fmu).description
    steps = np.broadcast_to(physics.horizon(values) if values else HORIZON, number)
    with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
        fmpy.extract(str(fmu), f"{folder}/fmu")

        def run_sweep() -> None:
            with table(Path(folder, "sweep.csv"), (*study.names, *plan.outputs)) as write:
                outcome, lines, _ = run_chunk(sweep.compute, True, columns)
                write({**columns, **outcome.columns}, outcome.refused, lines)

        def run_loop() -> None:
            with open(f"{folder}/loop.csv", "w", newline="") as stream:
                writer = csv.writer(stream)
                writer.writerow((*study.names, *plan.outputs))
                for n in islice(looped, _LOOPED):
                    start = {name: row[n].item() for name, row in values.items()}
                    result = fmpy.simulate_fmu(
                        f"{folder}/fmu",
                        stop_time=steps[n],
                        output_interval=steps[n],
                        start_values=start,
                        output=plan.outputs,
                        model_description=description,
                    )
                    row = {name: result[name][-1].item() for name in plan.outputs}
                    writer.writerow((*start.values(), *row.values()))
                    loop.append((start, row))

        loop: list[tuple[dict[str, float], dict[str, float]]] = []
        jobs = {
            "sweep": lambda: measure_seconds(run_sweep, number),
            "loop": lambda: measure_seconds(run_loop, _LOOPED),
        }
        times = run_interleaved(jobs, rounds)
    errors += [deviation(physics, *of_case)[0] for of_case in loop[: 4 * _LOOPED]]
    ratio = median_ratio(times["loop"], times["sweep"])
    return Comparison(1.0 / median(times["sweep"]), 1.0 / median(times["loop"]), ratio, max(errors))
