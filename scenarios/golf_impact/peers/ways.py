"""Ways to compute S, COR and E of the document's impact, as `bench` compares them."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import fmpy

from golf_impact.fmu import Impact
from golf_impact.peers import dop853, empty_fmu

METRICS = ["smash_factor", "coefficient_of_restitution", "energy_efficiency"]

#: A communication step longer than the contact, s.
STEP = 1e-3

OURS, EMPTY = "this FMU", "empty pythonfmu FMU"

#: From k (N/m) to S, COR and E.
Solve = Callable[[float], Sequence[float]]


class Way(NamedTuple):
    """A way to compute an impact."""

    name: str
    called: str  #: how, in words
    prepare: Callable[[int], Solve]  #: what is needed only once, for a law


def by_restored_state(impact: Impact) -> Way:
    """One doStep from a saved state: the fewest and cheapest FMI calls."""
    slave, at = impact.instance, impact.references

    def prepare(law: int) -> Solve:
        slave.reset()
        slave.setupExperiment()
        slave.enterInitializationMode()
        slave.setInteger([at["law"]], [law])
        slave.exitInitializationMode()
        return partial(_solve, slave, slave.getFMUstate(), [at["k"]], [at[x] for x in METRICS])

    return Way(OURS, "state restored, k set, doStep, getReal", prepare)


def by_simulate_fmu(
    impact: Impact, called: str, instance: Any = None, begin: Callable[[], Any] = lambda: None
) -> Way:
    """fmpy.simulate_fmu in one step: extracted, in this instance after `begin`, or in a new one."""

    def prepare(law: int) -> Solve:
        def solve(k: float) -> Sequence[float]:
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

        return solve

    return Way(OURS, f"simulate_fmu, {called}", prepare)


def by_sub_steps(language: str, folder: Path, order: int, dt: float) -> Way:
    """An extracted SteppedImpact.fmu: all sub-steps of `dt` s inside one doStep."""

    def prepare(law: int) -> Solve:
        slave, at = _instance(folder)
        slave.setInteger([at["law"], at["order"]], [law, order])
        slave.setReal([at["dt"]], [dt])
        slave.exitInitializationMode()
        return partial(_solve, slave, None, [at["k"]], [at[name] for name in METRICS])

    name = f"{'explicit Euler' if order == 1 else 'Runge–Kutta 4'}, {language} FMU"
    return Way(name, f"k set, doStep of {1e6 * dt:.2g} µs sub-steps, getReal", prepare)


def by_dop853(rtol: float) -> Way:
    """SciPy's DOP853 at this relative tolerance."""
    called = f"solve_ivp, rtol {rtol:g}"
    return Way("DOP853, SciPy", called, lambda law: partial(dop853.solve, law, rtol))


def by_empty_fmu(folder: Path) -> Way:
    """An extracted Empty.fmu: what doStep and its reads cost if nothing is computed."""

    def prepare(law: int) -> Solve:
        slave, at = _instance(folder)
        slave.exitInitializationMode()
        return partial(_solve, slave, None, [at["k"]], [at[n] for n in empty_fmu.OUTPUTS[:3]])

    return Way(EMPTY, "k set, doStep, getReal", prepare)


def _instance(folder: Path) -> tuple[Any, dict[str, int]]:
    """An instance in initialization mode, and value references by name."""
    description = fmpy.read_model_description(folder)
    slave = fmpy.instantiate_fmu(folder, description)
    slave.setupExperiment()
    slave.enterInitializationMode()
    return slave, {v.name: v.valueReference for v in description.modelVariables}


def _solve(
    slave: Any, start: Any, reference: list[int], outputs: list[int], k: float
) -> Sequence[float]:
    """An impact from this state, if one is given, with this stiffness (N/m) in one step."""
    if start is not None:
        slave.setFMUstate(start)
    slave.setReal(reference, [k])
    slave.doStep(0.0, STEP)
    return slave.getReal(outputs)
