"""Times that can be compared: taken in turns, so that whatever else the machine does hits all."""

import gc
import importlib.metadata
import os
import platform
import re
import timeit
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median

import numpy as np

#: Prepares, runs and times itself: seconds per unit of work, set-up not counted.
Job = Callable[[], float]


def seconds(work: Callable[[], object], units: int = 1) -> float:
    """How long a work takes per unit of it, s."""
    begin = timeit.default_timer()
    work()
    return (timeit.default_timer() - begin) / units


def interleaved(
    jobs: Mapping[str, Job], rounds: int, tick: Callable[[], None] = lambda: None
) -> dict[str, list[float]]:
    """Seconds per unit, of each job in each round.

    The order turns from round to round, so that no job always follows the same other one. One
    round before the first one warms up and isn't counted. No garbage is collected meanwhile, as in
    timeit: that would hit one job of many at random.
    """
    names = list(jobs)
    times: dict[str, list[float]] = {name: [] for name in names}
    collecting = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        for n in range(-1, rounds):
            turn = n % len(names)
            for name in names[turn:] + names[:turn]:
                time = jobs[name]()
                if n >= 0:
                    times[name].append(time)
            tick()
    finally:
        if collecting:
            gc.enable()
    return times


class Ratio(float):
    """The median of the ratios of rounds."""

    spread: float  #: their interquartile range over the median: how much else the machine did

    def __new__(cls, ratios: list[float]) -> "Ratio":
        """Of one round it spreads by nothing."""
        low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75)).tolist()
        self = super().__new__(cls, middle)
        self.spread = (high - low) / middle
        return self


def median_ratio(numerator: list[float], denominator: list[float]) -> Ratio:
    """The median of the ratios of rounds: a disturbance that lasts longer than one cancels."""
    return Ratio([a / b for a, b in zip(numerator, denominator, strict=True)])


def typical_seconds(call: Callable[[], object], budget: float, least: int) -> float:
    """The median time of a call, s, from as many calls as fit into `budget` s, `least` at least."""
    once = timeit.timeit(call, number=1)
    number = max(least, min(10_000, int(budget / once)))
    return median(timeit.repeat(call, number=1, repeat=number))


def machine() -> dict[str, str]:
    """What the numbers were measured on."""
    packages = ("fmpy", "pythonfmu", "numpy", "scipy", "mpmath")
    processor = _told("/proc/cpuinfo", r"model name\s*: *(.*)")
    return {
        "processor": processor or platform.processor() or platform.machine(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        **{name: importlib.metadata.version(name) for name in packages},
    }


def resident_bytes(process: int | str = "self") -> int | None:
    """The memory that a process occupies now; None where the system doesn't tell that simply."""
    pages = _told(f"/proc/{process}/statm", r"\d+ (\d+)")
    return None if pages is None else int(pages) * os.sysconf("SC_PAGE_SIZE")


def free_bytes() -> int | None:
    """The memory that processes can still get; None where the system doesn't tell that simply."""
    kilobytes = _told("/proc/meminfo", r"MemAvailable:\s*(\d+) kB")
    return None if kilobytes is None else int(kilobytes) * 1024


def _told(path: str, pattern: str) -> str | None:
    """What the group of a pattern is in a file of the system; None where there is no such file."""
    file = Path(path)
    found = re.search(pattern, file.read_text(errors="replace")) if file.is_file() else None
    return None if found is None else found[1].strip()
