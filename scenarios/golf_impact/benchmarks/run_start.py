"""How a run begins, and what a contact costs that the usual forms in doubles can't tell."""

from collections.abc import Callable
from functools import partial
from statistics import median

from golf_impact.benchmarks.floor import walk
from golf_impact.benchmarks.speedup import METRICS, STEP, STIFFNESSES, impact_of_stiffness
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.timing import Job, interleaved, median_ratio, seconds

_SPEEDS = ("club_velocity", "ball_velocity")

#: Damping from which law 1 is told in decimals, N.s/m (ζ = 2.6), and steps through such a contact.
_HEAVY = {"law": 1, "b": 1000.0}
_POINT = 1e-5
_POINTS = [n * _POINT for n in range(21)]


def start_ratios(ours: LoadedFmu, rounds: int, tick: Callable[[], None]) -> dict[str, float]:
    """Ratios by key, and times in µs (`…_us`).

    One run is a restored state, k, b and club_speed set, one step and two reads.
    """
    jobs = {
        f"{when} {law}": _runs(ours, law, in_initialization)
        for law in (1, 2)
        for when, in_initialization in (("in", True), ("after", False))
    }
    jobs |= {"heavy": _heavy_impacts(ours), "heavy read": _heavy_reads(ours)}
    times = interleaved(jobs, rounds, tick)

    def ratio(job: str, other: str) -> float:
        return median_ratio(times[job], times[other])

    sets = ratio("in 1", "after 1"), ratio("in 2", "after 2")
    figures = {
        "run_set_in_initialization_over_after": max(sets),
        "run_law1_over_law2": max(ratio("in 1", "in 2"), ratio("after 1", "after 2")),
        "unusual_impact_over_usual": ratio("heavy", "after 1"),
        "unusual_read_over_usual_run": ratio("heavy read", "after 1"),
    }
    micro = {name: 1e6 * median(spent) for name, spent in times.items()}
    for law in (1, 2):
        for when in ("in", "after"):
            figures[f"run_set_{when}_initialization_law{law}_us"] = micro[f"{when} {law}"]
    return figures | {"unusual_impact_us": micro["heavy"], "unusual_read_us": micro["heavy read"]}


def _runs(fmu: LoadedFmu, law: int, in_initialization: bool) -> Job:
    slave = fmu.keep(fmu.blank())
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

    return partial(seconds, runs, len(STIFFNESSES))


def _heavy_impacts(fmu: LoadedFmu) -> Job:
    impact = impact_of_stiffness(fmu, METRICS, 10.0 * STEP, **_HEAVY)
    return lambda: seconds(lambda: [impact(k) for k in STIFFNESSES[:5]], 5)


def _heavy_reads(fmu: LoadedFmu) -> Job:
    """Steps through the contact that are read; the first one, which solves it, is off the clock."""
    slave = fmu.instance(**_HEAVY)
    start, moving = slave.getFMUstate(), fmu.references(("force", *_SPEEDS))

    def read() -> float:
        slave.setFMUstate(start)
        walk(slave, _POINTS[:1], _POINT, moving)
        return seconds(partial(walk, slave, _POINTS[1:], _POINT, moving), len(_POINTS) - 1)

    # As long as the runs that it is compared with: a busy machine then hits both alike.
    return lambda: sum(read() for _ in range(5)) / 5
