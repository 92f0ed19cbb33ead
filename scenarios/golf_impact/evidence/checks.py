"""Checks of an impact through the FMU, for any inputs and steps: invariants, and 80 digits."""

import math
import random
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from golf_impact.data.runs import FLAGS
from golf_impact.evidence.random_impacts import ImpactCase, step_patterns
from golf_impact.evidence.reference import Segment, Steps, outputs_after
from golf_impact.evidence.scales import TOLERANCE, Scales, reduced_mass
from golf_impact.fmu import Impact

INPUTS = ("k", "b", "club_force")

#: Outputs that never fall.
RISING = ("contact_time", "max_force", "time_of_max_force", "max_compression", "impulse")

#: Every output after each step, by name.
Path = Mapping[str, np.ndarray]

#: The name of a check, the output, the number of steps, and the error without unit.
Error = tuple[str, str, int, float]


def start(impact: Impact, case: ImpactCase) -> None:
    """Begin a run of the FMU."""
    slave, at = impact.instance, impact.references
    slave.reset()
    slave.setupExperiment(startTime=case.start_time)
    slave.enterInitializationMode()
    reals = dict(case.values)
    slave.setInteger([at["law"]], [int(reals.pop("law"))])
    slave.setReal([at[name] for name in reals], [*reals.values()])
    slave.exitInitializationMode()


def follow(impact: Impact, time: float, steps: Steps) -> Path:
    """Every output after each of these steps from a time (s) on."""
    slave, at = impact.instance, impact.references
    outputs = [v for v in impact.description.modelVariables if v.causality == "output"]
    reals, flags = ([v.name for v in outputs if v.type == kind] for kind in ("Real", "Boolean"))
    inputs, real_at, flag_at = ([at[name] for name in names] for names in (INPUTS, reals, flags))
    rows = []
    for step in steps:
        slave.setReal(inputs, [step.k, step.b, step.club_force])
        slave.doStep(time, step.length)
        time += step.length
        rows.append([*slave.getReal(real_at), *slave.getBoolean(flag_at)])
    return dict(zip(reals + flags, np.array(rows, float).T))


def check(
    impact: Impact, case: ImpactCase, rng: random.Random, exact: bool = False, equal: int = 64
) -> Iterator[Error]:
    """Errors of an impact by several patterns of steps; `exact`: from the reference, too.

    FMICallException: the FMU refuses a step.
    """
    start(impact, case)
    final = {n: x[-1] for n, x in follow(impact, case.start_time, case.segments).items()}
    scales = scales_of(case, final)
    patterns = step_patterns(case, final["contact_time"], rng, equal)
    for pattern, steps in patterns.items():
        start(impact, case)
        path = follow(impact, case.start_time, steps)
        errors = {
            ("momentum", "momentum"): momentum_error(case, steps, path, scales),
            ("energy", "kinetic_energy"): energy_error(case, steps, path, scales),
            ("order", ""): order_error(path, scales),
        }
        for name in final.keys() - {"mean_force"}:  # that of the last step
            value = bool(final[name]) if name in FLAGS else final[name]
            errors["patterns", name] = scales.error(name, path[name][-1], value)
        yield from ((*which, len(steps), error) for which, error in errors.items())
        if exact:
            in_contact = np.flatnonzero(path["in_contact"]).tolist()
            rows = {n: n for n in (*in_contact[:: max(1, len(in_contact) // 3)], len(steps) - 1)}
            segments: Steps = steps
            if pattern == "equal":  # so many that the reference has the end alone
                segments, rows = case.segments, {len(case.segments) - 1: -1}
            for name, error in reference_errors(segments, path, scales, rows):
                yield "reference", name, len(steps), error
    yield "state", "", len(patterns["random"]), state_error(impact, case, patterns["random"])


def scales_of(case: ImpactCase, final: Mapping[str, float]) -> Scales:
    """The scales of errors of a run, from the outputs at its end."""
    span, mu = sum(segment.length for segment in case.segments), reduced_mass(case.values)
    fastest = max(max(math.sqrt(s.k / mu), s.b / mu) for s in case.segments)
    values = case.values | {"start_time": case.start_time}
    return Scales(values, final, case.approach, span, fastest, final)


def momentum_error(case: ImpactCase, steps: Steps, path: Path, scales: Scales) -> float:
    """The largest error of the balance of momentum, over masses times speeds.

    Momentum changes by the force on the head from touch on, and under law 1 by the drag in contact,
    b times the way of each body. Mean forces times steps add up to the impulse.
    """
    v, sizes = case.values, np.array([step.length for step in steps])
    acted = np.clip(np.cumsum(sizes) - case.approach, 0.0, sizes)
    push = np.cumsum([step.club_force for step in steps] * acted)
    drag = np.zeros_like(push)
    if v["law"] == 1:
        ball = np.diff(path["contact_displacement"], prepend=0.0)
        closer = np.diff(path["compression"] * path["in_contact"], prepend=0.0)
        drag = np.cumsum([step.b for step in steps] * (2.0 * ball + closer))
    start = v["m_club"] * v["club_speed"] + v["m_ball"] * v["ball_speed"]
    # As in `Scales`: the instant of touch is rounded, and the place.
    largest = max(abs(s.club_force) + 2.0 * s.b * scales.of("ball_velocity") for s in steps)
    rounding = 4e-16 * case.approach * largest
    scale = scales.of("momentum") + np.max(np.abs(push))
    error = np.max(np.abs(path["momentum"] - start - push + drag) - rounding) / scale
    impulse = abs(np.sum(path["mean_force"] * sizes) - path["impulse"][-1])
    missing = impulse / (scales.of("impulse") or 1.0) - scales.rounding_of_time("mean_force")
    return float(max(0.0, error, missing))


def energy_error(case: ImpactCase, steps: Steps, path: Path, scales: Scales) -> float:
    """By how much the energy rises in a step beyond the work done on the head, over the largest.

    It is kinetic and, in contact, that of the spring with the k of the step. Without damping, it
    may not fall, either.
    """
    v = case.values
    k, b, force = (np.array([getattr(s, name) for s in steps]) for name in ("k", "b", "club_force"))
    spring = 0.5 * (path["compression"] * path["in_contact"]) ** 2
    touch = v["ball_speed"] * case.approach
    moved = np.diff(np.where(path["touched"], path["club_position"], touch), prepend=touch)
    start = 0.5 * (v["m_club"] * v["club_speed"] ** 2 + v["m_ball"] * v["ball_speed"] ** 2)
    kinetic = path["kinetic_energy"]
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
    holds = (
        all(np.isfinite(values).all() for values in path.values()),
        np.array_equal(path["in_contact"], in_contact),
        not force[~in_contact].any(),
        (np.diff(touched) >= 0.0).all(),
        (np.diff(separated) >= 0.0).all(),
    )
    if not all(holds):
        return math.inf
    worst = np.max(np.maximum(-force, force - path["max_force"])) / (scales.of("force") or 1.0)
    # Just at touch the force is the limit for the inputs present, which may still be set.
    begun = path["contact_time"][:-1] > 0.0
    for name in RISING:
        falls = -np.diff(path[name])[begun]
        worst = max(worst, np.max(falls, initial=0.0) / (scales.of(name) or 1.0))
    return float(worst)


def state_error(impact: Impact, case: ImpactCase, steps: Sequence[Segment]) -> float:
    """The largest difference of outputs after the state in the middle of a run is restored."""
    slave, half = impact.instance, len(steps) // 2
    start(impact, case)
    follow(impact, case.start_time, steps[:half])
    time = sum((step.length for step in steps[:half]), case.start_time)
    state = slave.getFMUstate()
    first = follow(impact, time, steps[half:])
    slave.setFMUstate(state)
    again = follow(impact, time, steps[half:])
    slave.freeFMUstate(state)
    return float(max(np.max(np.abs(again[name] - first[name])) for name in first))


def reference_errors(
    steps: Steps, path: Path, scales: Scales, rows: Mapping[int, int]
) -> Iterator[tuple[str, float]]:
    """Errors of outputs (all but mean_force) after some steps, compared with 80-digit arithmetic.

    `rows` has the row of the path by the number of the step, from 0 on.
    """
    changed = len({(step.k, step.b, step.club_force) for step in steps}) > 1
    for number, expected in outputs_after(scales.values, steps, rows).items():
        found = {name: path[name][rows[number]] for name in expected}
        errors = {name: scales.error(name, found[name], x) for name, x in expected.items()}
        if changed and max(errors.values()) > TOLERANCE:
            # The instant at which k and b change has an error of up to one unit in the last place.
            shaken = outputs_after(scales.values, steps, rows, 1.0 + 2.0**-52)[number]
            for name, value in shaken.items():
                unknown = scales.error(name, value, expected[name])
                errors[name] = 0.0 if errors[name] <= unknown else errors[name] - unknown
        yield from errors.items()
