"""Model Exchange, which FMI 3.0 has beside stepping: a host's solver finds the motion.

An instance isn't told which of the two it is for: the first call that only Model Exchange has
decides. From then on the host's time and states count, and steps are refused.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import inf, isfinite, nan, nextafter
from typing import Any, NamedTuple

from ..impact import Touch, added
from ..laws.contact import State
from ..parameters import INPUTS, Inputs, Parameters
from ..variables import MORE_VARIABLES, VARIABLES
from . import state
from .component import BLOCKED, STEPPING, Component
from .outputs import OUTPUTS, Output, readings
from .segment import Segment

#: Added to an indicator that may be exactly 0 before its event: solvers look for changes of sign.
_ABOVE_ZERO = 1e-18


class SolvedImpact(NamedTuple):
    """An impact from its last event on; the host's solver has the states: positions (m) and
    velocities (m/s), each of club and ball. Outputs read its results as those of `Impact`.
    """

    parameters: Parameters
    inputs: Inputs
    k: float  #: of the contact, N/m
    b: float  #: of the contact, N.s/m
    touch: Touch | None = None  #: in the host's time
    in_contact: bool = False
    refusal_of_touch: str | None = None  #: why the law rejects the touch that there was
    dragged: float = 0.0  #: momentum that drag has taken from the ball until the last event, N.s
    drag: float = 0.0  #: its coefficient from then on, N.s/m
    x_ball: float = 0.0  #: position of the ball at that event, m
    lasted: float = 0.0  #: of the contact once it has ended, s
    x_end: float = 0.0  #: position of the ball then, m

    def solver_state(self, states: Sequence[float]) -> State:
        """The state; force and compression continue smoothly below 0 until the event."""
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
        force, *moving, compression = self.solver_state(states)
        return [max(0.0, force), *moving, max(0.0, compression)]

    def with_inputs(self, inputs: Inputs) -> "SolvedImpact":
        p = self.parameters
        k, b, _ = inputs
        if p.restitution_at_rest and self.touch is not None:
            b = p.contact_law.damping(p, k, self.touch.club_speed - p.ball_speed)
        return self._replace(inputs=inputs, k=k, b=b)

    def after_event(self, time: float, states: list[float]) -> tuple["SolvedImpact", list[float]]:
        """The impact and the states after what happens at this instant of the host's time (s)."""
        x_club, x_ball, _, v_ball = states
        p, impact = self.parameters, self
        if self.touch is None:
            club_speed = self.inputs[2]
            states = [x_club, x_ball, club_speed, v_ball]
            if x_club >= x_ball and club_speed > v_ball:
                refusal = p.contact_law.refusal_of_touch(p, club_speed)
                touch = Touch(time, 0.0, x_ball, club_speed)
                impact = self._replace(touch=touch, in_contact=True, refusal_of_touch=refusal)
                if refusal is None:
                    impact = impact.with_inputs(self.inputs)
                impact = impact._with_drag(states)
        elif self.in_contact:
            impact = self._with_drag(states)
            if separation_indicator(self, self.solver_state(states)) <= 0.0:
                lasted = time - self.touch.high
                impact = impact._replace(lasted=lasted, x_end=x_ball, in_contact=False)
        return impact, states

    def _with_drag(self, states: list[float]) -> "SolvedImpact":
        """Sums up the drag on the ball until here, where its coefficient may change."""
        dragged = self.dragged + self.drag * (states[1] - self.x_ball)
        drag = self.parameters.contact_law.drag(self.b)
        return self._replace(dragged=dragged, drag=drag, x_ball=states[1])

    def contact_until(self, high: float, low: float) -> "tuple[SolvedImpact, float]":
        in_contact = self.in_contact and self.touch is not None
        return self, (high + low - self.touch.high if in_contact else self.lasted)  # type: ignore[union-attr]

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


def accelerations(impact: Any, state: State) -> tuple[float, float]:
    """Of club and ball (m/s²), in an `Impact` or a `SolvedImpact`, as the indicators below."""
    if not impact.in_contact:
        return 0.0, 0.0
    p = impact.parameters
    force, _, _, v_club, v_ball, _ = state
    drag = p.contact_law.drag(impact.b)
    return -(force + drag * v_club) / p.m_club, (force - drag * v_ball) / p.m_ball


def touch_indicator(impact: Any, state: State) -> float:
    """Above 0 until the gap is closed and the bodies are closing, then -1."""
    if impact.touch is not None:
        return -1.0
    _, x_club, x_ball, v_club, v_ball, _ = state
    return max(x_ball - x_club, v_ball - v_club) + _ABOVE_ZERO


def separation_indicator(impact: Any, state: State) -> float:
    """Above 0 until the force has gone, then below 0: a root, as a power law's zero is too flat."""
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


#: What FMI 2.0 doesn't have.
_MORE: dict[str, Output] = {
    "time": lambda impact, state, at: at.time(),
    "club_acceleration": lambda impact, state, at: accelerations(impact, at.unclamped(state))[0],
    "ball_acceleration": lambda impact, state, at: accelerations(impact, at.unclamped(state))[1],
    "touch_indicator": lambda impact, state, at: touch_indicator(impact, state),
    "separation_indicator": lambda impact, state, at: separation_indicator(impact, state),
}


class Solving(Segment):
    """A host's solver in place of communication steps: its time, s, and its states.

    `started`: whether the start time is fixed.
    """

    __slots__ = ("started", "states")

    impact: SolvedImpact  # type: ignore[assignment]

    def __init__(
        self, impact: SolvedImpact, states: list[float], time: float, started: bool
    ) -> None:
        super().__init__(impact, time, 0.0, nan)  # type: ignore[arg-type]
        self.states, self.started = states, started

    def state(self, count: float) -> tuple[State, Any]:
        return self.impact.state(self.states), self.impact

    def packed(self) -> list:
        return ["Solving", self.impact, self.states, self.high, self.started]


def _revived(packed: list) -> Segment:
    if packed[0] != "Solving":
        return Segment.unpacked(packed)
    _, (values, inputs, k, b, touch, *rest), *others = packed
    touch = touch and Touch(*touch)
    return Solving(SolvedImpact(Parameters(*values), tuple(inputs), k, b, touch, *rest), *others)


class HybridComponent(Component):
    """An instance for co-simulation with event mode, or for Model Exchange."""

    __slots__ = ()

    reading = staticmethod(readings(VARIABLES + MORE_VARIABLES, OUTPUTS | _MORE))

    def __init__(self, report: Callable[[str], None]) -> None:
        super().__init__(report)
        # The start time isn't passed to an instance: it is that of the first step.
        self._point = nan
        self._anchored = False

    def time(self) -> float:
        high, low = self.instant()
        return self.origin + (high + low)

    def _check(self, point: float, size: float) -> Segment | str:
        if isinstance(self._segment, Solving):
            return "a step is refused: this instance is used for Model Exchange"
        first = not self.last_step
        accepted = super()._check(point, size)
        if first and not isinstance(accepted, str):
            self.start_time = self.origin
        return accepted

    def unclamped(self, state: State) -> State:
        """Without the lower limit of 0 that a host sees in Model Exchange."""
        solving = self._segment
        if not isinstance(solving, Solving):
            return state
        return solving.impact.solver_state(solving.states)

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        super().set_values(references, values, type_)
        inputs: Any = tuple(self.values[:INPUTS])
        solving = self._segment
        if isinstance(solving, Solving) and inputs != solving.impact.inputs:
            impact, started = solving.impact.with_inputs(inputs), solving.started
            self._go_on(Solving(impact, solving.states, solving.high, started), 0.0)

    def update(self) -> tuple[bool, bool, float | None]:
        """Handle the events of this instant.

        Returns whether the host must stop, since values were refused; whether its solver must start
        anew; while stepping, the host's time (s) of the next touch or separation, if one is due.
        """
        problem = self._begin() if self._mode == BLOCKED else None
        if problem is None and self._mode != STEPPING:
            self._refuse_once("an event before initialization or after the end is refused")
            return False, False, None
        solving = self._segment if isinstance(self._segment, Solving) else None
        if problem is None and self._refused and (solving or not self.last_step):
            problem = "; ".join(self._refused.values())
        if problem is None and solving:
            time, started = solving.high, solving.started
            impact, states = solving.impact.after_event(time, solving.states)
            self._go_on(Solving(impact, states, time, started), 0.0)
            problem = impact.refusal_of_touch
        if problem is not None:
            self._report(f"the simulation must stop: {problem}")
            return True, False, None
        # Before the first step it may still be used for Model Exchange, which has indicators.
        ahead = solving is None and self.last_step
        when = next(self._events_after(self._point), None) if ahead else None
        # A solver starts anew at every event: derivatives jump with inputs as well, and fmusim's
        # CVODE is wrong otherwise.
        return False, solving is not None, when

    def _events_after(self, point: float) -> Iterator[float]:
        """When touch and separation are still to come (s), if the host's time is this one now."""
        high, low = self._segment.instant(self._count)
        impact = self._segment.impact
        inputs: Any = tuple(self.values[:INPUTS])
        try:
            if inputs != impact.inputs:
                impact = impact.with_inputs(inputs, high, low)
            while True:
                impact = impact.at(high, low)
                left = nextafter(impact.duration - impact.elapsed(high, low), inf)
                if left == inf:
                    return
                # A step that ends there must not be shorter, whatever the host's rounding.
                when = point + left
                while when - point < left:
                    when = nextafter(when, inf)
                yield when
                high, low = added(high, low, when - point)
                point = when
        except (ArithmeticError, ValueError):
            return

    def step_to_event(self, point: float, size: float, early: bool) -> tuple[bool, bool, float]:
        """One communication step; if early return is allowed, only until touch or separation.

        Returns whether it was accepted, see `step`; whether it ends with an event; where it ends,
        s. An event inside a step that goes on is over when the step ends, and isn't reported.
        """
        end = point + size
        # A point or a size that isn't a number is refused below.
        if self._mode == STEPPING and not isinstance(self._segment, Solving) and isfinite(end):
            for when in self._events_after(point):
                if when > end:
                    break
                if when == end or (early and when > point):
                    return self.step(point, size if when == end else when - point), True, when
        return self.step(point, size), False, end

    def _solving(self) -> Solving:
        """The solver's time and states; before stepping, those of the present values."""
        if isinstance(self._segment, Solving):
            return self._segment
        p, inputs = self._split()
        time, start = self.time(), [-p.gap, 0.0, inputs[2], p.ball_speed]
        impact, states = SolvedImpact(p, inputs, *inputs[:2]).after_event(time, start)
        solving = Solving(impact, states, nan if self.last_step else time, False)
        if self._mode == STEPPING:
            self._go_on(solving, 0.0)
            # From here on the clock is the host's time.
            self.origin = 0.0
            if impact.refusal_of_touch is not None:
                self._report(impact.refusal_of_touch)
        return solving

    def set_time(self, time: float) -> None:
        """The host's time, s; the first one set before any state is that of the start."""
        solving = self._solving()
        impact = solving.impact
        if self._segment is solving:
            if not solving.started:
                self.start_time = time
                if impact.touch is not None:
                    impact = impact._replace(touch=impact.touch._replace(high=time))
            self._go_on(Solving(impact, solving.states, time, True), 0.0)

    def states(self) -> list[float]:
        """The continuous states: positions (m) and velocities (m/s), each of club and ball."""
        return self._solving().states

    def set_states(self, states: list[float]) -> None:
        """Of the host's solver; the list is kept."""
        solving = self._solving()
        if self._segment is solving:
            self._go_on(Solving(solving.impact, states, solving.high, True), 0.0)

    def derivatives(self) -> list[float]:
        """Of the states; NaN while values are refused, so that no solver goes on with others."""
        solving = self._solving()
        impact = solving.impact
        if self._refused or self._mode == BLOCKED or impact.refusal_of_touch is not None:
            return [nan] * 4
        now = impact.solver_state(solving.states)
        return [now[3], now[4], *accelerations(impact, now)]

    def indicators(self) -> list[float]:
        """Of touch and separation: above 0 until it happens."""
        solving = self._solving()
        now = solving.impact.solver_state(solving.states)
        return [touch_indicator(solving.impact, now), separation_indicator(solving.impact, now)]

    unpacked = staticmethod(partial(state.unpacked, revive=_revived))
