"""One instance: its variables, modes and clock.

A communication step only advances the clock; outputs are evaluated when they are read. Bad input
is reported by a message and a refused step, never by an exception, which would be fatal in FMI. A
refused call changes nothing: its effects are computed first, and take place only as a whole.
"""

from collections.abc import Callable
from math import isfinite, nan
from operator import attrgetter
from typing import Any

from ..impact import Impact
from ..laws.contact import State
from ..parameters import INPUTS, SETTABLE, Inputs, Parameters, conflict, refusal
from ..variables import VARIABLES
from .outputs import MOVING, OUTPUTS, readings
from .segment import NO_SEGMENT, Segment
from .state import Snapshot, packed, unpacked

#: Modes of an instance, in the order in which a host passes through them. Blocked: initialization
#: has ended on values that can't be used, so parameters may still be set.
INSTANTIATED, INITIALIZATION, BLOCKED, STEPPING, TERMINATED = range(5)

_START_VALUES = tuple(variable.start for variable in VARIABLES[:SETTABLE])
_LOW = [variable.low for variable in VARIABLES[:INPUTS]]
_HIGH = [variable.high for variable in VARIABLES[:INPUTS]]

#: A snapshot after the values, in its order.
_fields = attrgetter(
    "_mode", "_refused", "_once", "start_time", "origin", "_point", "_count", "_segment"
)

#: How far (relative to the step) a host's communication point may lie from where its last step
#: ended: enough for sums of rounded steps, far too little for a step left out.
_POINT_TOLERANCE = 1e-6

_OUT_OF_RANGE = "this impact leaves the range of a double"


class Component:
    """An instance; `report` is called with a message whenever something is refused."""

    __slots__ = (
        "_anchored", "_count", "_mode", "_now", "_once", "_pick", "_point", "_present", "_refused",
        "_report", "_requested", "_segment", "_size", "_watched", "origin", "start_time", "values",
    )  # fmt: skip

    #: How to read variables, by their value references.
    reading = staticmethod(readings(VARIABLES, OUTPUTS))

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._mode = INSTANTIATED
        #: Values as the host sees them: inputs and parameters in the table's order.
        self.values: list[Any] = list(_START_VALUES)
        #: Why steps are refused until it is corrected, by variable name; never changed in place.
        self._refused: dict[str, str] = {}
        #: Why the next step is refused: calls that nothing can correct.
        self._once: tuple[str, ...] = ()
        #: The impact and the steps since its inputs or the step size changed, and how many of them
        #: were accepted. Before stepping: for the present values, computed on demand.
        self._segment = NO_SEGMENT
        self._count = 0.0
        #: The last step size, s, if another such step needs only its communication point checked.
        self._size = nan
        #: The host's time at the start of the run and when the clock stood at 0, s.
        self.start_time = self.origin = 0.0
        #: Where the host's next step is expected to begin, s; unless anchored (after a restore),
        #: anywhere.
        self._point = 0.0
        self._anchored = True
        #: Whether every step must be checked: a touch is ahead that would be refused.
        self._watched = False
        #: The state at this communication point, once it has been read.
        self._now: State | None = None
        #: A state that has been evaluated, and the impact at its instant.
        self._present: tuple[State, Any] = [], None
        #: The last list of references read: see `outputs.Reading`.
        self._requested, self._pick = self.reading((), "Real")

    def set_up(self, start_time: float) -> None:
        """The host's time at the start, s."""
        if self._mode != INSTANTIATED:
            self._refuse_once("set-up after initialization has begun is refused")
        elif not isfinite(start_time):
            self._refuse("start time", f"start time = {start_time!r} s must be a finite number")
        else:
            self._corrected("start time")
            self.start_time = self.origin = self._point = start_time

    def enter_initialization(self) -> None:
        """From here on outputs are those of the present values."""
        if self._mode == INSTANTIATED:
            self._mode = INITIALIZATION
        else:
            self._refuse_once("a second initialization is refused: reset the instance first")

    def exit_initialization(self) -> bool:
        """Fix the parameters, as soon as they can be used.

        Returns whether all start values can be used; if not, steps are refused until they can.
        """
        if self._mode != INITIALIZATION:
            self._refuse_once("the end of an initialization that wasn't entered is refused")
            return True
        self._mode = BLOCKED
        problem = self._begin()
        if problem is not None:
            self._report(problem)
        return problem is None and not self._refused

    def _begin(self) -> str | None:
        """Fix the parameters; or return why they can't be used."""
        parameters, inputs = self._split()
        refused = [text for name, text in self._refused.items() if hasattr(parameters, name)]
        problem = "; ".join(refused) or conflict(parameters, inputs)
        if problem is None:
            self._mode = STEPPING
            self._go_on(Segment(Impact.start(parameters, inputs), 0.0, 0.0, 0.0))
        return problem

    def terminate(self) -> None:
        """The end of the run: values can still be read, nothing else."""
        self._mode = TERMINATED
        self._size = nan

    def _go_on(self, segment: Segment) -> None:
        """From here on the instant is that at which this segment begins."""
        self._segment, self._count, self._now = segment, 0.0, None

    def _split(self) -> tuple[Parameters, Inputs]:
        k, b, club_speed, *parameters = self.values
        return Parameters(*parameters), (k, b, club_speed)

    def step(self, point: float, size: float) -> bool:
        """One communication step from the host's communication point on, both in s.

        Returns whether it was accepted; if not, a message says why, and nothing has changed.
        """
        if size == self._size and (
            point == self._point or abs(point - self._point) <= _POINT_TOLERANCE * size
        ):
            self._count += 1.0
            self._point = point + size
            self._now = None
            return True
        segment = self._check(point, size)
        if isinstance(segment, str):
            self._size = nan
            self._report(segment)
            return False
        self._count = self._count + 1.0 if segment is self._segment else 1.0
        self._segment = segment
        self._now = None
        self._size = nan if self._watched else size
        self._point = point + size
        self._anchored = True
        return True

    @property
    def last_step(self) -> float:
        """The last accepted step size, s; 0 before the first step."""
        return self._segment.size

    def instant(self) -> tuple[float, float]:
        """The present instant: the sum of the accepted steps, s, as a pair."""
        return self._segment.instant(self._count)

    def _check(self, point: float, size: float) -> Segment | str:
        """The segment that a step belongs to, or why it is refused."""
        if not 0.0 < size <= 1e100:
            return f"communication step size = {size!r} s is refused: it must be > 0 and finite"
        if self._mode == BLOCKED:
            problem = self._begin()
            if problem:
                return f"steps are refused until this is corrected: {problem}"
        elif self._mode == TERMINATED:
            return "a step after the end of the run is refused: reset the instance first"
        elif self._mode != STEPPING:
            return "a step before the end of initialization is refused"
        if self._refused or self._once:
            problems = "; ".join((*self._refused.values(), *self._once))
            self._once = ()
            return f"steps are refused until this is corrected: {problems}"
        segment = self._segment
        impact = segment.impact
        high, low = segment.instant(self._count)
        deviation = point - self._point
        origin = self.origin
        if deviation and not abs(deviation) <= _POINT_TOLERANCE * size + 1e-15 * abs(self._point):
            if self._anchored or not abs(point) <= 1e100:
                return (
                    f"communication point = {point!r} s is refused: the last step ended at "
                    f"{self._point!r} s, and no state has been restored since"
                )
            # After a restore the host's time may go on from anywhere; a touch to come moves along.
            touch = impact.at(high, low).touch
            if touch is None or touch.high >= high:
                origin = point - high
        values = self.values
        inputs = k, b, club_speed = values[0], values[1], values[2]
        if inputs != impact.inputs:
            problem = conflict(impact.parameters, inputs)
            if problem is not None:
                return problem
            try:
                impact = impact.with_inputs(inputs, high, low)
            except (ArithmeticError, ValueError) as error:
                return f"k = {k!r}, b = {b!r} are refused: {_OUT_OF_RANGE} ({error})"
        p, watched = impact.parameters, False
        if p.restitution_at_rest and impact.touch is None:
            problem = p.contact_law.refusal_of_touch(p, club_speed)
            watched = problem is not None
            left = impact.duration - impact.elapsed(high, low)
            if problem is not None and left <= size * (1.0 + 1e-12):
                return problem
        self._watched = watched
        self.origin = origin
        if size == segment.size and impact is segment.impact:
            return segment
        return Segment(impact, high, low, size)

    def _refuse(self, name: str, message: str) -> None:
        self._refused = {**self._refused, name: message}
        self._size = nan
        self._report(message)

    def _corrected(self, name: str) -> None:
        if name in self._refused:
            self._refused = {n: text for n, text in self._refused.items() if n != name}

    def _refuse_once(self, message: str) -> None:
        self._once = (*self._once, message)[-8:]
        self._size = nan
        self._report(message)

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        """Set inputs and parameters that the host takes for this type; refused ones keep theirs."""
        for reference, value in zip(references, values):
            # Inputs first: a host may set them at every step.
            if (
                -1 < reference < INPUTS
                and self._mode <= STEPPING
                and type_ == "Real"
                and _LOW[reference] <= value <= _HIGH[reference]
                and not self._refused
            ) or self._accepts(reference, value, type_):
                if value == self.values[reference]:
                    continue
                self.values[reference] = value
                self._size = nan
                if self._mode < STEPPING:
                    self._go_on(NO_SEGMENT)

    def _accepts(self, reference: int, value: Any, type_: str) -> bool:
        """Whether a value may be set; if not, it is refused."""
        variable = VARIABLES[reference] if 0 <= reference < SETTABLE else None
        if variable is None or variable.type != type_:
            known = 0 <= reference < len(VARIABLES)
            what = VARIABLES[reference].name if known else f"value reference {reference}"
            self._refuse_once(f"{what} is no {type_} input or parameter: it can't be set")
        elif self._mode == TERMINATED:
            self._refuse_once(f"{variable.name} can't be set after the end of the run")
        elif not variable.low <= value <= variable.high:
            self._refuse(variable.name, refusal(variable, value))
        elif reference >= INPUTS and self._mode == STEPPING and value != self.values[reference]:
            self._refuse(
                variable.name,
                f"{variable.name} = {value!r} is refused: a parameter is fixed once "
                f"initialization has ended (at {self.values[reference]!r})",
            )
        else:
            self._corrected(variable.name)
            return True
        return False

    def reals(self, references: list[int]) -> list[float]:
        """Values of Real variables; the list may go on after them, and must not be changed."""
        if references != self._requested:
            self._requested, self._pick = self.reading(tuple(references), "Real")
        now = self._now
        if now is None:
            # In 2/3 of the time from the dense output of the contact.
            motion, first, offset, pace, since, until = self._segment.reader
            t = offset + (self._count - first) * pace
            now = self._now = motion(t) if since < t < until else self._evaluate()
        pick = self._pick
        if pick is None:
            return now
        try:
            return pick(now, self)
        except (ArithmeticError, ValueError) as error:
            self._report(f"{_OUT_OF_RANGE} ({error})")
            return [nan] * len(references)

    def discretes(self, references: list[int], type_: str) -> list:
        """Values of variables of another type ("Enumeration", "Boolean")."""
        _, pick = self.reading(tuple(references), type_)
        now = self._now or self._evaluate()
        return now if pick is None else pick(now, self)

    def unknown(self, type_: str) -> float:
        """For a value reference that no variable of this type has."""
        self._refuse_once(f"a value reference that no {type_} variable has is refused")
        return nan if type_ == "Real" else 0

    def impact(self) -> Any:
        """The impact at the present instant, for outputs."""
        state, impact = self._present
        return impact if state is self._now else self._segment.impact.at(*self.instant())

    def _evaluate(self) -> State:
        """The state at this communication point; before stepping, under the present values."""
        if self._segment.impact is None:
            parameters, inputs = self._split()
            if conflict(parameters, inputs) is not None:
                # Bodies that never meet.
                inputs = 1.0, 0.0, parameters.ball_speed
            self._segment = Segment(Impact.start(parameters, inputs), 0.0, 0.0, 0.0)
        try:
            self._present = self._segment.state(self._count)
        except (ArithmeticError, ValueError) as error:
            self._report(f"{_OUT_OF_RANGE} ({error})")
            self._present = [nan] * len(MOVING), self._segment.impact
        self._now, _ = self._present
        return self._now

    def snapshot(self) -> tuple:
        """Everything, for `restore` in any instance of this process."""
        return Snapshot((tuple(self.values), *_fields(self)))

    def restore(self, snapshot: tuple | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if not isinstance(snapshot, Snapshot):
            self._refuse_once(
                "a state that this component didn't make is refused; it has no effect"
            )
            return
        (
            values, self._mode, self._refused, self._once, self.start_time, self.origin,
            self._point, self._count, self._segment,
        ) = snapshot  # fmt: skip
        self.values = list(values)
        self._anchored = self._watched = False
        self._size = nan
        self._now = None

    #: A snapshot as bytes, for another process, and back.
    packed = staticmethod(packed)
    unpacked = staticmethod(unpacked)
