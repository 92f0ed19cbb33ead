"""One impact at any instants."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from golf_impact.arrays import impacts
from golf_impact.arrays.contacts import Contacts
from golf_impact.arrays.elementwise import Values
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError
from golf_impact.runs import PATH, Named

#: The largest communication step of the FMU, s.
_LONGEST = 1e100


def run_trajectory(
    outputs: Sequence[str], times: Any, values: Mapping[str, Any]
) -> Named[np.ndarray]:
    """See `golf_impact.run_trajectory`."""
    times = impacts.as_arrays({"times": times})[0]["times"]
    accepted = (times >= 0.0) & (times <= _LONGEST)
    if not accepted.all():
        given, why = times[~accepted][0].item(), f"each must be a number of 0 to {_LONGEST:g} s"
        raise UserError(f"times with {given!r} are refused: {why}", "times", given, why)
    if "mean_force" in outputs:
        why = "it is that of a communication step; use points"
        raise UserError(f"mean_force is refused with times: {why}", "mean_force", reason=why)
    runs = ScalarImpacts()
    runs.start(**values)
    contact = closed_contact(values)
    if contact is not None and {*PATH, "momentum", "kinetic_energy"}.issuperset(outputs):
        columns = in_blocks(lambda block: _rows(contact, block), outputs, times)
        return Named({"time": times, **columns})
    instants, places = np.unique(np.append(0.0, times), return_inverse=True)
    places = places[1:].reshape(times.shape)
    samples = runs.sample(instants, outputs)
    return Named({"time": times, **{name: row[places] for name, row in samples.items()}})


@np.errstate(all="ignore")
def forces(times: np.ndarray, contact: Contacts) -> np.ndarray:
    """Force (N) of a contact in closed form at times since first touch (s): 0 before and after it.

    Times and the contact's values may be complex, as in `elementwise`.
    """
    inside = np.flatnonzero((np.real(times) > 0.0) & (np.real(times - contact.contact_time) < 0.0))
    force = np.zeros(times.shape, np.result_type(times, contact.contact_time))
    for begin in range(0, inside.size, impacts.BLOCK):
        places = inside[begin : begin + impacts.BLOCK]
        block = impacts.padded({"time": times}, places, len(places))["time"]
        force[places] = contact.motion(block).force[: len(places)]
    return force


@np.errstate(all="ignore")
def closed_contact(values: Mapping[str, Any]) -> Contacts | None:
    """The contact of one impact, if it is in closed form; values may be complex."""
    columns = impacts.columns_of({name: np.real(value) for name, value in values.items()}, ())
    for _, contact in impacts.closed_contacts(columns, 1):
        if contact.closed:
            stepped = {name: value for name, value in values.items() if np.iscomplexobj(value)}
            return Contacts(contact.formulas, columns | stepped) if stepped else contact
    return None


@np.errstate(all="ignore")
def in_blocks(
    rows: Callable[[np.ndarray], Mapping[str, Values]], names: Sequence[str], times: np.ndarray
) -> dict[str, np.ndarray]:
    """Rows of these names, from a function of times; of the shape of these."""
    flat = times.ravel()
    results = {name: np.empty(flat.shape) for name in names}
    for begin in range(0, flat.size, impacts.BLOCK):
        part = slice(begin, min(begin + impacts.BLOCK, flat.size))
        count = part.stop - begin
        block = rows(impacts.padded({"time": flat}, part, count)["time"])
        for name, column in results.items():
            column[part] = impacts.first(block[name], count)
    return {name: column.reshape(times.shape) for name, column in results.items()}


def _rows(c: Contacts, times: np.ndarray) -> dict[str, Values]:
    """Outputs at these times since the start of the run, s."""
    t = times - c.touch_time
    past = t - c.contact_time
    motion = c.motion(np.clip(t, 0.0, c.contact_time))

    def pick(approach: Values, contact: Values, flight: Values) -> Values:
        return np.where(t < 0.0, approach, np.where(past < 0.0, contact, flight))

    v_club = pick(c.club_speed, motion.club_velocity, c.club_velocity)
    v_ball = pick(c.ball_speed, motion.ball_velocity, c.ball_velocity)
    in_contact = np.maximum(motion.compression, 0.0)
    d = pick(c.closing * t, in_contact, c.left + (c.club_velocity - c.ball_velocity) * past)
    travel = pick(c.ball_speed * t, motion.travel, c.contact_displacement + c.ball_velocity * past)
    x_ball = c.ball_speed * c.touch_time + travel
    return {
        "force": pick(0.0, np.maximum(motion.force, 0.0), 0.0),
        "club_position": x_ball + d,
        "ball_position": x_ball,
        "club_velocity": v_club,
        "ball_velocity": v_ball,
        "compression": pick(0.0, in_contact, np.maximum(d, 0.0)),
        "momentum": c.m_club * v_club + c.m_ball * v_ball,
        "kinetic_energy": c.energy(v_club, v_ball),
    }
