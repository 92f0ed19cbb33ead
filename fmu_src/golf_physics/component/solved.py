"""An impact in Model Exchange, where a host's solver finds the motion."""

from math import inf, nan
from typing import Any, NamedTuple

from ..impact import Touch
from ..laws import LAWS
from ..values import Inputs, Instant, Parameters, Refusal, State

#: Added to an indicator that may be exactly 0 before its event: solvers look for changes of sign.
_ABOVE_ZERO = 1e-18


#: Relative to the way to touch: a distance of rounding errors.
_NEAR = 2.0**-48


class SolvedImpact(NamedTuple):
    """An impact from its last event on; a value that outputs read as an `Impact`."""

    parameters: Parameters
    inputs: Inputs
    b: float  #: of the contact, N.s/m
    states: list[float]  #: positions (m) and velocities (m/s), each of club and ball
    started: bool = False  #: whether the start time is fixed
    touch: Touch | None = None  #: in the host's time
    in_contact: bool = False
    refusal_of_touch: Refusal | None = None  #: why the law rejects the touch that there was
    dragged: float = 0.0  #: momentum that drag has taken from the ball until the last event, N.s
    drag: float = 0.0  #: its coefficient from then on, N.s/m
    x_end: float = 0.0  #: position of the ball at that event, the last one of the contact, m
    lasted: float = 0.0  #: of the contact once it has ended, s
    at_separation: tuple[float, float] | None = None  #: velocities of club and ball, m/s

    # As of an `Impact` in a phase that holds every instant.

    @property
    def begin(self) -> Instant:
        return nan, nan

    @property
    def duration(self) -> float:
        return inf

    @property
    def velocities(self) -> tuple[float, float]:
        _, _, v_club, v_ball = self.states
        if self.at_separation is not None:
            return self.at_separation
        return (self.inputs.club_speed if self.touch is None else v_club), v_ball

    @property
    def is_pushed(self) -> bool:
        return True

    @property
    def club_force(self) -> float:
        return self.inputs.club_force

    def state(self, instant: Instant) -> State:
        force, *moving, compression = self.solver_state()
        return [max(0.0, force), *moving, max(0.0, compression)]

    def solver_state(self) -> State:
        """The state; force and compression continue smoothly below 0 until the event."""
        x_club, x_ball, v_club, v_ball = self.states
        if self.touch is None:
            v_club = self.inputs.club_speed
        compression = x_club - x_ball
        force = 0.0
        if self.in_contact:
            p = self.parameters
            force = LAWS[p.law].force(p, self.inputs.k, self.b, compression, v_club - v_ball)
        return [force, x_club, x_ball, v_club, v_ball, compression]

    def with_inputs(self, inputs: Inputs) -> "SolvedImpact":
        p = self.parameters
        k, b, _, _ = inputs
        if self.touch is not None:
            b = LAWS[p.law].damping(p, k, b, self.touch.club_speed - p.ball_speed)
        return self._replace(inputs=inputs, b=b)

    def after_event(self, time: float) -> "SolvedImpact":
        """The impact after what happens at this instant of the host's time, s."""
        x_club, x_ball, _, v_ball = self.states
        p, impact = self.parameters, self
        if self.touch is None:
            club_speed = self.inputs.club_speed
            impact = self._replace(states=[x_club, x_ball, club_speed, v_ball])
            # A solver may stop a rounding error before the root of the indicator.
            near = _NEAR * (p.gap + abs(x_ball))
            if x_club >= x_ball - near and club_speed > v_ball:
                refusal = LAWS[p.law].refusal_of_touch(p, club_speed)
                touch = Touch((time, 0.0), x_ball, club_speed)
                impact = impact._replace(touch=touch, in_contact=True, refusal_of_touch=refusal)
                if refusal is None:
                    impact = impact.with_inputs(self.inputs)
                impact = impact._with_drag()
        elif self.in_contact:
            impact = self._with_drag()
            if separation_indicator(self, self.solver_state()) <= 0.0:
                lasted = time - self.touch.instant[0]
                impact = impact._replace(
                    lasted=lasted, in_contact=False, at_separation=impact.velocities
                )
        return impact

    def _with_drag(self) -> "SolvedImpact":
        """Sums up the drag on the ball until here, where its coefficient may change."""
        x_ball = self.states[1]
        dragged = self.dragged + self.drag * (x_ball - self.x_end)
        drag = LAWS[self.parameters.law].drag(self.b)
        return self._replace(dragged=dragged, drag=drag, x_end=x_ball)

    def last(self, instant: Instant) -> "tuple[SolvedImpact, float]":
        touch = self.touch if self.in_contact else None
        return self, (self.lasted if touch is None else instant[0] - touch.instant[0])

    def contact_time(self, t: float) -> float:
        return t

    def total_impulse(self, t: float) -> float:
        """N.s: the ball's momentum and what drag has taken, with b constant between events."""
        p, (_, x_ball, _, v_ball) = self.parameters, self.states
        gained = p.m_ball * (v_ball - p.ball_speed)
        dragging = self.drag * (x_ball - self.x_end) if self.in_contact else 0.0
        return gained + self.dragged + dragging

    # NaN: which of the states have been passed is unknown, and there are no steps.

    def peak_force(self, t: float) -> tuple[float, float]:
        return nan, nan

    def peak_compression(self, t: float) -> float:
        return nan

    def impulse_of_step(self, instant: Instant, step: float) -> float:
        return nan


def accelerations(impact: Any, state: State) -> tuple[float, float]:
    """Of club and ball (m/s²), in an `Impact` or a `SolvedImpact`, as the indicators below."""
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
