"""Targets of the figures in bench.json, and their tables: limits.csv.

Times differ between machines, ratios within one run of the benchmark don't. On the reference
machine an impact in extended precision may take 0.6 ms, and a step that is read 40 µs; an impact of
law 1 in closed form takes 16.6 µs.
"""

import csv
from pathlib import Path

with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as _rows:
    #: By key: the `limit` if there is one, the title of the `table` and the `meaning`.
    FIGURES = {row["key"]: row for row in csv.DictReader(_rows)}


def is_met(limit: str, figure: float) -> bool:
    """Whether a figure meets a limit such as "≤ 1.1"."""
    sign, value = limit.split()
    return figure <= float(value) if sign == "≤" else figure >= float(value)
