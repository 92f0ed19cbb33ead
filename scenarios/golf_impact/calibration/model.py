"""What a contact law gives for measurements, all rows of a curve at once, and its derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from golf_impact.arrays.impacts import DEFAULTS
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.arrays.trajectory import closed_contact, forces
from golf_impact.calibration.measurements import TARGETS, Measurements, Series
from golf_impact.errors import UserError

#: The parameters of COR = first − second · approach speed; they replace b.
LINE = ("restitution_at_rest", "restitution_slope")

#: The complex step (`golf_impact.arrays.sensitivities`), relative; where contact isn't in closed
#: form, that of differences.
_STEP, _DIFFERENCE = 1e-30, 1e-6

#: Rows in contact above which derivatives are computed at so many instants, denser towards touch,
#: and interpolated: to 1e-6 of the largest, where the fit needs a direction and standard errors.
#: So are forces that aren't in closed form, by cubic splines.
_INSTANTS = 1000


class NotAnalyticError(UserError):
    """There is no complex step: the contact isn't in closed form."""


class Model:
    """A law's values for all measured ones; values of impacts (SI units) may be complex.

    Beside the FMU's names they have `touch`, the instant by a curve's clock, s; those that belong
    to one of several curves end with its number: `touch 2`, `k 2`.
    """

    def __init__(self, data: Measurements) -> None:
        self.data, self.physics = data, ScalarImpacts()

    def __call__(self, values: Mapping[str, Any]) -> np.ndarray:
        """Shape (n,); of stepped values only the imaginary part has a meaning.

        UserError: the physics rejects a value, or the bodies don't separate.
        """
        data, ball = self.data, {name: v for name, v in values.items() if name in DEFAULTS}
        stepped = _is_stepped(*values.values())
        parts: list[Any] = [self.scalars(data.targets, {**ball, **data.impact}, stepped)]
        for name, curve in data.curves.items():
            own = name.removeprefix("curve")
            of_curve = {**ball, "k": values.get(f"k{own}", values["k"]), **curve.impact}
            parts.append(self._forces(curve, of_curve, values[f"touch{own}"], stepped))
        if data.cor_speeds:
            # Law 2 takes its damping from this line.
            rest, slope = (values[name] for name in LINE)
            parts.append(rest - slope * data.cor_speeds.x)
            if np.real(parts[-1]).min() <= 0.0:
                raise UserError("COR isn't above 0 at these speeds")
        return np.concatenate(parts)

    def scalars(self, names: Iterable[str], impact: Mapping[str, Any], stepped: bool) -> list[Any]:
        """Scalar targets of these names."""
        outputs = [TARGETS[name] for name in names]
        if not (outputs or stepped):
            return []
        if not stepped:
            # The physics of the FMU to the last bit.
            values = self.physics.impact(outputs, **impact)
            self._check_separation()
            return [*values.values()]
        if not (outputs and _is_stepped(*impact.values())):
            return [0.0] * len(outputs)
        contact = _contact(impact)
        return [getattr(contact, output) for output in outputs]

    def _check_separation(self) -> None:
        if not self.physics.read_flag("separated"):
            raise UserError("the bodies don't separate")

    def _forces(
        self, curve: Series, impact: Mapping[str, Any], touch: Any, stepped: bool
    ) -> np.ndarray:
        times, force = curve.x - touch, np.zeros(curve.x.shape)
        if not stepped:
            if found := closed_contact(impact):
                return forces(times, found)
            end = self.physics.impact(("contact_time",), **impact)["contact_time"]
            self._check_separation()
            inside = (times > 0.0) & (times < end)
            rows = instants = times[inside]
            if len(rows) > _INSTANTS:
                instants = end * np.linspace(1e-3, 1.0 - 1e-9, _INSTANTS) ** 2
            self.physics.start(**impact)
            sampled = self.physics.sample(np.append(0.0, instants), ("force",))["force"][1:]
            if rows is not instants:
                from scipy.interpolate import CubicSpline

                sampled = CubicSpline(np.sqrt(instants), sampled)(np.sqrt(rows))
            force[inside] = sampled
            return force
        if not _is_stepped(touch, *impact.values()):
            return force
        contact, begin = _contact(impact), np.real(touch)
        end = begin + np.real(contact.contact_time)
        if np.count_nonzero((curve.x > begin) & (curve.x < end)) <= _INSTANTS:
            return forces(times, contact)
        instants = begin + (end - begin) * np.linspace(0.0, 1.0, _INSTANTS) ** 2
        slopes = forces(instants - touch, contact).imag
        return 1j * np.interp(curve.x, instants, slopes, left=0.0, right=0.0)

    def slopes(
        self, at: Callable[[np.ndarray], Mapping[str, Any]], x: np.ndarray, bounds: np.ndarray
    ) -> np.ndarray:
        """Derivatives (n, p) of the values by the coordinates x, (p,), from which `at` has them.

        Exact by complex steps, or by central differences, one-sided at the `bounds`, (2, p).
        """
        columns = []
        for unit, value, low, high in zip(np.eye(len(x)), x, *bounds):
            step = _STEP * (abs(value) or 1.0)
            try:
                columns.append(np.imag(self(at(x + 1j * step * unit))) / step)
            except NotAnalyticError:
                step = _DIFFERENCE * max(abs(value), 1.0)
                ends = max(low, value - step), min(high, value + step)
                first, last = (self(at(np.where(unit, end, x))) for end in ends)
                columns.append((last - first) / (ends[1] - ends[0]))
        return np.array(columns).T


def _is_stepped(*values: Any) -> bool:
    return any(map(np.iscomplexobj, values))


def _contact(values: Mapping[str, Any]) -> Any:
    contact = closed_contact(values)
    n, b = values.get("exponent", 2.0), values.get("b", 1.0)
    # Formulas of exponent 1 don't contain it; without damping times have no slope over it.
    if contact is None or (_is_stepped(n) and n.real == 1.0) or (_is_stepped(b) and b.real == 0.0):
        raise NotAnalyticError("the contact isn't in closed form")
    return contact
