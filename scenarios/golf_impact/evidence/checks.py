"""Checks of an impact through the FMU, by any steps: arithmetic of 80 digits, restored states."""

import random
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from golf_impact.data.runs import FLAGS, REALS
from golf_impact.evidence.random_impacts import ImpactCase, Step
from golf_impact.evidence.reference import Reference
from golf_impact.evidence.scales import Scales
from golf_impact.fmu import Impact

#: The name of a check, the output, the number of steps, and the error without unit.
Error = tuple[str, str, int, float]


def check(impact: Impact, case: ImpactCase, rng: random.Random) -> Iterator[Error]:
    """Errors of all outputs by each pattern of steps, at some of their ends and the last.

    Momentum and energy need no checks of their own: the reference has them.
    FMICallException is raised if the FMU refuses a step.
    """
    values = {**case.values, "start_time": case.start_time}
    reference = Reference(values, case.changes)
    final = reference.outputs(case.end)
    scales = Scales(values, final, case.approach, case.end, case.changes)
    for pattern, steps in case.patterns(float(final["contact_time"]), rng).items():
        number, sizes = len(steps), [step.length for step in steps]
        times, path = np.cumsum(sizes), run(impact, case, steps)
        impulse = np.dot(path["mean_force"], sizes)
        yield pattern, "mean_force", number, scales.error("impulse", impulse, final["impulse"])
        for row in {*rng.sample(range(number), min(number, 3)), number - 1}:
            for name, expected in reference.outputs(times[row]).items():
                yield pattern, name, number, scales.error(name, path[name][row], expected)
        yield "state", "", number, path["changed"].max()


def run(impact: Impact, case: ImpactCase, steps: Sequence[Step]) -> Mapping[str, np.ndarray]:
    """Every output after each step, and by how much one of them changes from a restored state.

    The state is that in the middle of the run.
    """
    slave, half = impact.instance, len(steps) // 2
    impact.start(case.start_time, **case.values)
    begun = follow(impact, case.start_time, steps[:half])
    state, time = slave.getFMUstate(), sum((step.length for step in steps[:half]), case.start_time)
    rest = follow(impact, time, steps[half:])
    slave.setFMUstate(state)
    again = follow(impact, time, steps[half:])
    slave.freeFMUstate(state)
    rows = np.array(begun + rest)
    changed = np.abs(rows - np.array(begun + again)).max(axis=1)
    return dict(zip((*REALS, *FLAGS, "changed"), [*rows.T, changed]))


def follow(impact: Impact, time: float, steps: Sequence[Step]) -> list[list[float]]:
    """Every output after each of these steps from a time (s) on."""
    slave, at = impact.instance, impact.references
    inputs, reals, flags = ([at[n] for n in names] for names in (Step._fields[1:], REALS, FLAGS))
    rows = []
    for length, *values in steps:
        slave.setReal(inputs, values)
        slave.doStep(time, length)
        time += length
        rows.append([*slave.getReal(reals), *slave.getBoolean(flags)])
    return rows
