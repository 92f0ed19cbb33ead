"""A sweep's rate beside that of a loop over fmpy.simulate_fmu, measured in turns in one run."""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import fmpy
import numpy as np

from golf_scenarios.benchmarks.timing import interleaved, median_ratio, undisturbed
from golf_scenarios.errors import UserError
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.sweeps.chunk import computed
from golf_scenarios.sweeps.impacts import horizon, impacts
from golf_scenarios.sweeps.plan import Plan, plan
from golf_scenarios.sweeps.study import Study
from golf_scenarios.sweeps.target import Csv, Target

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


def compare(
    study: Study, fmu: Path, rounds: int = 7, tick: Callable[[], None] = lambda: None
) -> Comparison:
    """Measure both on cases of a study: the same cases, outputs and communication step.

    Args:
        study: its cases, taken evenly from all.
        fmu: the .fmu file.
        rounds: of which the medians are taken.
        tick: called after each round.

    Raises:
        UserError: the FMU refuses all cases tried.
    """
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-")))
        instance = stack.enter_context(ImpactFmu(fmu))
        made = plan(study, instance.variables)
        sweep = _Sweep(study, made, instance, folder / "sweep.csv")
        loop = _Loop(sweep, folder)
        with undisturbed():
            times = interleaved({"sweep": sweep, "loop": loop}, rounds, tick)
    middle = {name: sorted(seconds)[len(seconds) // 2] for name, seconds in times.items()}
    return Comparison(
        sweep=1.0 / middle["sweep"],
        simulate_fmu=1.0 / middle["loop"],
        ratio=median_ratio(times["loop"], times["sweep"]),
        same=loop.same,
    )


class _Sweep:
    """A sweep of some cases in an instance at hand, into a file; called, it times itself."""

    def __init__(self, study: Study, made: Plan, instance: ImpactFmu, path: Path) -> None:
        self.study, self.plan, self.instance, self.path = study, made, instance, path
        index = np.arange(_CASES)
        # Evenly from all; where there are fewer, again and again.
        self.index = index * study.cases // _CASES if study.cases > _CASES else index % study.cases

    def __call__(self) -> float:
        begin = perf_counter()
        columns = self.study.columns_at(self.index)
        with Target(self.path, self.study, self.plan) as target:
            target.write(columns, computed(self.instance, self.plan, Csv.form(self.plan), columns))
        return (perf_counter() - begin) / len(self.index)


class _Loop:
    """The same through simulate_fmu, a few cases per call."""

    def __init__(self, sweep: _Sweep, folder: Path) -> None:
        self.same = True
        self._sweep = sweep
        self._file = folder / "loop.csv"
        self._fmu = str(folder / "fmu")
        fmpy.extract(str(sweep.instance.path), self._fmu)
        values = sweep.plan.values(sweep.study.columns_at(sweep.index))
        found = impacts(sweep.instance, sweep.plan, values)
        usable = np.setdiff1d(np.arange(len(sweep.index)), found.refused)
        if not len(usable):
            raise UserError(f"there is nothing to compare: the FMU refuses all: {found.reason}")
        steps = horizon(sweep.instance, sweep.plan.fixed, values, len(sweep.index)).tolist()
        #: Start values, communication step and the sweep's outputs, case by case.
        self._cases: list[tuple[dict[str, Any], float, list[float]]] = [
            (
                sweep.plan.fixed | {name: column[n].item() for name, column in values.items()},
                steps[n],
                found.outputs[n].tolist(),
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
                    model_description=self._sweep.instance.description,
                )
                row = [result[name][-1].item() for name in outputs]
                writer.writerow((*values.values(), *row))
                rows.append((row, expected))
        seconds = perf_counter() - begin
        self.same = self.same and all(row == expected for row, expected in rows)
        return seconds / _LOOPED
