"""Comparable run times: interleaved measurements, so that other load affects all of them."""

import importlib.metadata
import os
import platform
import re
import timeit
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median


def measure_interleaved(
    jobs: Sequence[Callable[[], object]], rounds: int, least: float = 5e-3
) -> list[float]:
    """Median run times of a call of each job, s.

    In each round every job takes its turn, with as many calls as take
    `least` s, so that the first of them, not yet in the processor's caches, doesn't count much.
    """
    numbers = [max(1, round(least / min(timeit.repeat(job, number=1, repeat=3)))) for job in jobs]
    times: list[list[float]] = [[] for _ in jobs]
    for _ in range(rounds):
        # timeit switches garbage collection off, which would affect one of the jobs at random.
        for job, number, spent in zip(jobs, numbers, times):
            spent.append(timeit.timeit(job, number=number) / number)
    return [median(spent) for spent in times]


def describe_machine() -> dict[str, str]:
    """Processor, system and versions on which times are measured."""
    packages = ("fmpy", "pythonfmu", "numpy", "scipy", "mpmath")
    file = Path("/proc/cpuinfo")
    name = re.search(r"model name\s*: *(.*\S)", file.read_text()) if file.is_file() else None
    return {
        "processor": name[1] if name else platform.processor() or platform.machine(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        **{name: importlib.metadata.version(name) for name in packages},
    }
