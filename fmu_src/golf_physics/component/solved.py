"""An impact in Model Exchange, where a host's solver finds the motion."""

from math import inf, nan, sqrt
from typing import Any, NamedTuple

from ..codec import Real
from ..impact import Impact, Touch
from ..laws import LAWS
from ..values import Inputs, Instant, Motion, Parameters, Refusal, State

#: Added to an indicator that may be exactly 0 before its event: solvers look for changes of sign.
_ABOVE_ZERO = 1e-18

#: An event nearer than this (in units of 1/ω, and relative to the host's time) has happened: a
#: solver's root is some 1e-15 s off, and restarted before that root it would find it again.
_NEAR, _NEAR_IN_TIME = 1e-11, 1e-15


class _Solution(NamedTuple):
    parameters: Parameters
    inputs: Inputs
    b: Real  #: of the contact, N.s/m
    time: Real  #: the host's, s
    states: tuple[Real, ...]  #: positions (m) and velocities (m/s), each of club and ball
    started: bool = False  #: whether the start time is fixed
    touch: Touch | None = None  #: in the host's time
    in_contact: bool = False
    refusal_of_touch: Refusal | None = None  #: why the law rejects the touch that there was
    dragged: bool = False  #: whether a drag has acted: what it took of the impulse isn't known
    lasted: Real = 0.0  #: of the contact once it has ended, s
    at_separation: Motion | None = None  #: the bodies then


class SolvedImpact(_Solution, Impact):
    """An impact from its last event on; its phase holds every instant. `states` are the host's."""

    __slots__ = ()

    begin = nan, nan
    duration = inf
    is_pushed = True

    @property
    def velocities(self) -> tuple[float, float]:  # type: ignore[override]
        if self.at_separation is not None:
            return self.at_separation[2:4]
        _, _, v_club, v_ball = self.states
        return (self.inputs.club_speed if self.touch is None else v_club), v_ball

    @property
    def club_force(self) -> float:
        return self.inputs.club_force

    def displacement(self, instant: Instant) -> float:
        if self.touch is None:
            return 0.0
        x_ball = self.states[1] if self.at_separation is None else self.at_separation.x_ball
        return x_ball - self.touch.x_ball

    def state(self, instant: Instant) -> State:
        force, *moving, compression = self.solver_state()
        start = self.at_separation
        if start is not None:
            # Even if a force turned the club at once, it would have vanished after this time.
            rest = 2.0 * start.compression + start.closing * self._in_flight()
            compression = compression if rest > 0.0 else 0.0
        return [max(0.0, force), *moving, max(0.0, compression)]

    def _in_flight(self) -> float:
        return self.time - self.touch.instant[0] - self.lasted if self.touch else 0.0

    def solver_state(self) -> State:
        """The state; force and compression continue smoothly below 0 until the event."""
        x_club, x_ball, v_club, v_ball = self.states
        if self.touch is None:
            v_club = self.inputs.club_speed
        return self._state(x_club, x_ball, v_club, v_ball)

    def _state(self, x_club: float, x_ball: float, v_club: float, v_ball: float) -> State:
        compression, force = x_club - x_ball, 0.0
        if self.in_contact:
            p = self.parameters
            force = LAWS[p.law].force(p, self.inputs.k, self.b, compression, v_club - v_ball)
        return [force, x_club, x_ball, v_club, v_ball, compression]

    def with_inputs(self, inputs: Inputs) -> "SolvedImpact":
        p = self.parameters
        k, b, _, _ = inputs
        if self.touch is not None:
            b = LAWS[p.law].damping(p, k, b, self.touch.club_speed - p.ball_speed)
        dragged = self.dragged or (self.in_contact and LAWS[p.law].drag(b) != 0.0)
        return self._replace(inputs=inputs, b=b, dragged=dragged)

    def after_event(self) -> "SolvedImpact":
        """The impact after what happens at this instant."""
        p, impact = self.parameters, self
        _, x_club, x_ball, v_club, v_ball, d = self.solver_state()
        near = _NEAR * sqrt(p.m_club * (p.m_ball / (p.m_club + p.m_ball)) / self.inputs.k)
        near = max(near, _NEAR_IN_TIME * abs(self.time))
        ahead = self._state(x_club + near * v_club, x_ball + near * v_ball, v_club, v_ball)
        if self.touch is None:
            impact = self._replace(states=(x_club, x_ball, v_club, v_ball))
            if touch_indicator(self, ahead) <= _ABOVE_ZERO and v_club > v_ball:
                # A host's solver is exact beside any force.
                refusal = LAWS[p.law].refusal_of_touch(p, self.inputs._replace(club_force=0.0))
                touch = Touch((self.time, 0.0), x_ball, v_club)
                impact = impact._replace(touch=touch, in_contact=True, refusal_of_touch=refusal)
                if refusal is None:
                    impact = impact.with_inputs(self.inputs)
        elif self.in_contact and separation_indicator(self, ahead) <= 0.0:
            lasted = self.time - self.touch.instant[0]
            separation = Motion(x_club, x_ball, v_club, v_ball, d, v_club - v_ball)
            impact = self._replace(lasted=lasted, in_contact=False, at_separation=separation)
        return impact

    def last_contact(self, instant: Instant) -> "tuple[SolvedImpact, float]":
        touch = self.touch if self.in_contact else None
        return self, (self.lasted if touch is None else self.time - touch.instant[0])

    def contact_time(self, t: float) -> float:
        return t

    def total_impulse(self, t: float) -> float:
        """N.s: what the ball has gained, unless a drag has taken some of it."""
        p, (*_, v_ball) = self.parameters, self.states
        return nan if self.dragged else p.m_ball * (v_ball - p.ball_speed)

    # NaN: which of the states have been passed is unknown, and there are no steps.

    def peak_force(self, t: float) -> tuple[float, float]:
        return nan, nan

    def peak_compression(self, t: float) -> float:
        return nan

    def mean_force(self, instant: Instant, step: float) -> float:
        return nan


def accelerations(impact: Any, state: State) -> tuple[float, float]:
    """Of club and ball (m/s²), in an `Impact`, as the indicators below."""
    p, club_force = impact.parameters, 0.0 if impact.touch is None else impact.club_force
    if not impact.in_contact:
        return club_force / p.m_club, 0.0
    # A host sees a force of at least 0, its solver doesn't.
    if isinstance(impact, SolvedImpact):
        state = impact.solver_state()
    force, _, _, v_club, v_ball, _ = state
    drag = LAWS[p.law].drag(impact.b)
    of_club = -(force + drag * v_club) + club_force if club_force else -(force + drag * v_club)
    return of_club / p.m_club, (force - drag * v_ball) / p.m_ball


def touch_indicator(impact: Any, state: State) -> float:
    """Positive until the gap is closed and the bodies are closing, then -1."""
    if impact.touch is not None:
        return -1.0
    _, x_club, x_ball, v_club, v_ball, _ = state
    return max(x_ball - x_club, v_ball - v_club) + _ABOVE_ZERO


def separation_indicator(impact: Any, state: State) -> float:
    """Positive while there is a force, then negative: a root, as a power law's zero is too flat."""
    if impact.touch is None:
        return 1.0
    if not impact.in_contact:
        return -1.0
    root = abs(state[0]) ** (1.0 / impact.parameters.exponent)
    # The force is 0 at touch, too; but then the bodies still close at their approach speed.
    force, _, _, v_club, v_ball, _ = state
    approach = impact.touch.club_speed - impact.parameters.ball_speed
    over = force <= 0.0 and v_club - v_ball < 0.5 * approach
    return -root - _ABOVE_ZERO if over else root + _ABOVE_ZERO
