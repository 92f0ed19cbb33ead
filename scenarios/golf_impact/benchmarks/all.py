"""All benchmarks, one after the other."""

import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from golf_impact.benchmarks import accuracy, floor, run_start, speedup, sweep_rate
from golf_impact.benchmarks.work_precision import run_time_and_error
from golf_impact.fmu.file import build_plain_fmu, current_fmu
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers.document_scheme import SLAVE as DOCUMENT_FMU
from golf_impact.stress.driver import driver
from golf_impact.timing import machine

_HERE = Path(__file__).parent

#: About how often `costs_and_errors` calls its tick, with --quick and without.
TICKS = {True: 165, False: 460}

_PLAIN = (DOCUMENT_FMU, _HERE / "empty_fmu.py", _HERE / "empty_wide_fmu.py")


def costs_and_errors(quick: bool, tick: Callable[[], None]) -> dict[str, Any]:
    """The figures by name, series of run time against error by law, and what they are of."""
    path, _ = current_fmu()
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-")))
        paths = [path, *(build_plain_fmu(script, scratch) for script in _PLAIN)]
        ours, document, empty, wide = (stack.enter_context(LoadedFmu(one)) for one in paths)
        figures = floor.call_ratios(ours, empty, wide, 15 if quick else 41, tick)
        figures |= speedup.speedups(ours, document, 9 if quick else 25, tick)
        figures |= run_start.start_ratios(ours, 15 if quick else 41, tick)
        series = {
            f"law {law}": run_time_and_error(ours, document, law, quick, tick) for law in (1, 2)
        }
        guid = ours.description.guid
    figures |= sweep_rate.rates(path, quick, tick)
    with driver() as fmu:
        accurate = accuracy.worst_error(fmu, 2 if quick else 60, tick)
    figures["worst_error"] = accurate.pop("worst_error")
    return {
        "figures": figures,
        "series": series,
        "worst_error_is_of": accurate,
        "machine": machine() | {"fmu": guid},
    }
