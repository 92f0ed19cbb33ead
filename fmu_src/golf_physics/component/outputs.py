"""The outputs, each a function of the impact at one instant: only those that are read are computed.

Results are "so far" at every instant. Before touch S and COR are 0 and the energy efficiency is 1.
S is 0, too, if the club stood at touch.
"""

from collections.abc import Callable
from functools import lru_cache
from math import inf
from operator import itemgetter
from typing import Any

from ..impact import AnyImpact
from ..variables import BY_NAME, MOTION, SETTABLE, Variable

#: Of the impact, and the instance for its clock, its values and the state, as far as it is needed.
Output = Callable[[Any, Any], Any]


def _mean_force(impact: AnyImpact, at: Any) -> float:
    step = at.last_step
    return impact.impulse_of_step(at.instant(), step) / step if step else 0.0


def _touch_time(impact: AnyImpact, at: Any) -> float:
    touch = impact.touch
    if touch is None:
        return at.start_time
    high, low = touch.instant
    return at.origin + (high + low)


def _smash_factor(impact: AnyImpact, at: Any) -> float:
    touch = impact.touch
    if touch is None or not touch.club_speed:
        return 0.0
    v_ball = at.state()[4] if impact.in_contact else impact.velocities[1]
    factor = v_ball / touch.club_speed
    # The club hardly moved: S leaves the range of a double, as if the club stood.
    return 0.0 if factor == inf or factor == -inf else factor


def _coefficient_of_restitution(impact: AnyImpact, at: Any) -> float:
    touch = impact.touch
    if touch is None:
        return 0.0
    v_club, v_ball = at.state()[3:5] if impact.in_contact else impact.velocities
    return (v_ball - v_club) / (touch.club_speed - impact.parameters.ball_speed)


def _energy_efficiency(impact: AnyImpact, at: Any) -> float:
    touch = impact.touch
    if touch is None:
        return 1.0
    v_club, v_ball = at.state()[3:5] if impact.in_contact else impact.velocities
    p, u_club = impact.parameters, touch.club_speed
    m_club, m_ball, u_ball = p.m_club, p.m_ball, p.ball_speed
    at_touch = m_club * u_club * u_club + m_ball * u_ball * u_ball
    return (m_club * v_club * v_club + m_ball * v_ball * v_ball) / at_touch if at_touch else 1.0


def _contact_displacement(impact: AnyImpact, at: Any) -> float:
    touch = impact.touch
    if touch is None:
        return 0.0
    return (at.state()[2] if impact.in_contact else impact.x_end) - touch.x_ball


def _momentum(impact: AnyImpact, at: Any) -> float:
    moving = impact.in_contact or impact.is_pushed
    v_club, v_ball = at.state()[3:5] if moving else impact.velocities
    return impact.parameters.m_club * v_club + impact.parameters.m_ball * v_ball


def _kinetic_energy(impact: AnyImpact, at: Any) -> float:
    p, moving = impact.parameters, impact.in_contact or impact.is_pushed
    v_club, v_ball = at.state()[3:5] if moving else impact.velocities
    return 0.5 * (p.m_club * v_club * v_club + p.m_ball * v_ball * v_ball)


def _of_contact(result: Callable[[Any, float, Any], float]) -> Output:
    """A result of the last contact phase, of how long that has lasted (s) and of the instance."""

    def output(impact: AnyImpact, at: Any) -> float:
        last = impact.last(at.instant())
        return result(*last, at) if last else 0.0

    return output


#: By name, beside the state; Model Exchange adds its own.
OUTPUTS: dict[str, Output] = {
    "mean_force": _mean_force,
    "touched": lambda impact, at: impact.touch is not None,
    "in_contact": lambda impact, at: impact.in_contact,
    "separated": lambda impact, at: impact.touch is not None and not impact.in_contact,
    "touch_time": _touch_time,
    "smash_factor": _smash_factor,
    "coefficient_of_restitution": _coefficient_of_restitution,
    "energy_efficiency": _energy_efficiency,
    "contact_time": _of_contact(lambda contact, t, at: contact.contact_time(t)),
    "max_force": _of_contact(lambda contact, t, at: max(contact.peak_force(t)[0], at.state()[0])),
    "time_of_max_force": _of_contact(lambda contact, t, at: contact.peak_force(t)[1]),
    # After law 2's separation the ball is still compressed, without force.
    "max_compression": _of_contact(lambda c, t, at: max(c.peak_compression(t), at.state()[5])),
    "contact_displacement": _contact_displacement,
    "impulse": _of_contact(lambda contact, t, at: contact.total_impulse(t)),
    "momentum": _momentum,
    "kinetic_energy": _kinetic_energy,
}

#: The value references of what the state has, in its order.
_MOVING = [BY_NAME[name].reference for name in MOTION]
_PLACES = {reference: place for place, reference in enumerate(SETTABLE)}


#: How to read a list of value references: they themselves, and their values from an instance; None
#: if they are the first ones of the state.
Reading = tuple[list[int], Callable[[Any], list] | None]


def readings(
    variables: tuple[Variable, ...], functions: dict[str, Output]
) -> Callable[[tuple[int, ...], str], Reading]:
    """How to read any variables of this table, by value references and type."""
    rows = {row.reference: row for row in variables}

    def output(reference: int, type_: str) -> Output:
        row = rows.get(reference)
        if row is None or row.type != type_:
            return lambda impact, at: at.unknown(type_)
        if reference in SETTABLE:
            place = _PLACES[reference]
            return lambda impact, at: at.values[place]
        if row.name in MOTION:
            place = MOTION.index(row.name)
            return lambda impact, at: at.state()[place]
        return functions[row.name]

    # A host reads the same few lists at every step.
    @lru_cache(256)
    def reading(references: tuple[int, ...], type_: str) -> Reading:
        requested = list(references)
        if type_ == "Real" and len(requested) > 1 and all(n in _MOVING for n in requested):
            if requested == _MOVING[: len(requested)]:
                return requested, None
            pick = itemgetter(*map(_MOVING.index, requested))
            return requested, lambda at: list(pick(at.state()))
        outputs = [output(n, type_) for n in requested]

        def values(at: Any) -> list:
            # Not a comprehension, which is a call of its own before Python 3.12.
            impact, values = at.impact(), []
            for output in outputs:
                values.append(output(impact, at))
            return values

        return requested, values

    return reading
