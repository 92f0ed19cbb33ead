"""The FMI floor: the same calls on ClubBallImpact.fmu and on FMUs in which nothing is computed."""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate, repeat
from time import perf_counter

from fmpy.fmi2 import FMU2Slave

from golf_scenarios.fmu.loaded import LoadedFmu
from golf_scenarios.timing import Job, interleaved, median_ratio, undisturbed

#: What is read at every step, and as many outputs of the empty FMU.
READ = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity")
EMPTY_READ = tuple(f"output{n}" for n in range(1, 6))

#: So many steps through the contact at the baseline (620 µs): all of them are in it.
_POINTS = 600
_STEP = 1e-6


def call_ratios(
    ours: LoadedFmu, empty: LoadedFmu, wide: LoadedFmu, rounds: int, tick: Callable[[], None]
) -> dict[str, float]:
    """Ratios of medians to the empty FMUs by name, and the floor's own times in µs (`…_us`)."""
    read, empty_read = ours.references(READ), empty.references(EMPTY_READ)
    jobs: dict[str, Job] = {}
    # n·h: a host that computes its points, as fmpy.simulate_fmu does, instead of adding steps up.
    for how, added_up in (("", True), (" n·h", False)):
        jobs[f"step{how} empty"] = _stepping(empty.instance(), added_up)
        jobs[f"read{how} empty"] = _reading(empty.instance(), empty_read, added_up)
        for law in (1, 2):
            jobs[f"step{how} {law}"] = _stepping(ours.instance(law=law), added_up)
            jobs[f"read{how} {law}"] = _reading(ours.instance(law=law), read, added_up)
    jobs["instantiate"] = _instantiating(ours)
    jobs["instantiate empty"] = _instantiating(wide)
    with undisturbed():
        times = interleaved(jobs, rounds, tick)

    def over_empty(kind: str) -> float:
        """The worse law's."""
        return max(median_ratio(times[f"{kind} {law}"], times[f"{kind} empty"]) for law in (1, 2))

    figures = {
        "do_step_over_empty": over_empty("step"),
        "step_and_read5_over_empty": over_empty("read"),
        "instantiate_over_empty": median_ratio(times["instantiate"], times["instantiate empty"]),
        "do_step_at_computed_points_over_empty": over_empty("step n·h"),
        "step_and_read5_at_computed_points_over_empty": over_empty("read n·h"),
    }
    for law in (1, 2):
        figures[f"step_and_read5_over_empty_law{law}"] = median_ratio(
            times[f"read {law}"], times["read empty"]
        )
    for name in (
        "step empty",
        "read empty",
        "instantiate empty",
        "instantiate",
        "read 1",
        "read 2",
    ):
        figures[f"{name.replace(' ', '_')}_us"] = 1e6 * sorted(times[name])[len(times[name]) // 2]
    return figures


def _points(added_up: bool) -> list[float]:
    if added_up:
        return list(accumulate(repeat(_STEP, _POINTS - 1), initial=0.0))
    return [n * _STEP for n in range(_POINTS)]


def _stepping(slave: FMU2Slave, added_up: bool) -> Job:
    """Time of doStep alone, s."""
    start = slave.getFMUstate()
    points = _points(added_up)

    def job() -> float:
        slave.setFMUstate(start)
        do_step = slave.doStep
        begin = perf_counter()
        for point in points:
            do_step(point, _STEP)
        return (perf_counter() - begin) / len(points)

    return job


def _reading(slave: FMU2Slave, references: list[int], added_up: bool) -> Job:
    """Time of doStep and one getReal of five outputs, s."""
    start = slave.getFMUstate()
    points = _points(added_up)

    def job() -> float:
        slave.setFMUstate(start)
        do_step, get_real = slave.doStep, slave.getReal
        begin = perf_counter()
        for point in points:
            do_step(point, _STEP)
            get_real(references)
        return (perf_counter() - begin) / len(points)

    return job


def _instantiating(fmu: LoadedFmu, number: int = 5) -> Job:
    """instantiate() of fmpy, s; its object is made and the instance freed off the clock."""
    # The library and its modules stay loaded, whatever is freed.
    fmu.instance()

    def job() -> float:
        slaves = [fmu.blank() for _ in range(number)]
        begin = perf_counter()
        for slave in slaves:
            slave.instantiate()
        seconds = (perf_counter() - begin) / number
        for slave in slaves:
            fmu.free(slave)
        return seconds

    return job
