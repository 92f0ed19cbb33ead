"""Partial derivatives of an impact's results, exact to rounding: by a complex step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from golf_impact.arrays import impacts
from golf_impact.arrays.contacts import Contacts
from golf_impact.arrays.elementwise import Values
from golf_impact.arrays.power_law import POWER_LAW
from golf_impact.errors import UserError
from golf_impact.runs import FLAGS

#: Relative; of a variable below `_TINY`, where it would underflow, absolute (SI). Its square is far
#: below rounding.
_STEP, _TINY = 1e-30, 1e-200


@np.errstate(all="ignore")
def sensitivities(
    outputs: Sequence[str], wrt: Sequence[str], values: Mapping[str, Any]
) -> dict[str, dict[str, np.ndarray]]:
    """See `golf_impact.sensitivities`."""
    impacts.check_names(outputs, (*values, *wrt))
    for name in (*outputs, *wrt):
        # The closed forms are those of a head without a force.
        if name in (*FLAGS, *impacts.MOMENTARY, "force", "law", "club_force"):
            why = (
                "sensitivities are those of a contact's results, not of flags or of values at the "
                "end of the simulated time, over numbers other than law and club_force"
            )
            raise UserError(f"{name} is refused: {why}", name, reason=why)
    arrays, shape = impacts.as_arrays(values)
    outcome = impacts.impacts(("touched", *outputs), arrays, shape)
    _check(
        outcome.scalar & outcome.columns["touched"],
        "its contact must be a closed form: underdamped, without a club_force, with a COR that "
        "isn't far below golf's",
    )
    slopes = {name: {of: np.full(shape, np.nan) for of in wrt} for name in outputs}
    columns = impacts.columns_of(arrays, shape)
    for places, contacts in impacts.closed_contacts(columns, outcome.refused.size):
        count = len(outcome.refused.ravel()[places])
        for of in wrt:
            for name, slope in _slopes(contacts, outputs, of).items():
                slopes[name][of].reshape(-1)[places] = impacts.first(slope, count)
    for name, row in slopes.items():
        for of, slope in row.items():
            _check(np.isinf(slope), f"{name} has no finite slope over {of} there")
    return slopes


def _check(wrong: np.ndarray, why: str) -> None:
    if wrong.any():
        place = np.argwhere(wrong)[0].tolist()
        case = f"the case at {place}" if place else "this impact"
        raise UserError(f"{case} has no sensitivities: {why}")


def _slopes(contacts: Contacts, outputs: Sequence[str], of: str) -> dict[str, Values]:
    """Derivatives by one variable; infinite where there is none."""
    values = {name: getattr(contacts, name) for name in impacts.DEFAULTS}
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
        slopes[name] = np.where(no_slope, np.inf, np.imag(getattr(stepped, name)) / step)[()]
    return slopes
