"""Times that can be compared: taken in turns, so that whatever else the machine does hits all."""

from __future__ import annotations

import gc
import importlib.metadata
import os
import platform
import re
import statistics
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter

#: Prepares, runs and times itself: seconds per unit of work, set-up not counted.
Job = Callable[[], float]


def interleaved(
    jobs: Mapping[str, Job], rounds: int, tick: Callable[[], None] = lambda: None
) -> dict[str, list[float]]:
    """Seconds per unit, of each job in each round.

    The order turns from round to round, so that no job always follows the same other one. One
    round before the first one warms up and isn't counted.
    """
    names = list(jobs)
    times: dict[str, list[float]] = {name: [] for name in names}
    for n in range(-1, rounds):
        turn = n % len(names)
        for name in names[turn:] + names[:turn]:
            seconds = jobs[name]()
            if n >= 0:
                times[name].append(seconds)
        tick()
    return times


class Ratio(float):
    """The median of the ratios of rounds.

    Attributes:
        spread: their interquartile range over the median: how much else the machine did.
    """

    spread: float

    def __new__(cls, ratios: list[float]) -> Ratio:
        """Of one round it spreads by nothing."""
        self = super().__new__(cls, statistics.median(ratios))
        quartiles = statistics.quantiles(ratios, method="inclusive") if len(ratios) > 1 else [0.0]
        self.spread = (quartiles[-1] - quartiles[0]) / self
        return self


def median_ratio(numerator: list[float], denominator: list[float]) -> Ratio:
    """The median of the ratios of rounds: a disturbance that lasts longer than one cancels."""
    return Ratio([a / b for a, b in zip(numerator, denominator, strict=True)])


@contextmanager
def undisturbed() -> Iterator[None]:
    """Without garbage collection, as timeit does it: it would hit one job of many at random."""
    was = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def typical_seconds(call: Callable[[], object], budget: float, least: int = 3) -> float:
    """The median time of a call, s, from as many calls as fit into `budget` s, `least` at least."""
    times: list[float] = []
    end = perf_counter() + budget
    while len(times) < least or perf_counter() < end:
        begin = perf_counter()
        call()
        times.append(perf_counter() - begin)
        if len(times) >= 10_000:
            break
    return statistics.median(times)


def machine() -> dict[str, str]:
    """What the numbers were measured on."""
    versions = {
        name: importlib.metadata.version(name)
        for name in ("fmpy", "pythonfmu", "numpy", "scipy", "mpmath")
    }
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        **versions,
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def resident_bytes() -> int | None:
    """The memory that this process occupies now; None where the system doesn't tell that simply."""
    statm = Path("/proc/self/statm")
    if not statm.is_file():
        return None
    return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def free_bytes() -> int | None:
    """The memory that processes can still get; None where the system doesn't tell that simply."""
    info = Path("/proc/meminfo")
    if not info.is_file():
        return None
    found = re.search(r"MemAvailable:\s*(\d+) kB", info.read_text())
    return None if found is None else int(found[1]) * 1024
