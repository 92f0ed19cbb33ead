"""The outputs, each a function of the impact at one instant: only those that are read are computed.

Results are "so far" at every instant. Before touch S and COR are 0 and the energy efficiency is 1.
S is 0, too, if the club stood at touch.
"""

from collections.abc import Callable
from functools import lru_cache
from math import inf
from operator import itemgetter
from typing import Any

from ..impact import Impact
from ..laws.contact import State
from ..parameters import SETTABLE
from ..variables import Variable

#: Of the impact, its state, and the instance (for its clock and values).
Output = Callable[[Any, State, Any], Any]


def _mean_force(impact: Impact, state: State, at: Any) -> float:
    high, low = at.instant()
    step = at.last_step
    return impact.impulse_of_step(high, low, step) / step if step else 0.0


def _touch_time(impact: Impact, state: State, at: Any) -> float:
    touch = impact.touch
    return at.start_time if touch is None else at.origin + (touch.high + touch.low)


def _smash_factor(impact: Impact, state: State, at: Any) -> float:
    touch = impact.touch
    if touch is None or not touch.club_speed:
        return 0.0
    factor = state[4] / touch.club_speed
    # The club hardly moved: S leaves the range of a double, as if the club stood.
    return 0.0 if abs(factor) == inf else factor


def _coefficient_of_restitution(impact: Impact, state: State, at: Any) -> float:
    touch = impact.touch
    if touch is None:
        return 0.0
    return (state[4] - state[3]) / (touch.club_speed - impact.parameters.ball_speed)


def _energy_efficiency(impact: Impact, state: State, at: Any) -> float:
    touch = impact.touch
    if touch is None:
        return 1.0
    p, v_club, v_ball, u_club = impact.parameters, state[3], state[4], touch.club_speed
    m_club, m_ball, u_ball = p.m_club, p.m_ball, p.ball_speed
    at_touch = m_club * u_club * u_club + m_ball * u_ball * u_ball
    return (m_club * v_club * v_club + m_ball * v_ball * v_ball) / at_touch if at_touch else 1.0


def _contact_displacement(impact: Any, state: State, at: Any) -> float:
    touch = impact.touch
    if touch is None:
        return 0.0
    return (state[2] if impact.in_contact else impact.x_end) - touch.x_ball


def _momentum(impact: Impact, state: State, at: Any) -> float:
    return impact.parameters.m_club * state[3] + impact.parameters.m_ball * state[4]


def _kinetic_energy(impact: Impact, state: State, at: Any) -> float:
    p, v_club, v_ball = impact.parameters, state[3], state[4]
    return 0.5 * (p.m_club * v_club * v_club + p.m_ball * v_ball * v_ball)


def _of_contact(result: Callable[..., float]) -> Output:
    """A result of the last contact phase, from how long that has lasted (s) and the state."""

    def output(impact: Any, state: State, at: Any) -> float:
        last = impact.contact_until(*at.instant())
        return result(*last, state) if last else 0.0

    return output


#: By name, beside the state; Model Exchange adds its own.
OUTPUTS: dict[str, Output] = {
    "mean_force": _mean_force,
    "touched": lambda impact, state, at: impact.touch is not None,
    "in_contact": lambda impact, state, at: impact.in_contact,
    "separated": lambda impact, state, at: impact.touch is not None and not impact.in_contact,
    "touch_time": _touch_time,
    "smash_factor": _smash_factor,
    "coefficient_of_restitution": _coefficient_of_restitution,
    "energy_efficiency": _energy_efficiency,
    "contact_time": _of_contact(lambda contact, t, state: contact.contact_time(t)),
    "max_force": _of_contact(lambda contact, t, state: max(contact.peak_force(t)[0], state[0])),
    "time_of_max_force": _of_contact(lambda contact, t, state: contact.peak_force(t)[1]),
    # After law 2's separation the ball is still compressed, without force.
    "max_compression": _of_contact(lambda c, t, state: max(c.peak_compression(t), state[5])),
    "contact_displacement": _contact_displacement,
    "impulse": _of_contact(lambda contact, t, state: contact.impulse(t, state)),
    "momentum": _momentum,
    "kinetic_energy": _kinetic_energy,
}

#: The value references of what a phase's state is, in its order.
MOVING = range(SETTABLE, SETTABLE + 6)

#: How to read a list of references: they themselves, and their values from the state and the
#: instance; None if they are the first ones of the state.
Reading = tuple[list[int], Callable[[State, Any], list] | None]


def readings(
    variables: tuple[Variable, ...], functions: dict[str, Output]
) -> Callable[[tuple[int, ...], str], Reading]:
    """How to read any variables of this table, by value references and type."""

    def output(reference: int, type_: str) -> Output:
        known = 0 <= reference < len(variables)
        if not known or variables[reference].type != type_:
            return lambda impact, state, at: at.unknown(type_)
        if reference < SETTABLE:
            return lambda impact, state, at: at.values[reference]
        if reference in MOVING:
            return lambda impact, state, at: state[reference - SETTABLE]
        return functions[variables[reference].name]

    # A host reads the same few lists at every step.
    @lru_cache(256)
    def reading(references: tuple[int, ...], type_: str) -> Reading:
        requested = list(references)
        if type_ == "Real" and len(requested) > 1 and all(n in MOVING for n in requested):
            if requested == list(MOVING[: len(requested)]):
                return requested, None
            pick = itemgetter(*map(MOVING.index, requested))
            return requested, lambda state, at: list(pick(state))
        outputs = [output(n, type_) for n in requested]

        def values(state: State, at: Any) -> list:
            impact = at.impact()
            return [output(impact, state, at) for output in outputs]

        return requested, values

    return reading
