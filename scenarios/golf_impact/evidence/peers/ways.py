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
    fastest = [*stepped.items()][-1]
    slave, restored = impact.instance, "state restored, k set, doStep, getReal"
    restore = partial(slave.setFMUstate, slave.getFMUstate())
    rows = [
        by_calls(OURS, restored, impact.folder, restored=True),
        by_simulate_fmu(impact, "state restored", restore, fmu_instance=slave),
        by_simulate_fmu(impact, "instance reset", slave.reset, fmu_instance=slave),
        by_simulate_fmu(impact, "a new instance", lambda: None),
        *(by_sub_steps(each, 1, 0.5e-6) for each in stepped.items()),
        by_sub_steps(fastest, 4, 5e-6),
        by_dop853(1e-12),
    ]
    if in_c:
        library = fmus.compile_library("impacts.c", Path(folder, "impacts"))
        rows += [
            by_calls(NATIVE, restored, in_c.folder, restored=True),
            by_calls(NATIVE, restored, in_c.folder, library, restored=True),
            by_sub_steps(fastest, 1, 0.5e-6, library),
        ]
    rows += [by_calls(EMPTY, "k set, doStep, getReal", empty)] if empty else []
    spaces = 4 if quick else 16
    sub_steps = [*(10.0 ** -(5 + 2 * n / spaces) for n in range(spaces + 1)), 1e-8, 1e-9]
    points = [by_sub_steps(fastest, order, dt) for order in (1, 4) for dt in sub_steps]
    return rows, points + [by_dop853(10.0**-n) for n in range(3, 14, 5 if quick else 1)]


def by_calls(
    name: str,
    called: str,
    folder: Path | str,
    library: Path | None = None,
    restored: bool = False,
    **start: float,
) -> Way:
    """The fewest and cheapest FMI calls of an extracted FMU, by fmpy or by the library in C.

    Each impact is a doStep, after `restored` from a state; `start` has values of parameters.
    """

    def prepare(law: int) -> Solve:
        about = fmpy.read_model_description(folder)
        variables = {variable.name: variable for variable in about.modelVariables}
        slave = fmpy.instantiate_fmu(folder, about)
        slave.setupExperiment()
        slave.enterInitializationMode()
        for parameter, value in {"law": law, **start}.items():
            variable = variables[parameter]
            getattr(slave, f"set{variable.type}")([variable.valueReference], [value])
        slave.exitInitializationMode()
        k, *outputs = (variables[each].valueReference for each in ("k", *METRICS))
        state = slave.getFMUstate() if restored else None
        run = partial(_in_c, library) if library else partial(partial, _solve)
        return run(slave, k, outputs, state)

    return Way(name, f"in C: {called}" if library else called, prepare, IMPACTS if library else 1)


def _solve(slave: Any, reference: int, outputs: list[int], start: Any, k: float) -> Sequence[float]:
    """An impact with this stiffness (N/m) in one step, from a state if one is given."""
    if start is not None:
        slave.setFMUstate(start)
    slave.setReal([reference], [k])
    slave.doStep(0.0, STEP)
    return slave.getReal(outputs)


def _in_c(library: Path, slave: Any, k: int, outputs: list[int], start: Any) -> Solve:
    """IMPACTS impacts in C, the last with the given stiffness (N/m)."""
    run, values = ctypes.CDLL(str(library)).impacts, (ctypes.c_double * 3)()
    names = ("SetFMUstate", "SetReal", "DoStep", "GetReal")
    functions = [ctypes.cast(getattr(slave.dll, f"fmi2{n}"), ctypes.c_void_p) for n in names]
    references = ctypes.byref(ctypes.c_uint(k)), (ctypes.c_uint * 3)(*outputs)
    component = ctypes.c_void_p(slave.component)

    def solve(k: float) -> Sequence[float]:
        run(IMPACTS, component, start, ctypes.c_double(k), *references, values, *functions)
        return list(values)

    return solve


def by_simulate_fmu(impact: Impact, called: str, begin: Callable[[], Any], **options: Any) -> Way:
    """fmpy.simulate_fmu in one step, of the extracted FMU, after `begin`."""

    def solve(law: int, k: float) -> Sequence[float]:
        begin()
        rows = fmpy.simulate_fmu(
            impact.folder,
            model_description=impact.description,
            start_values={"law": law, "k": k},
            output=METRICS,
            stop_time=STEP,
            output_interval=STEP,
            **options,
        )
        return [rows[name][-1] for name in METRICS]

    return Way(OURS, f"simulate_fmu, {called}", lambda law: partial(solve, law))


def by_sub_steps(peer: tuple[str, Path], order: int, dt: float, library: Path | None = None) -> Way:
    """SteppedImpact.fmu in a language, extracted: sub-steps of `dt` s inside one doStep."""
    language, folder = peer
    name = f"{'explicit Euler' if order == 1 else 'Runge–Kutta 4'}, {language} FMU"
    called = f"k set, doStep of {1e6 * dt:.2g} µs sub-steps, getReal"
    return by_calls(name, called, folder, library, order=order, dt=dt)


def by_dop853(rtol: float) -> Way:
    """SciPy's DOP853 at this relative tolerance."""
    called = f"solve_ivp, rtol {rtol:g}"
    return Way("DOP853, SciPy", called, lambda law: partial(dop853.solve, law, rtol))
