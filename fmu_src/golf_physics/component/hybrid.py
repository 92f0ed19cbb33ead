"""Model Exchange, which FMI 3.0 has beside stepping: a host's solver finds the motion.

An instance isn't told which of the two it is for: the first call that only Model Exchange has
decides. From then on the host's time and states count, and steps are refused.
"""

from collections.abc import Callable, Iterator
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
from .segment import NO_READER, Segment

#: Added to an indicator that may be exactly 0 before its event: solvers look for changes of sign.
_ABOVE_ZERO = 1e-18


class _Solved(NamedTuple):
    parameters: Parameters
    inputs: Inputs
    k: float  #: of the contact, N/m
    b: float  #: of the contact, N.s/m
    time: float  #: the host's, s
    states: list[float]  #: positions (m) and velocities (m/s), each of club and ball
    started: bool = False  #: whether the start time is fixed
    touch: Touch | None = None  #: in the host's time
    in_contact: bool = False
    refusal_of_touch: str | None = None  #: why the law rejects the touch that there was
    dragged: float = 0.0  #: momentum that drag has taken from the ball until the last event, N.s
    drag: float = 0.0  #: its coefficient from then on, N.s/m
    x_ball: float = 0.0  #: position of the ball at that event, m
    lasted: float = 0.0  #: of the contact once it has ended, s
    x_end: float = 0.0  #: position of the ball then, m


class SolvedImpact(_Solved):
    """An impact from its last event on, whose motion a host's solver finds.

    Outputs read it as an `Impact`; it takes the place of an instance's communication steps.
    """

    # As of a segment.
    size = nan
    reader = NO_READER

    @property
    def impact(self) -> "SolvedImpact":
        return self

    def instant(self, count: float) -> tuple[float, float]:
        return self.time, 0.0

    def state(self, count: float) -> "tuple[State, SolvedImpact]":
        force, *moving, compression = self.solver_state()
        return [max(0.0, force), *moving, max(0.0, compression)], self

    def packed(self) -> list:
        return ["SolvedImpact", *self]

    @staticmethod
    def unpacked(packed: list) -> Any:
        """A segment or a solved impact from what JSON makes of its `packed`."""
        if packed[0] != "SolvedImpact":
            return Segment.unpacked(packed)
        _, values, inputs, *others = packed
        solved = SolvedImpact(Parameters(*values), tuple(inputs), *others)
        return solved._replace(touch=solved.touch and Touch(*solved.touch))

    def solver_state(self) -> State:
        """The state; force and compression continue smoothly below 0 until the event."""
        x_club, x_ball, v_club, v_ball = self.states
        if self.touch is None:
            v_club = self.inputs[2]
        compression = x_club - x_ball
        force = 0.0
        if self.in_contact:
            p = self.parameters
            force = p.contact_law.force(p, self.k, self.b, compression, v_club - v_ball)
        return [force, x_club, x_ball, v_club, v_ball, compression]

    def with_inputs(self, inputs: Inputs) -> "SolvedImpact":
        p = self.parameters
        k, b, _ = inputs
        if self.touch is not None:
            b = p.contact_law.damping(p, k, b, self.touch.club_speed - p.ball_speed)
        return self._replace(inputs=inputs, k=k, b=b)

    def after_event(self) -> "SolvedImpact":
        """The impact after what happens at this instant."""
        x_club, x_ball, _, v_ball = self.states
        p, impact = self.parameters, self
        if self.touch is None:
            club_speed = self.inputs[2]
            impact = self._replace(states=[x_club, x_ball, club_speed, v_ball])
            if x_club >= x_ball and club_speed > v_ball:
                refusal = p.contact_law.refusal_of_touch(p, club_speed)
                touch = Touch(self.time, 0.0, x_ball, club_speed)
                impact = impact._replace(touch=touch, in_contact=True, refusal_of_touch=refusal)
                if refusal is None:
                    impact = impact.with_inputs(self.inputs)
                impact = impact._with_drag()
        elif self.in_contact:
            impact = self._with_drag()
            if separation_indicator(self, self.solver_state()) <= 0.0:
                lasted = self.time - self.touch.high
                impact = impact._replace(lasted=lasted, x_end=x_ball, in_contact=False)
        return impact

    def _with_drag(self) -> "SolvedImpact":
        """Sums up the drag on the ball until here, where its coefficient may change."""
        x_ball = self.states[1]
        dragged = self.dragged + self.drag * (x_ball - self.x_ball)
        drag = self.parameters.contact_law.drag(self.b)
        return self._replace(dragged=dragged, drag=drag, x_ball=x_ball)

    def contact_until(self, high: float, low: float) -> "tuple[SolvedImpact, float]":
        touch = self.touch if self.in_contact else None
        return self, (self.time - touch.high if touch is not None else self.lasted)

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
    # A host sees a force of at least 0, its solver doesn't.
    if isinstance(impact, SolvedImpact):
        state = impact.solver_state()
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
    "club_acceleration": lambda impact, state, at: accelerations(impact, state)[0],
    "ball_acceleration": lambda impact, state, at: accelerations(impact, state)[1],
    "touch_indicator": lambda impact, state, at: touch_indicator(impact, state),
    "separation_indicator": lambda impact, state, at: separation_indicator(impact, state),
}


class HybridComponent(Component):
    """An instance for co-simulation with event mode, or for Model Exchange."""

    __slots__ = ()

    reading = staticmethod(readings(VARIABLES + MORE_VARIABLES, OUTPUTS | _MORE))

    def __init__(self, report: Callable[[str], None]) -> None:
        super().__init__(report)
        # The start time isn't passed to an instance: it is that of the first step.
        self._point = nan
        self._anchored = False

    @property
    def _solved(self) -> SolvedImpact | None:
        """In Model Exchange, the impact."""
        segment: Any = self._segment
        return segment if isinstance(segment, SolvedImpact) else None

    def time(self) -> float:
        high, low = self.instant()
        return self.origin + (high + low)

    def _check(self, point: float, size: float) -> Segment | str:
        if self._solved is not None:
            return "a step is refused: this instance is used for Model Exchange"
        first = not self.last_step
        accepted = super()._check(point, size)
        if first and not isinstance(accepted, str):
            self.start_time = self.origin
        return accepted

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        super().set_values(references, values, type_)
        inputs: Any = tuple(self.values[:INPUTS])
        solved = self._solved
        if solved is not None and inputs != solved.inputs:
            self._go_on(solved.with_inputs(inputs), 0.0)

    def update(self) -> tuple[bool, bool, float | None]:
        """Handle the events of this instant.

        Returns whether the host must stop, since values were refused; whether its solver must start
        anew; while stepping, the host's time (s) of the next touch or separation, if one is due.
        """
        problem = self._begin() if self._mode == BLOCKED else None
        if problem is None and self._mode != STEPPING:
            self._refuse_once("an event before initialization or after the end is refused")
            return False, False, None
        solved = self._solved
        if problem is None and self._refused and (solved is not None or not self.last_step):
            problem = "; ".join(self._refused.values())
        if problem is None and solved is not None:
            solved = solved.after_event()
            self._go_on(solved, 0.0)
            problem = solved.refusal_of_touch
        if problem is not None:
            self._report(f"the simulation must stop: {problem}")
            return True, False, None
        # Before the first step it may still be used for Model Exchange, which has indicators.
        ahead = solved is None and self.last_step
        when = next(self._events_after(self._point), None) if ahead else None
        # A solver starts anew at every event: derivatives jump with inputs as well, and fmusim's
        # CVODE is wrong otherwise.
        return False, solved is not None, when

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
        if self._mode == STEPPING and self._solved is None and isfinite(end):
            for when in self._events_after(point):
                if when > end:
                    break
                if when == end or (early and when > point):
                    return self.step(point, size if when == end else when - point), True, when
        return self.step(point, size), False, end

    def _solving(self) -> SolvedImpact:
        """The impact to solve; before stepping, that of the present values."""
        solved = self._solved
        if solved is not None:
            return solved
        p, inputs = self._split()
        k, b, club_speed = inputs
        start = [-p.gap, 0.0, club_speed, p.ball_speed]
        time = nan if self.last_step else self.time()
        solved = SolvedImpact(p, inputs, k, b, time, start).after_event()
        if self._mode == STEPPING:
            self._go_on(solved, 0.0)
            # From here on the clock is the host's time.
            self.origin = 0.0
            if solved.refusal_of_touch is not None:
                self._report(solved.refusal_of_touch)
        return solved

    def set_time(self, time: float) -> None:
        """The host's time, s; the first one set before any state is that of the start."""
        solved = self._solving()
        if self._solved is None:
            return
        if not solved.started:
            self.start_time = time
            if solved.touch is not None:
                solved = solved._replace(touch=solved.touch._replace(high=time))
        self._go_on(solved._replace(time=time, started=True), 0.0)

    def states(self) -> list[float]:
        """The continuous states: positions (m) and velocities (m/s), each of club and ball."""
        return self._solving().states

    def set_states(self, states: list[float]) -> None:
        """Of the host's solver; the list is kept."""
        solved = self._solving()
        if self._solved is not None:
            self._go_on(solved._replace(states=states, started=True), 0.0)

    def derivatives(self) -> list[float]:
        """Of the states; NaN while values are refused, so that no solver goes on with others."""
        solved = self._solving()
        if self._refused or self._mode == BLOCKED or solved.refusal_of_touch is not None:
            return [nan] * 4
        now = solved.solver_state()
        return [now[3], now[4], *accelerations(solved, now)]

    def indicators(self) -> list[float]:
        """Of touch and separation: above 0 until it happens."""
        solved = self._solving()
        now = solved.solver_state()
        return [touch_indicator(solved, now), separation_indicator(solved, now)]

    unpacked = staticmethod(partial(state.unpacked, revive=SolvedImpact.unpacked))
