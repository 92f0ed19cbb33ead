"""The error of each method over step size and damping, all without unit.

A law-2 impact of the document's bodies; ω0 h is the step over the undamped time scale, ζ the
damping ratio. The error is the worst of velocities (over |u_C| + |u_B|), contact time and largest
force (relative). SciPy's adaptive methods choose h themselves: their map is over rtol instead.
"""

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from golf_impact.peers import solve_ivp, stepping
from golf_impact.peers.problem import Case, Outcome, errors
from golf_impact.report import figures
from golf_impact.stress.cases import critical_damping
from golf_impact.stress.driver import Driver
from golf_impact.stress.reference import exact_outcome

OURS = "this FMU"

#: The methods, each a map; those of SciPy are over rtol.
METHODS = (OURS, *stepping.METHODS, "SciPy DOP853", "SciPy Radau")

#: Between which errors the colours change: two decades a colour up to 1, and beyond, where no digit
#: is right, in colours of their own.
_BOUNDS = [*(10.0**power for power in range(-16, 1, 2)), 10.0, 1e3, 1e6]
_NO_DIGIT = ("#F2A48B", figures.VERMILION, "#7A2000")


#: The errors of one method, for JSON: `method`, `axis` ("ω0 h" or "rtol"), `steps` along it,
#: `damping` (ζ) and `errors`, a row for each ζ; inf where no end of contact is found.
Map = dict[str, Any]


def maps(driver: Driver, quick: bool, tick: Callable[[], None]) -> list[Map]:
    """The maps of the FMU and its peers; `tick` is called after each."""
    steps = np.logspace(-2 if quick else -3, 3, 6 if quick else 37).tolist()
    tolerances = np.logspace(-3, -13, 3 if quick else 11).tolist()
    damping = [0.0, *np.logspace(-2, 3, 4 if quick else 26).tolist()]
    cases = [_case(zeta) for zeta in damping]
    exact = [exact_outcome(case) for case in cases]
    made = []
    for method in METHODS:
        axis, columns = ("rtol", tolerances) if "SciPy" in method else ("ω0 h", steps)
        table = [
            [_error(driver, method, case, x, right) for x in columns]
            for case, right in zip(cases, exact, strict=True)
        ]
        made.append(
            {"method": method, "axis": axis, "steps": columns, "damping": damping, "errors": table}
        )
        tick()
    return made


def _case(zeta: float) -> Case:
    return Case(law=2, b=zeta * critical_damping(Case.k, Case.m_club, Case.m_ball))


def _error(driver: Driver, method: str, case: Case, x: float, exact: Outcome) -> float:
    with warnings.catch_warnings():
        # A peer that diverges may warn: that is what the map is for.
        warnings.simplefilter("ignore")
        try:
            error = max(errors(case, _solve(driver, method, case, x), exact))
        except (ArithmeticError, ValueError):
            return math.inf
    return error if math.isfinite(error) else math.inf


def _solve(driver: Driver, method: str, case: Case, x: float) -> Outcome:
    """The outcome of a method with the step ω0 h = x, or with rtol = x."""
    if method.startswith("SciPy "):
        return solve_ivp.solve(case, x, method.removeprefix("SciPy "))
    size, point = x / case.natural_frequency, 0.0
    if method != OURS:
        return stepping.METHODS[method](case, size)
    driver.begin_run(vars(case))
    while not driver.read_flag("separated"):
        driver.slave.doStep(point, size)
        point += size
    return Outcome(**driver.read(Outcome._fields))


def draw(maps: list[Map]) -> bytes:
    """The maps as PNG, on one colour scale."""
    figure, axes = figures.plt.subplots(2, 3, figsize=(11.5, 7.0))
    title = "Error over step size and damping (law 2): the FMU is flat, stepping methods diverge"
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    number = len(_BOUNDS) - 1 - len(_NO_DIGIT)
    usable = figures.plt.get_cmap("cividis", number)(range(number))
    colours = ListedColormap([*usable, *_NO_DIGIT]).with_extremes(bad="0.75")
    norm = BoundaryNorm(_BOUNDS, colours.N)
    for one, place in zip(maps, axes.flat, strict=True):
        table = np.ma.masked_invalid(one["errors"]).clip(_BOUNDS[0], _BOUNDS[-1] * 0.999)
        image = place.pcolormesh(table, cmap=colours, norm=norm)
        place.set_title(one["method"], fontsize=10.5)
        place.set_xlabel("step size ω₀h" if one["axis"] == "ω0 h" else "tolerance rtol")
        place.set_ylabel("damping ratio ζ")
        for axis, values in ((place.xaxis, one["steps"]), (place.yaxis, one["damping"])):
            chosen = [n for n, x in enumerate(values) if not x or math.log10(x) % 1.0 < 1e-9]
            chosen = chosen[:: 1 + len(chosen) // 8]
            axis.set_ticks([n + 0.5 for n in chosen], [_power(values[n]) for n in chosen])
        place.grid(False)
    bar = figure.colorbar(image, ax=axes, shrink=0.9, extend="max", spacing="uniform")
    bar.set_ticks(_BOUNDS, labels=[*map(_power, _BOUNDS)])
    bar.set_label("error (grey: no end of contact found)")
    return figures.to_png(figure)


def _power(value: float) -> str:
    return f"$10^{{{math.log10(value):.0f}}}$" if value else "0"
