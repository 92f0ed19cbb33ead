"""One impact whose motion a host's solver finds: what happens at events, and the results so far.

Beside `Impact` it has no phases with solutions: the host says where the bodies are, and the
equations say how that changes. `results` reads both in the same way.
"""

from math import nan
from typing import Any

from ..impact import Impact, Touch
from ..laws.contact import State
from ..parameters import Inputs, Parameters

#: Added to an indicator that may be exactly 0 before its event: solvers look for changes of sign.
_ABOVE_ZERO = 1e-18


class SolvedImpact:
    """State and results at the instant for which the host has set states and inputs.

    Args:
        parameters: the fixed values.
        inputs: k, b and club_speed from the start on.
    """

    def __init__(self, parameters: Parameters, inputs: Inputs) -> None:
        self.parameters = parameters
        #: The inputs that act now, and stiffness and damping that follow from them.
        self.in_force = inputs
        self._acting = inputs[:2]
        #: Positions (m) and velocities (m/s), each of club and ball; never changed in place.
        self.states = [-parameters.gap, 0.0, inputs[2], parameters.ball_speed]
        #: First touch, in the host's time, or None before it.
        self.touch: Touch | None = None
        self.in_contact = False
        #: Why the law can't have the touch that there was.
        self.refusal_of_touch: str | None = None
        #: Whether the host's time at the start is known, or may not be told any more.
        self.started = False
        #: What law 1's drag has taken from the ball until the last event, N.s; and its coefficient
        #: from then on (N.s/m), and where the ball was (m).
        self._dragged = 0.0
        self._dragging = (0.0, 0.0)
        #: Contact time, s, and position of the ball, m, when contact ended.
        self._ended = (0.0, 0.0)

    # The equations

    def now(self) -> State:
        """As `state`, but force and compression go on below 0 as a solver needs them."""
        x_club, x_ball, v_club, v_ball = self.states
        if self.touch is None:
            v_club = self.in_force[2]
        compression = x_club - x_ball
        force = 0.0
        if self.in_contact:
            p = self.parameters
            k, b = self._acting
            force = p.contact_law.force(p, k, b, compression, v_club - v_ball)
        return [force, x_club, x_ball, v_club, v_ball, compression]

    # Events

    def hold(self, inputs: Inputs) -> None:
        """Take these inputs from this instant on, which a solver may only be trying."""
        p, self.in_force = self.parameters, inputs
        k, b, _ = inputs
        if p.restitution_at_rest and self.touch is not None:
            b = p.contact_law.damping(p, k, self.touch[3] - p.ball_speed)
        self._acting = k, b

    def _drag(self) -> float:
        """What law 1's drag has taken from the ball since the last event, N.s."""
        drag, x_ball = self._dragging
        return drag * (self.states[1] - x_ball)

    def update(self, time: float) -> bool:
        """Whatever happens at this instant (host's time, s); whether a state has jumped."""
        x_club, x_ball, v_club, v_ball = self.states
        if self.touch is None:
            club_speed = self.in_force[2]
            self.states = [x_club, x_ball, club_speed, v_ball]
            if x_club >= x_ball and club_speed > v_ball:
                self.touch = (time, 0.0, x_ball, club_speed)
                self.in_contact = True
                p = self.parameters
                self.refusal_of_touch = p.contact_law.refusal_of_touch(p, club_speed)
                if self.refusal_of_touch is None:
                    self.hold(self.in_force)
                self._dragging = p.contact_law.drag(self._acting[1]), x_ball
            return v_club != club_speed
        if self.in_contact:
            self._dragged += self._drag()
            self._dragging = self.parameters.contact_law.drag(self._acting[1]), x_ball
            if separation_indicator(self, self.now()) <= 0.0:
                self._ended = (time - self.touch[0], x_ball)
                self.in_contact = False
        return False

    # What results ask for, as of Impact

    def state(self) -> State:
        """Force (N), positions (m) and velocities (m/s) of club and ball, compression (m)."""
        now = self.now()
        now[0] = max(0.0, now[0])
        now[5] = max(0.0, now[5])
        return now

    def contact_time(self, high: float, low: float) -> float:
        """Time in contact so far, s."""
        if self.in_contact and self.touch is not None:
            return high + low - self.touch[0]
        return self._ended[0]

    def contact_displacement(self, state: State) -> float:
        """How far the ball has moved while in contact, m."""
        if self.touch is None:
            return 0.0
        return (state[2] if self.in_contact else self._ended[1]) - self.touch[2]

    def impulse(self, high: float, low: float) -> float:
        """Impulse of the contact force so far, N.s: the ball's momentum and what drag has taken.

        Law 1 takes b to be constant between events.
        """
        if self.touch is None:
            return 0.0
        p = self.parameters
        gained = p.m_ball * (self.states[3] - p.ball_speed)
        return gained + self._dragged + (self._drag() if self.in_contact else 0.0)

    # NaN: nobody tells which of the states asked about have been passed, and there are no steps.

    def peak_force(self, high: float, low: float) -> tuple[float, float]:
        return nan, nan

    def peak_compression(self, high: float, low: float) -> float:
        return nan

    def impulse_of_step(self, high: float, low: float, step: float) -> float:
        return nan

    # State

    def snapshot(self) -> dict[str, Any]:
        """Everything, for `restored`; its parts are never changed in place."""
        return dict(vars(self))

    @classmethod
    def restored(cls, snapshot: dict[str, Any]) -> "SolvedImpact":
        """The impact that a snapshot was taken of."""
        self = cls.__new__(cls)
        vars(self).update(snapshot)
        return self

    def packed(self) -> dict[str, Any]:
        """The same as numbers and lists of numbers, for `unpacked` in another process."""
        return self.snapshot() | {"parameters": self.parameters.values()}

    @classmethod
    def unpacked(cls, packed: dict[str, Any]) -> "SolvedImpact":
        """The impact that `packed` was taken of."""
        snapshot = {n: tuple(v) if isinstance(v, list) else v for n, v in packed.items()}
        snapshot["parameters"] = Parameters(*snapshot["parameters"])
        snapshot["states"] = [float(value) for value in snapshot["states"]]
        return cls.restored(snapshot)


#: Either kind: what indicators and results look at.
AnyImpact = Impact | SolvedImpact


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
    return -root - _ABOVE_ZERO if _over(impact, state) else root + _ABOVE_ZERO


def _over(impact: AnyImpact, state: State) -> bool:
    """Whether contact is over, though a solver that looks for the event may not know it yet.

    The force is 0 at touch, too; but then the bodies still close at their approach speed.
    """
    assert impact.touch is not None
    force, _, _, v_club, v_ball, _ = state
    return force <= 0.0 and v_club - v_ball < 0.5 * (impact.touch[3] - impact.parameters.ball_speed)


def acceleration(impact: AnyImpact, state: State, body: int) -> float:
    """The acceleration of club (0) or ball (1), m/s².

    Past the end of contact the bodies move freely, as they will: pulled back by a force below 0
    they would turn round, and a solver with long steps would overlook the separation.
    """
    if not impact.in_contact or _over(impact, state):
        return 0.0
    p = impact.parameters
    force, _, _, v_club, v_ball, _ = state
    drag = p.contact_law.drag(impact.in_force[1])
    return (force - drag * v_ball) / p.m_ball if body else -(force + drag * v_club) / p.m_club
