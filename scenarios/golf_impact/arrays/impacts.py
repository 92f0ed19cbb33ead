"""Many impacts at once: by arrays where a contact is a closed form, else by the scalar physics."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from golf_physics.instance import Instance
from golf_physics.variables import VARIABLES

from golf_impact.arrays.absolute import ABSOLUTE
from golf_impact.arrays.contacts import Contacts
from golf_impact.arrays.relative import POWER_LAW, RELATIVE
from golf_impact.errors import UserError
from golf_impact.quantities import START
from golf_impact.runs import ImpactRuns

#: Cases at a time, so that arrays stay in a processor's cache.
_BLOCK = 4096

#: Values for which arrays are used: far inside all that the physics accepts, so that it alone
#: states why it rejects others. So are approach and club speed (m/s) and touch time (s).
_RANGES = {
    "k": (1.0, 1e12), "b": (0.0, 1e6), "club_speed": (-1e4, 1e4), "ball_speed": (-1e4, 1e4),
    "m_club": (1e-4, 1e4), "m_ball": (1e-4, 1e4), "ball_diameter": (1e-6, 1e6), "gap": (0.0, 1e3),
    "exponent": (1.0, 12.0), "reference_compression": (1e-6, 10.0),
    "restitution_at_rest": (0.0, 1.0), "restitution_slope": (0.0, 1e6), "club_force": (0.0, 0.0),
}  # fmt: skip
_LEAST_SPEED, _LATEST_TOUCH = 1e-3, 10.0

#: Outputs that go on changing after separation, for which there are no arrays.
MOMENTARY = frozenset(row.name for row in VARIABLES if row.momentary)

#: Inputs and parameters by name (SI units): numbers, or arrays of shape (cases,).
Columns = Mapping[str, Any]

DEFAULTS: dict[str, Any] = {name: np.float64(value) for name, value in START.items()}


class ScalarImpacts(ImpactRuns, Instance):
    """Single impacts by the scalar physics; methods raise UserError for what it refuses."""

    error = UserError


def closed_contacts(columns: Columns, number: int) -> Iterator[tuple[np.ndarray, Contacts]]:
    """Contacts that may be `closed`, and the numbers of their cases."""
    for begin in range(0, number, _BLOCK):
        end = min(begin + _BLOCK, number)
        block = _at(slice(begin, end), DEFAULTS | dict(columns))
        law, linear, ordinary = block["law"], block["exponent"] == 1.0, _ordinary(block)
        for formulas, chosen in (
            (ABSOLUTE, (law == 1.0) & linear & (block["restitution_at_rest"] == 0.0)),
            (RELATIVE, (law == 2.0) & linear),
            (POWER_LAW, (law == 2.0) & np.logical_not(linear)),
        ):
            inside = np.flatnonzero(np.broadcast_to(ordinary & chosen, end - begin))
            if len(inside):
                values = {name: _shortest(value) for name, value in _at(inside, block).items()}
                yield begin + inside, Contacts(formulas, values)


def _at(places: slice | np.ndarray, columns: Columns) -> dict[str, Any]:
    return {name: value[places] if np.ndim(value) else value for name, value in columns.items()}


def _shortest(value: Any) -> Any:
    """One number for equal elements: formulas of it cost less."""
    return value[0] if np.ndim(value) and (value == value[0]).all() else value


def _ordinary(block: Columns) -> Any:
    closing = block["club_speed"] - block["ball_speed"]
    inside: Any = (closing >= _LEAST_SPEED) & (np.abs(block["club_speed"]) >= _LEAST_SPEED)
    inside = inside & (block["gap"] <= _LATEST_TOUCH * closing)
    for name, (low, high) in _RANGES.items():
        inside = inside & (block[name] >= low) & (block[name] <= high)
    return inside


def closed_contact(values: Mapping[str, float]) -> Contacts | None:
    """The contact of one impact (SI units), if it is in closed form."""
    columns = {name: np.float64(value) for name, value in values.items()}
    return next((contact for _, contact in closed_contacts(columns, 1) if contact.closed), None)
