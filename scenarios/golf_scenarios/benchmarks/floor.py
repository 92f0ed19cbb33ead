"""The FMI floor: the same calls on ClubBallImpact.fmu and on FMUs in which nothing is computed."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

from fmpy.fmi2 import FMU2Slave

from golf_scenarios.benchmarks.loaded import LoadedFmu, saved_start
from golf_scenarios.benchmarks.timing import Job, interleaved, median_ratio, undisturbed

#: What is read at every step, and as many outputs of the empty FMU.
READ = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity")
EMPTY_READ = tuple(f"output{n}" for n in range(1, 6))

#: So many steps through the contact at the baseline (620 µs): all of them are in it.
_POINTS = 600
_STEP = 1e-6


def measure(
    ours: LoadedFmu, empty: LoadedFmu, wide: LoadedFmu, rounds: int, tick: Callable[[], None]
) -> dict[str, float]:
    """Ratios of medians to the empty FMUs by name, and the floor's own times in µs (`…_us`)."""
    jobs: dict[str, Job] = {}
    jobs["step empty"] = _stepping(empty.instance(), _POINTS)
    jobs["read empty"] = _reading(empty.instance(), empty.find(EMPTY_READ))
    for law in (1, 2):
        jobs[f"step {law}"] = _stepping(ours.instance(law=law), _POINTS)
        jobs[f"read {law}"] = _reading(ours.instance(law=law), ours.find(READ))
        # A host that computes its points, as fmpy.simulate_fmu does, instead of adding steps up.
        jobs[f"step n·h {law}"] = _stepping(ours.instance(law=law), _POINTS, added_up=False)
        jobs[f"read n·h {law}"] = _reading(ours.instance(law=law), ours.find(READ), added_up=False)
    jobs["step n·h empty"] = _stepping(empty.instance(), _POINTS, added_up=False)
    jobs["read n·h empty"] = _reading(empty.instance(), empty.find(EMPTY_READ), added_up=False)
    jobs["instantiate"] = _instantiating(ours)
    jobs["instantiate empty"] = _instantiating(wide)
    with undisturbed():
        times = interleaved(jobs, rounds, tick)

    def over_empty(kind: str) -> float:
        """The worse law's."""
        return max(median_ratio(times[f"{kind} {law}"], times[f"{kind} empty"]) for law in (1, 2))

    found = {
        "do_step_over_empty": over_empty("step"),
        "step_and_read5_over_empty": over_empty("read"),
        "instantiate_over_empty": median_ratio(times["instantiate"], times["instantiate empty"]),
        "do_step_at_computed_points_over_empty": over_empty("step n·h"),
        "step_and_read5_at_computed_points_over_empty": over_empty("read n·h"),
    }
    for law in (1, 2):
        found[f"step_and_read5_over_empty_law{law}"] = median_ratio(
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
        found[f"{name.replace(' ', '_')}_us"] = 1e6 * sorted(times[name])[len(times[name]) // 2]
    return found


def _points(steps: int, added_up: bool) -> list[float]:
    points = [n * _STEP for n in range(steps)]
    if added_up:
        for n in range(1, steps):
            points[n] = points[n - 1] + _STEP
    return points


def _stepping(slave: FMU2Slave, steps: int, added_up: bool = True) -> Job:
    """Time of doStep alone, s."""
    start = saved_start(slave)
    points = _points(steps, added_up)

    def job() -> float:
        slave.setFMUstate(start)
        do_step = slave.doStep
        begin = perf_counter()
        for point in points:
            do_step(point, _STEP)
        return (perf_counter() - begin) / steps

    return job


def _reading(slave: FMU2Slave, references: list[int], added_up: bool = True) -> Job:
    """Time of doStep and one getReal of five outputs, s."""
    start = saved_start(slave)
    points = _points(_POINTS, added_up)

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
