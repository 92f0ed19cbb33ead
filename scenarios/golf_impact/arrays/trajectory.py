"""One impact at any instants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from golf_impact.arrays.contacts import Contacts, States
from golf_impact.arrays.impacts import BLOCK, check_names, closed_contacts, columns_of, padded
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError


def run_trajectory(
    outputs: Sequence[str], times: Any, values: Mapping[str, Any]
) -> dict[str, np.ndarray]:
    """See `golf_impact.run_trajectory`; without the times.

    Raises:
        UserError: the physics rejects a value or there is no variable of a name; a time isn't a
            finite number of at least 0; the mean force, which is that of a communication step.
    """
    check_names(outputs, values)
    times = np.asarray(times, float)
    if not np.all((times >= 0.0) & (times < np.inf)):
        raise UserError("times are refused: each must be a finite number of at least 0 s")
    if "mean_force" in outputs:
        raise UserError(
            "mean_force is refused with times: it is that of a communication step; use points"
        )
    runs = ScalarImpacts()
    runs.start(**values)
    contact = closed_contact(values)
    known = {*States._fields, "momentum", "kinetic_energy"}
    if contact is not None and known.issuperset(outputs):
        return _by_arrays(contact, outputs, times)
    instants, places = np.unique(times, return_inverse=True)
    ahead = instants[:1] > 0.0
    samples = runs.sample(np.concatenate([np.zeros(np.sum(ahead)), instants]), outputs)
    return {name: row[places.reshape(times.shape) + np.sum(ahead)] for name, row in samples.items()}


def forces(times: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
    """Contact force (N) of an impact without a gap at these times since first touch (s, >= 0)."""
    return run_trajectory(("force",), times, {**values, "gap": 0.0})["force"]


def closed_contact(values: Mapping[str, Any]) -> Contacts | None:
    """The contact of one impact, if it is in closed form."""
    with np.errstate(all="ignore"):
        for _, contact in closed_contacts(columns_of(values, ()), 1, False):
            if contact.closed:
                return contact
    return None


@np.errstate(all="ignore")
def _by_arrays(contact: Contacts, outputs: Sequence[str], times: np.ndarray) -> dict[str, Any]:
    flat = times.ravel()
    results = {name: np.empty(flat.shape) for name in outputs}
    for begin in range(0, flat.size, BLOCK):
        part = slice(begin, min(begin + BLOCK, flat.size))
        count = part.stop - begin
        states = _states(contact, padded({"time": flat}, part, count)["time"])
        for name, column in results.items():
            if name == "momentum":
                value = contact.m_club * states.club_velocity + contact.m_ball * states.ball_velocity
            elif name == "kinetic_energy":
                value = contact.energy(states.club_velocity, states.ball_velocity)
            else:
                value = getattr(states, name)
            column[part] = value[:count]
    return {name: column.reshape(times.shape) for name, column in results.items()}


def _states(contact: Contacts, times: np.ndarray) -> States:
    """At these times since the start of the run, s."""
    t, lasts = times - contact.touch_time, contact.contact_time
    inside = contact.states(np.clip(t, 0.0, lasts))
    before, after = t < 0.0, t >= lasts
    past = t - lasts
    origin = contact.ball_speed * contact.touch_time
    d = np.where(before, contact.closing * t, inside.compression)
    apart = contact.d_end + (contact.ball_velocity - contact.club_velocity) * -past
    d = np.where(after, apart, np.where(before, d, np.maximum(d, 0.0)))
    x_ball = np.where(before, contact.ball_speed * t, inside.club_position - d)
    x_ball = np.where(
        after, contact.contact_displacement + contact.ball_velocity * past, x_ball
    )
    return States(
        force=np.where(before | after, 0.0, np.maximum(inside.force, 0.0)),
        club_position=origin + x_ball + d,
        ball_position=origin + x_ball,
        club_velocity=np.where(
            before, contact.club_speed, np.where(after, contact.club_velocity, inside.club_velocity)
        ),
        ball_velocity=np.where(
            before, contact.ball_speed, np.where(after, contact.ball_velocity, inside.ball_velocity)
        ),
        compression=np.where(before, 0.0, np.maximum(d, 0.0)),
    )
