"""A sweep's rate beside that of a loop over fmpy.simulate_fmu, measured in turns in one run."""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import fmpy
import numpy as np

from golf_scenarios.errors import UserError
from golf_scenarios.sweeps.impacts import impacts
from golf_scenarios.sweeps.run import Sweep
from golf_scenarios.sweeps.table_file import table_file
from golf_scenarios.timing import interleaved, median_ratio

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

    The cases are taken evenly from all.

    Raises:
        UserError: the FMU refuses all cases tried.
    """
    index = np.arange(_CASES)
    cases = sweep.study.cases
    # Evenly from all; where there are fewer, again and again.
    index = index * cases // _CASES if cases > _CASES else index % cases
    with tempfile.TemporaryDirectory(prefix="golf-impact-") as folder:

        def swept() -> float:
            begin = perf_counter()
            columns = sweep.study.columns_at(index)
            with table_file(Path(folder, "sweep.csv"), sweep.study, sweep.plan) as table:
                table.write(columns, sweep.here(True, columns).result())
            return (perf_counter() - begin) / len(index)

        loop = _Loop(sweep, index, Path(folder))
        times = interleaved({"sweep": swept, "loop": loop}, rounds, tick)
    return Comparison(
        sweep=1.0 / median(times["sweep"]),
        simulate_fmu=1.0 / median(times["loop"]),
        ratio=median_ratio(times["loop"], times["sweep"]),
        same=loop.same,
    )


class _Loop:
    """The same through simulate_fmu, a few cases per call."""

    def __init__(self, sweep: Sweep, index: np.ndarray, folder: Path) -> None:
        self.same = True
        self._sweep, self._folder = sweep, folder
        fmpy.extract(str(sweep.fmu.path), str(folder / "fmu"))
        values = sweep.plan.values(sweep.study.columns_at(index))
        expected, reason = impacts(sweep.instance, sweep.plan, values)
        usable = np.flatnonzero(~np.isnan(expected[:, 0]))
        if not len(usable):
            raise UserError(f"there is nothing to compare: the FMU refuses all: {reason}")
        steps = np.broadcast_to(sweep.fmu.horizon({**sweep.plan.fixed, **values}), len(index))

        def case(n: int) -> tuple[dict[str, Any], float, list[float]]:
            """Start values, communication step and the sweep's outputs."""
            given = {name: column[n].item() for name, column in values.items()}
            return sweep.plan.fixed | given, steps[n].item(), expected[n].tolist()

        self._cases = cycle([case(n) for n in usable[:: max(1, len(usable) // (4 * _LOOPED))]])

    def __call__(self) -> float:
        outputs = self._sweep.plan.outputs
        begin = perf_counter()
        with open(self._folder / "loop.csv", "w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow((*self._sweep.study.names, *outputs))
            for values, step, expected in islice(self._cases, _LOOPED):
                result = fmpy.simulate_fmu(
                    str(self._folder / "fmu"),
                    stop_time=step,
                    output_interval=step,
                    start_values=values,
                    output=outputs,
                    model_description=self._sweep.fmu.description,
                )
                row = [result[name][-1].item() for name in outputs]
                writer.writerow((*values.values(), *row))
                self.same &= row == expected
        return (perf_counter() - begin) / _LOOPED
