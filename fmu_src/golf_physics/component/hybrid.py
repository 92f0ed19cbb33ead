"""Model Exchange, which FMI 3.0 has beside stepping: a host's solver finds the motion.

Which of the two an instance is for follows from the first call that only Model Exchange has: from
then on the host's time and states count, and steps are refused.
"""

from collections.abc import Callable
from math import inf, nan, nextafter
from typing import Any

from ..impact import advance
from ..modes import START_REFUSED, STEPPING
from ..refusals import conflict_of_inputs
from ..values import Inputs, Refusal
from ..variables import INPUTS, MORE_VARIABLES, VARIABLES
from .component import Component
from .outputs import OUTPUTS, Output, readings
from .solved import SolvedImpact, accelerations, separation_indicator, touch_indicator
from .state import Snapshot

# Sentences, with {} in place of the refusals.
NO_EVENT = "an event before initialization or after the end is refused"
MUST_STOP = "the simulation must stop: {}"

#: What FMI 2.0 doesn't have.
_MORE: dict[str, Output] = {
    "time": lambda impact, at: at.time(),
    "club_acceleration": lambda impact, at: accelerations(impact, at.state())[0],
    "ball_acceleration": lambda impact, at: accelerations(impact, at.state())[1],
    "touch_indicator": lambda impact, at: touch_indicator(impact, at.state()),
    "separation_indicator": lambda impact, at: separation_indicator(impact, at.state()),
}


def _is_solved(impact: Any, last_step: float) -> bool | None:
    """Whether an instance is used for Model Exchange; None if that is still open."""
    return isinstance(impact, SolvedImpact) or (False if last_step else None)


class HybridComponent(Component):
    """An instance for co-simulation with event mode, or for Model Exchange."""

    __slots__ = ()

    reading = staticmethod(readings(VARIABLES + MORE_VARIABLES, OUTPUTS | _MORE))

    def __init__(self, report: Callable[[Refusal], Any]) -> None:
        super().__init__(report)
        # The start time isn't passed to an instance: it is that of the first step.
        self._point = nan
        self._point_is_free = True

    @property
    def _solved(self) -> SolvedImpact | None:
        """In Model Exchange, the impact."""
        return self._impact if isinstance(self._impact, SolvedImpact) else None

    def _is_alike(self, snapshot: Snapshot) -> bool:
        # Before either of them has stepped or been solved, an instance may become both.
        kinds = _is_solved(snapshot.impact, snapshot.size), _is_solved(self._impact, self.last_step)
        return not {True, False} <= {*kinds}

    def _solve(self, solved: SolvedImpact) -> None:
        self._run(solved, solved.inputs, (solved.time, 0.0), 0.0)

    def time(self) -> float:
        high, low = self.instant()
        return self.origin + (high + low)

    def _check(self, point: float, size: float) -> Refusal | None:
        if self._solved is not None:
            return Refusal("a step is refused: this instance is used for Model Exchange")
        first = not self.last_step
        problem = super()._check(point, size)
        if first and problem is None:
            self.start_time = self.origin
        return problem

    def set_values(self, references: list[int], values: list[Any], type_: str = "Real") -> None:
        super().set_values(references, values, type_)
        inputs = Inputs(*self.values[:INPUTS])
        solved = self._solved
        if solved is not None and inputs != solved.inputs:
            self._solve(solved.with_inputs(inputs))

    def update(self) -> tuple[bool, bool, float | None]:
        """Handle the events of this instant.

        Returns whether the host must stop, since values were refused; whether its solver must start
        anew; while stepping, the host's time (s) of the next touch or separation, if one is due.
        """
        problem = self._start() if self._mode == START_REFUSED else None
        if problem is None and self._mode != STEPPING:
            self._refuse_call(NO_EVENT)
            return False, False, None
        solved = self._solved
        if problem is None and (solved is not None or not self.last_step):
            problem = self._take_refusals()
        if problem is None and solved is not None:
            problem = conflict_of_inputs(solved.parameters, solved.inputs)
        if problem is None and solved is not None:
            solved = solved.after_event()
            self._solve(solved)
            problem = solved.refusal_of_touch
        if problem is not None:
            self._report(problem._replace(sentence=MUST_STOP.format(problem)))
            return True, False, None
        # Before the first step it may still be used for Model Exchange, which has indicators.
        ahead = solved is None and self.last_step
        when = self._next_event(self._point) if ahead else None
        # A solver starts anew at every event: derivatives jump with inputs as well, and fmusim's
        # CVODE is wrong otherwise.
        return False, solved is not None, when

    def _next_event(self, point: float) -> float | None:
        """When touch or separation comes, s, if the host's time is this one now; None: never."""
        instant, inputs = self.instant(), Inputs(*self.values[:INPUTS])
        if conflict_of_inputs(self._impact.parameters, inputs) is not None:
            # The next step will be refused.
            return None
        try:
            impact = advance(self._changed(inputs), inputs, instant)
            impact.find_end()
        except (ArithmeticError, ValueError):
            return None
        left = nextafter(impact.duration - impact.elapsed(instant), inf)
        if left == inf:
            return None
        # A step that ends there must not be shorter, whatever the host's rounding.
        when = point + left
        while when - point < left:
            when = nextafter(when, inf)
        return when

    def _solving(self) -> SolvedImpact:
        """The impact to solve; before stepping, that of the present values."""
        solved = self._solved
        if solved is not None:
            return solved
        p, inputs = self._split()
        if self.last_step:
            refusal = Refusal("Model Exchange is refused: this instance has made steps")
            self._report(refusal)
            return SolvedImpact(p, inputs, inputs.b, nan, (nan,) * 4, refusal_of_touch=refusal)
        start = -p.gap, 0.0, inputs.club_speed, p.ball_speed
        solved = SolvedImpact(p, inputs, inputs.b, self.time(), start).after_event()
        if self._mode == STEPPING:
            self._solve(solved)
            # From here on the clock is the host's time.
            self.origin = 0.0
            if solved.refusal_of_touch is not None:
                self._report(solved.refusal_of_touch)
        return solved

    def set_time(self, time: float) -> None:
        """The host's time, s."""
        solved = self._solving()
        if self._solved is not None:
            self._solve(solved._replace(time=time))

    def states(self) -> list[float]:
        """The continuous states: positions (m) and velocities (m/s), each of club and ball."""
        return list(self._solving().states)

    def set_states(self, states: list[float]) -> None:
        """Of the host's solver."""
        solved = self._solving()
        if self._solved is None:
            return
        moved = tuple(states)
        if not solved.started and moved == solved.states:
            solved = self._started()
        self._solve(solved._replace(states=moved, started=True))

    def _started(self) -> SolvedImpact:
        """The impact of a run whose start is now, as long as its states are those of the start.

        pythonfmu3 doesn't pass the start time on: it is the time at which the host evaluates the
        equations in these states; until then, 0.
        """
        solved = self._solving()
        if self._solved is not None and not solved.started and self.start_time != solved.time:
            self.start_time = solved.time
            if solved.touch is not None:
                touch = solved.touch._replace(instant=(solved.time, 0.0))
                solved = solved._replace(touch=touch)
                self._solve(solved)
        return solved

    def derivatives(self) -> list[float]:
        """Of the states; NaN while values are refused, so that no solver continues with others."""
        solved = self._started()
        refused = self._refused or self._illegal or solved.refusal_of_touch is not None
        if refused or self._mode == START_REFUSED:
            return [nan] * 4
        now = solved.solver_state()
        return [now[3], now[4], *accelerations(solved, now)]

    def indicators(self) -> list[float]:
        """Of touch and separation: above 0 until it happens."""
        solved = self._solving()
        now = solved.solver_state()
        return [touch_indicator(solved, now), separation_indicator(solved, now)]
