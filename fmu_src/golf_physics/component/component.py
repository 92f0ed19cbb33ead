"""One instance: its variables, modes and clock.

A communication step only advances the clock; outputs are evaluated when they are read. Bad input
is reported by a message and a refused step, never by an exception, which would be fatal in FMI. A
refused call changes nothing: its effects are computed first, and take place only as a whole.
"""

from collections.abc import Callable
from math import inf, isfinite, nan
from operator import attrgetter
from typing import Any

from ..impact import Impact
from ..laws import LAWS
from ..refusals import conflict, conflict_of_inputs, refusal
from ..values import START, Inputs, Instant, Parameters, Refusal, State, new, rejected
from ..variables import INPUTS, MOTION, SETTABLE, VARIABLES
from .outputs import OUTPUTS, PLACES, readings
from .segment import NO_SEGMENT, Segment
from .solved import SolvedImpact
from .state import (
    BLOCKED,
    INITIALIZATION,
    INSTANTIATED,
    STEPPING,
    TERMINATED,
    Snapshot,
    packed,
    unpacked,
)  # fmt: skip

_START_VALUES = tuple(row.start for row in SETTABLE.values())
#: Of inputs by reference: the place among the values, and the least and largest value allowed.
_INPUTS = {
    reference: (place, row.low, row.high)
    for place, (reference, row) in enumerate(SETTABLE.items())
    if row.causality == "input"
}

#: No value lies between these bounds.
_NO_INPUT = 0, inf, -inf

#: A snapshot after the values, in its order.
_fields = attrgetter(
    "_mode", "_refused", "_once", "start_time", "origin", "_point", "_count", "_segment"
)

#: How far (relative to the step) a host's communication point may lie from where its last step
#: ended: enough for sums of rounded steps, far too little for a step left out.
_POINT_TOLERANCE = 1e-6


def _out_of_range(error: Exception) -> Refusal:
    return Refusal(f"this impact leaves the range of a double ({error})")


def together(refusals: list[Refusal]) -> Refusal | None:
    """Several refusals as one, whose fields are those of the first; None if there are none."""
    if not refusals:
        return None
    return refusals[0]._replace(sentence="; ".join(map(str, refusals)))


def _until_corrected(problem: Refusal) -> Refusal:
    return problem._replace(sentence=f"steps are refused until this is corrected: {problem}")


class Component:
    """An instance; `report` is called with a `Refusal` whenever something is refused."""

    __slots__ = (
        "_anchored", "_count", "_known", "_mode", "_now", "_once", "_pick", "_point", "_refused",
        "_report", "_requested", "_restored", "_segment", "_size", "_watched", "origin",
        "start_time", "values",
    )  # fmt: skip

    #: How to read variables, by their value references.
    reading = staticmethod(readings(VARIABLES, OUTPUTS))

    def __init__(self, report: Callable[[Refusal], None]) -> None:
        self._report = report
        self._mode = INSTANTIATED
        #: Values as the host sees them: inputs and parameters in the table's order.
        self.values: list[Any] = list(_START_VALUES)
        #: Why steps are refused until it is corrected, by variable name; never changed in place.
        self._refused: dict[str, Refusal] = {}
        #: Why the next step is refused: calls that nothing can correct.
        self._once: tuple[Refusal, ...] = ()
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
        #: The last list of references read: see `outputs.Reading`.
        self._requested, self._pick = self.reading((), "Real")
        #: The values of the last restored state while its parameters haven't been set; and those
        #: from which an initialization ended, with its approach.
        self._restored: tuple | None = None
        self._known: tuple[tuple | None, Any] = None, None

    def set_up(self, start_time: float) -> None:
        """The host's time at the start, s."""
        if self._mode != INSTANTIATED:
            self._refuse_once("set-up after initialization has begun is refused")
        elif not isfinite(start_time):
            self._refuse(rejected("start time", start_time, "it must be a finite number", " s"))
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

    def _begin(self) -> Refusal | None:
        """Fix the parameters; or return why they can't be used."""
        restored = self._restored
        known, approach = self._known
        if known is None or known is not restored:
            approach = None
            parameters, inputs = self._split()
            find_conflict = conflict
        else:
            # Another run of a restored initialization: a third of its time less.
            parameters, inputs = approach.parameters, new(Inputs, self.values[:INPUTS])
            find_conflict = conflict_of_inputs
        problem = None
        if self._refused:
            items = self._refused.items()
            problem = together([one for name, one in items if hasattr(parameters, name)])
        problem = problem or find_conflict(parameters, inputs)
        if problem is None:
            self._mode = STEPPING
            # Not of an equal speed: 0.0 and -0.0 are.
            if approach is None or approach.velocities[0] is not inputs.club_speed:
                approach = Impact.start(parameters, inputs.club_speed)
            self._known = restored, approach
            self._go_on(Segment(approach, inputs, START, 0.0))
        return problem

    def terminate(self) -> None:
        """The end of the run: values can still be read, nothing else."""
        self._mode = TERMINATED
        self._size = nan

    def _go_on(self, segment: Segment) -> None:
        """From here on the instant is that at which this segment begins."""
        self._segment, self._count, self._now = segment, 0.0, None

    def _split(self) -> tuple[Parameters, Inputs]:
        values = self.values
        return Parameters(*values[INPUTS:]), new(Inputs, values[:INPUTS])

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
        problem = self._check(point, size)
        if problem is not None:
            self._size = nan
            self._report(problem)
            return False
        self._now = None
        self._size = nan if self._watched else size
        self._point = point + size
        self._anchored = True
        return True

    @property
    def last_step(self) -> float:
        """The last accepted step size, s; 0 before the first step."""
        return self._segment.size

    def instant(self) -> Instant:
        """The present instant: the sum of the accepted steps."""
        return self._segment.instant(self._count)

    def _check(self, point: float, size: float) -> Refusal | None:
        """Why a step is refused; or None, and it is counted."""
        if not 0.0 < size <= 1e100:
            reason = "it must be > 0 and finite"
            return rejected("communication step size", size, reason, " s")._replace(variable="")
        if self._mode != STEPPING or self._refused or self._once:
            problem = self._why_not()
            if problem is not None:
                return problem
        segment = self._segment
        count = self._count
        instant = segment.instant(count) if count else segment.begin
        origin = self.origin
        if point != self._point:
            deviation = abs(point - self._point)
            if not deviation <= _POINT_TOLERANCE * size + 1e-15 * abs(self._point):
                if self._anchored or not abs(point) <= 1e100:
                    reason = (
                        f"the last step ended at {self._point!r} s, and no state has been "
                        "restored since"
                    )
                    return rejected("communication point", point, reason, " s")._replace(
                        variable=""
                    )
                # After a restore the host's time may go on from anywhere; a touch to come moves.
                touch = segment.present(count).touch
                if touch is None or touch.instant[0] >= instant[0]:
                    origin = point - instant[0]
        values, inputs, impact = self.values, segment.inputs, segment.impact
        k, b, club_speed, club_force = values[0], values[1], values[2], values[3]
        if k != inputs[0] or b != inputs[1] or club_speed != inputs[2] or club_force != inputs[3]:
            inputs = new(Inputs, (k, b, club_speed, club_force))
            problem = conflict_of_inputs(impact.parameters, inputs)
            if problem is not None:
                return problem
            try:
                impact = segment.changed(inputs, count)
            except (ArithmeticError, ValueError) as error:
                reason = str(_out_of_range(error))
                return Refusal(f"k = {k!r}, b = {b!r} are refused: {reason}", "k", k, reason)
            if impact is segment.impact and impact.touch is not None:
                segment = segment.with_inputs(inputs)
            else:
                segment = NO_SEGMENT
        p, watched = impact.parameters, False
        if p.restitution_at_rest and impact.touch is None:
            problem = LAWS[p.law].refusal_of_touch(p, club_speed)
            watched = problem is not None
            left = impact.duration - impact.elapsed(instant)
            if problem is not None and left <= size * (1.0 + 1e-12):
                return problem
        self._watched = watched
        self.origin = origin
        if size == segment.size:
            self._segment, self._count = segment, count + 1.0
        else:
            if segment is NO_SEGMENT:
                segment = Segment(impact, inputs, instant, size)
            else:
                segment = segment.resized(instant, size)
            self._segment, self._count = segment, 1.0
        return None

    def _why_not(self) -> Refusal | None:
        """Why no step is possible in this mode, or until a value is corrected; or None."""
        if self._mode == BLOCKED:
            problem = self._begin()
            if problem is not None:
                return _until_corrected(problem)
        elif self._mode == TERMINATED:
            return Refusal("a step after the end of the run is refused: reset the instance first")
        elif self._mode != STEPPING:
            return Refusal("a step before the end of initialization is refused")
        problem = together([*self._refused.values(), *self._once])
        self._once = ()
        return problem and _until_corrected(problem)

    def _refuse(self, refusal: Refusal) -> None:
        self._refused = {**self._refused, refusal.variable: refusal}
        self._size = nan
        self._report(refusal)

    def _corrected(self, name: str) -> None:
        if name in self._refused:
            self._refused = {n: one for n, one in self._refused.items() if n != name}

    def _refuse_once(self, sentence: str, name: str = "", value: Any = None) -> None:
        refusal = Refusal(sentence, name, value, sentence)
        self._once = (*self._once, refusal)[-8:]
        self._size = nan
        self._report(refusal)

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        """Set inputs and parameters that the host takes for this type; refused ones keep theirs."""
        for reference, value in zip(references, values):
            # Inputs first: a host may set them at every step.
            place, low, high = _INPUTS.get(reference, _NO_INPUT)
            if not (
                type_ == "Real"
                and low <= value <= high
                and self._mode <= STEPPING
                and not self._refused
            ):
                if not self._accepts(reference, value, type_):
                    continue
                place = PLACES[reference]
                self._restored = None
            if value == self.values[place]:
                continue
            self.values[place] = value
            self._size = nan
            if self._mode < STEPPING:
                self._go_on(NO_SEGMENT)

    def _accepts(self, reference: int, value: Any, type_: str) -> bool:
        """Whether a value may be set; if not, it is refused."""
        variable = SETTABLE.get(reference)
        if variable is None or variable.type != type_:
            names = (row.name for row in VARIABLES if row.reference == reference)
            what = next(names, f"value reference {reference}")
            self._refuse_once(f"{what} is no {type_} input or parameter: it can't be set")
        elif self._mode == TERMINATED:
            sentence = f"{variable.name} can't be set after the end of the run"
            self._refuse_once(sentence, variable.name, value)
        elif not variable.low <= value <= variable.high:
            self._refuse(refusal(variable, value))
        elif (
            variable.causality == "parameter"
            and self._mode == STEPPING
            and value != (now := self.values[PLACES[reference]])
        ):
            reason = f"a parameter is fixed once initialization has ended (at {now!r})"
            self._refuse(rejected(variable.name, value, reason))
        else:
            self._corrected(variable.name)
            return True
        return False

    def reals(self, references: list[int]) -> list[float]:
        """Values of Real variables; the list may go on after them, and must not be changed."""
        if references != self._requested:
            self._requested, self._pick = self.reading(tuple(references), "Real")
        pick = self._pick
        if pick is not None:
            try:
                return pick(self)
            except (ArithmeticError, ValueError) as error:
                self._report(_out_of_range(error))
                return [nan] * len(references)
        now = self._now
        if now is None:
            # As in `state`, without its call, 3 to 4 % of a read. In 2/3 of the time
            # from the dense output of the contact.
            motion, first, offset, pace, since, until = self._segment.reader
            t = offset + (self._count - first) * pace
            now = self._now = motion(t) if since < t < until else self._evaluate()
        return now

    def discretes(self, references: list[int], type_: str) -> list:
        """Values of variables of another type ("Enumeration", "Boolean")."""
        _, pick = self.reading(tuple(references), type_)
        return self.state() if pick is None else pick(self)

    def unknown(self, type_: str) -> float:
        """For a value reference that no variable of this type has."""
        self._refuse_once(f"a value reference that no {type_} variable has is refused")
        return nan if type_ == "Real" else 0

    def impact(self) -> Any:
        """The impact at the present instant, for outputs; raises as `Segment.present`."""
        if self._segment.impact is None:
            self._preview()
        return self._segment.present(self._count)

    def state(self) -> State:
        """The state at this communication point; before stepping, under the present values."""
        now = self._now
        if now is None:
            motion, first, offset, pace, since, until = self._segment.reader
            t = offset + (self._count - first) * pace
            now = self._now = motion(t) if since < t < until else self._evaluate()
        return now

    def _preview(self) -> None:
        """Before stepping: the impact of the present values."""
        parameters, inputs = self._split()
        if conflict(parameters, inputs) is not None:
            # Bodies that never meet.
            inputs = Inputs(1.0, 0.0, parameters.ball_speed, 0.0)
        approach = Impact.start(parameters, inputs.club_speed)
        self._segment = Segment(approach, inputs, START, 0.0)

    def _evaluate(self) -> State:
        if self._segment.impact is None:
            self._preview()
        try:
            self._now = self._segment.state(self._count)
        except (ArithmeticError, ValueError) as error:
            self._report(_out_of_range(error))
            self._now = [nan] * len(MOTION)
        return self._now

    def snapshot(self) -> tuple:
        """Everything, for `restore` in any instance of this process."""
        return Snapshot((tuple(self.values), *_fields(self)))

    def restore(self, snapshot: tuple | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if not (isinstance(snapshot, Snapshot) and self._is_alike(snapshot[-1])):
            self._refuse_once(
                "a state that this component didn't make is refused; it has no effect"
            )
            return
        (
            values, self._mode, self._refused, self._once, self.start_time, self.origin,
            self._point, self._count, self._segment,
        ) = snapshot  # fmt: skip
        self._restored = values
        self.values = list(values)
        self._anchored = self._watched = False
        self._size = nan
        self._now = None

    def _is_alike(self, segment: Segment) -> bool:
        """Whether the steps of a state are of the kind of this instance: not of Model Exchange."""
        return not isinstance(segment.impact, SolvedImpact)

    #: A snapshot as bytes, for another process, and back.
    packed = staticmethod(packed)
    unpacked = staticmethod(unpacked)
