"""The outputs one by one: each a function of the impact at one instant, so that only those that are
read are computed.

Results are "so far" at every instant. Before touch S and COR are 0 and the energy efficiency is 1.
S is 0, too, if the club stood at touch.
"""

from collections.abc import Callable
from math import inf
from typing import Any, Protocol

from .impact import Impact, State
from .parameters import SETTABLE
from .variables import REFERENCES


class Moment(Protocol):
    """What an output may ask about the communication point, beside the impact's state."""

    #: s since the start, as a pair.
    clock: float
    carry: float
    #: The last communication step, s (0 before the first).
    last_step: float
    #: The host's time at the start of the run, and when the clock stood at 0, s.
    start_time: float
    origin: float


Result = Callable[[Impact, State, Moment], Any]


def _moving(index: int) -> Result:
    return lambda impact, state, at: state[index]


def _mean_force(impact: Impact, state: State, at: Moment) -> float:
    step = at.last_step
    return impact.impulse_of_step(at.clock, at.carry, step) / step if step else 0.0


def _touch_time(impact: Impact, state: State, at: Moment) -> float:
    touch = impact.touch
    return at.start_time if touch is None else at.origin + (touch[0] + touch[1])


def _smash_factor(impact: Impact, state: State, at: Moment) -> float:
    touch = impact.touch
    if touch is None or not touch[3]:
        return 0.0
    found = state[4] / touch[3]
    # A club that all but stood leaves no double to tell it: as if it stood.
    return 0.0 if abs(found) == inf else found


def _coefficient_of_restitution(impact: Impact, state: State, at: Moment) -> float:
    touch = impact.touch
    if touch is None:
        return 0.0
    return (state[4] - state[3]) / (touch[3] - impact.parameters.ball_speed)


def _energy_efficiency(impact: Impact, state: State, at: Moment) -> float:
    touch = impact.touch
    if touch is None:
        return 1.0
    v_club, v_ball = state[3], state[4]
    p = impact.parameters
    m_club, m_ball, u_ball = p.m_club, p.m_ball, p.ball_speed
    u_club = touch[3]
    at_touch = m_club * u_club * u_club + m_ball * u_ball * u_ball
    return (m_club * v_club * v_club + m_ball * v_ball * v_ball) / at_touch if at_touch else 1.0


def _momentum(impact: Impact, state: State, at: Moment) -> float:
    return impact.parameters.m_club * state[3] + impact.parameters.m_ball * state[4]


def _kinetic_energy(impact: Impact, state: State, at: Moment) -> float:
    _, _, _, v_club, v_ball, _ = state
    p = impact.parameters
    return 0.5 * (p.m_club * v_club * v_club + p.m_ball * v_ball * v_ball)


_RESULTS: dict[str, Result] = {
    "force": _moving(0),
    "club_position": _moving(1),
    "ball_position": _moving(2),
    "club_velocity": _moving(3),
    "ball_velocity": _moving(4),
    "compression": _moving(5),
    "mean_force": _mean_force,
    "touched": lambda impact, state, at: impact.touch is not None,
    "in_contact": lambda impact, state, at: impact.in_contact,
    "separated": lambda impact, state, at: impact.touch is not None and not impact.in_contact,
    "touch_time": _touch_time,
    "smash_factor": _smash_factor,
    "coefficient_of_restitution": _coefficient_of_restitution,
    "energy_efficiency": _energy_efficiency,
    "contact_time": lambda impact, state, at: impact.contact_time(at.clock, at.carry),
    "max_force": lambda impact, state, at: impact.peak_force(at.clock, at.carry)[0],
    "time_of_max_force": lambda impact, state, at: impact.peak_force(at.clock, at.carry)[1],
    "max_compression": lambda impact, state, at: impact.peak_compression(at.clock, at.carry),
    "contact_displacement": lambda impact, state, at: impact.contact_displacement(state),
    "impulse": lambda impact, state, at: impact.impulse(at.clock, at.carry),
    "momentum": _momentum,
    "kinetic_energy": _kinetic_energy,
}

#: The function of each output, by value reference.
BY_REFERENCE: dict[int, Result] = {REFERENCES[name]: result for name, result in _RESULTS.items()}

#: Those that ask for the clock, and are kept until the next communication point; the others are a
#: few operations on the state.
CLOCKED = frozenset(
    REFERENCES[name]
    for name in (
        "mean_force",
        "contact_time",
        "max_force",
        "time_of_max_force",
        "max_compression",
        "impulse",
    )
)

#: The value references of what `Impact.state` gives, in its order.
MOVING = range(SETTABLE, SETTABLE + 6)
