"""A component whose motion the host's solver may find: what FMI 3.0 has beside stepping.

An instance isn't told which of the two it is for. The first call that only Model Exchange has
decides; from then on the host's time and states count, and steps are refused.
"""

from collections.abc import Callable, Iterator
from math import inf, isfinite, nan, nextafter
from typing import Any

from ..impact import added
from ..laws.contact import State
from ..parameters import INPUTS
from ..variables import MORE_VARIABLES, VARIABLES
from . import state
from .component import BLOCKED, STEPPING, Component
from .outputs import OUTPUTS, Output, readings
from .segment import NO_SEGMENT, Segment
from .solved import SolvedImpact, accelerations, separation_indicator, touch_indicator

#: What FMI 2.0 doesn't have.
_MORE: dict[str, Output] = {
    "time": lambda impact, state, at: at.time(),
    "club_acceleration": lambda impact, state, at: accelerations(impact, at.unclamped(state))[0],
    "ball_acceleration": lambda impact, state, at: accelerations(impact, at.unclamped(state))[1],
    "touch_indicator": lambda impact, state, at: touch_indicator(impact, state),
    "separation_indicator": lambda impact, state, at: separation_indicator(impact, state),
}


class HybridComponent(Component):
    """An instance for co-simulation with event mode, or for Model Exchange.

    Args:
        report: called with a message whenever something is refused.
    """

    __slots__ = ("_solved", "_started", "_states", "_time")

    reading = staticmethod(readings(VARIABLES + MORE_VARIABLES, OUTPUTS | _MORE))

    def __init__(self, report: Callable[[str], None]) -> None:
        super().__init__(report)
        #: Model Exchange: the impact, the states and the time that the host's solver is at, and
        #: whether the host's time at the start is known, or can't be set any more.
        self._solved: SolvedImpact | None = None
        self._states: list[float] = []
        self._time = nan
        self._started = False
        # The start time isn't passed to an instance: it is that of the first step.
        self._point = nan
        self._anchored = False

    @property
    def last_step(self) -> float:
        return super().last_step if self._solved is None else nan

    def instant(self) -> tuple[float, float]:
        return super().instant() if self._solved is None else (self._time, 0.0)

    def time(self) -> float:
        """The host's time, s."""
        high, low = self.instant()
        return self.origin + (high + low)

    def impact(self) -> Any:
        return super().impact() if self._solved is None else self._solved

    def _check(self, point: float, size: float) -> Segment | str:
        if self._solved is not None:
            return "a step is refused: this instance is used for Model Exchange"
        first = not self.last_step
        accepted = super()._check(point, size)
        if first and not isinstance(accepted, str):
            self.start_time = self.origin
        return accepted

    def _evaluate(self) -> State:
        if self._solved is None:
            return super()._evaluate()
        self._now = self._solved.state(self._states)
        return self._now

    def unclamped(self, state: State) -> State:
        """The state that the equations of Model Exchange have."""
        return state if self._solved is None else self._solved.solver_state(self._states)

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        """Set inputs and parameters; what is refused keeps its value. See `Component`."""
        super().set_values(references, values, type_)
        solved = self._solved
        if solved is not None:
            inputs: Any = tuple(self.values[:INPUTS])
            if inputs != solved.inputs:
                self._solved = solved.with_inputs(inputs)
            self._now = None

    # Event mode

    def update(self) -> tuple[bool, bool, float | None]:
        """Handle the events of this instant.

        Returns:
            Whether the host must stop, since values were refused; whether its solver must start
            anew, since a state or a derivative has jumped; and, while stepping, the host's time (s)
            of the next touch or separation, if one is due under the present inputs.
        """
        problem = self._begin() if self._mode == BLOCKED else None
        if problem is None and self._mode != STEPPING:
            self._refuse_once("an event before initialization or after the end is refused")
            return False, False, None
        solved = self._solved
        if problem is None and self._refused and (solved is not None or not self.last_step):
            problem = "; ".join(self._refused.values())
        jumped = False
        if problem is None and solved is not None:
            self._now = None
            self._solved, self._states = solved.after_event(self._time, self._states)
            # At every event: derivatives jump with inputs as well, and fmusim's CVODE is wrong
            # unless it starts anew.
            jumped = True
            problem = self._solved.refusal_of_touch
        if problem is not None:
            self._report(f"the simulation must stop: {problem}")
            return True, jumped, None
        # Before the first step it may still be used for Model Exchange, which has indicators.
        ahead = solved is None and self.last_step
        return False, jumped, next(self._events_after(self._point), None) if ahead else None

    def _events_after(self, point: float) -> Iterator[float]:
        """When touch and separation are still to come (s), if the host's time is this one now."""
        segment = self._segment
        if segment is NO_SEGMENT:
            return
        high, low = segment.instant(self._count)
        impact = segment.impact
        inputs: Any = tuple(self.values[:INPUTS])
        try:
            if inputs != impact.inputs:
                impact = impact.with_inputs(inputs, high, low)
            while True:
                impact = impact.at(high, low)
                left = nextafter(impact.duration - impact.elapsed(high, low), inf)
                if left == inf:
                    return
                # The event belongs to a step that ends there, so the difference that the host takes
                # as its step must not be shorter, whatever its rounding.
                when = point + left
                while when - point < left:
                    when = nextafter(when, inf)
                yield when
                high, low = added(high, low, when - point)
                point = when
        except (ArithmeticError, ValueError):
            return

    def step_to_event(self, point: float, size: float, early: bool) -> tuple[bool, bool, float]:
        """One communication step, or as much of it as there is until touch or separation.

        Args:
            point: the host's communication point, s.
            size: communication step size, s, > 0.
            early: whether early return is allowed.

        Returns:
            Whether it was accepted, see `step`; whether it ends with an event; where it ends, s.
            An event inside a step that goes on is over when the step ends, and isn't reported.
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

    # Model Exchange

    def _solving(self) -> tuple[SolvedImpact, list[float]]:
        """The impact to solve and its states; before stepping, those of the present values."""
        if self._solved is not None:
            return self._solved, self._states
        solved, states = SolvedImpact.start(*self._split())
        time = self.time()
        solved, states = solved.after_event(time, states)
        if self._mode == STEPPING:
            self._solved, self._states, self._now = solved, states, None
            # From here on the clock is the host's time.
            self._time, self.origin = nan if self.last_step else time, 0.0
            if solved.refusal_of_touch is not None:
                self._report(solved.refusal_of_touch)
        return solved, states

    def set_time(self, time: float) -> None:
        """The host's time, s; the first one set before any state is that of the start."""
        solved, _ = self._solving()
        if not self._started and self._solved is not None:
            self._started = True
            self.start_time = time
            if solved.touch is not None:
                self._solved = solved._replace(touch=solved.touch._replace(high=time))
        self._time = time
        self._now = None

    def states(self) -> list[float]:
        """The continuous states: positions (m) and velocities (m/s), each of club and ball."""
        return self._solving()[1]

    def set_states(self, states: list[float]) -> None:
        """The states that the host's solver is at; the list is kept."""
        self._solving()
        if self._solved is not None:
            self._started = True
            self._states = states
        self._now = None

    def derivatives(self) -> list[float]:
        """Of the states; NaN while values are refused, so that no solver goes on with others."""
        solved, states = self._solving()
        if self._refused or self._mode == BLOCKED or solved.refusal_of_touch is not None:
            return [nan] * 4
        now = solved.solver_state(states)
        return [now[3], now[4], *accelerations(solved, now)]

    def indicators(self) -> list[float]:
        """Of touch and separation: above 0 until it happens."""
        solved, states = self._solving()
        now = solved.solver_state(states)
        return [touch_indicator(solved, now), separation_indicator(solved, now)]

    # State

    def snapshot(self) -> tuple:
        solving = self._solved, self._states, self._time, self._started
        return (*super().snapshot(), *solving)

    def restore(self, snapshot: tuple | None) -> None:
        super().restore(snapshot)
        if state.is_own(snapshot):
            self._solved, self._states, self._time, self._started = snapshot[state.LENGTH :]  # type: ignore[index]

    @staticmethod
    def _pack_more(more: tuple) -> list:
        solved, *others = more
        return [solved and solved.packed(), *others]

    @staticmethod
    def _unpack_more(more: list) -> tuple:
        solved, states, time, started = more
        solved = None if solved is None else SolvedImpact.unpacked(solved)
        return solved, [float(value) for value in states], float(time), bool(started)
