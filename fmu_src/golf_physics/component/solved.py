"""One impact whose motion a host's solver finds: the equations, the events, the results so far.

Beside `Impact` it has no phases with solutions: the host supplies the states, and the equations
give their derivatives. Outputs read results of both by the same names.
"""

from collections.abc import Sequence
from math import nan
from typing import NamedTuple

from ..impact import Impact, Touch
from ..laws.contact import State
from ..parameters import Inputs, Parameters

#: Added to an indicator that may be exactly 0 before its event: solvers look for changes of sign.
_ABOVE_ZERO = 1e-18


class SolvedImpact(NamedTuple):
    """An impact from its last event on. The states are a list of the positions (m) and velocities
    (m/s), each of club and ball.
    """

    parameters: Parameters
    inputs: Inputs
    #: The contact's stiffness (N/m) and damping (N.s/m).
    k: float
    b: float
    #: In the host's time.
    touch: Touch | None = None
    in_contact: bool = False
    #: Why the law rejects the touch that there was.
    refusal_of_touch: str | None = None
    #: Momentum that the drag has taken from the ball until the last event, N.s; its coefficient
    #: from then on, N.s/m, and the position of the ball then, m.
    dragged: float = 0.0
    drag: float = 0.0
    x_ball: float = 0.0
    #: Contact time, s, and position of the ball, m, at the end of contact.
    ended: tuple[float, float] = (0.0, 0.0)

    @staticmethod
    def start(parameters: Parameters, inputs: Inputs) -> "tuple[SolvedImpact, list[float]]":
        """The impact at the start, and the states."""
        states = [-parameters.gap, 0.0, inputs[2], parameters.ball_speed]
        return SolvedImpact(parameters, inputs, *inputs[:2]), states

    @property
    def touched(self) -> bool:
        """Whether there has been a touch."""
        return self.touch is not None

    # The equations

    def solver_state(self, states: Sequence[float]) -> State:
        """As `state`, but force and compression continue smoothly below 0 until the event."""
        x_club, x_ball, v_club, v_ball = states
        if self.touch is None:
            v_club = self.inputs[2]
        compression = x_club - x_ball
        force = 0.0
        if self.in_contact:
            p = self.parameters
            force = p.contact_law.force(p, self.k, self.b, compression, v_club - v_ball)
        return [force, x_club, x_ball, v_club, v_ball, compression]

    def state(self, states: Sequence[float]) -> State:
        """Force (N), positions (m) and velocities (m/s) of club and ball, compression (m)."""
        now = self.solver_state(states)
        now[0] = max(0.0, now[0])
        now[5] = max(0.0, now[5])
        return now

    # Events

    def with_inputs(self, inputs: Inputs) -> "SolvedImpact":
        """The impact with other inputs from this instant on, which a solver may only be trying."""
        p = self.parameters
        k, b, _ = inputs
        if p.restitution_at_rest and self.touch is not None:
            b = p.contact_law.damping(p, k, self.touch.club_speed - p.ball_speed)
        return self._replace(inputs=inputs, k=k, b=b)

    def after_event(self, time: float, states: list[float]) -> tuple["SolvedImpact", list[float]]:
        """The impact and the states after what happens at this instant of the host's time (s)."""
        x_club, x_ball, _, v_ball = states
        p = self.parameters
        if self.touch is None:
            club_speed = self.inputs[2]
            states = [x_club, x_ball, club_speed, v_ball]
            if x_club < x_ball or club_speed <= v_ball:
                return self, states
            refusal = p.contact_law.refusal_of_touch(p, club_speed)
            touch = Touch(time, 0.0, x_ball, club_speed)
            impact = self._replace(touch=touch, in_contact=True, refusal_of_touch=refusal)
            if refusal is None:
                impact = impact.with_inputs(self.inputs)
            return impact._with_drag(states), states
        if self.in_contact:
            impact = self._with_drag(states)
            if separation_indicator(self, self.solver_state(states)) <= 0.0:
                ended = time - self.touch.high, x_ball
                return impact._replace(ended=ended, in_contact=False), states
            return impact, states
        return self, states

    def _with_drag(self, states: list[float]) -> "SolvedImpact":
        """Sums up the drag on the ball until here, where its coefficient may change."""
        dragged = self.dragged + self.drag * (states[1] - self.x_ball)
        drag = self.parameters.contact_law.drag(self.b)
        return self._replace(dragged=dragged, drag=drag, x_ball=states[1])

    # Results so far, by the names of those of `Impact` and `Contact`

    def contact_until(self, high: float, low: float) -> "tuple[SolvedImpact, float]":
        in_contact = self.in_contact and self.touch is not None
        return self, (high + low - self.touch.high if in_contact else self.ended[0])  # type: ignore[union-attr]

    def contact_displacement(self, state: State) -> float:
        if self.touch is None:
            return 0.0
        return (state[2] if self.in_contact else self.ended[1]) - self.touch.x_ball

    def contact_time(self, t: float) -> float:
        return t

    def impulse(self, t: float, state: State) -> float:
        """N.s: the ball's momentum and what drag has taken, with b constant between events."""
        p = self.parameters
        gained = p.m_ball * (state[4] - p.ball_speed)
        dragging = self.drag * (state[2] - self.x_ball) if self.in_contact else 0.0
        return gained + self.dragged + dragging

    # NaN: which of the states have been passed is unknown, and there are no steps.

    def peak_force(self, t: float) -> tuple[float, float]:
        return nan, nan

    def peak_compression(self, t: float) -> float:
        return nan

    def impulse_of_step(self, high: float, low: float, step: float) -> float:
        return nan

    # Serialization

    def packed(self) -> list:
        """The impact as numbers and lists of numbers, for `unpacked` in another process."""
        return [self.parameters.values(), *self[1:]]

    @staticmethod
    def unpacked(packed: Sequence) -> "SolvedImpact":
        """The impact that `packed` was called on."""
        values, inputs, k, b, touch, *rest, ended = packed
        touch = None if touch is None else Touch(*touch)
        return SolvedImpact._make(
            (Parameters(*values), tuple(inputs), k, b, touch, *rest, tuple(ended))
        )


#: Either kind: what the functions below take.
AnyImpact = Impact | SolvedImpact


def accelerations(impact: AnyImpact, state: State) -> tuple[float, float]:
    """Of club and ball, m/s²."""
    if not impact.in_contact:
        return 0.0, 0.0
    p = impact.parameters
    force, _, _, v_club, v_ball, _ = state
    drag = p.contact_law.drag(impact.b)  # type: ignore[union-attr]
    return -(force + drag * v_club) / p.m_club, (force - drag * v_ball) / p.m_ball


def touch_indicator(impact: AnyImpact, state: State) -> float:
    """Above 0 until the gap is closed and the bodies are closing, then -1."""
    if impact.touch is not None:
        return -1.0
    _, x_club, x_ball, v_club, v_ball, _ = state
    return max(x_ball - x_club, v_ball - v_club) + _ABOVE_ZERO


def separation_indicator(impact: AnyImpact, state: State) -> float:
    """Above 0 until the force has gone, then below 0 for good.

    A root of the force, because a power law's own zero is too flat to be located well.
    """
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
