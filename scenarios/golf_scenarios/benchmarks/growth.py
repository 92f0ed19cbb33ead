"""How time and memory grow: with the number of steps in an impact, and with instances."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

from golf_scenarios.benchmarks.loaded import LoadedFmu, saved_start
from golf_scenarios.benchmarks.speedup import METRICS, STEP, STIFFNESSES, impact
from golf_scenarios.benchmarks.timing import resident_bytes, typical_seconds, undisturbed


def over_steps(fmu: LoadedFmu, most: int, tick: Callable[[], None]) -> list[dict[str, float]]:
    """Time of one impact (1 ms) over the number of its steps: metrics read once, at the end."""
    slave = fmu.instance(law=2)
    start = saved_start(slave)
    references = fmu.find(METRICS)
    found = []
    number = 1
    while number <= most:
        size = STEP / number
        points = [0.0]
        for _ in range(number - 1):
            points.append(points[-1] + size)

        def run(points: list[float] = points, size: float = size) -> None:
            slave.setFMUstate(start)
            do_step = slave.doStep
            for point in points:
                do_step(point, size)
            slave.getReal(references)

        with undisturbed():
            seconds = typical_seconds(run, 0.05)
        found.append(
            {"steps": number, "time_us": 1e6 * seconds, "per_step_us": 1e6 * seconds / number}
        )
        number *= 10
        tick()
    return found


def over_instances(
    fmu: LoadedFmu, most: int, tick: Callable[[], None]
) -> list[dict[str, float | None]]:
    """Time of one impact, and memory, while so many instances are alive and take turns."""
    k, read = fmu.find(("k",)), fmu.find(METRICS)
    found: list[dict[str, float | None]] = []
    slaves = [fmu.instance(law=2)]
    starts = [saved_start(slaves[0])]
    impact(slaves[0], starts[0], k, read, 1e6)
    bytes_before = resident_bytes()
    number = 1
    while number <= most:
        while len(slaves) < number:
            slaves.append(fmu.instance(law=2))
            starts.append(saved_start(slaves[-1]))
            impact(slaves[-1], starts[-1], k, read, 1e6)
        bytes_now = resident_bytes()
        impacts = max(1000, number)
        with undisturbed():
            begin = perf_counter()
            for n in range(impacts):
                turn = n % number
                impact(slaves[turn], starts[turn], k, read, STIFFNESSES[n % len(STIFFNESSES)])
            seconds = (perf_counter() - begin) / impacts
        kib = None
        if bytes_before is not None and bytes_now is not None and number > 1:
            kib = (bytes_now - bytes_before) / 1024.0 / (number - 1)
        found.append({"instances": number, "time_us": 1e6 * seconds, "kib_per_instance": kib})
        number *= 10
        tick()
    for slave in slaves:
        fmu.free(slave)
    return found
