"""All benchmarks, one after the other, and their targets: ratios, as times differ by machine."""

import csv
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from golf_impact.benchmarks import accuracy, calls, empty_fmu, impact, sweep_rate
from golf_impact.benchmarks.work_precision import run_time_and_error
from golf_impact.fmu.file import build_plain_fmu
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers import document_fmu
from golf_impact.peers.compiled import SUB_STEP, compiled_fmu, compiler
from golf_impact.stress.driver import driver
from golf_impact.timing import describe_machine
from golf_impact.toml import read_toml

with Path(__file__).with_name("limits.csv").open(encoding="utf-8", newline="") as _rows:
    #: By key: the `limit`, and the `meaning` if the table of the methods doesn't have it.
    FIGURES = {row["key"]: row for row in csv.DictReader(_rows)}

#: The sentences of the conclusion, and the methods in words.
WORDS = read_toml(Path(__file__).with_name("conclusion.toml"))

#: How often `costs_and_errors` calls its tick.
TICKS = 6


def costs_and_errors(quick: bool, tick: Callable[[], None]) -> dict[str, Any]:
    """What bench.json contains; without a C compiler no figures of compiled FMUs."""
    rounds = 15 if quick else 41
    series = {}
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-")))
        ours = stack.enter_context(driver())
        document, empty = (
            stack.enter_context(LoadedFmu(build_plain_fmu(Path(str(module.__file__)), scratch)))
            for module in (document_fmu, empty_fmu)
        )
        compiled = {
            method: stack.enter_context(LoadedFmu(compiled_fmu(method, scratch)))
            for method in SUB_STEP
            if compiler()
        }
        figures = calls.call_ratios(ours, empty, rounds)
        tick()
        figures |= impact.other_ways(ours, document, compiled, 9 if quick else 25)
        for law in (1, 2):
            tick()
            series[f"law {law}"] = run_time_and_error(ours, document, compiled, law, quick)
        tick()
        accurate = accuracy.worst_error(ours, 2 if quick else 60)
    tick()
    figures |= sweep_rate.rates(ours.path, quick)
    tick()
    figures["worst_error"] = accurate.pop("worst_error")
    targets = {
        key: {"limit": row["limit"], "passed": is_met(row["limit"], figures[key])}
        for key, row in FIGURES.items()
        if key in figures
    }
    missed = [key for key, target in targets.items() if not target["passed"]]
    fast = WORDS["fast"] + (WORDS["compiled"] if compiled else "")
    fast += f"; missed on this machine: {', '.join(missed)}." if missed else "."
    return {
        **{key: figures[key] for key in targets},
        "targets": targets,
        "passed": not missed,
        "quick": quick,
        "figures": figures,
        "worst_error_is_of": accurate,
        "machine": describe_machine() | {"fmu": ours.description.guid},
        "run_time_vs_error": series,
        "conclusion": [w.format(**figures) for w in (fast, WORDS["extended"], WORDS["limits"])],
    }


def is_met(limit: str, figure: float) -> bool:
    """Whether a figure meets a limit such as "≤ 1.1"."""
    sign, value = limit.split()
    return figure <= float(value) if sign == "≤" else figure >= float(value)
