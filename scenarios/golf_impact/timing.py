"""Comparable run times: interleaved measurements, so that other load affects all of them."""

import gc
import importlib.metadata
import os
import platform
import re
import timeit
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median

#: Prepares and runs its work; returns seconds per unit of work, without the preparation.
Job = Callable[[], float]


def measure_seconds(work: Callable[[], object], units: int = 1) -> float:
    """Run time of a call per unit of work, s."""
    return timeit.timeit(work, number=1) / units


def run_interleaved(jobs: Mapping[str, Job], rounds: int) -> dict[str, list[float]]:
    """Seconds per unit of work, of each job in each round, after one more as a warm-up.

    The order rotates, so that no job always follows the same other one. Garbage collection is off:
    it would affect one of the jobs at random.
    """
    names = list(jobs)
    times: dict[str, list[float]] = {name: [] for name in names}
    gc.collect()
    gc.disable()
    try:
        for n in range(-1, rounds):
            turn = n % len(names)
            for name in names[turn:] + names[:turn]:
                time = jobs[name]()
                if n >= 0:
                    times[name].append(time)
    finally:
        gc.enable()
    return times


def median_ratio(numerator: list[float], denominator: list[float]) -> float:
    """The median of the ratios of rounds; disturbances longer than a round cancel."""
    return median(a / b for a, b in zip(numerator, denominator, strict=True))


def typical_seconds(call: Callable[[], object], budget: float, least: int) -> float:
    """Median run time of a call, s, over as many calls as fit into `budget` s, at least `least`."""
    number = max(least, min(10_000, int(budget / measure_seconds(call))))
    return median(timeit.repeat(call, number=1, repeat=number))


def describe_machine() -> dict[str, str]:
    """Processor, system and versions on which times are measured."""
    packages = ("fmpy", "pythonfmu", "numpy", "scipy", "mpmath")
    processor = _read_group("/proc/cpuinfo", r"model name\s*: *(.*)")
    return {
        "processor": processor or platform.processor() or platform.machine(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        **{name: importlib.metadata.version(name) for name in packages},
    }


def resident_bytes(process: int | str = "self") -> int | None:
    """Resident memory of a process; None on systems without /proc."""
    pages = _read_group(f"/proc/{process}/statm", r"\d+ (\d+)")
    # wine shows Windows programs a /proc.
    return None if pages is None or os.name == "nt" else int(pages) * os.sysconf("SC_PAGE_SIZE")


def free_bytes() -> int | None:
    """Memory available to new processes; None on systems without /proc."""
    kilobytes = _read_group("/proc/meminfo", r"MemAvailable:\s*(\d+) kB")
    return None if kilobytes is None else int(kilobytes) * 1024


def _read_group(path: str, pattern: str) -> str | None:
    """The first group of a pattern in a file; None without such a file or a match."""
    file = Path(path)
    found = re.search(pattern, file.read_text(errors="replace")) if file.is_file() else None
    return None if found is None else found[1].strip()
