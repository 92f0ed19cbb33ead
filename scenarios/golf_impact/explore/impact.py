"""One impact through the FMU: its metrics, its curves, and its metrics over one variable."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from golf_impact.errors import UserError
from golf_impact.fmu.impact_fmu import METRICS, PATH, ImpactFmu
from golf_impact.report.report import derive_metrics

#: Communication points before touch, in contact, after it.
POINTS = (12, 160, 28)

#: What is shown over one variable, at how many of its values.
SWEPT_METRICS = ("smash_factor", "coefficient_of_restitution")
SWEPT = 25


@dataclass(frozen=True)
class Impact:
    """What the page shows of a case; SI units."""

    values: dict[str, float]  #: all inputs and parameters
    changed: dict[str, float]  #: those of them that aren't the FMU's start values
    metrics: dict[str, float]  #: the FMU's and those derived, by the names of results.json
    #: Columns by name, arrays of one shape: time since touch, the FMU's outputs (positions from
    #: where the bodies touch), energies, and what the animation draws.
    path: dict[str, np.ndarray]
    touched: bool  #: whether the bodies ever meet
    separated: bool  #: whether they part


def explored(fmu: ImpactFmu, values: Mapping[str, float]) -> Impact:
    """Run a case (all inputs and parameters, SI): in one step for metrics, in many for curves.

    Raises:
        UserError: the FMU refuses a value; the message is the FMU's own.
    """
    values = dict(values)
    changed = _changed(fmu, values)
    outputs = fmu.impact(METRICS, **changed)
    touched, separated = fmu.read_flag("touched"), fmu.read_flag("separated")
    metrics = derive_metrics(outputs, values)
    for body in ("club", "ball"):
        energy = 0.5 * values[f"m_{body}"] * metrics[f"{body}_velocity"] ** 2
        metrics[f"{body}_energy_share"] = _ratio(energy, metrics["kinetic_energy_initial"])
    metrics["compression_over_diameter"] = metrics["max_compression"] / values["ball_diameter"]
    metrics["momentum_kept"] = _ratio(metrics["momentum_final"], metrics["momentum_initial"])
    path = _path(fmu, values, metrics, touched, separated)
    return Impact(values, changed, metrics, path, touched, separated)


def _changed(fmu: ImpactFmu, values: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in values.items() if value != fmu.default(name)}


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else math.nan


def nice(limit: float) -> float:
    """The next of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten: the end of an axis."""
    if not 0.0 < limit < math.inf:
        return 1.0
    power = 10.0 ** math.floor(math.log10(limit))
    steps = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
    return next((step * power for step in steps if step * power >= limit), 10.0 * power)


def _path(
    fmu: ImpactFmu, values: dict[str, float], metrics: dict[str, float], touched: bool, parted: bool
) -> dict[str, np.ndarray]:
    contact = metrics["contact_time"] if parted else fmu.half_period(values).item()
    if touched and not parted:
        contact *= 10.0  # the time in which it takes shape
    end = nice(1.15 * contact)
    times = _times(contact, end, metrics["time_of_max_force"])
    # The approach is shown as well, whatever the gap of the case is.
    lead = -times[0]
    if touched:
        values = {**values, "gap": (values["club_speed"] - values["ball_speed"]) * lead}
    host = np.concatenate(([0.0], times[1:] + lead))
    if host[-1] + lead == host[-1] or (np.diff(host) <= 0.0).any():
        raise UserError(f"a contact of {contact:g} s is too short or too long to be drawn")
    fmu.start(**_changed(fmu, values))
    outputs = fmu.sample(host, PATH)
    touch = fmu.read(("touch_time",))["touch_time"] if touched else 0.0
    path = {"time": host - touch, **outputs}
    for body in ("club", "ball"):
        path[f"{body}_position"] -= values["ball_speed"] * touch
    return path | _energies(values, path) | _shapes(values, path)


def _times(contact: float, end: float, peak: float) -> np.ndarray:
    """Since touch: just before and after it, closer at both ends of contact, its peak, its end."""
    before, within, after = POINTS
    close = 1e-6 * contact
    share = np.linspace(0.0, 1.0, within)
    inside = contact * (0.5 * share + 0.25 * (1.0 - np.cos(np.pi * share)))
    if 0.0 < peak < contact:
        inside[np.argmin(np.abs(inside[1:-1] - peak)) + 1] = peak
    inside[0] = close
    lead = np.linspace(-0.1 * end, -close, before)
    return np.concatenate((lead, inside, np.linspace(contact, end, after)[1:]))


def _energies(values: Mapping[str, float], path: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Where the energy is, J: the spring's is ∫ k d_r (d/d_r)^n dd."""
    n, length = values["exponent"], values["reference_compression"]
    club, ball = (
        0.5 * values[f"m_{body}"] * path[f"{body}_velocity"] ** 2 for body in ("club", "ball")
    )
    squeezed = path["compression"] / length
    spring = values["k"] * length**2 / (n + 1.0) * squeezed ** (n + 1.0)
    lost = club[0] + ball[0] - club - ball - spring
    return {"club_energy": club, "ball_energy": ball, "spring_energy": spring, "lost_energy": lost}


def _shapes(values: Mapping[str, float], path: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The ball, an ellipse that keeps its volume when it is compressed, and the club; m."""
    diameter = values["ball_diameter"]
    width = np.maximum(diameter - path["compression"], 0.02 * diameter)
    club = np.full_like(width, 1.2 * diameter)
    return {
        "club_height": club,
        "club_back": path["club_position"] - 0.6 * club,
        "ball_middle": path["ball_position"] + diameter - 0.5 * width,
        "ball_width": width,
        "ball_height": diameter * np.sqrt(diameter / width),
    }


def swept(
    fmu: ImpactFmu, values: Mapping[str, float], name: str, low: float, high: float
) -> dict[str, np.ndarray]:
    """S and COR over one variable; NaN where the FMU refuses the value or the bodies never meet.

    Returns:
        `x` (SI), `smash_factor` and `coefficient_of_restitution`, arrays of shape (SWEPT,).
    """
    xs = np.linspace(low, high, SWEPT)
    table = np.full((SWEPT, len(SWEPT_METRICS)), math.nan)
    given = _changed(fmu, values)
    for n, x in enumerate(xs.tolist()):
        try:
            outputs = fmu.impact(SWEPT_METRICS, **{**given, name: x})
        except UserError:
            continue
        if fmu.read_flag("touched"):
            table[n] = list(outputs.values())
    return {"x": xs, **dict(zip(SWEPT_METRICS, table.T.copy()))}
