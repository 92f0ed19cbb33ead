"""Where each method blows up: the error over step size and damping, all without unit.

A law-2 impact of the document's bodies; ω0 h is the step over the undamped time scale, ζ the
damping ratio. The error is the worst of velocities (over |u_C| + |u_B|), contact time and largest
force (relative). SciPy's adaptive methods choose h themselves: their map is over rtol instead.
"""

import math
import warnings
from bisect import bisect_left
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path

from golf_impact.peers import solve_ivp, stepping
from golf_impact.peers.problem import Case, Outcome, errors
from golf_impact.report import figures
from golf_impact.stress.driver import Driver
from golf_impact.stress.reference import exact_outcome

OURS = "this FMU"

#: Between which errors the colours change: two decades a colour up to 1, and what is beyond, where
#: nothing of the answer is left, in colours of its own.
_BOUNDS = [*(10.0**power for power in range(-16, 1, 2)), 10.0, 1e3, 1e6]
_NONSENSE = ("#F2A48B", figures.VERMILION, "#7A2000")


#: The errors of one method, for JSON: `method`, `axis` ("ω0 h" or "rtol"), `steps` along it,
#: `damping` (ζ) and `errors`, a row for each ζ; inf where there is no answer.
Map = dict[str, Any]


def _explicit(order: int, x: float, zeta: float) -> np.ndarray:
    """The exponential series up to this order."""
    a, step = x * np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]]), np.eye(2)
    for n in range(order, 0, -1):
        step = np.eye(2) + a / n @ step
    return step


def _kick(x: float, zeta: float) -> np.ndarray:
    return np.array([[1.0, 0.0], [-x, 1.0 - 2.0 * zeta * x]])


def _drift(x: float) -> np.ndarray:
    return np.array([[1.0, x], [0.0, 1.0]])


#: Peers that step, and the matrix that takes (ω0 d, d') over one step of ω0 h.
STEPPING: dict[str, tuple[Any, Callable[[float, float], np.ndarray]]] = {
    "explicit Euler": (stepping.explicit_euler, partial(_explicit, 1)),
    "semi-implicit Euler": (
        stepping.semi_implicit_euler,
        lambda x, zeta: _drift(x) @ _kick(x, zeta),
    ),
    "Störmer–Verlet": (
        stepping.stormer_verlet,
        # Half a kick, explicit before the drift and implicit after it.
        lambda x, zeta: np.linalg.solve(_kick(-x / 2.0, zeta), _drift(x) @ _kick(x / 2.0, zeta)),
    ),
    "Runge–Kutta 4": (stepping.runge_kutta4, partial(_explicit, 4)),
}


def euler_limit(zeta: float) -> float:
    """Explicit Euler's largest stable ω0 h: 2ζ below critical damping, 2/(ζ + √(ζ²-1)) above."""
    if zeta <= 1.0:
        return 2.0 * zeta
    return 2.0 / (zeta + math.sqrt((zeta - 1.0) * (zeta + 1.0)))


def stable(step: Callable[[float, float], np.ndarray], x: float, zeta: float) -> bool:
    """Whether the free motion doesn't grow: no eigenvalue of the step is outside the unit circle.

    One on the circle (an undamped symplectic method) is allowed its rounding.
    """
    return bool(np.abs(np.linalg.eigvals(step(x, zeta))).max() <= 1.0 + 1e-9)


def maps(driver: Driver, quick: bool, tick: Callable[[], None]) -> list[Map]:
    """The maps of the FMU and its peers."""
    steps = np.logspace(-2 if quick else -3, 3, 6 if quick else 37).tolist()
    tolerances = np.logspace(-3, -13, 3 if quick else 11).tolist()
    cases = {zeta: _case(zeta) for zeta in (0.0, *np.logspace(-2, 3, 4 if quick else 26).tolist())}
    exact = {zeta: exact_outcome(case) for zeta, case in cases.items()}
    solvers: list[tuple[str, str, list[float], Callable[[Case, float], Outcome]]] = [
        (OURS, "ω0 h", steps, partial(_fmu, driver)),
        *((name, "ω0 h", steps, partial(_stepped, peer)) for name, (peer, _) in STEPPING.items()),
        *(
            (f"SciPy {method}", "rtol", tolerances, partial(solve_ivp.solve, method=method))
            for method in ("DOP853", "LSODA", "Radau")
        ),
    ]
    made = []
    for name, axis, columns, solve in solvers:
        one: Map = {"method": name, "axis": axis, "steps": columns, "damping": [*cases]}
        one["errors"] = []
        for zeta, case in cases.items():
            one["errors"].append([_error(case, solve, x, exact[zeta]) for x in columns])
            tick()
        made.append(one)
    return made


def _case(zeta: float) -> Case:
    plain = Case(law=2)
    return Case(law=2, b=2.0 * zeta * math.sqrt(plain.k * plain.reduced_mass))


def _error(case: Case, solve: Callable[[Case, float], Outcome], x: float, exact: Outcome) -> float:
    with warnings.catch_warnings():
        # A peer that blows up may say so: that is what the map is for.
        warnings.simplefilter("ignore")
        try:
            error = max(errors(case, solve(case, x), exact))
        except (ArithmeticError, ValueError):
            return math.inf
    return error if math.isfinite(error) else math.inf


def _stepped(peer: Any, case: Case, x: float) -> Outcome:
    """A stepping method's answer with the step ω0·h = x."""
    return peer(case, x / case.natural_frequency)


def _fmu(driver: Driver, case: Case, x: float) -> Outcome:
    """By steps of x/ω0 through the contact, until it is over."""
    size, point = x / case.natural_frequency, 0.0
    driver.begin_run(vars(case))
    while not driver.flag("separated"):
        driver.slave.doStep(point, size)
        point += size
    return Outcome(**driver.read(Outcome._fields))


def draw(maps: list[Map]) -> bytes:
    """The maps as PNG, one colour scale; the limits of theory on those that step."""
    figure, axes = figures.plt.subplots(2, 4, figsize=(13.5, 7.0), sharey=True)
    title = "Error over step size and damping (law 2): the FMU is flat, stepping methods blow up"
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    number = len(_BOUNDS) - 1 - len(_NONSENSE)
    usable = figures.plt.get_cmap("cividis", number)(range(number))
    colours = ListedColormap([*usable, *_NONSENSE])
    norm = BoundaryNorm(_BOUNDS, colours.N)
    for one, place in zip(maps, axes.flat):
        steps, damping, errors = (np.array(one[key]) for key in ("steps", "damping", "errors"))
        # ζ = 0 has no place on a logarithmic axis: a row of its own, apart from the rest.
        edges = _edges(damping[1:])
        zero = edges[0] * (edges[0] / edges[-1]) ** np.array([0.12, 0.04])
        for up, table in ((edges, errors[1:]), (zero, errors[:1])):
            cells = _edges(steps), up
            shown = np.ma.masked_invalid(table).clip(_BOUNDS[0], _BOUNDS[-1] * 0.999)
            place.pcolormesh(*cells, shown, cmap=colours, norm=norm)
            none = np.isinf(table)
            _hatch(place, *cells, (table > 1.0) & ~none, "///")
            _hatch(place, *cells, none, "xxx")
        place.set(xscale="log", yscale="log", ylim=(zero[0], edges[-1]))
        place.set_title(one["method"], fontsize=10.5)
        place.set_xlabel("step size ω₀h" if one["axis"] == "ω0 h" else "tolerance rtol")
        decades = [zeta for zeta in (1e-2, 1.0, 1e2) if zeta >= edges[0]]
        place.set_yticks([math.sqrt(zero[0] * zero[1]), *decades], ["0", *map(_power, decades)])
        place.set_yticks([], minor=True)
        place.grid(False)
        if one["axis"] == "rtol":
            place.invert_xaxis()
        elif one["method"] in STEPPING:
            _limit(place, one["method"], steps, damping)
    for place in axes[:, 0]:
        place.set_ylabel("damping ratio ζ")
    scale = figures.plt.cm.ScalarMappable(norm, colours)
    bar = figure.colorbar(scale, ax=axes, shrink=0.9, extend="max", spacing="uniform")
    bar.set_ticks(_BOUNDS, labels=[*map(_power, _BOUNDS)])
    bar.set_label("error (hatched above 1)")
    limit = Line2D([], [], color=figures.BLACK, ls="--")
    keys = {
        "limit of stability from theory (stable to the left)": limit,
        "error above 1": Patch(fc="white", ec="black", hatch="///"),
        "no end of contact found": Patch(fc="white", ec="black", hatch="xxx"),
    }
    figure.legend(keys.values(), keys, loc="outside lower left", ncols=3)
    return figures.png(figure)


def _hatch(place: Any, across: np.ndarray, up: np.ndarray, chosen: np.ndarray, hatch: str) -> None:
    """Hatch these cells as one area; `chosen` of shape (up, across), without the last edges."""
    turns = ((0, 0), (0, 1), (1, 1), (1, 0), (0, 0))
    cells = [
        Path([(across[column + n], up[row + m]) for m, n in turns], closed=True)
        for row, column in np.argwhere(chosen)
    ]
    if cells:
        area = Path.make_compound_path(*cells)
        place.add_patch(PathPatch(area, fc="none", ec="0.35", lw=0.0, hatch=hatch))


def _power(value: float) -> str:
    return f"$10^{{{math.log10(value):.0f}}}$"


def _edges(centres: np.ndarray) -> np.ndarray:
    """Between which the cells of a logarithmic axis lie, all of one width."""
    low, high = np.log10(centres[[0, -1]])
    half = 0.5 * (high - low) / (len(centres) - 1)
    return np.logspace(low - half, high + half, len(centres) + 1)


def _limit(place: Any, method: str, steps: np.ndarray, damping: np.ndarray) -> None:
    """The edge of stability: explicit Euler's in closed form, the others' from their matrices."""
    _, step = STEPPING[method]
    falling = np.geomspace(steps[-1], steps[0], 400).tolist()
    drawn = []
    for zeta in np.geomspace(damping[1], damping[-1], 200).tolist():
        if method == "explicit Euler":
            x = euler_limit(zeta)
        else:
            # Below the smallest unstable step all are stable.
            unstable = bisect_left(falling, True, key=partial(stable, step, zeta=zeta))
            x = falling[unstable - 1] if unstable else math.inf
        if falling[-1] < x <= falling[0]:  # else it is beside the map
            drawn.append((x, zeta))
    place.plot(*zip(*drawn), color="white", lw=4.0)
    place.plot(*zip(*drawn), color=figures.BLACK, ls="--")
