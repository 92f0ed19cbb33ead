"""Ways to compute S, COR and E of the document's impact, as `bench` compares them."""

import ctypes
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import fmpy

from golf_impact.evidence.peers import dop853, fmus
from golf_impact.fmu import Impact

METRICS = ["smash_factor", "coefficient_of_restitution", "energy_efficiency"]

#: A communication step longer than the contact, s.
STEP = 1e-3

OURS, NATIVE, EMPTY = "this FMU", "native FMU", "empty pythonfmu FMU"

#: In a call of a way in C.
IMPACTS = 100

#: From k (N/m) to S, COR and E.
Solve = Callable[[float], Sequence[float]]


class Way(NamedTuple):
    """A way to compute an impact."""

    name: str
    called: str  #: how, in words
    prepare: Callable[[int], Solve]  #: what is needed only once, for a law
    impacts: int = 1  #: that a call computes


def compared(
    impact: Impact, in_c: Impact | None, folder: str, quick: bool
) -> tuple[list[Way], list[Way]]:
    """The rows of the tables, the first of which is the unit of the ratios; points of curves.

    Args:
        impact: the FMU.
        in_c: the native FMU, if it is compared.
        folder: for what is built.
        quick: fewer points.
    """
    stepped, empty = fmus.extract_peers(folder)
    library = fmus.compile_calls(folder) if in_c else None
    language, fastest = [*stepped.items()][-1]
    slave, restored = impact.instance, "state restored, k set, doStep, getReal"
    restore = partial(slave.setFMUstate, slave.getFMUstate())
    rows = [
        by_calls(OURS, restored, impact.folder, restored=True),
        by_simulate_fmu(impact, "state restored", slave, restore),
        by_simulate_fmu(impact, "instance reset", slave, slave.reset),
        by_simulate_fmu(impact, "a new instance"),
        *(by_sub_steps(*each, order=1, dt=0.5e-6) for each in stepped.items()),
        by_sub_steps(language, fastest, order=4, dt=5e-6),
        by_dop853(1e-12),
    ]
    if in_c:
        rows += [
            by_calls(NATIVE, restored, in_c.folder, restored=True),
            by_calls(NATIVE, restored, in_c.folder, library, restored=True),
            by_sub_steps(language, fastest, order=1, dt=0.5e-6, library=library),
        ]
    rows += [by_calls(EMPTY, "k set, doStep, getReal", empty)] if empty else []
    spaces = 4 if quick else 16
    sub_steps = [*(10.0 ** -(5 + 2 * n / spaces) for n in range(spaces + 1)), 1e-8, 1e-9]
    points = [by_sub_steps(language, fastest, order, dt) for order in (1, 4) for dt in sub_steps]
    return rows, points + [by_dop853(10.0**-n) for n in range(3, 14, 5 if quick else 1)]


def by_calls(
    name: str,
    called: str,
    folder: Path | str,
    library: Path | None = None,
    restored: bool = False,
    **start: float,
) -> Way:
    """The fewest and cheapest FMI calls, by fmpy or in C.

    Args:
        name: of the way.
        called: how, in words.
        folder: the extracted FMU.
        library: that of impacts.c, for calls in C.
        restored: each impact begins by restoring a state; else a doStep is a whole impact.
        start: values of parameters.
    """

    def prepare(law: int) -> Solve:
        description = fmpy.read_model_description(folder)
        slave = fmpy.instantiate_fmu(folder, description)
        slave.setupExperiment()
        slave.enterInitializationMode()
        variables = {v.name: v for v in description.modelVariables}
        for variable, value in {"law": law, **start}.items():
            setter = getattr(slave, f"set{variables[variable].type}")
            setter([variables[variable].valueReference], [value])
        slave.exitInitializationMode()
        k, *outputs = (variables[name].valueReference for name in ("k", *METRICS))
        run = partial(_in_c, library) if library else _by_fmpy
        return run(slave, [k], outputs, slave.getFMUstate() if restored else None)

    return Way(name, f"in C: {called}" if library else called, prepare, IMPACTS if library else 1)


def _by_fmpy(slave: Any, k: list[int], outputs: list[int], start: Any) -> Solve:
    def solve(stiffness: float) -> Sequence[float]:
        if start is not None:
            slave.setFMUstate(start)
        slave.setReal(k, [stiffness])
        slave.doStep(0.0, STEP)
        return slave.getReal(outputs)

    return solve


def _in_c(library: Path, slave: Any, k: list[int], outputs: list[int], start: Any) -> Solve:
    """IMPACTS impacts, the last with the given stiffness."""
    run, values = ctypes.CDLL(str(library)).impacts, (ctypes.c_double * 3)()
    names = ("SetFMUstate", "SetReal", "DoStep", "GetReal")
    functions = [ctypes.cast(getattr(slave.dll, f"fmi2{n}"), ctypes.c_void_p) for n in names]
    component, references = ctypes.c_void_p(slave.component), ((ctypes.c_uint * 3)(*outputs))
    reference = ctypes.byref(ctypes.c_uint(*k))

    def solve(stiffness: float) -> Sequence[float]:
        number = ctypes.c_double(stiffness)
        run(IMPACTS, component, start, number, reference, references, values, *functions)
        return list(values)

    return solve


def by_sub_steps(
    language: str, folder: Path, order: int, dt: float, library: Path | None = None
) -> Way:
    """An extracted SteppedImpact.fmu: all sub-steps of `dt` s inside one doStep."""
    name = f"{'explicit Euler' if order == 1 else 'Runge–Kutta 4'}, {language} FMU"
    called = f"k set, doStep of {1e6 * dt:.2g} µs sub-steps, getReal"
    return by_calls(name, called, folder, library, order=order, dt=dt)


def by_simulate_fmu(
    impact: Impact, called: str, instance: Any = None, begin: Callable[[], Any] = lambda: None
) -> Way:
    """fmpy.simulate_fmu in one step: extracted, in this instance after `begin`, or in a new one."""

    def solve(law: int, k: float) -> Sequence[float]:
        begin()
        rows = fmpy.simulate_fmu(
            impact.folder,
            model_description=impact.description,
            fmu_instance=instance,
            start_values={"law": law, "k": k},
            output=METRICS,
            stop_time=STEP,
            output_interval=STEP,
        )
        return [rows[name][-1] for name in METRICS]

    return Way(OURS, f"simulate_fmu, {called}", lambda law: partial(solve, law))


def by_dop853(rtol: float) -> Way:
    """SciPy's DOP853 at this relative tolerance."""
    called = f"solve_ivp, rtol {rtol:g}"
    return Way("DOP853, SciPy", called, lambda law: partial(dop853.solve, law, rtol))
