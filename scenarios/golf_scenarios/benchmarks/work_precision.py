"""Run time against error: the FMU and its peers on the document's baseline impact, law 1 and 2.

Each point is the time that one impact takes, set-up off the clock, and the worst error among both
final velocities (over |u_C| + |u_B|), contact time and largest force (relative).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import accumulate, count, repeat
from typing import Any

import numpy as np

from golf_scenarios.benchmarks.floor import READ
from golf_scenarios.benchmarks.speedup import STEP, impact_of_stiffness
from golf_scenarios.fmu.loaded import LoadedFmu
from golf_scenarios.peers import (
    explicit_euler,
    runge_kutta4,
    semi_implicit_euler,
    solve_ivp,
    stormer_verlet,
)
from golf_scenarios.peers.document_scheme import steps_of_contact
from golf_scenarios.peers.problem import Case, Outcome, errors
from golf_scenarios.stress.reference import exact_outcome
from golf_scenarios.timing import typical_seconds, undisturbed

FMU_STEPPED = "this FMU, read every step"
FMU_ONCE = "this FMU, metrics only"

#: Stepping methods in plain Python, by the name in the figure.
_STEPPING: dict[str, Any] = {
    "explicit Euler, Python": explicit_euler,
    "semi-implicit Euler": semi_implicit_euler,
    "Störmer–Verlet": stormer_verlet,
    "Runge–Kutta 4": runge_kutta4,
}
DOCUMENT = "the document's scheme as FMU"

#: Solves the impact once.
Solve = Callable[[], Outcome]


@dataclass
class Series:
    """One method: points from coarse to fine.

    Attributes:
        method: its name.
        settings: dt (s) or rtol of each point.
        setting: "dt" or "rtol".
        seconds: s per impact.
        errors: without unit; inf where the method found no end of contact.
        order: of the error in dt (log–log slope), for stepping methods.
    """

    method: str
    setting: str
    settings: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    order: float | None = None


def run_time_and_error(
    ours: LoadedFmu, document: LoadedFmu, law: int, quick: bool, tick: Callable[[], None]
) -> list[Series]:
    """All methods on the baseline impact under one law."""
    case = Case(law=law)
    exact = exact_outcome(case)
    budget = 0.005 if quick else 0.15
    finest = 1e-6 if quick else 1e-8
    steps = [dt for dt in _ladder(1e-5, 1e-8) if dt >= finest]
    tolerances = [10.0**-exponent for exponent in range(3, 14, 5 if quick else 1)]
    points = [dt for dt in _ladder(1e-3, 1e-7) if dt >= finest]
    #: Method, settings, and what makes ready to solve with one of them.
    ways: list[tuple[Series, list[float], Callable[[float], Solve]]] = [
        (Series(DOCUMENT, "dt"), steps, partial(_stepped_document, document, law)),
        *(
            (Series(name, "dt"), steps, partial(partial, module.solve, case))
            for name, module in _STEPPING.items()
        ),
        *(
            (
                Series(f"SciPy {method}", "rtol"),
                tolerances,
                partial(partial, solve_ivp.solve, case, method=method),
            )
            for method in solve_ivp.METHODS
        ),
        (Series(FMU_STEPPED, "dt"), points, partial(_stepped_fmu, ours, law)),
        (Series(FMU_ONCE, "dt"), [STEP], lambda _: _metrics_only(ours, law)),
    ]
    for series, settings, ready in ways:
        for setting in settings:
            solve = ready(setting)
            error = max(errors(case, solve(), exact))
            with undisturbed():
                seconds = typical_seconds(solve, budget, 1 if quick else 3)
            series.settings.append(setting)
            series.seconds.append(seconds)
            series.errors.append(error if math.isfinite(error) else math.inf)
            tick()
        if settings is steps:
            series.order = slope(series.settings, series.errors)
    return [series for series, _, _ in ways]


def _ladder(high: float, low: float) -> list[float]:
    """1, 2 and 5 in every decade, downwards."""
    places = range(round(math.log10(high)), round(math.log10(low)) - 1, -1)
    values = [digit * 10.0**place for place in places for digit in (5.0, 2.0, 1.0)]
    return [value for value in values if low * 0.999 < value < high * 1.001]


def slope(settings: Sequence[float], errors: Sequence[float]) -> float | None:
    """The least-squares slope of log error over log dt, while rounding plays no part."""
    points = [
        (math.log10(dt), math.log10(error))
        for dt, error in zip(settings, errors, strict=True)
        if 1e-11 < error < 1.0
    ]
    if len(points) < 3:
        return None
    x, y = np.transpose(points)
    return float(np.polyfit(x, y, 1)[0])


def _stepped_document(fmu: LoadedFmu, law: int, dt: float) -> Solve:
    """To the end of contact, which takes a number of steps that is known beforehand."""
    slave = fmu.instance(law=law, dt=dt)
    start = slave.getFMUstate()
    read = fmu.references(Outcome._fields)
    number = steps_of_contact(fmu, slave, dt, end=0.01)

    def solve() -> Outcome:
        slave.setFMUstate(start)
        do_step = slave.doStep
        for n in range(number):
            do_step(n * dt, dt)
        return Outcome(*slave.getReal(read))

    return solve


def _stepped_fmu(fmu: LoadedFmu, law: int, dt: float) -> Solve:
    """1 ms in steps of dt, five outputs read at each, the metrics at the end."""
    slave = fmu.instance(law=law)
    start = slave.getFMUstate()
    outcome, read = fmu.references(Outcome._fields), fmu.references(READ)
    points = list(accumulate(repeat(dt, round(1e-3 / dt) - 1), initial=0.0))

    def solve() -> Outcome:
        slave.setFMUstate(start)
        do_step, get_real = slave.doStep, slave.getReal
        for point in points:
            do_step(point, dt)
            get_real(read)
        return Outcome(*get_real(outcome))

    return solve


def _metrics_only(fmu: LoadedFmu, law: int) -> Solve:
    """One step and one read, with a new k every time but the first (k = 1e6 for the error)."""
    impact, calls = impact_of_stiffness(fmu, law, Outcome._fields), count()
    return lambda: Outcome(*impact(1e6 + next(calls) % 100))
