"""A loop over fmpy.simulate_fmu on some cases of a sweep: its rate, and how its numbers compare."""

from pathlib import Path
from statistics import median

import numpy as np

from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.sweeps.checks import deviations
from golf_impact.sweeps.run import Sweep
from golf_impact.timing import measure_seconds

#: Cases of the sweep from which those of the loop are chosen, evenly spaced.
_TRIED, LOOPED = 500, 25


class Loop:
    """So many cases of a sweep, one after another by fmpy.simulate_fmu.

    Each in one communication step; the FMU is extracted and its description read beforehand.
    UserError if all cases tried are refused.
    """

    def __init__(self, sweep: Sweep, fmu: LoadedFmu) -> None:
        columns = sweep.study.columns(np.linspace(0, sweep.study.cases - 1, _TRIED).astype(int))
        outcome = sweep.compute(columns)
        usable = np.all([column == column for column in outcome.columns.values()], axis=0)
        cases = np.flatnonzero(usable & ~outcome.refused)
        if not len(cases):
            raise UserError(f"nothing to compare: no case has all outputs {outcome.reason}")
        # If there are fewer, some are repeated.
        cases = np.resize(cases[:: max(1, len(cases) // LOOPED)], LOOPED)
        values = sweep.plan.values({name: column[cases] for name, column in columns.items()})
        self.fmu, self.outputs = fmu, sweep.plan.outputs
        self.values = {n: np.broadcast_to(v, LOOPED).tolist() for n, v in values.items()}
        self.cases = [dict(zip(values, row)) for row in zip(*self.values.values())]
        runs = ScalarImpacts()
        self.steps = [runs.run_to_end(runs.horizon(case).item(), case) for case in self.cases]
        self.results = {name: np.empty(LOOPED) for name in self.outputs}

    def run(self) -> None:
        for n, (step, case) in enumerate(zip(self.steps, self.cases)):
            options = {"stop_time": step, "output_interval": step, "start_values": case}
            for name, value in self.fmu.simulate(self.outputs, **options).items():
                self.results[name][n] = value


def compare(sweep: Sweep, fmu: Path, rounds: int = 3) -> tuple[float, float]:
    """Such a loop on cases of a sweep: impacts per second, a median, and its largest deviation.

    The deviation is from the scalar physics, without unit, in `Scales`.
    """
    with LoadedFmu(fmu) as loaded:
        loop = Loop(sweep, loaded)
        seconds = median(measure_seconds(loop.run, LOOPED) for _ in range(rounds))
    cases = deviations(loop.values, loop.results, np.zeros(LOOPED, bool))
    return 1.0 / seconds, max(case.error for case in cases)
