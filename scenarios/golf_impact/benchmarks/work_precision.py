"""Run time against error: the FMU and its peers on the document's baseline impact, law 1 and 2.

Each point is the time that one impact takes, set-up off the clock, and the worst error among both
final velocities (over |u_C| + |u_B|), contact time and largest force (relative).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import count
from typing import Any

import numpy as np

from golf_impact.benchmarks.floor import READ, walk
from golf_impact.benchmarks.impact import STEP, document_impact, impact_of_stiffness
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers import solve_ivp, stepping
from golf_impact.peers.problem import Case, Outcome, errors
from golf_impact.report import figures
from golf_impact.stress.reference import exact_outcome
from golf_impact.timing import typical_seconds

FMU_STEPPED = "this FMU, read every step"
FMU_ONCE = "this FMU, metrics only"
DOCUMENT = "the document's scheme as FMU"
COMPILED = {"euler": "explicit Euler, C FMU", "rk4": "Runge–Kutta 4, C FMU"}

#: Solves the impact once.
Solve = Callable[[], Outcome]


#: One method's points from coarse to fine, for JSON: `method`, `setting` ("dt" or "rtol") and its
#: `settings` (dt in s), `seconds` per impact, `errors` (inf where the method found no end of
#: contact) and `order` of the error in dt (log–log slope) for stepping methods.
Series = dict[str, Any]


def run_time_and_error(
    ours: LoadedFmu,
    document: LoadedFmu,
    compiled: Mapping[str, LoadedFmu],
    law: int,
    quick: bool,
    tick: Callable[[], None],
) -> list[Series]:
    """All methods on the baseline impact under one law."""
    case = Case(law=law)
    exact = exact_outcome(case)
    budget, least, finest = (0.005, 1, 1e-6) if quick else (0.15, 3, 1e-8)
    steps, points = _ladder(1e-5, finest), _ladder(1e-3, max(finest, 1e-7))
    tolerances = [10.0**-exponent for exponent in range(3, 14, 5 if quick else 1)]
    # Method, setting and settings, and what makes ready to solve with one of them.
    ways: list[tuple[str, str, list[float], Callable[[float], Solve]]] = [
        (DOCUMENT, "dt", steps, partial(_stepped_document, document, law))
    ]
    for name, fmu in compiled.items():
        ways.append((COMPILED[name], "dt", steps, _sub_stepped(fmu, law)))
    for name, peer in stepping.METHODS.items():
        words = "explicit Euler, Python" if name == "explicit Euler" else name
        ways.append((words, "dt", steps, _solving(peer, case)))
    for method in solve_ivp.METHODS:
        ready = _solving(solve_ivp.solve, case, method=method)
        ways.append((f"SciPy {method}", "rtol", tolerances, ready))
    ways.append((FMU_STEPPED, "dt", points, partial(_stepped_fmu, ours, law)))
    ways.append((FMU_ONCE, "dt", [STEP], lambda _: _in_one_step(ours, law)))
    made = []
    for method, setting, settings, ready in ways:
        one: Series = {"method": method, "setting": setting, "settings": settings}
        one |= {"seconds": [], "errors": []}
        for value in settings:
            solve = ready(value)
            error = max(errors(case, solve(), exact))
            one["errors"].append(error if math.isfinite(error) else math.inf)
            one["seconds"].append(typical_seconds(solve, budget, least))
            tick()
        one["order"] = slope(steps, one["errors"]) if settings is steps else None
        made.append(one)
    return made


def _solving(solve: Callable[..., Outcome], case: Case, **how: str) -> Callable[[float], Solve]:
    return lambda setting: partial(solve, case, setting, **how)


def _ladder(high: float, low: float) -> list[float]:
    """1, 2 and 5 in every decade, downwards."""
    places = range(round(math.log10(high)), round(math.log10(low)) - 1, -1)
    values = [digit * 10.0**place for place in places for digit in (5.0, 2.0, 1.0)]
    return [value for value in values if low * 0.999 < value < high * 1.001]


def slope(settings: Sequence[float], errors: Sequence[float]) -> float | None:
    """The least-squares slope of log error over log dt, while rounding plays no part."""
    points = [(dt, error) for dt, error in zip(settings, errors) if 1e-11 < error < 1.0]
    if len(points) < 3:
        return None
    x, y = np.log10(points).T
    return float(np.polyfit(x, y, 1)[0])


def _stepped_document(fmu: LoadedFmu, law: int, dt: float) -> Solve:
    impact = document_impact(fmu, law, dt, (), Outcome._fields)
    return lambda: Outcome(*impact(1e6))


def _stepped_fmu(fmu: LoadedFmu, law: int, dt: float) -> Solve:
    """1 ms in steps of dt, five outputs read at each, the metrics at the end."""
    slave = fmu.instance(law=law)
    start = slave.getFMUstate()
    outcome, read = fmu.references(Outcome._fields), fmu.references(READ)
    points = [n * dt for n in range(round(1e-3 / dt))]

    def solve() -> Outcome:
        slave.setFMUstate(start)
        walk(slave, points, dt, read)
        return Outcome(*slave.getReal(outcome))

    return solve


def _sub_stepped(fmu: LoadedFmu, law: int) -> Callable[[float], Solve]:
    return lambda dt: _in_one_step(fmu, law, dt=dt)


def _in_one_step(fmu: LoadedFmu, law: int, **values: float) -> Solve:
    """One step and one read, with a new k every time but the first (k = 1e6 for the error)."""
    impact, calls = impact_of_stiffness(fmu, Outcome._fields, law=law, **values), count()
    return lambda: Outcome(*impact(1e6 + next(calls) % 100))


def run_time_vs_error(series_by_law: dict[str, list[Series]]) -> bytes:
    """The work–precision figure as PNG: both laws side by side, one legend below."""
    figure, both = figures.new_pair("Run time against error: the document's baseline impact")
    figure.set_size_inches(11.0, 6.6)
    words = {"law 1": "drag on each body", "law 2": "damper between the bodies"}
    for axes, (law, methods) in zip(both, series_by_law.items(), strict=True):
        for series in methods:
            pairs = zip(series["errors"], series["seconds"], strict=True)
            points = [(error, 1e6 * time) for error, time in pairs if math.isfinite(error)]
            size, above = (15, 5) if series["method"] == FMU_ONCE else (5, 3)
            look = figures.STYLES[series["method"]].points
            axes.plot(*zip(*points), **look, lw=1.4, ms=size, zorder=above, label=series["method"])
        figures.set_run_time_axes(
            axes, "worst error of velocities, contact time, max force (relative)"
        )
        axes.set_title(f"{law}: {words[law]}", fontsize=10.5)
    low, high = zip(*(axes.get_ylim() for axes in both))
    for axes in both:
        axes.set_ylim(min(low), 3.0 * max(high))
    figures.add_legend_below(figure, both[0], columns=4)
    return figures.to_png(figure)
