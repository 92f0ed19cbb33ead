"""Run time against error: the FMU and its peers on the document's baseline impact, law 1 and 2.

Each point is the time that one impact takes, set-up off the clock, and the worst error among both
final velocities (over |u_C| + |u_B|), contact time and largest force (relative).
"""

import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import cycle
from typing import Any

from golf_impact.benchmarks.empty_fmu import OUTPUTS as READ
from golf_impact.benchmarks.impact import STEP, Impact, document_impact, impact_of
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.peers import solve_ivp
from golf_impact.peers.problem import Case, Outcome, errors
from golf_impact.reference import exact_outcome
from golf_impact.report import figures
from golf_impact.timing import typical_seconds

FMU_STEPPED = "this FMU, read every step"
FMU_ONCE = "this FMU, metrics only"
COMPILED = {"euler": "explicit Euler, C FMU", "rk4": "Runge–Kutta 4, C FMU"}

#: The baseline's stiffness, for the error, and another one: k changes at every impact, N/m.
_STIFFNESSES = (1e6, 1e6 + 1.0)

#: One method's points from coarse to fine, for JSON: `method`, `setting` ("dt" or "rtol") and its
#: `settings` (dt in s), `seconds` per impact and `errors` (inf where the method found no end of
#: contact).
Series = dict[str, Any]


def run_time_and_error(
    ours: LoadedFmu, document: LoadedFmu, compiled: Mapping[str, LoadedFmu], law: int, quick: bool
) -> list[Series]:
    """All methods on the baseline impact under one law."""
    case = Case(law=law)
    exact = exact_outcome(case)
    budget, least = (0.005, 1) if quick else (0.15, 3)
    steps, points = _one_two_five(-5, -6 if quick else -8), _one_two_five(-3, -6 if quick else -7)
    tolerances = [10.0**-exponent for exponent in range(3, 14, 5 if quick else 1)]
    outputs = Outcome._fields

    def by_compiled(fmu: LoadedFmu, dt: float) -> Impact:
        return impact_of(fmu, outputs, law=law, dt=dt)

    def by_scipy(method: str, rtol: float) -> Impact:
        return lambda k: solve_ivp.solve(Case(law=law, k=k), rtol, method)

    def in_steps(dt: float) -> Impact:
        at = [n * dt for n in range(round(STEP / dt))]
        return impact_of(ours, outputs, dt, lambda _: at, READ, law=law)

    # By method, settings (dt in s, or rtol), and from one to the impact.
    ways: dict[str, tuple[list[float], Callable[[float], Impact]]] = {}
    by_document = partial(document_impact, document, law, _STIFFNESSES, outputs=outputs)
    ways["the document's scheme as FMU"] = steps, by_document
    for name, fmu in compiled.items():
        ways[COMPILED[name]] = steps, partial(by_compiled, fmu)
    for name in solve_ivp.METHODS:
        ways[f"SciPy {name}"] = tolerances, partial(by_scipy, name)
    ways[FMU_STEPPED] = points, in_steps
    ways[FMU_ONCE] = [STEP], partial(impact_of, ours, outputs, law=law)
    made = []
    for method, (settings, way) in ways.items():
        by = "rtol" if settings is tolerances else "dt"
        series: Series = {"method": method, "setting": by, "settings": settings}
        series |= {"seconds": [], "errors": []}
        for setting in settings:
            impact, stiffnesses = way(setting), cycle(_STIFFNESSES)
            series["errors"].append(max(errors(case, Outcome(*impact(case.k)), exact)))
            seconds = typical_seconds(lambda: impact(next(stiffnesses)), budget, least)  # noqa: B023
            series["seconds"].append(seconds)
        made.append(series)
    return made


def _one_two_five(high: int, low: int) -> list[float]:
    """From 10^high down to 10^low, with 5 and 2 between powers of ten."""
    return [digit * 10.0**n for n in range(high, low - 1, -1) for digit in (5.0, 2.0, 1.0)][2:]


def run_time_vs_error(series_by_law: dict[str, list[Series]]) -> bytes:
    """The work–precision figure as PNG: both laws side by side, one legend below."""
    figure, both = figures.new_pair("Run time against error: the document's baseline impact")
    figure.set_size_inches(11.0, 6.6)
    words = {"law 1": "drag on each body", "law 2": "damper between the bodies"}
    label = "worst error of velocities, contact time, max force (relative)"
    for axes, (law, methods) in zip(both, series_by_law.items(), strict=True):
        for series in methods:
            pairs = zip(series["errors"], series["seconds"], strict=True)
            points = [(error, 1e6 * time) for error, time in pairs if math.isfinite(error)]
            size, above = (15, 5) if series["method"] == FMU_ONCE else (5, 3)
            style = figures.STYLES[series["method"]].points
            axes.plot(*zip(*points), **style, lw=1.4, ms=size, zorder=above, label=series["method"])
        figures.set_run_time_axes(axes, label)
        axes.set_title(f"{law}: {words[law]}", fontsize=10.5)
    low, high = zip(*(axes.get_ylim() for axes in both))
    for axes in both:
        axes.set_ylim(min(low), 3.0 * max(high))
    figures.add_legend_below(figure, both[0], columns=4)
    return figures.to_png(figure)
