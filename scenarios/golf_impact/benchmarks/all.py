"""All benchmarks, one after the other."""

import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from golf_impact.benchmarks import accuracy, floor, impact, sweep_rate
from golf_impact.benchmarks.work_precision import run_time_and_error
from golf_impact.fmu.file import build_plain_fmu, current_fmu
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers.compiled import SUB_STEP, compiled_fmu, compiler
from golf_impact.peers.document_scheme import SLAVE as DOCUMENT_FMU
from golf_impact.stress.driver import driver
from golf_impact.timing import describe_machine

_HERE = Path(__file__).parent
_PLAIN = (DOCUMENT_FMU, _HERE / "empty_fmu.py", _HERE / "empty_wide_fmu.py")

#: How often `costs_and_errors` calls its tick.
TICKS = 7


def costs_and_errors(quick: bool, tick: Callable[[], None]) -> dict[str, Any]:
    """The figures by name, series of run time against error by law, and what they are of.

    Without a C compiler there are no figures of compiled FMUs.
    """
    path, _ = current_fmu()
    rounds = 15 if quick else 41
    figures: dict[str, float] = {}
    series = {}
    with ExitStack() as stack:

        def loaded(file: Path) -> LoadedFmu:
            return stack.enter_context(LoadedFmu(file))

        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="golf-impact-")))
        ours = loaded(path)
        document, empty, wide = (loaded(build_plain_fmu(script, scratch)) for script in _PLAIN)
        methods = SUB_STEP if compiler() else ()
        compiled = {method: loaded(compiled_fmu(method, scratch)) for method in methods}
        tick()
        figures |= floor.call_ratios(ours, empty, wide, rounds)
        tick()
        figures |= impact.other_ways(ours, document, compiled, 9 if quick else 25)
        tick()
        figures |= impact.other_runs(ours, rounds)
        for law in (1, 2):
            tick()
            series[f"law {law}"] = run_time_and_error(ours, document, compiled, law, quick)
        guid = ours.description.guid
    tick()
    figures |= sweep_rate.rates(path, quick)
    tick()
    with driver() as fmu:
        accurate = accuracy.worst_error(fmu, 2 if quick else 60)
    figures["worst_error"] = accurate.pop("worst_error")
    return {
        "figures": figures,
        "series": series,
        "worst_error_is_of": accurate,
        "machine": describe_machine() | {"fmu": guid},
    }
