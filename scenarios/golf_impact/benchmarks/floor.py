"""The FMI floor: the same calls on ClubBallImpact.fmu and on FMUs in which nothing is computed."""

from collections.abc import Sequence
from functools import partial
from statistics import median

from fmpy.fmi2 import FMU2Slave

from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.timing import Job, measure_seconds, median_ratio, run_interleaved

#: What is read at every step, and as many outputs of the empty FMU.
READ = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity")
EMPTY_READ = tuple(f"output{n}" for n in range(1, 6))

#: Steps of 1 µs through the contact at the baseline (620 µs): all of them are in it.
_STEP = 1e-6
_POINTS = [n * _STEP for n in range(600)]


def call_ratios(
    ours: LoadedFmu, empty: LoadedFmu, wide: LoadedFmu, rounds: int
) -> dict[str, float]:
    """Ratios of medians to the empty FMUs by name, and the floor's own times in µs (`…_us`)."""
    jobs = {
        "step_empty": _stepping(empty.instance()),
        "read_empty": _stepping(empty.instance(), empty.references(EMPTY_READ)),
        "instantiate": _instantiating(ours),
        "instantiate_empty": _instantiating(wide),
    }
    for law in (1, 2):
        jobs[f"step_{law}"] = _stepping(ours.instance(law=law))
        jobs[f"read_{law}"] = _stepping(ours.instance(law=law), ours.references(READ))
    times = run_interleaved(jobs, rounds)

    def ratio(job: str, empty: str) -> float:
        return median_ratio(times[job], times[empty])

    read_1, read_2 = ratio("read_1", "read_empty"), ratio("read_2", "read_empty")
    return {
        "do_step_over_empty": max(ratio("step_1", "step_empty"), ratio("step_2", "step_empty")),
        "step_and_read5_over_empty": max(read_1, read_2),
        "instantiate_over_empty": ratio("instantiate", "instantiate_empty"),
        "step_and_read5_over_empty_law1": read_1,
        "step_and_read5_over_empty_law2": read_2,
        **{f"{name}_us": 1e6 * median(spent) for name, spent in times.items()},
    }


def walk(slave: FMU2Slave, points: Sequence[float], size: float, read: Sequence[int] = ()) -> None:
    """Step from each of these points, and read outputs after each step, if any are wanted."""
    do_step, get_real = slave.doStep, slave.getReal
    for point in points:
        do_step(point, size)
        if read:
            get_real(read)


def _stepping(slave: FMU2Slave, read: Sequence[int] = ()) -> Job:
    """Time of doStep, and of one getReal of these references if there are any, s."""
    start = slave.getFMUstate()

    def job() -> float:
        slave.setFMUstate(start)
        return measure_seconds(partial(walk, slave, _POINTS, _STEP, read), len(_POINTS))

    return job


def _instantiating(fmu: LoadedFmu) -> Job:
    """instantiate() of fmpy, s; its object is made and the instance freed off the clock."""
    # The library and its modules stay loaded, whatever is freed.
    fmu.instance()

    def job() -> float:
        slaves = [fmu.new_instance() for _ in range(5)]
        time = measure_seconds(lambda: [slave.instantiate() for slave in slaves], len(slaves))
        for slave in slaves:
            fmu.free(slave)
        return time

    return job
