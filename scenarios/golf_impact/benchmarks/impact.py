"""Run time of an impact: S, COR and E by this FMU, by other methods, and in other runs.

One impact is a restored start state, a new k, one step and one read. k changes at every impact, so
that no result can come from a cache.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import cycle, islice
from statistics import median

import fmpy

from golf_impact.benchmarks.floor import walk
from golf_impact.facts.document import TIME_STEP
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers import solve_ivp
from golf_impact.peers.compiled import SUB_STEP
from golf_impact.peers.problem import Case, Outcome, errors
from golf_impact.peers.stepping import explicit_euler
from golf_impact.stress.reference import exact_outcome
from golf_impact.timing import Job, measure_seconds, median_ratio, run_interleaved

#: S, COR and E: what a metrics-only scene reads.
METRICS = ("smash_factor", "coefficient_of_restitution", "energy_efficiency")
_SPEEDS = ("club_velocity", "ball_velocity")

#: Around the baseline's stiffness, N/m: neighbours differ by a few percent.
STIFFNESSES = tuple(1e6 * (0.9 + 0.2 * (37 * n % 101) / 101) for n in range(101))

#: Longer than any of these contacts, s.
STEP = 1e-3

#: Damping from which law 1 needs extended precision, N.s/m (ζ = 2.6), and points in such a contact.
_HEAVY = {"law": 1, "b": 1000.0}
_POINT = 1e-5
_POINTS = [n * _POINT for n in range(21)]

#: From k (N/m) to outputs.
Impact = Callable[[float], Sequence[float]]


def other_ways(
    ours: LoadedFmu, document: LoadedFmu, compiled: Mapping[str, LoadedFmu], rounds: int
) -> dict[str, float]:
    """An impact by each way, under law 2 and law 1 (`…_law1`).

    By key: times in µs (`…_us`), worst errors, `impact_speedup_over_…` (another way's time over
    ours) and, for compiled FMUs, `impact_over_…` (ours over theirs).
    """
    figures: dict[str, float] = {}
    for law, suffix in ((2, ""), (1, "_law1")):
        case = Case(law=law)
        exact = exact_outcome(case)
        # In a folder of its own, so that its library isn't already loaded by another instance.
        with LoadedFmu(ours.path) as alone:
            # From names of outputs to the impact.
            ways: dict[str, Callable[[Sequence[str]], Impact]] = {
                "fmu": partial(impact_of_stiffness, ours, law=law),
                "document_fmu": partial(
                    document_impact, document, law, (1e6, *STIFFNESSES), TIME_STEP
                ),
            }
            for name, fmu in compiled.items():
                key = f"compiled_{name}"
                ways[key] = partial(impact_of_stiffness, fmu, law=law, dt=SUB_STEP[name])
            ways["simulate_fmu"] = partial(_simulation, alone, law)
            ways["scipy"] = partial(_by_scipy, law)
            for name, way in ways.items():
                outcome = Outcome(*way(Outcome._fields)(case.k))
                figures[f"impact_by_{name}{suffix}_error"] = max(errors(case, outcome, exact))
            # So many of the fast ones per round that the first ones, whose data aren't in the
            # processor's caches, don't matter.
            numbers = {"document_fmu": 1, "simulate_fmu": 2, "scipy": 2}
            jobs = {name: _job(way(METRICS), numbers.get(name, 200)) for name, way in ways.items()}
            times = run_interleaved(jobs, rounds)
        for name, spent in times.items():
            figures[f"impact_by_{name}{suffix}_us"] = 1e6 * median(spent)
            if name.startswith("compiled"):
                figures[f"impact_over_{name}{suffix}"] = median_ratio(times["fmu"], spent)
            elif name != "fmu":
                key = f"impact_speedup_over_{name}{suffix}"
                figures[key] = median_ratio(spent, times["fmu"])
    return figures


def other_runs(ours: LoadedFmu, rounds: int) -> dict[str, float]:
    """Other initializations, and contacts in extended precision: ratios, and µs (`…_us`).

    One run is a restored state, k, b and club_speed set, one step and two reads.
    """
    jobs = {
        f"run_set_{when}_initialization_law{law}": _runs(ours, law, when == "in")
        for law in (1, 2)
        for when in ("in", "after")
    }
    jobs |= {"unusual_impact": _heavy_impacts(ours), "unusual_read": _heavy_reads(ours)}
    times = run_interleaved(jobs, rounds)
    in_1, after_1, in_2, after_2, impact, read = times.values()
    return {
        "run_set_in_initialization_over_after": max(
            median_ratio(in_1, after_1), median_ratio(in_2, after_2)
        ),
        "run_law1_over_law2": max(median_ratio(in_1, in_2), median_ratio(after_1, after_2)),
        "unusual_impact_over_usual": median_ratio(impact, after_1),
        "unusual_read_over_usual_run": median_ratio(read, after_1),
        **{f"{name}_us": 1e6 * median(spent) for name, spent in times.items()},
    }


def _job(impact: Callable[[float], object], number: int) -> Job:
    """So many impacts, each with another stiffness."""
    values = cycle(STIFFNESSES)
    return partial(measure_seconds, lambda: [impact(k) for k in islice(values, number)], number)


def _by_scipy(law: int, _: Sequence[str]) -> Impact:
    """Its outputs are always those of an Outcome."""
    return lambda k: solve_ivp.solve(Case(law=law, k=k), rtol=1e-12)


def impact_of_stiffness(
    fmu: LoadedFmu, outputs: Sequence[str], step: float = STEP, **values: float
) -> Impact:
    """An impact as a scene makes it, of an instance with these values, in one step (s)."""
    slave = fmu.instance(**values)
    start, k, read = slave.getFMUstate(), fmu.references(("k",)), fmu.references(outputs)

    def impact(value: float) -> list[float]:
        slave.setFMUstate(start)
        slave.setReal(k, [value])
        slave.doStep(0.0, step)
        return slave.getReal(read)

    return impact


def impact_in_steps(
    fmu: LoadedFmu,
    points: Mapping[float, Sequence[float]],
    step: float,
    outputs: Sequence[str],
    moving: Sequence[str] = (),
    **values: float,
) -> Impact:
    """The same by steps (s) from the points for each k, after which `moving` outputs are read."""
    slave = fmu.instance(**values)
    start, k = slave.getFMUstate(), fmu.references(("k",))
    read, read_moving = fmu.references(outputs), fmu.references(moving)

    def impact(value: float) -> list[float]:
        slave.setFMUstate(start)
        slave.setReal(k, [value])
        walk(slave, points[value], step, read_moving)
        return slave.getReal(read)

    return impact


def document_impact(
    fmu: LoadedFmu, law: int, stiffnesses: Sequence[float], dt: float, outputs: Sequence[str]
) -> Impact:
    """The document's scheme by steps of dt (s) to the end of contact, and no further.

    The number of steps is determined beforehand, for each of these stiffnesses (N/m).
    """
    points = {}
    for k in stiffnesses:
        contact_time = explicit_euler(Case(law=law, k=k), dt).contact_time
        points[k] = [n * dt for n in range(round(contact_time / dt))]
    return impact_in_steps(fmu, points, dt, outputs, law=law, dt=dt)


def _simulation(fmu: LoadedFmu, law: int, outputs: Sequence[str]) -> Impact:
    """fmpy.simulate_fmu with one step: the cost of not keeping an instance.

    The FMU is extracted beforehand and its description read, and no other instance holds its
    library: as for a loop over simulate_fmu.
    """

    def impact(k: float) -> Sequence[float]:
        rows = fmpy.simulate_fmu(
            fmu.folder,
            stop_time=STEP,
            output_interval=STEP,
            start_values={"law": law, "k": k},
            output=outputs,
            model_description=fmu.description,
        )
        return [rows[name][-1] for name in outputs]

    return impact


def _runs(fmu: LoadedFmu, law: int, in_initialization: bool) -> Job:
    slave = fmu.new_instance()
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    fmu.set({"law": law}, slave)
    if not in_initialization:
        slave.exitInitializationMode()
    start = slave.getFMUstate()
    inputs, metrics, speeds = map(fmu.references, (("k", "b", "club_speed"), METRICS, _SPEEDS))

    def runs() -> None:
        for k in STIFFNESSES:
            slave.setFMUstate(start)
            slave.setReal(inputs, [k, 9.0, 35.0])
            if in_initialization:
                slave.exitInitializationMode()
            slave.doStep(0.0, STEP)
            slave.getReal(metrics)
            slave.getReal(speeds)

    return partial(measure_seconds, runs, len(STIFFNESSES))


def _heavy_impacts(fmu: LoadedFmu) -> Job:
    return _job(impact_of_stiffness(fmu, METRICS, 10.0 * STEP, **_HEAVY), 5)


def _heavy_reads(fmu: LoadedFmu) -> Job:
    """Steps through the contact that are read; the first one, which solves it, is off the clock."""
    slave = fmu.instance(**_HEAVY)
    start, moving = slave.getFMUstate(), fmu.references(("force", *_SPEEDS))

    def read() -> float:
        slave.setFMUstate(start)
        walk(slave, _POINTS[:1], _POINT, moving)
        return measure_seconds(partial(walk, slave, _POINTS[1:], _POINT, moving), len(_POINTS) - 1)

    # As long as the runs that it is compared with, so that a busy machine affects both equally.
    return lambda: sum(read() for _ in range(5)) / 5
