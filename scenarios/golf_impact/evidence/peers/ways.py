"""Ways to compute S, COR and E of the document's impact, as `bench` compares them."""

import ctypes
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import fmpy

from golf_impact.evidence.peers import dop853, empty_fmu, fmus
from golf_impact.fmu import Impact

METRICS = ["smash_factor", "coefficient_of_restitution", "energy_efficiency"]

#: A communication step longer than the contact, s.
STEP = 1e-3

OURS, NATIVE, EMPTY = "this FMU", "native FMU", "empty pythonfmu FMU"

#: In a call of a way in C.
IMPACTS = 100

#: From k (N/m) to S, COR and E.
Solve = Callable[[float], Sequence[float]]

#: For a law an instance, its value references by name, and the state in which each impact begins,
#: or None if a doStep is a whole impact.
Open = Callable[[int], tuple[Any, Mapping[str, int], Any]]


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
    *_, fastest = stepped.items()
    slave = impact.instance
    restore = partial(slave.setFMUstate, slave.getFMUstate())
    rows = [
        by_restored_state(impact, OURS),
        by_simulate_fmu(impact, "state restored", slave, restore),
        by_simulate_fmu(impact, "instance reset", slave, slave.reset),
        by_simulate_fmu(impact, "a new instance"),
        *(by_sub_steps(*each, order=1, dt=0.5e-6) for each in stepped.items()),
        by_sub_steps(*fastest, order=4, dt=5e-6),
        by_dop853(1e-12),
    ]
    if in_c:
        library = fmus.compile_calls(folder)
        rows += [
            by_restored_state(in_c, NATIVE),
            by_restored_state(in_c, NATIVE, library),
            by_sub_steps(*fastest, order=1, dt=0.5e-6, library=library),
        ]
    rows += [by_empty_fmu(empty)] if empty else []
    spaces = 4 if quick else 16
    sub_steps = [*(10.0 ** -(5 + 2 * n / spaces) for n in range(spaces + 1)), 1e-8, 1e-9]
    points = [by_sub_steps(*fastest, order, dt) for order in (1, 4) for dt in sub_steps]
    return rows, points + [by_dop853(10.0**-n) for n in range(3, 14, 5 if quick else 1)]


def by_restored_state(impact: Impact, name: str, library: Path | None = None) -> Way:
    """One doStep from a saved state: the fewest and cheapest FMI calls."""
    slave, at = impact.instance, impact.references

    def opened(law: int) -> tuple[Any, Mapping[str, int], Any]:
        slave.reset()
        slave.setupExperiment()
        slave.enterInitializationMode()
        slave.setInteger([at["law"]], [law])
        slave.exitInitializationMode()
        return slave, at, slave.getFMUstate()

    return _by_calls(name, "state restored, k set, doStep, getReal", opened, library)


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


def by_sub_steps(
    language: str, folder: Path, order: int, dt: float, library: Path | None = None
) -> Way:
    """An extracted SteppedImpact.fmu: all sub-steps of `dt` s inside one doStep."""

    def opened(law: int) -> tuple[Any, Mapping[str, int], Any]:
        slave, at = _instance(folder)
        slave.setInteger([at["law"], at["order"]], [law, order])
        slave.setReal([at["dt"]], [dt])
        slave.exitInitializationMode()
        return slave, at, None

    name = f"{'explicit Euler' if order == 1 else 'Runge–Kutta 4'}, {language} FMU"
    called = f"k set, doStep of {1e6 * dt:.2g} µs sub-steps, getReal"
    return _by_calls(name, called, opened, library)


def by_dop853(rtol: float) -> Way:
    """SciPy's DOP853 at this relative tolerance."""
    called = f"solve_ivp, rtol {rtol:g}"
    return Way("DOP853, SciPy", called, lambda law: partial(dop853.solve, law, rtol))


def by_empty_fmu(folder: Path) -> Way:
    """An extracted Empty.fmu: what doStep and its reads cost if nothing is computed."""

    def opened(law: int) -> tuple[Any, Mapping[str, int], Any]:  # noqa: ARG001
        slave, at = _instance(folder)
        slave.exitInitializationMode()
        return slave, dict(zip(METRICS, (at[name] for name in empty_fmu.OUTPUTS))) | at, None

    return _by_calls(EMPTY, "k set, doStep, getReal", opened)


def _instance(folder: Path) -> tuple[Any, dict[str, int]]:
    """An instance in initialization mode, and value references by name."""
    description = fmpy.read_model_description(folder)
    slave = fmpy.instantiate_fmu(folder, description)
    slave.setupExperiment()
    slave.enterInitializationMode()
    return slave, {v.name: v.valueReference for v in description.modelVariables}


def _by_calls(name: str, called: str, opened: Open, library: Path | None = None) -> Way:
    """FMI calls by fmpy, or in C by the library of impacts.c."""
    if library:
        return Way(name, f"in C: {called}", lambda law: _in_c(library, *opened(law)), IMPACTS)

    def prepare(law: int) -> Solve:
        slave, at, start = opened(law)
        return partial(_solve, slave, start, [at["k"]], [at[name] for name in METRICS])

    return Way(name, called, prepare)


def _solve(
    slave: Any, start: Any, reference: list[int], outputs: list[int], k: float
) -> Sequence[float]:
    """An impact from this state, if one is given, with this stiffness (N/m) in one step."""
    if start is not None:
        slave.setFMUstate(start)
    slave.setReal(reference, [k])
    slave.doStep(0.0, STEP)
    return slave.getReal(outputs)


def _in_c(library: Path, slave: Any, at: Mapping[str, int], start: Any) -> Solve:
    """IMPACTS impacts in C, the last with the given stiffness (N/m)."""
    run, values = ctypes.CDLL(str(library)).impacts, (ctypes.c_double * 3)()
    outputs = (ctypes.c_uint * 3)(*(at[name] for name in METRICS))
    functions = [
        ctypes.cast(getattr(slave.dll, f"fmi2{name}"), ctypes.c_void_p)
        for name in ("SetFMUstate", "SetReal", "DoStep", "GetReal")
    ]
    stiffness = ctypes.byref(ctypes.c_uint(at["k"]))
    component = ctypes.c_void_p(slave.component)

    def solve(k: float) -> Sequence[float]:
        number = ctypes.c_double(k)
        run(IMPACTS, component, start, number, stiffness, outputs, values, *functions)
        return list(values)

    return solve
