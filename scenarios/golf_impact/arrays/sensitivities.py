"""Partial derivatives of an impact's results, exact to rounding: by a complex step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from golf_impact.arrays.contacts import Contacts, Values
from golf_impact.arrays.impacts import DEFAULTS, Columns, closed_contacts, impacts
from golf_impact.arrays.relative import POWER_LAW
from golf_impact.runs import Named

#: Relative; of a variable below `_TINY`, where it would underflow, absolute (SI). Its square is far
#: below rounding.
_STEP, _TINY = 1e-30, 1e-200

_NOT_CLOSED = (
    "its contact must be a closed form: underdamped, without a club_force, with a COR that isn't "
    "far below golf's"
)


class Sensitivities(Named[dict[str, np.ndarray]]):
    """Derivatives by output and variable, arrays of the shape of the cases."""

    refused: np.ndarray  #: whether the physics rejects a case, bool
    reason: str = ""  #: why a derivative is NaN in the first case with one, in C order


def sensitivities(
    outputs: Sequence[str], wrt: Sequence[str], columns: Columns, shape: tuple[int, ...]
) -> Sensitivities:
    """See `golf_impact.sensitivities`; arguments as of `impacts`."""
    found = impacts(("touched",), columns, shape)
    slopes = {name: {of: np.full(shape, np.nan) for of in wrt} for name in outputs}
    for places, contacts in closed_contacts(columns, found.closed.size):
        for of in wrt:
            for name, slope in _slopes(contacts, outputs, of).items():
                slopes[name][of].flat[places] = np.where(contacts.closed, slope, np.nan)
    results = Sensitivities(slopes)
    results.refused = found.refused
    missing = {
        (n, of): np.isnan(slope).ravel() for n, row in slopes.items() for of, slope in row.items()
    }
    if np.any([*missing.values()]):
        first = int(np.argmax(np.any([*missing.values()], axis=0)))
        name, of = next(pair for pair, nan in missing.items() if nan[first])
        if found.refused.flat[first]:
            results.reason = found.reason
        elif not found["touched"].flat[first]:
            results.reason = "the bodies don't touch"
        elif not found.closed.flat[first]:
            results.reason = _NOT_CLOSED
        else:
            results.reason = f"{name} has no finite slope over {of} there"
    return results


def _slopes(contacts: Contacts, outputs: Sequence[str], of: str) -> dict[str, Values]:
    """Derivatives by one variable; NaN where there is none."""
    values = {name: getattr(contacts, name) for name in DEFAULTS}
    size = np.abs(values[of])
    step = _STEP * np.where(size < _TINY, 1.0, size)[()]
    stepped = Contacts(contacts.formulas, values | {of: values[of] + 1j * step})
    power_law = contacts.formulas is POWER_LAW
    none: Any = of == "exponent" and not power_law
    if of == "restitution_at_rest":
        none = contacts.restitution_at_rest == 0.0
    slopes = {}
    for name in outputs:
        no_slope = none
        if power_law and name in ("contact_time", "contact_displacement"):
            # Time passes as a power of x: without damping its slope over the damping is infinite.
            no_slope = no_slope | ((contacts.zeta == 0.0) & (np.imag(stepped.zeta) != 0.0))
        slope = np.imag(getattr(stepped, name)) / step
        slopes[name] = np.where(no_slope | ~np.isfinite(slope), np.nan, slope)
    return slopes
