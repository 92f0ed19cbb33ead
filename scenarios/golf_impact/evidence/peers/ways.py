"""Ways to compute S, COR and E of the document's impact, as `bench` compares them."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import fmpy
import numpy as np
from scipy.integrate import solve_ivp

from golf_impact.evidence.peers.fmus import PYTHON, RUNGE_KUTTA, extract_peers
from golf_impact.evidence.peers.stepped_impact import CLUB_SPEED, M_BALL, M_CLUB, B
from golf_impact.fmu import Impact

METRICS = ["smash_factor", "coefficient_of_restitution", "energy_efficiency"]

#: A communication step longer than the contact, s.
STEP = 1e-3

OURS, NATIVE = "this FMU", "native FMU"

#: From k (N/m) to S, COR and E.
Solve = Callable[[float], Sequence[float]]


class Way(NamedTuple):
    """A way to compute an impact."""

    name: str
    called: str  #: how, in words
    prepare: Callable[[int], Solve]  #: what is needed only once, for a law


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
    stepped, slave = extract_peers(folder), impact.instance
    slave.reset()
    restore = partial(slave.setFMUstate, slave.getFMUstate())
    rows = [
        by_restored_state(OURS, impact),
        by_simulate_fmu(impact, "state restored", restore, fmu_instance=slave),
        by_simulate_fmu(impact, "instance reset", slave.reset, fmu_instance=slave),
        by_simulate_fmu(impact, "a new instance", lambda: None),
        *(by_sub_steps(name, stepped, 5e-6 if name == RUNGE_KUTTA else 0.5e-6) for name in stepped),
        by_dop853(1e-12),
    ]
    rows += [by_restored_state(NATIVE, in_c)] if in_c else []
    spaces = 4 if quick else 16
    sub_steps = [*(10.0 ** -(5 + 2 * n / spaces) for n in range(spaces + 1)), 1e-8, 1e-9]
    curves = [name for name in stepped if name != PYTHON]
    points = [by_sub_steps(name, stepped, dt) for name in curves for dt in sub_steps]
    return rows, points + [by_dop853(10.0**-n) for n in range(3, 14, 5 if quick else 1)]


def by_restored_state(name: str, impact: Impact) -> Way:
    """An FMU whose state after initialization is restored before each step."""
    called = "state restored, k set, doStep, getReal"
    return Way(name, called, partial(_by_calls, impact.folder, True))


def by_sub_steps(name: str, folders: Mapping[str, Path], dt: float) -> Way:
    """SteppedImpact.fmu of this method, extracted: sub-steps of `dt` s inside one doStep."""
    called = f"k set, doStep of {1e6 * dt:.2g} µs sub-steps, getReal"
    return Way(name, called, partial(_by_calls, folders[name], False, dt=dt))


def _by_calls(folder: str | Path, restored: bool, law: int, **start: float) -> Solve:
    """The fewest and cheapest FMI calls of an extracted FMU, with parameters from `start`."""
    about = fmpy.read_model_description(folder)
    at = {variable.name: variable.valueReference for variable in about.modelVariables}
    slave = fmpy.instantiate_fmu(folder, about)
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.setInteger([at["law"]], [law])
    slave.setReal([at[name] for name in start], [*start.values()])
    slave.exitInitializationMode()
    k, outputs = [at["k"]], [at[name] for name in METRICS]
    state = slave.getFMUstate() if restored else None

    def solve(stiffness: float) -> Sequence[float]:
        if restored:
            slave.setFMUstate(state)
        slave.setReal(k, [stiffness])
        slave.doStep(0.0, STEP)
        found: Sequence[float] = slave.getReal(outputs)
        return found

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


def by_dop853(rtol: float) -> Way:
    """SciPy's DOP853 with its own error control (Hairer, Nørsett & Wanner, 1993).

    The end of contact is a terminal event. Absolute tolerances are `rtol` of the speed, and of the
    compression that the speed reaches in 0.2 ms.
    """

    def solve(law: int, k: float) -> Sequence[float]:
        drag, damper = (B, 0.0) if law == 1 else (0.0, B)
        # Compression and velocities: y' = rates y. Method dot is faster than @ here.
        force = np.array([k, damper, -damper])
        rates = np.array([[0.0, 1.0, -1.0], -force / M_CLUB, force / M_BALL])
        rates -= np.diag([0.0, drag / M_CLUB, drag / M_BALL])

        def force_of(_: float, y: Any) -> Any:
            return force.dot(y)

        force_of.terminal, force_of.direction = True, -1  # type: ignore[attr-defined]
        start, atol = (0.0, CLUB_SPEED, 0.0), rtol * CLUB_SPEED * np.array([2e-4, 1.0, 1.0])
        options = {"method": "DOP853", "events": force_of, "rtol": rtol, "atol": atol}
        path = solve_ivp(lambda _, y: rates.dot(y), (0.0, 1e-2), start, **options)
        _, v_club, v_ball = path.y_events[0][0].tolist()
        efficiency = (M_CLUB * v_club**2 + M_BALL * v_ball**2) / (M_CLUB * CLUB_SPEED**2)
        return v_ball / CLUB_SPEED, (v_ball - v_club) / CLUB_SPEED, efficiency

    called = f"solve_ivp, rtol {rtol:g}"
    return Way("DOP853, SciPy", called, lambda law: partial(solve, law))
