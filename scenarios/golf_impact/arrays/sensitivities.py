"""Partial derivatives of an impact's results, exact to rounding: by a complex step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from golf_impact.arrays.contacts import Contacts
from golf_impact.arrays.elementwise import Values
from golf_impact.arrays.impacts import (
    DEFAULTS, MOMENTARY, as_arrays, check_names, closed_contacts, columns_of, first, impacts,
)  # fmt: skip
from golf_impact.arrays.power_law import PowerLawContacts
from golf_impact.arrays.trajectory import closed_contact, in_blocks
from golf_impact.errors import UserError
from golf_impact.runs import FLAGS

#: Relative; of a variable that is 0, absolute (SI). Its square is far below rounding.
_STEP = 1e-30


def sensitivities(
    outputs: Sequence[str], wrt: Sequence[str], values: Mapping[str, Any]
) -> dict[str, dict[str, np.ndarray]]:
    """See `golf_impact.sensitivities`."""
    check_names(outputs, dict.fromkeys((*values, *wrt)))
    for name in (*outputs, *wrt):
        if name in (*FLAGS, *MOMENTARY, "force", "law"):
            raise UserError(
                f"{name} is refused: sensitivities are those of a contact's results, not of flags "
                "or of values at the end of the simulated time, over numbers other than law"
            )
    arrays, shape = as_arrays(values)
    outcome = impacts(("touched", *outputs), arrays, shape)
    _check(
        outcome.scalar & outcome.columns["touched"],
        "its contact must be a closed form: underdamped, with a COR that isn't far below golf's",
    )
    columns, number = columns_of(arrays, shape), outcome.refused.size
    slopes = {name: {of: np.full(number, np.nan) for of in wrt} for name in outputs}
    for places, contacts in closed_contacts(columns, number, False):
        found = len(outcome.refused.ravel()[places])
        for of in wrt:
            for name, slope in _slopes(contacts, outputs, of).items():
                slopes[name][of][places] = first(slope, found)
    for name, row in slopes.items():
        for of in row:
            row[of] = row[of].reshape(shape)
            _check(np.isinf(row[of]), f"{name} has no finite slope over {of} there")
    return slopes


def _check(wrong: np.ndarray, why: str) -> None:
    if wrong.any():
        place = np.argwhere(wrong)[0].tolist()
        case = f"the case at {place}" if place else "this impact"
        raise UserError(f"{case} has no sensitivities: {why}")


@np.errstate(all="ignore")
def _slopes(contacts: Contacts, outputs: Sequence[str], of: str) -> dict[str, Values]:
    """Derivatives by one variable; infinite where there is none."""
    stepped, step = _stepped(contacts, of)
    slopes = {name: np.imag(getattr(stepped, name)) / step for name in outputs}
    none: Any = False
    if of == "restitution_at_rest":
        none = contacts.restitution_at_rest == 0.0
    elif of == "exponent":
        none = not isinstance(contacts, PowerLawContacts)
    slopes = {name: np.where(none, np.inf, slope)[()] for name, slope in slopes.items()}
    if isinstance(contacts, PowerLawContacts):
        # Time passes as a power of x: its slope over the damping is infinite where that is 0.
        none = (contacts.zeta == 0.0) & (np.imag(stepped.zeta) != 0.0)
        for name in {"contact_time", "contact_displacement"} & slopes.keys():
            slopes[name] = np.where(none, np.inf, slopes[name])[()]
    return slopes


def _stepped(contacts: Contacts, of: str) -> tuple[Contacts, Values]:
    """The contacts after an imaginary step of one variable, and that step."""
    values = {name: getattr(contacts, name) for name in DEFAULTS}
    step = _STEP * np.where(values[of] == 0.0, 1.0, np.abs(values[of]))[()]
    values[of] = values[of] + 1j * step
    return type(contacts)(values), step


@np.errstate(all="ignore")
def force_slopes(
    times: np.ndarray, wrt: Sequence[str], values: Mapping[str, float]
) -> dict[str, np.ndarray] | None:
    """Partial derivatives of `trajectory.forces` at these times by each of these variables.

    None if the contact isn't in closed form; the exponent must be above 1 if it is one of them.
    """
    contact = closed_contact(values)
    if contact is None:
        return None
    stepped = {of: _stepped(contact, of) for of in wrt}

    def slopes(t: np.ndarray) -> dict[str, Values]:
        inside = t < contact.contact_time
        rows = {}
        for of, (contacts, step) in stepped.items():
            slope = np.imag(contacts.states(np.where(inside, t, 0.0)).force) / step
            # Powers of a compression of 0 have no derivative by the exponent.
            rows[of] = np.where(inside & ~np.isnan(slope), slope, 0.0)
        return rows

    return in_blocks(slopes, wrt, times)
