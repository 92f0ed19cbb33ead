"""One instance: its variables, modes and clock.

A communication step only moves the clock. Outputs are evaluated when they are read. Whatever a
host does wrong is answered by a message and a refused step, never by an exception: an interface
has no way back from one. A refused call changes nothing: what follows from a call is made first,
and taken only when it is whole.
"""

from collections.abc import Callable
from math import ceil, inf, isfinite, nan
from operator import attrgetter
from typing import Any, ClassVar

from ..impact import Impact, added
from ..laws.contact import EARLY, State
from ..parameters import INPUTS, SETTABLE, Inputs, Parameters, conflict, refusal
from ..variables import VARIABLES
from . import state
from .outputs import MOVING, OUTPUTS, Output, readings

#: Modes of an instance, in the order in which a host passes through them. Blocked: initialization
#: has ended on values that can't be used, so parameters may still be set.
INSTANTIATED, INITIALIZATION, BLOCKED, STEPPING, TERMINATED = range(5)

_START_VALUES = tuple(variable.start for variable in VARIABLES[:SETTABLE])
_LOW = [variable.low for variable in VARIABLES[:INPUTS]]
_HIGH = [variable.high for variable in VARIABLES[:INPUTS]]

#: What a snapshot has beside values and impact, in its order.
_plain = attrgetter(
    *("_mode", "_refused", "_once", "clock", "carry", "_count", "last_step", "start_time"),
    *("origin", "_point"),
)

#: How far (relative to the step) a host's communication point may lie from where its last step
#: ended: enough for sums of rounded steps, far too little for a step left out.
_POINT_TOLERANCE = 1e-6

#: So near to touch or separation (relative) force and compression may be all rounding error.
_CLOSE = 1e-12

_OUT_OF_RANGE = "this impact leaves the range of a double"


class Component:
    """An instance between instantiation and termination.

    Args:
        report: called with a message whenever something is refused.
    """

    __slots__ = (
        "_anchored", "_count", "_course_of", "_impact", "_mode", "_motion", "_moving", "_now",
        "_offset", "_once", "_outputs", "_pace", "_pick", "_point", "_refused", "_report", "_scale",
        "_size", "_until", "_watched", "carry", "clock", "last_step", "origin", "start_time",
        "values",
    )  # fmt: skip

    #: How to read what can be read.
    reading = staticmethod(readings(VARIABLES, OUTPUTS))

    #: What an impact may be, by the type of its snapshot and of what is serialized of that.
    kinds: ClassVar[dict[type, Any]] = {tuple: Impact, list: Impact}

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._mode = INSTANTIATED
        #: Values as the host sees them: inputs and parameters in the table's order.
        self.values: list[Any] = list(_START_VALUES)
        #: Why steps are refused until it is corrected, by variable name; never changed in place.
        self._refused: dict[str, str] = {}
        #: Why the next step is refused: calls that nothing can correct.
        self._once: tuple[str, ...] = ()
        #: Before stepping: a preview for the present values, made when it is read.
        self._impact: Impact | None = None
        #: The sum of the accepted steps, s, as a pair, but for the last `_count`, of one size.
        self.clock = self.carry = self._count = 0.0
        #: The last accepted step, s.
        self.last_step = 0.0
        #: The same, as long as another such step needs no look at anything but the clock; or NaN.
        self._size = nan
        #: The host's time at the start of the run, s.
        self.start_time = 0.0
        #: The host's time when the clock stood at 0, s.
        self.origin = 0.0
        #: Where the host's next step is expected to begin, s; anywhere after a restore.
        self._point = 0.0
        self._anchored = True
        #: Whether every step must be looked at: a touch is ahead that would be refused.
        self._watched = False
        #: The present phase as a function of a time of its own, and how much of that passes in a
        #: second. What that time was before the counted steps, how much of it passes in one, and
        #: until when the function may be asked (NaN: not known yet).
        self._course_of: object = None
        self._motion: Any = None
        self._scale = self._offset = self._pace = 0.0
        self._until = nan
        #: The state at this communication point, once it has been read.
        self._now: State | None = None
        #: The last list of references read, if all of them are of the state, and how to pick them
        #: from it (None: they come first); else the outputs.
        self._moving: list[int] | None = None
        self._pick: Callable[[State], list[float]] | None = None
        self._outputs: tuple[list[int], tuple[Output, ...]] = [], ()

    # Modes

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
        """From here on outputs answer for the values present."""
        if self._mode == INSTANTIATED:
            self._mode = INITIALIZATION
        else:
            self._refuse_once("a second initialization is refused: reset the instance first")

    def exit_initialization(self) -> bool:
        """From here on parameters are fixed, as soon as they can be used.

        Returns:
            Whether all start values can be used; if not, steps are refused until they are
            corrected.
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
        """Fix the parameters; or say why they can't be used."""
        parameters, inputs = self._split()
        refused = [text for name, text in self._refused.items() if hasattr(parameters, name)]
        problem = "; ".join(refused) or conflict(parameters, inputs)
        if problem is None:
            self._impact = Impact(parameters, inputs)
            self._mode = STEPPING
            self._until = nan
            self._now = None
        return problem

    def terminate(self) -> None:
        """The end of the run: values can still be read, nothing else."""
        self._mode = TERMINATED
        self._size = nan

    def _split(self) -> tuple[Parameters, Inputs]:
        values = self.values
        return Parameters(*values[INPUTS:]), (values[0], values[1], values[2])

    # Steps

    def step(self, point: float, size: float) -> bool:
        """One communication step.

        Args:
            point: the host's communication point, s.
            size: communication step size, s, > 0.

        Returns:
            Whether the step was accepted; if not, a message says why, and nothing has changed.
        """
        if size == self._size and (
            point == self._point or abs(point - self._point) <= _POINT_TOLERANCE * size
        ):
            self._count += 1.0
            self._point = point + size
            self._now = None
            return True
        high, low = self.instant()
        problem = self._look(point, size, high, low)
        if problem is not None:
            self._size = nan
            self._report(problem)
            return False
        if size == self.last_step:
            self._count += 1.0
        else:
            self.clock, self.carry = added(high, low, size)
            self._count = 0.0
            self._until = nan
        self.last_step = size
        self._size = nan if self._watched else size
        self._point = point + size
        self._anchored = True
        self._now = None
        return True

    def instant(self, count: float | None = None) -> tuple[float, float]:
        """The present instant, or that after so many of the counted steps; s, as a pair.

        The sum of the accepted steps.
        """
        if count is None:
            count = self._count
        if not count:
            return self.clock, self.carry
        size = self.last_step
        if count == 1.0:
            return added(self.clock, self.carry, size)
        # Two factors of at most 26 bits have an exact product.
        high = 134217729.0 * size
        high -= high - size
        clock, carry = added(self.clock, self.carry, count * high)
        return added(clock, carry, count * (size - high))

    def _look(self, point: float, size: float, high: float, low: float) -> str | None:
        """Whatever a step in a row of equal ones needn't look at: why it is refused, or None.

        Last of all, the inputs that have been set come into force.
        """
        if not 0.0 < size <= 1e100:
            return f"communication step size = {size!r} s is refused: it must be > 0 and finite"
        if self._mode != STEPPING:
            problem = self._not_stepping()
            if problem is not None:
                return problem
        if self._refused or self._once:
            problems = "; ".join((*self._refused.values(), *self._once))
            self._once = ()
            return f"steps are refused until this is corrected: {problems}"
        impact = self._impact
        assert impact is not None
        off = point - self._point
        origin = self.origin
        if off and not abs(off) <= _POINT_TOLERANCE * size + 1e-15 * abs(self._point):
            if self._anchored or not abs(point) <= 1e100:
                return (
                    f"communication point = {point!r} s is refused: the last step ended at "
                    f"{self._point!r} s, and no state has been restored since"
                )
            # After a restore the host's time may go on from anywhere; a touch to come moves along.
            impact.advance(high, low)
            if impact.touch is None or impact.touch[0] >= high:
                origin = point - high
        values = self.values
        inputs = values[0], values[1], values[2]
        if impact.parameters.restitution_at_rest:
            self._watched, problem = impact.refusal_of_touch(high, low, inputs, size)
            if problem is not None:
                return problem
        if inputs != impact.in_force:
            problem = conflict(impact.parameters, inputs)
            if problem is not None:
                return problem
            try:
                impact.hold(high, low, inputs)
            except (ArithmeticError, ValueError) as error:
                k, b, _ = inputs
                return f"k = {k!r}, b = {b!r} are refused: {_OUT_OF_RANGE} ({error})"
            self._until = nan
        self.origin = origin
        return None

    def _not_stepping(self) -> str | None:
        if self._mode == BLOCKED:
            problem = self._begin()
            return problem and f"steps are refused until this is corrected: {problem}"
        if self._mode == TERMINATED:
            return "a step after the end of the run is refused: reset the instance first"
        return "a step before the end of initialization is refused"

    # Refusals

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

    # Values

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        """Set inputs and parameters; what is refused keeps its value.

        Args:
            references: value references.
            values: one for each.
            type_: the type that the host believes they have.
        """
        for reference, value in zip(references, values):
            # First of all an input: what a host sets again and again.
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
                    self._impact = self._now = None

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
        """Values of Real variables.

        The list may go on after the values asked for; it must not be changed.
        """
        if references == self._moving:
            # The fast read, 2/3 of what the general one takes: straight from the phase's function
            # of time, without a look at the impact, as long as the phase goes on.
            now = self._now
            if now is None:
                t = self._offset + self._count * self._pace
                now = self._now = self._motion(t) if t < self._until else self._evaluate()
            pick = self._pick
            return now if pick is None else pick(now)
        asked, outputs = self._outputs
        if references != asked:
            self._moving, self._pick, outputs = self.reading(tuple(references), "Real")
            if self._moving:
                return self.reals(references)
            self._outputs = list(references), outputs
        now = self._now or self._evaluate()
        try:
            return [output(self._impact, now, self) for output in outputs]
        except (ArithmeticError, ValueError) as error:
            self._report(f"{_OUT_OF_RANGE} ({error})")
            return [nan] * len(outputs)

    def discretes(self, references: list[int], type_: str) -> list:
        """Values of variables of another type ("Enumeration", "Boolean")."""
        now = self._now or self._evaluate()
        outputs = self.reading(tuple(references), type_)[2]
        return [output(self._impact, now, self) for output in outputs]

    def unknown(self, type_: str) -> float:
        """For a value reference that no variable of this type has."""
        self._refuse_once(f"a value reference that no {type_} variable has is refused")
        return nan if type_ == "Real" else 0

    def _evaluate(self) -> State:
        """The state at this communication point, and what the fast read needs of its phase."""
        impact = self._impact
        if impact is None:
            parameters, inputs = self._split()
            if conflict(parameters, inputs) is not None:
                # Nothing to show but bodies that never meet.
                inputs = (1.0, 0.0, parameters.ball_speed)
            impact = self._impact = Impact(parameters, inputs)
        high, low = self.instant()
        try:
            t = impact.advance(high, low)
            contact = impact.contact
            if contact is None:
                # Free motion is told from the exact instant, as quickly.
                self._until = nan
                now = self._now = impact.free.state(t)
                return now
            count, began, began_low = self._count, impact.began_high, impact.began_low
            offset = (self.clock - began) + (self.carry - began_low)
            if offset < 0.0 and count:
                # Steps that were over before the phase began only cost digits of its own time.
                # A phase that begins on a communication point begins there to the last bits.
                passed = ceil(-offset / self.last_step - 1e-9)
                self.clock, self.carry = self.instant(min(passed, count))
                self._count = count = max(0.0, count - passed)
                offset = (self.clock - began) + (self.carry - began_low)
            if contact is not self._course_of:
                self._motion, self._scale = contact.course()
                self._course_of = contact
            scale = self._scale
            self._offset = offset = scale * offset
            self._pace = pace = scale * self.last_step
            now = self._now = impact.settled(self._motion(offset + count * pace), high, low)
        except (ArithmeticError, ValueError) as error:
            self._report(f"{_OUT_OF_RANGE} ({error})")
            self._until = nan
            now = self._now = [nan] * len(MOVING)
            return now
        # Next to an event the exact instant decides, and the state must be settled.
        self._until = scale * contact.duration * (1.0 - _CLOSE)
        if t * contact.rate <= EARLY:
            self._until = -inf
        return now

    # State

    def snapshot(self) -> tuple:
        """Everything, for `restore` in any instance of this process."""
        impact = self._impact.snapshot() if self._mode >= STEPPING and self._impact else None
        return state.OWN, tuple(self.values), *_plain(self), impact

    def restore(self, snapshot: tuple | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        # As `state.is_own`, written out: every run begins here.
        if type(snapshot) is not tuple or not snapshot or snapshot[0] is not state.OWN:
            self._refuse_once(
                "a state that this component didn't make is refused; it has no effect"
            )
            return
        (
            _, values, self._mode, self._refused, self._once, self.clock, self.carry, self._count,
            self.last_step, self.start_time, self.origin, self._point, impact,
        ) = snapshot  # fmt: skip
        self.values = list(values)
        if impact is None:
            self._impact = None
        elif type(self._impact) is Impact:
            self._impact.restore(impact)
        else:
            self._impact = Impact.restored(impact)
        self._anchored = self._watched = False
        self._size = self._until = nan
        self._now = None

    @classmethod
    def packed(cls, snapshot: tuple) -> bytes:
        """A snapshot as bytes, for another process."""
        return state.packed(snapshot, cls.kinds)

    @classmethod
    def unpacked(cls, data: bytes) -> tuple | None:
        """The snapshot that became these bytes, or None if they are none of this component's."""
        return state.unpacked(data, cls.kinds)
