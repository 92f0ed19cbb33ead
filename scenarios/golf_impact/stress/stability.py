"""The error of each method over step size and damping, all without unit.

A law-2 impact of the document's bodies; ω0 h is the step over the undamped time scale, ζ the
damping ratio. The error is the worst of velocities (over |u_C| + |u_B|), contact time and largest
force (relative).
"""

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from golf_impact.peers import stepping
from golf_impact.peers.problem import Case, Outcome, errors
from golf_impact.report import figures
from golf_impact.stress.cases import critical_damping
from golf_impact.stress.driver import Driver
from golf_impact.stress.reference import exact_outcome

OURS = "this FMU"

#: Errors at which the colours change: two decades a colour up to 1, and beyond, where no digit
#: is right, in colours of their own.
_BOUNDS = [*(10.0**power for power in range(-16, 1, 2)), 10.0, 1e3, 1e6]
_NO_DIGIT = ("#F2A48B", figures.VERMILION, "#7A2000")

#: The errors of one method, for JSON: `method`, `steps` (ω0 h), `damping` (ζ) and `errors`, a row
#: for each ζ; inf where no end of contact is found.
Map = dict[str, Any]


def maps(driver: Driver, quick: bool, tick: Callable[[], None]) -> list[Map]:
    """The maps of the FMU and of stepping methods; `tick` is called after each damping ratio."""
    steps = np.logspace(-2 if quick else -3, 3, 6 if quick else 37).tolist()
    damping = [0.0, *np.logspace(-2, 3, 4 if quick else 26).tolist()]
    methods: dict[str, Callable[[Case, float], Outcome]]
    methods = {OURS: partial(_by_fmu, driver), **stepping.METHODS}
    axes = {"steps": steps, "damping": damping}
    made: list[Map] = [{"method": name, **axes, "errors": []} for name in methods]
    for zeta in damping:
        case = Case(law=2, b=zeta * critical_damping(Case.k, Case.m_club, Case.m_ball))
        exact = exact_outcome(case)
        for map_, solve in zip(made, methods.values(), strict=True):
            runs = [partial(solve, case, x / case.natural_frequency) for x in steps]
            map_["errors"].append([_error(case, run, exact) for run in runs])
        tick()
    return made


def _error(case: Case, run: Callable[[], Outcome], exact: Outcome) -> float:
    with suppress(ArithmeticError, ValueError):  # of a method that diverges
        if math.isfinite(error := max(errors(case, run(), exact))):
            return error
    return math.inf


def _by_fmu(driver: Driver, case: Case, size: float) -> Outcome:
    driver.begin_run(vars(case))
    point = 0.0
    while not driver.read_flag("separated"):
        driver.slave.doStep(point, size)
        point += size
    return Outcome(**driver.read(Outcome._fields))


def draw(maps: list[Map]) -> bytes:
    """The maps as PNG, on one colour scale."""
    figure, axes = figures.plt.subplots(2, 2, figsize=(9.0, 7.0), sharex=True, sharey=True)
    title = "Error over step size and damping (law 2): the FMU is flat, stepping methods diverge"
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    number = len(_BOUNDS) - 1 - len(_NO_DIGIT)
    usable = figures.plt.get_cmap("cividis", number)(range(number))
    colours = ListedColormap([*usable, *_NO_DIGIT]).with_extremes(bad="0.75")
    norm = BoundaryNorm(_BOUNDS, colours.N)
    for map_, place in zip(maps, axes.flat, strict=True):
        table = np.ma.masked_invalid(map_["errors"]).clip(_BOUNDS[0], _BOUNDS[-1] * 0.999)
        image = place.pcolormesh(table, cmap=colours, norm=norm)
        place.set_title(map_["method"], fontsize=10.5)
        for axis, values in ((place.xaxis, map_["steps"]), (place.yaxis, map_["damping"])):
            chosen = [n for n, x in enumerate(values) if not x or math.log10(x) % 1.0 < 1e-9]
            chosen = chosen[:: 1 + len(chosen) // 8]
            axis.set_ticks([n + 0.5 for n in chosen], [_power(values[n]) for n in chosen])
        place.grid(False)
    figure.supylabel("damping ratio ζ")
    figure.supxlabel("step size ω₀h")
    bar = figure.colorbar(image, ax=axes, shrink=0.9, extend="max", spacing="uniform")
    bar.set_ticks(_BOUNDS, labels=[*map(_power, _BOUNDS)])
    bar.set_label("error (grey: no end of contact found)")
    return figures.to_png(figure)


def _power(value: float) -> str:
    return f"$10^{{{math.log10(value):.0f}}}$" if value else "0"
