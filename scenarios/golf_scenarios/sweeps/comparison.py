"""A sweep's rate beside that of a loop over fmpy.simulate_fmu, measured in turns in one run."""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import fmpy
import numpy as np

from golf_scenarios.errors import UserError
from golf_scenarios.sweeps.impacts import horizon, impacts
from golf_scenarios.sweeps.run import Sweep
from golf_scenarios.sweeps.table_file import Csv, TableFile
from golf_scenarios.timing import interleaved, median_ratio, undisturbed

#: Cases of the sweep per round, and of the loop, which takes about as long for them.
_CASES, _LOOPED = 2000, 25


@dataclass(frozen=True)
class Comparison:
    """Impacts per second of both, and their ratio: medians of rounds.

    Attributes:
        sweep: in one process, with the file as CSV.
        simulate_fmu: the loop, with the FMU extracted and its description read beforehand.
        ratio: of the two in the same round.
        same: whether the loop's numbers were the sweep's to the last bit.
    """

    sweep: float
    simulate_fmu: float
    ratio: float
    same: bool


def compare(sweep: Sweep, rounds: int = 7, tick: Callable[[], None] = lambda: None) -> Comparison:
    """Measure both on cases of a study: the same cases, outputs and communication step.

    Args:
        sweep: its cases are taken evenly from all.
        rounds: of which the medians are taken.
        tick: called after each round.

    Raises:
        UserError: the FMU refuses all cases tried.
    """
    index = np.arange(_CASES)
    cases = sweep.study.cases
    # Evenly from all; where there are fewer, again and again.
    index = index * cases // _CASES if cases > _CASES else index % cases
    with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:
        file = Path(folder, "sweep.csv")

        def swept() -> float:
            begin = perf_counter()
            columns = sweep.study.columns_at(index)
            with TableFile(file, sweep.study, sweep.plan) as table:
                table.write(columns, sweep.here(Csv.form(sweep.plan), columns).result())
            return (perf_counter() - begin) / len(index)

        loop = _Loop(sweep, index, Path(folder))
        with undisturbed():
            times = interleaved({"sweep": swept, "loop": loop}, rounds, tick)
    middle = {name: sorted(seconds)[len(seconds) // 2] for name, seconds in times.items()}
    return Comparison(
        sweep=1.0 / middle["sweep"],
        simulate_fmu=1.0 / middle["loop"],
        ratio=median_ratio(times["loop"], times["sweep"]),
        same=loop.same,
    )


class _Loop:
    """The same through simulate_fmu, a few cases per call."""

    def __init__(self, sweep: Sweep, index: np.ndarray, folder: Path) -> None:
        self.same = True
        self._sweep = sweep
        self._file = folder / "loop.csv"
        self._fmu = str(folder / "fmu")
        fmpy.extract(str(sweep.fmu.path), self._fmu)
        values = sweep.plan.values(sweep.study.columns_at(index))
        swept = impacts(sweep.instance, sweep.plan, values)
        usable = np.setdiff1d(np.arange(len(index)), swept.refused)
        if not len(usable):
            raise UserError(f"there is nothing to compare: the FMU refuses all: {swept.reason}")
        steps = horizon(sweep.instance, sweep.plan.fixed, values, len(index)).tolist()
        #: Start values, communication step and the sweep's outputs, case by case.
        self._cases: list[tuple[dict[str, Any], float, list[float]]] = [
            (
                sweep.plan.fixed | {name: column[n].item() for name, column in values.items()},
                steps[n],
                swept.outputs[n].tolist(),
            )
            for n in usable
        ]
        self._next = 0

    def __call__(self) -> float:
        begin = perf_counter()
        outputs = self._sweep.plan.outputs
        rows = []
        with open(self._file, "w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow((*self._cases[0][0], *outputs))
            for _ in range(_LOOPED):
                values, step, expected = self._cases[self._next % len(self._cases)]
                self._next += max(1, len(self._cases) // (4 * _LOOPED))
                result = fmpy.simulate_fmu(
                    self._fmu,
                    stop_time=step,
                    output_interval=step,
                    start_values=values,
                    output=outputs,
                    model_description=self._sweep.fmu.description,
                )
                row = [result[name][-1].item() for name in outputs]
                writer.writerow((*values.values(), *row))
                rows.append((row, expected))
        seconds = perf_counter() - begin
        self.same = self.same and all(row == expected for row, expected in rows)
        return seconds / _LOOPED
