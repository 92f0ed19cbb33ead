"""A component whose motion the host may also find itself: what FMI 3.0 has beside stepping.

Nobody tells an instance which of the two it is for. The first call that only Model Exchange knows
decides; from then on the host's time and states count, and steps are refused.
"""

from collections.abc import Callable, Iterator
from math import inf, isfinite, nan, nextafter
from typing import Any, ClassVar

from ..impact import Impact, added
from ..laws.contact import State
from ..parameters import INPUTS
from ..variables import MORE_VARIABLES, VARIABLES
from .component import BLOCKED, STEPPING, Component
from .outputs import OUTPUTS, Output, readings
from .solved import SolvedImpact, acceleration, separation_indicator, touch_indicator
from .state import is_own

#: What FMI 2.0 doesn't have.
_MORE: dict[str, Output] = {
    "time": lambda impact, state, at: at.time(),
    "club_acceleration": lambda impact, state, at: acceleration(impact, state, 0),
    "ball_acceleration": lambda impact, state, at: acceleration(impact, state, 1),
    "touch_indicator": lambda impact, state, at: touch_indicator(impact, state),
    "separation_indicator": lambda impact, state, at: separation_indicator(impact, state),
}


class HybridComponent(Component):
    """An instance for co-simulation with event mode, or for Model Exchange.

    Args:
        report: called with a message whenever something is refused.
    """

    __slots__ = ("_solved",)

    reading = staticmethod(readings(VARIABLES + MORE_VARIABLES, OUTPUTS | _MORE))
    kinds: ClassVar[dict[type, Any]] = Component.kinds | {dict: SolvedImpact}

    def __init__(self, report: Callable[[str], None]) -> None:
        super().__init__(report)
        #: The impact as the host's solver finds it; None while the phases do.
        self._solved: SolvedImpact | None = None
        # The host's time at the start isn't told: it is that of the first step.
        self._point = nan
        self._anchored = False

    def time(self) -> float:
        """The host's time, s."""
        high, low = self.instant()
        return self.origin + (high + low)

    def _look(self, point: float, size: float, high: float, low: float) -> str | None:
        if self._solved is not None:
            return "a step is refused: this instance is used for Model Exchange"
        problem = super()._look(point, size, high, low)
        if problem is None and not self.last_step:
            self.start_time = self.origin
        return problem

    def _evaluate(self) -> State:
        if self._solved is None:
            return super()._evaluate()
        self._now = self._solved.state()
        return self._now

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        """Set inputs and parameters; what is refused keeps its value. See `Component`."""
        super().set_values(references, values, type_)
        solved = self._solved
        if solved is not None:
            inputs: Any = tuple(self.values[:INPUTS])
            if inputs != solved.in_force:
                solved.hold(inputs)
            self._now = None

    # Event mode

    def update(self) -> tuple[bool, bool, float | None]:
        """Whatever happens at this instant.

        Returns:
            Whether the host must stop, since values were refused; whether a solver must start anew,
            since states or derivatives may have jumped; and, while stepping, the host's time (s) of
            the next touch or separation, if one is due under the present inputs.
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
            solved.update(self.clock)
            # Derivatives jump at touch, at separation and with inputs, even where states don't, and
            # this alone makes fmusim's CVODE start anew.
            jumped = True
            problem = solved.refusal_of_touch
        if problem is not None:
            self._report(f"the simulation must stop: {problem}")
            return True, jumped, None
        # Before the first step it may still be used for Model Exchange, where indicators tell it.
        ahead = solved is None and self.last_step
        return False, jumped, next(self._events_after(self._point), None) if ahead else None

    def _events_after(self, point: float) -> Iterator[float]:
        """When touch and separation are still to come (s), if the host's time is this one now."""
        impact = self._impact
        if impact is None:
            return
        high, low = self.instant()
        ahead = Impact.restored(impact.snapshot())
        inputs: Any = tuple(self.values[:INPUTS])
        try:
            if inputs != ahead.in_force:
                ahead.hold(high, low, inputs)
            while True:
                ahead.advance(high, low)
                phase = ahead.contact or ahead.free
                left = nextafter(phase.duration - ahead.elapsed(high, low), inf)
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
            early: whether the step may end before its time.

        Returns:
            Whether it was accepted, see `step`; whether it ends with an event; where it ends, s.
            An event inside a step that goes on is over when the step ends, and isn't told.
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

    def _solving(self) -> SolvedImpact:
        """The impact to solve; before the end of initialization, one of the present values."""
        if self._solved is not None:
            return self._solved
        if self._mode == STEPPING and not self.last_step:
            # From here on the clock is the host's time.
            self.clock, self.origin = self.time(), 0.0
        solved = SolvedImpact(*self._split())
        solved.update(self.clock)
        if self._mode == STEPPING:
            # Results look at either.
            self._impact = self._solved = solved  # type: ignore[assignment]
            self._now = None
            self._until = self.last_step = nan
            if solved.refusal_of_touch is not None:
                self._report(solved.refusal_of_touch)
        return solved

    def set_time(self, time: float) -> None:
        """The host's time, s; the first one told before any state is that of the start."""
        solved = self._solving()
        if not solved.started:
            solved.started = True
            self.start_time = time
            if solved.touch is not None:
                solved.touch = (time, *solved.touch[1:])
        self.clock = time
        self._now = None

    def states(self) -> list[float]:
        """The continuous states: positions (m) and velocities (m/s), each of club and ball."""
        return self._solving().states

    def set_states(self, states: list[float]) -> None:
        """Where the host's solver is; the list is kept."""
        solved = self._solving()
        solved.started = True
        solved.states = states
        self._now = None

    def derivatives(self) -> list[float]:
        """Of the states; NaN while values are refused, so that no solver goes on with others."""
        solved = self._solving()
        if self._refused or self._mode == BLOCKED or solved.refusal_of_touch is not None:
            return [nan] * 4
        now = solved.now()
        return [now[3], now[4], acceleration(solved, now, 0), acceleration(solved, now, 1)]

    def indicators(self) -> list[float]:
        """Of touch and separation: above 0 until it happens."""
        solved = self._solving()
        now = solved.now()
        return [touch_indicator(solved, now), separation_indicator(solved, now)]

    # State

    def restore(self, snapshot: tuple | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if snapshot is None or not is_own(snapshot):
            super().restore(snapshot)
        elif type(snapshot[-1]) is dict:
            super().restore((*snapshot[:-1], None))
            self._impact = self._solved = SolvedImpact.restored(snapshot[-1])  # type: ignore
        else:
            super().restore(snapshot)
            self._solved = None
