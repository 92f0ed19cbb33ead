"""What a scene costs: time, calls, evaluations of the closed form, and what the FMU imports.

Calls and evaluations are counted by putting counters around the real functions: fmpy's, and those
of the FMU's own modules, which live in this process under private names.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import patch

from fmpy.fmi2 import FMU2Slave

from golf_scenarios.benchmarks.loaded import LoadedFmu, saved_start
from golf_scenarios.benchmarks.speedup import METRICS
from golf_scenarios.benchmarks.timing import typical_seconds, undisturbed
from golf_scenarios.fmu.impact_fmu import PATH

#: A trajectory of so many points.
_POINTS = 200

#: Packages whose absence from the FMU is part of what makes it light.
HEAVY = ("numpy", "matplotlib", "scipy", "mpmath")

#: Methods of a contact phase that evaluate the closed form; beside them `fast_state` makes one.
_EVALUATIONS = {"state", "end", "closing", "impulse"}

#: Functions of the standard library, by the names that the modules give them.
_EXPONENTIALS = {"exp", "expm1", "complex_exp"}

_LOADER = Path(__file__).with_name("imported.py")


def measure(fmu: LoadedFmu, quick: bool) -> dict[str, dict[str, dict[str, float]]]:
    """By law and scene: time (µs) and counts (doStep, getReal, closed form, contact phases)."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for law in (1, 2):
        found[f"law {law}"] = {}
        slave = fmu.instance(law=law)
        for name, scene in _scenes(fmu, slave).items():
            scene()
            with counted(fmu) as counts:
                scene()
            with undisturbed():
                seconds = typical_seconds(scene, 0.02 if quick else 0.5)
            found[f"law {law}"][name] = {"time_us": 1e6 * seconds, **counts}
    return found


def _scenes(fmu: LoadedFmu, slave: FMU2Slave) -> dict[str, Callable[[], Any]]:
    start = saved_start(slave)
    k = fmu.find(("k",))
    calls = 0

    def begin() -> None:
        nonlocal calls
        slave.setFMUstate(start)
        slave.setReal(k, [1e6 + calls % 100])
        calls += 1

    def once(names: tuple[str, ...]) -> Callable[[], Any]:
        references = fmu.find(names)

        def scene() -> list[float]:
            begin()
            slave.doStep(0.0, 1e-3)
            return slave.getReal(references)

        return scene

    path = fmu.find(PATH)

    def trajectory() -> None:
        begin()
        point, size = 0.0, 7e-4 / _POINTS
        for _ in range(_POINTS):
            slave.doStep(point, size)
            slave.getReal(path)
            point += size

    return {
        "S, COR and E": once(METRICS),
        "peak force and contact time": once(("max_force", "contact_time")),
        f"a trajectory of {_POINTS} points": trajectory,
    }


def own_modules(fmu: LoadedFmu) -> list[ModuleType]:
    """The modules that this FMU brought and this process has loaded."""
    package = next(Path(fmu.folder, "resources").glob("golf_impact_*")).name
    return [m for name, m in list(sys.modules.items()) if name.startswith(f"{package}.")]


@contextmanager
def counted(fmu: LoadedFmu) -> Iterator[Counter[str]]:
    """Counts calls of doStep and getReal, evaluations of the closed form, exponentials and phases.

    An evaluation gives the motion (or its impulse) at one instant; the exponentials are those in
    evaluations and in the search for events, where law 1 needs one.
    """
    counts: Counter[str] = Counter(
        do_step=0, get_real=0, closed_form=0, exponentials=0, contact_phases=0
    )
    inside = False

    def counting(key: str, call: Callable) -> Callable:
        def wrapped(*args: Any, **options: Any) -> Any:
            counts[key] += 1
            return call(*args, **options)

        return wrapped

    def counting_outermost(call: Callable) -> Callable:
        """One evaluation may be made of others, which aren't counted again."""

        def wrapped(*args: Any) -> Any:
            nonlocal inside
            if inside:
                return call(*args)
            counts["closed_form"] += 1
            inside = True
            try:
                return call(*args)
            finally:
                inside = False

        return wrapped

    def counting_maker(make: Callable) -> Callable:
        def wrapped(self: Any) -> tuple:
            made, *time = make(self)
            # The method itself is counted already.
            return made if hasattr(made, "__self__") else counting_outermost(made), *time

        return wrapped

    with ExitStack() as stack:
        for module in own_modules(fmu):
            for name in _EXPONENTIALS & vars(module).keys():
                call = counting("exponentials", getattr(module, name))
                stack.enter_context(patch.object(module, name, call))
            for name, kind in list(vars(module).items()):
                if not name.endswith("Contact") or kind.__module__ != module.__name__:
                    continue
                made = counting("contact_phases", kind.__init__)
                stack.enter_context(patch.object(kind, "__init__", made))
                for method in _EVALUATIONS & vars(kind).keys():
                    call = counting_outermost(getattr(kind, method))
                    stack.enter_context(patch.object(kind, method, call))
                maker = counting_maker(kind.fast_state)
                stack.enter_context(patch.object(kind, "fast_state", maker))
        for key, name in (("do_step", "doStep"), ("get_real", "getReal")):
            call = counting(key, getattr(FMU2Slave, name))
            stack.enter_context(patch.object(FMU2Slave, name, call))
        yield counts


def imported(fmu: LoadedFmu) -> dict[str, Any]:
    """What the process has loaded after a run of this FMU, driven by ctypes alone.

    fmpy would bring numpy itself. Standard modules are only counted.
    """
    simulation = fmu.description.coSimulation
    assert simulation is not None
    done = subprocess.run(
        [
            sys.executable,
            "-I",
            str(_LOADER),
            fmu.folder,
            simulation.modelIdentifier or "",
            fmu.description.guid or "",
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    modules: list[str] = json.loads(done.stdout)
    standard = [name for name in modules if name.split(".")[0] in sys.stdlib_module_names]
    others = sorted(set(modules) - set(standard))
    return {
        "standard_library": len(standard),
        "others": others,
        "heavy": [name for name in others if name.split(".")[0] in HEAVY],
    }
