"""Model Exchange, which FMI 3.0 has beside stepping: a host's solver finds the motion.

Which of the two an instance is for follows from the first call that only Model Exchange has: from
then on the host's time and states count, and steps are refused.
"""

from collections.abc import Callable, Iterator
from math import inf, isfinite, nan, nextafter

from ..impact import advance
from ..refusals import conflict_of_inputs
from ..values import Inputs, Refusal, added
from ..variables import INPUTS, MORE_VARIABLES, VARIABLES
from .component import Component, together
from .outputs import OUTPUTS, Output, readings
from .segment import Segment
from .solved import SolvedImpact, accelerations, separation_indicator, touch_indicator
from .state import BLOCKED, STEPPING

#: What FMI 2.0 doesn't have.
_MORE: dict[str, Output] = {
    "time": lambda impact, at: at.time(),
    "club_acceleration": lambda impact, at: accelerations(impact, at.state())[0],
    "ball_acceleration": lambda impact, at: accelerations(impact, at.state())[1],
    "touch_indicator": lambda impact, at: touch_indicator(impact, at.state()),
    "separation_indicator": lambda impact, at: separation_indicator(impact, at.state()),
}


def _is_solved(segment: Segment) -> bool | None:
    """Whether steps are those of Model Exchange; None if there were none."""
    return isinstance(segment.impact, SolvedImpact) or (False if segment.size else None)


class HybridComponent(Component):
    """An instance for co-simulation with event mode, or for Model Exchange."""

    __slots__ = ()

    reading = staticmethod(readings(VARIABLES + MORE_VARIABLES, OUTPUTS | _MORE))

    def __init__(self, report: Callable[[Refusal], None]) -> None:
        super().__init__(report)
        # The start time isn't passed to an instance: it is that of the first step.
        self._point = nan
        self._anchored = False

    @property
    def _solved(self) -> SolvedImpact | None:
        """In Model Exchange, the impact."""
        impact = self._segment.impact
        return impact if isinstance(impact, SolvedImpact) else None

    def _is_alike(self, segment: Segment) -> bool:
        # Before either of them has stepped or been solved, an instance may become both.
        kinds = {_is_solved(one) for one in (segment, self._segment)}
        return not {True, False} <= kinds

    def _solve(self, solved: SolvedImpact, time: float) -> None:
        """Go on with this impact at this time of the host, s."""
        self._go_on(Segment(solved, solved.inputs, (time, 0.0), nan))

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

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        super().set_values(references, values, type_)
        inputs = Inputs(*self.values[:INPUTS])
        solved = self._solved
        if solved is not None and inputs != solved.inputs:
            self._solve(solved.with_inputs(inputs), self._segment.begin[0])

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
            problem = together([*self._refused.values()])
        if problem is None and solved is not None:
            time = self._segment.begin[0]
            solved = solved.after_event(time)
            self._solve(solved, time)
            problem = solved.refusal_of_touch
        if problem is not None:
            self._report(problem._replace(sentence=f"the simulation must stop: {problem}"))
            return True, False, None
        # Before the first step it may still be used for Model Exchange, which has indicators.
        ahead = solved is None and self.last_step
        when = next(self._events_after(self._point), None) if ahead else None
        # A solver starts anew at every event: derivatives jump with inputs as well, and fmusim's
        # CVODE is wrong otherwise.
        return False, solved is not None, when

    def _events_after(self, point: float) -> Iterator[float]:
        """When touch and separation are still to come (s), if the host's time is this one now."""
        instant = self.instant()
        inputs, segment = Inputs(*self.values[:INPUTS]), self._segment
        if conflict_of_inputs(segment.impact.parameters, inputs) is not None:
            # The next step will be refused.
            return
        try:
            impact = segment.changed(inputs, self._count)
            while True:
                impact = advance(impact, inputs, instant)
                impact.find_end()
                left = nextafter(impact.duration - impact.elapsed(instant), inf)
                if left == inf:
                    return
                # A step that ends there must not be shorter, whatever the host's rounding.
                when = point + left
                while when - point < left:
                    when = nextafter(when, inf)
                yield when
                instant = added(instant, when - point)
                point = when
        except (ArithmeticError, ValueError):
            return

    def step_to_event(self, point: float, size: float, early: bool) -> tuple[bool, bool, float]:
        """One communication step; if early return is allowed, only until touch or separation.

        Returns whether it was accepted, see `step`; whether it ends with an event; where it ends,
        s. An event inside a step that continues is over when the step ends, and isn't reported.
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
        if self.last_step:
            refusal = Refusal("Model Exchange is refused: this instance has made steps")
            self._report(refusal)
            return SolvedImpact(p, inputs, inputs.b, [nan] * 4, refusal_of_touch=refusal)
        start = [-p.gap, 0.0, inputs.club_speed, p.ball_speed]
        time = self.time()
        solved = SolvedImpact(p, inputs, inputs.b, start).after_event(time)
        if self._mode == STEPPING:
            self._solve(solved, time)
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
                solved = solved._replace(touch=solved.touch._replace(instant=(time, 0.0)))
            solved = solved._replace(started=True)
        self._solve(solved, time)

    def states(self) -> list[float]:
        """The continuous states: positions (m) and velocities (m/s), each of club and ball."""
        return list(self._solving().states)

    def set_states(self, states: list[float]) -> None:
        """Of the host's solver; the list is kept."""
        solved = self._solving()
        if self._solved is not None:
            self._solve(solved._replace(states=states, started=True), self._segment.begin[0])

    def derivatives(self) -> list[float]:
        """Of the states; NaN while values are refused, so that no solver continues with others."""
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
