"""How a run begins, and what a contact costs that the usual forms in doubles can't tell."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from time import perf_counter

from golf_scenarios.benchmarks.speedup import METRICS, STEP, STIFFNESSES
from golf_scenarios.fmu.loaded import LoadedFmu
from golf_scenarios.timing import Job, interleaved, median_ratio, undisturbed

_SPEEDS = ("club_velocity", "ball_velocity")
_INPUTS = ("k", "b", "club_speed")

#: Damping from which law 1 is told in decimals, N.s/m (ζ = 2.6), and steps through such a contact.
_HEAVY, _POINTS, _POINT = 1000.0, 20, 1e-5


def start_ratios(ours: LoadedFmu, rounds: int, tick: Callable[[], None]) -> dict[str, float]:
    """Ratios by key, and times in µs (`…_us`).

    One run is a restored state, k, b and club_speed set, one step and two reads.
    """
    jobs: dict[str, Job] = {}
    for law in (1, 2):
        for when in ("in initialization", "after it"):
            jobs[f"{when} {law}"] = _runs(ours, law, when == "in initialization")
    jobs["heavy"], jobs["heavy read"] = _heavy(ours, read=False), _heavy(ours, read=True)
    with undisturbed():
        times = interleaved(jobs, rounds, tick)
    figures: dict[str, float] = {
        "run_set_in_initialization_over_after": max(
            median_ratio(times[f"in initialization {law}"], times[f"after it {law}"])
            for law in (1, 2)
        ),
        "run_law1_over_law2": max(
            median_ratio(times[f"{when} 1"], times[f"{when} 2"])
            for when in ("in initialization", "after it")
        ),
        "unusual_impact_over_usual": median_ratio(times["heavy"], times["after it 1"]),
    }
    micro = {name: 1e6 * median(seconds) for name, seconds in times.items()}
    for law in (1, 2):
        figures[f"run_set_in_initialization_law{law}_us"] = micro[f"in initialization {law}"]
        figures[f"run_set_after_initialization_law{law}_us"] = micro[f"after it {law}"]
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
    inputs, metrics, speeds = map(fmu.references, (_INPUTS, METRICS, _SPEEDS))

    def job() -> float:
        begin = perf_counter()
        for k in STIFFNESSES:
            slave.setFMUstate(start)
            slave.setReal(inputs, [k, 9.0, 35.0])
            if in_initialization:
                slave.exitInitializationMode()
            slave.doStep(0.0, STEP)
            slave.getReal(metrics)
            slave.getReal(speeds)
        return (perf_counter() - begin) / len(STIFFNESSES)

    return job


def _heavy(fmu: LoadedFmu, read: bool) -> Job:
    """A heavily damped impact in one step; or one read of its contact."""
    slave = fmu.instance(law=1, b=_HEAVY)
    start = slave.getFMUstate()
    k, metrics = fmu.references(("k",)), fmu.references(METRICS)
    moving = fmu.references(("force", *_SPEEDS))

    def impact() -> float:
        begin = perf_counter()
        for value in STIFFNESSES[:5]:
            slave.setFMUstate(start)
            slave.setReal(k, [value])
            slave.doStep(0.0, 10.0 * STEP)
            slave.getReal(metrics)
        return (perf_counter() - begin) / 5

    def reads() -> float:
        slave.setFMUstate(start)
        slave.doStep(0.0, _POINT)
        slave.getReal(moving)
        begin = perf_counter()
        for n in range(1, _POINTS + 1):
            slave.doStep(n * _POINT, _POINT)
            slave.getReal(moving)
        return (perf_counter() - begin) / _POINTS

    return reads if read else impact
