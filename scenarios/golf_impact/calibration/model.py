"""What a contact law gives for measurements, and the derivatives over its parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from golf_impact.api import run_impact, run_trajectory
from golf_impact.arrays.impacts import closed_contact
from golf_impact.calibration.intervals import ends_of
from golf_impact.calibration.measurements import (
    IMPACT,
    LAW_PARAMETERS,
    TARGETS,
    Measurements,
)
from golf_impact.errors import UserError

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: What a law is given beside its parameters.
_LAW = ("law", "reference_compression", *LAW_PARAMETERS)

#: Rows in contact above which the force is a cubic spline between so many instants, denser towards
#: touch; instants where the contact isn't in closed form, so that each of them takes longer.
_INSTANTS, _SCALAR_INSTANTS = 1000, 300

#: The step of a difference over an instant of touch, in its unit.
_TOUCH = 1e-3

#: The unit of an instant of touch, of a drift over time.
MICRO, PER_MS = 1e-6, 1e3


#: Parameters that each curve has of its own; so may be k.
_OF_CURVES = ("touch", "offset", "drift")


def of_curve(name: str, curve: str) -> str:
    """The name of a parameter that belongs to one of several curves: touch_2 of curve_2."""
    return name + curve.removeprefix("curve")


def split_name(name: str) -> tuple[str, str]:
    """The inverse of `of_curve`; of k and others that belong to all curves, without a curve."""
    of, _, number = name.partition("_")
    return (of, f"curve_{number}" if number else "curve") if of in _OF_CURVES else (name, "")


class Model:
    """A law's values for all that is measured.

    Its values have the FMU's names (SI units). A curve has besides `touch` (µs since its origin),
    `offset` (N) and `drift` (N/ms) of its baseline, and perhaps a stiffness of its own: `touch_2`,
    `k_2` are those of the second one.
    """

    def __init__(self, data: Measurements) -> None:
        self.data = data

    def __call__(self, values: Mapping[str, float]) -> np.ndarray:
        """Shape (n,). UserError: the physics rejects a value, or the bodies don't separate."""
        data, parts = self.data, []
        if data.targets:
            found = self.scalars(data.targets, values)
            parts.append(np.array([*found.values()]))
        parts += [self.curve(name, values) for name in data.curves]
        if data.cor_speeds:
            # Law 2 takes its damping from this line.
            rest, slope = (values[name] for name in LINE)
            parts.append(rest - slope * data.cor_speeds.x)
            if parts[-1].min() <= 0.0:
                raise UserError("COR isn't above 0 at these speeds")
        parts.append(np.array([values[name] for name in data.priors]))
        return np.concatenate(parts)

    def scalars(self, names: Any, values: Mapping[str, float]) -> dict[str, float]:
        """Scalars of these names, by the physics of the FMU to the last bit."""
        impact = _impact(self.data.impact, values)
        found = run_impact([TARGETS[name] for name in names], **impact)
        if any(map(np.isnan, found.values())):
            raise UserError("the bodies don't separate")
        return dict(zip(names, found.values()))

    def curve(self, name: str, values: Mapping[str, float]) -> np.ndarray:
        """Force and baseline of a curve, N."""
        curve = self.data.curves[name]
        own = {of: values.get(of_curve(of, name), 0.0) for of in ("touch", "offset", "drift")}
        since = curve.x - curve.origin
        impact = _impact(curve.impact, values)
        impact["k"] = values.get(of_curve("k", name), values["k"])
        baseline = own["offset"] + own["drift"] * PER_MS * since
        return _forces(since - MICRO * own["touch"], impact) + baseline

    def slopes(
        self, values: Mapping[str, float], names: Sequence[str], near: float = 0.0
    ) -> np.ndarray:
        """Derivatives (n, p) over the parameters of these names, by central differences.

        Rows within so many spacings of touch have none over its instant: the force jumps or rises
        steeply there.
        """
        columns = np.zeros((len(names), len(self.data.values)))
        for column, name in zip(columns, names):
            of, curve = split_name(name)
            if of not in _OF_CURVES:
                ends = ends_of("k" if of.startswith("k") else of, values[name])
                low, high = (self({**values, name: end}) for end in ends)
                column[:] = (high - low) / (ends[1] - ends[0])
                continue
            one, rows = self.data.curves[curve], column[self.data.groups[curve]]
            since = one.x - one.origin
            if of == "touch":
                touch = values[name]
                late, early = (
                    self.curve(curve, {**values, name: touch + s}) for s in (_TOUCH, -_TOUCH)
                )
                rows[:] = (late - early) / (2.0 * _TOUCH)
                close = max(near * one.spacing, 2.0 * _TOUCH * MICRO)
                rows[abs(since - MICRO * touch) <= close] = 0.0
            else:
                rows[:] = 1.0 if of == "offset" else PER_MS * since
        return columns.T


def _impact(conditions: Mapping[str, float], values: Mapping[str, float]) -> dict[str, float]:
    """Inputs and parameters of an impact: the law's, and conditions that may be fitted."""
    law = {name: values[name] for name in _LAW if name in values}
    return {**conditions, **law, **{name: values[name] for name in IMPACT if name in values}}


def _forces(times: np.ndarray, impact: Mapping[str, float]) -> np.ndarray:
    """Contact force at times since first touch, N."""
    force, contact = np.zeros(times.shape), closed_contact(impact)
    most, end = _INSTANTS, contact.contact_time if contact else 0.0
    if contact is None:
        most, end = _SCALAR_INSTANTS, run_impact(["contact_time"], **impact)["contact_time"]
    if not end > 0.0:
        raise UserError("the bodies don't separate")
    inside = (times > 0.0) & (times < end)
    rows = instants = times[inside]
    if len(rows) > most:
        instants = end * np.linspace(1e-3, 1.0 - 1e-9, most) ** 2
    if contact:
        sampled = contact.forces(instants)
    else:
        sampled = run_trajectory(0, ["force"], times=instants, **impact)["force"]
    if rows is not instants:
        from scipy.interpolate import CubicSpline

        sampled = CubicSpline(np.sqrt(instants), sampled)(np.sqrt(rows))
    force[inside] = sampled
    return force
