"""The FMI floor: the same calls on ClubBallImpact.fmu and on FMUs in which nothing is computed."""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate, repeat
from statistics import median
from time import perf_counter

from fmpy.fmi2 import FMU2Slave

from golf_scenarios.fmu.loaded import LoadedFmu
from golf_scenarios.timing import Job, interleaved, median_ratio, undisturbed

#: What is read at every step, and as many outputs of the empty FMU.
READ = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity")
EMPTY_READ = tuple(f"output{n}" for n in range(1, 6))

#: Steps of 1 µs through the contact at the baseline (620 µs): all of them are in it.
_STEP = 1e-6
_POINTS = list(accumulate(repeat(_STEP, 599), initial=0.0))


def call_ratios(
    ours: LoadedFmu, empty: LoadedFmu, wide: LoadedFmu, rounds: int, tick: Callable[[], None]
) -> dict[str, float]:
    """Ratios of medians to the empty FMUs by name, and the floor's own times in µs (`…_us`)."""
    read, empty_read = ours.references(READ), empty.references(EMPTY_READ)
    jobs: dict[str, Job] = {
        "step empty": _stepping(empty.instance()),
        "read empty": _reading(empty.instance(), empty_read),
        "instantiate": _instantiating(ours),
        "instantiate empty": _instantiating(wide),
    }
    for law in (1, 2):
        jobs[f"step {law}"] = _stepping(ours.instance(law=law))
        jobs[f"read {law}"] = _reading(ours.instance(law=law), read)
    with undisturbed():
        times = interleaved(jobs, rounds, tick)

    def over_empty(kind: str) -> float:
        """The worse law's."""
        return max(median_ratio(times[f"{kind} {law}"], times[f"{kind} empty"]) for law in (1, 2))

    figures = {
        "do_step_over_empty": over_empty("step"),
        "step_and_read5_over_empty": over_empty("read"),
        "instantiate_over_empty": median_ratio(times["instantiate"], times["instantiate empty"]),
    }
    for law in (1, 2):
        figures[f"step_and_read5_over_empty_law{law}"] = median_ratio(
            times[f"read {law}"], times["read empty"]
        )
    micro = {f"{name.replace(' ', '_')}_us": 1e6 * median(times[name]) for name in times}
    return figures | micro


def _stepping(slave: FMU2Slave) -> Job:
    """Time of doStep alone, s."""
    start = slave.getFMUstate()

    def job() -> float:
        slave.setFMUstate(start)
        do_step = slave.doStep
        begin = perf_counter()
        for point in _POINTS:
            do_step(point, _STEP)
        return (perf_counter() - begin) / len(_POINTS)

    return job


def _reading(slave: FMU2Slave, references: list[int]) -> Job:
    """Time of doStep and one getReal of five outputs, s."""
    start = slave.getFMUstate()

    def job() -> float:
        slave.setFMUstate(start)
        do_step, get_real = slave.doStep, slave.getReal
        begin = perf_counter()
        for point in _POINTS:
            do_step(point, _STEP)
            get_real(references)
        return (perf_counter() - begin) / len(_POINTS)

    return job


def _instantiating(fmu: LoadedFmu) -> Job:
    """instantiate() of fmpy, s; its object is made and the instance freed off the clock."""
    # The library and its modules stay loaded, whatever is freed.
    fmu.instance()

    def job() -> float:
        slaves = [fmu.blank() for _ in range(5)]
        begin = perf_counter()
        for slave in slaves:
            slave.instantiate()
        seconds = (perf_counter() - begin) / len(slaves)
        for slave in slaves:
            fmu.free(slave)
        return seconds

    return job
