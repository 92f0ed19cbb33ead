"""Checks of an impact through the FMU, for any inputs and steps: invariants, and 80 digits."""

import math
import random
from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate

import numpy as np

from golf_impact.data.runs import FLAGS, REALS
from golf_impact.evidence.random_impacts import ImpactCase, Step
from golf_impact.evidence.reference import Reference
from golf_impact.evidence.scales import Scales
from golf_impact.fmu import Impact

INPUTS = Step._fields[1:]

#: Outputs that never fall.
RISING = ("contact_time", "max_force", "time_of_max_force", "max_compression", "impulse")

#: Every output after each step, by name.
Path = Mapping[str, np.ndarray]

#: The name of a check, the output, the number of steps, and the error without unit.
Error = tuple[str, str, int, float]


def check(
    impact: Impact, case: ImpactCase, rng: random.Random, exact: bool = False, equal: int = 64
) -> Iterator[Error]:
    """Errors of an impact by several patterns of steps; `exact`: from the reference, too.

    FMICallException: the FMU refuses a step.
    """
    one_step = case.steps()
    final = {name: x[-1] for name, x in run(impact, case, one_step).items()}
    values = {**case.values, "start_time": case.start_time}
    scales = Scales(values, final, case.approach, case.end, case.changes)
    begins = accumulate(step.length for step in one_step[:-1])
    changes = zip(begins, (dict(zip(INPUTS, step[1:])) for step in one_step[1:]))
    reference = Reference(values, changes) if exact else None
    for pattern, steps in case.patterns(final["contact_time"], rng, equal):
        path, number = run(impact, case, steps), len(steps)
        yield "momentum", "momentum", number, momentum_error(case, steps, path, scales)
        yield "energy", "kinetic_energy", number, energy_error(case, steps, path, scales)
        yield "order", "", number, order_error(path, scales)
        for name in final.keys() - {"mean_force"}:  # that of the last step
            value = bool(final[name]) if name in FLAGS else final[name]
            yield "patterns", name, number, scales.error(name, path[name][-1], value)
        if pattern == "random":
            yield "state", "", number, state_error(impact, case, steps)
        if reference:
            yield from reference_errors(reference, steps, path, scales)


def run(impact: Impact, case: ImpactCase, steps: Sequence[Step]) -> Path:
    """The whole run by these steps."""
    impact.start(case.start_time, **case.values)
    return follow(impact, case.start_time, steps)


def follow(impact: Impact, time: float, steps: Sequence[Step]) -> Path:
    """Every output after each of these steps from a time (s) on."""
    slave, at = impact.instance, impact.references
    inputs, reals, flags = ([at[name] for name in names] for names in (INPUTS, REALS, FLAGS))
    rows = []
    for length, *values in steps:
        slave.setReal(inputs, values)
        slave.doStep(time, length)
        time += length
        rows.append([*slave.getReal(reals), *slave.getBoolean(flags)])
    return dict(zip((*REALS, *FLAGS), np.array(rows, float).T))


def momentum_error(case: ImpactCase, steps: Sequence[Step], path: Path, scales: Scales) -> float:
    """The largest error of the balance of momentum, over masses times speeds.

    Momentum changes by the force on the head from touch on, and under law 1 by the drag in contact,
    b times the way of each body. Mean forces times steps add up to the impulse.
    """
    v, (sizes, _, b, force) = case.values, np.array(steps).T
    push = np.cumsum(force * np.clip(np.cumsum(sizes) - case.approach, 0.0, sizes))
    drag = np.zeros_like(push)
    if v["law"] == 1:
        ball = np.diff(path["contact_displacement"], prepend=0.0)
        closer = np.diff(path["compression"] * path["in_contact"], prepend=0.0)
        drag = np.cumsum(b * (2.0 * ball + closer))
    start = v["m_club"] * v["club_speed"] + v["m_ball"] * v["ball_speed"]
    # As in `Scales`: the instant of touch is rounded, and the place.
    rounding = 4e-16 * case.approach * np.max(np.abs(force) + 2.0 * b * scales.of("ball_velocity"))
    scale = scales.of("momentum") + np.max(np.abs(push))
    error = np.max(np.abs(path["momentum"] - start - push + drag) - rounding) / scale
    impulse = abs(np.sum(path["mean_force"] * sizes) - path["impulse"][-1])
    missing = impulse / (scales.of("impulse") or 1.0) - scales.rounding_of_time("mean_force")
    return float(max(0.0, error, missing))


def energy_error(case: ImpactCase, steps: Sequence[Step], path: Path, scales: Scales) -> float:
    """By how much the energy rises in a step beyond the work done on the head, over the largest.

    It is kinetic and, in contact, that of the spring with the k of the step. Without damping, it
    may not fall, either.
    """
    v, (_, k, b, force) = case.values, np.array(steps).T
    spring = 0.5 * (path["compression"] * path["in_contact"]) ** 2
    touch, kinetic = v["ball_speed"] * case.approach, path["kinetic_energy"]
    moved = np.diff(np.where(path["touched"], path["club_position"], touch), prepend=touch)
    start = 0.5 * (v["m_club"] * v["club_speed"] ** 2 + v["m_ball"] * v["ball_speed"] ** 2)
    before = np.append(start, kinetic[:-1]) + k * np.append(0.0, spring[:-1])
    after, work = kinetic + k * spring, force * moved
    # As in `Scales`: the place of touch is rounded.
    rounding = 4e-16 * case.approach * scales.of("club_velocity") * np.max(np.abs(force))
    rise = after - before - work
    error = np.max(np.where(b == 0.0, np.abs(rise), rise)) - rounding
    return float(max(0.0, error) / np.max(after + np.abs(work) + start))


def order_error(path: Path, scales: Scales) -> float:
    """How far forces are outside of 0 to `max_force`, and results so far fall, on their scales.

    Infinity if an output isn't finite, or if touched, in_contact and separated don't follow each
    other.
    """
    force, touched, separated = path["force"], path["touched"], path["separated"]
    in_contact = touched > separated
    ordered = np.array_equal(path["in_contact"], in_contact) and not force[~in_contact].any()
    ordered = ordered and min(np.diff([touched, separated]).flat, default=0.0) >= 0.0
    if not (ordered and np.isfinite([*path.values()]).all()):
        return math.inf
    worst = np.max(np.maximum(-force, force - path["max_force"])) / (scales.of("force") or 1.0)
    # Just at touch the force is the limit for the inputs present, which may still be set.
    begun = path["contact_time"][:-1] > 0.0
    for name in RISING:
        falls = np.max(-np.diff(path[name])[begun], initial=0.0)
        worst = max(worst, falls / (scales.of(name) or 1.0))
    return float(worst)


def state_error(impact: Impact, case: ImpactCase, steps: Sequence[Step]) -> float:
    """The largest difference of outputs after the state in the middle of a run is restored."""
    slave, half = impact.instance, len(steps) // 2
    run(impact, case, steps[:half])
    time = sum((step.length for step in steps[:half]), case.start_time)
    state = slave.getFMUstate()
    first = follow(impact, time, steps[half:])
    slave.setFMUstate(state)
    again = follow(impact, time, steps[half:])
    slave.freeFMUstate(state)
    return float(max(np.max(np.abs(again[name] - first[name])) for name in first))


def reference_errors(
    reference: Reference, steps: Sequence[Step], path: Path, scales: Scales
) -> Iterator[Error]:
    """Errors of all outputs but mean_force at the end and at some points in contact."""
    in_contact = np.flatnonzero(path["in_contact"]).tolist()
    times = np.cumsum([step.length for step in steps])
    for row in (*in_contact[:: max(1, len(in_contact) // 3)], len(steps) - 1):
        for name, expected in reference.outputs(times[row]).items():
            error = scales.error(name, path[name][row], expected)
            yield "reference", name, len(steps), error
