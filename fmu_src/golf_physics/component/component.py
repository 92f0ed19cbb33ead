"""One instance: its variables, modes and clock.

A communication step only advances the clock; outputs are evaluated when they are read. Bad input
is reported by a message and a refused step, never by an exception, which would be fatal in FMI. A
refused call changes nothing: its effects are computed first, and take place only as a whole.
"""

from collections.abc import Callable
from math import ceil, inf, isfinite, nan
from typing import Any

from ..impact import RESOLUTION, Contact, Impact, advance
from ..laws import LAWS
from ..refusals import conflict, conflict_of_inputs, refusal
from ..values import START, Inputs, Instant, Parameters, Refusal, State, added, new, rejected
from ..variables import INPUTS, MOTION, SETTABLE, VARIABLES
from .outputs import OUTPUTS, PLACES, readings
from .solved import SolvedImpact
from .state import (
    INITIALIZATION,
    INSTANTIATED,
    START_REFUSED,
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

#: How far (relative to the step) a host's communication point may lie from where its last step
#: ended: enough for sums of rounded steps, far too little for a step left out.
_POINT_TOLERANCE = 1e-6


#: Next to touch and separation (relative) force and compression may be all rounding error.
_CLOSE = 1e-12

#: No contact's dense output: see `Component._evaluate`.
_NO_DENSE_OUTPUT: Any = list, 0.0, 0.0, 0.0, inf, -inf

#: No instance gets so far: 10⁹ steps of 1e100 s.
_LONGEST_STEP = 1e100


def _not_computed(error: Exception) -> Refusal:
    # A phase's own reason; other classes are those of Python's arithmetic.
    if type(error) is ArithmeticError:
        return Refusal(f"this impact can't be computed: {error}")
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
        "_begin", "_check_every_step", "_count", "_counted", "_dense_output", "_illegal", "_impact",
        "_inputs", "_instant", "_last_start", "_mode", "_now", "_pick", "_point", "_point_is_free",
        "_present", "_refused", "_report", "_requested", "_restored_values", "_size", "last_step",
        "origin", "start_time", "values",
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
        #: Why the next step is refused: illegal calls, which nothing can correct.
        self._illegal: tuple[Refusal, ...] = ()
        #: The host's time at the start of the run and when the clock stood at 0, s.
        self.start_time = self.origin = 0.0
        #: Where the host's next step is expected to begin, s, or anywhere: after a restore.
        self._point = 0.0
        self._point_is_free = False
        self._run(None, None, START, 0.0)
        #: The last step size, s, if another such step needs only its communication point checked.
        self._size = nan
        #: Whether every step must be checked: a touch is ahead that would be refused.
        self._check_every_step = False
        #: The last list of references read: see `outputs.Reading`.
        self._requested, self._pick = self.reading((), "Real")
        #: The values of the last restored state while its parameters haven't been set; and those
        #: from which an initialization ended, with its approach.
        self._restored_values: tuple | None = None
        self._last_start: tuple[tuple | None, Any] = None, None

    def _run(self, impact: Any, inputs: Inputs | None, begin: Instant, size: float) -> None:
        """Steps of this size (s; 0: none yet) from an instant on, with this impact and inputs.

        The impact is that of the instant or before; None, before stepping: that of the values.
        """
        self._impact = impact
        self._inputs: Any = inputs
        self._resize(impact, begin, size)

    def _resize(self, present: Any, begin: Instant, size: float) -> None:
        """The same by steps of another size; `present` is the impact from some phase on."""
        self._begin, self.last_step, self._count = begin, size, 0.0
        #: The last number of steps whose instant was computed, and that.
        self._counted, self._instant = 0.0, begin
        #: The impact from a phase on, at most that of the present instant.
        self._present = present
        self._dense_output = _NO_DENSE_OUTPUT
        #: The state at this communication point, once it has been read.
        self._now: State | None = None

    def set_up(self, start_time: float) -> None:
        """The host's time at the start, s."""
        if self._mode != INSTANTIATED:
            self._refuse_call("set-up after initialization has begun is refused")
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
            self._refuse_call("a second initialization is refused: reset the instance first")

    def exit_initialization(self) -> bool:
        """Fix the parameters, as soon as they can be used.

        Returns whether all start values can be used; if not, steps are refused until they can.
        """
        if self._mode != INITIALIZATION:
            self._refuse_call("the end of an initialization that wasn't entered is refused")
            return True
        self._mode = START_REFUSED
        problem = self._start()
        if problem is not None:
            self._report(problem)
        return problem is None and not self._refused

    def _start(self) -> Refusal | None:
        """Fix the parameters; or return why they can't be used."""
        restored = self._restored_values
        known, approach = self._last_start
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
            self._last_start = restored, approach
            self._run(approach, inputs, START, 0.0)
        return problem

    def terminate(self) -> None:
        """The end of the run: values can still be read, nothing else."""
        self._mode = TERMINATED
        self._size = nan

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
        self._size = nan if self._check_every_step else size
        self._point = point + size
        self._point_is_free = False
        return True

    def instant(self) -> Instant:
        """The present instant: the sum of the accepted steps."""
        count = self._count
        if count != self._counted:
            self._counted, self._instant = count, self._after(count)
        return self._instant

    def _after(self, count: float) -> Instant:
        """The instant after so many steps of this size, without loss."""
        size = self.last_step
        if count == 1.0:
            return added(self._begin, size)
        # Two factors of at most 26 bits have an exact product.
        high = 134217729.0 * size
        high -= high - size
        return added(added(self._begin, count * high), count * (size - high))

    def _check(self, point: float, size: float) -> Refusal | None:
        """Why a step is refused; or None, and it is counted."""
        if not 0.0 < size <= _LONGEST_STEP:
            reason = "it must be > 0 and finite"
            return rejected("communication step size", size, reason, " s")._replace(variable="")
        if self._mode != STEPPING or self._refused or self._illegal:
            problem = self._why_not()
            if problem is not None:
                return problem
        instant, origin = self.instant(), self.origin
        if point != self._point:
            deviation = abs(point - self._point)
            if not deviation <= _POINT_TOLERANCE * size + 1e-15 * abs(self._point):
                if not self._point_is_free or not abs(point) <= _LONGEST_STEP:
                    reason = (
                        f"the last step ended at {self._point!r} s, and no state has been "
                        "restored since"
                    )
                    return rejected("communication point", point, reason, " s")._replace(
                        variable=""
                    )
                # After a restore the host's time may go on from anywhere; a touch to come moves.
                try:
                    touch = self.impact().touch
                except (ArithmeticError, ValueError) as error:
                    return _not_computed(error)
                if touch is None or touch.instant[0] >= instant[0]:
                    origin = point - instant[0]
        values, inputs, impact = self.values, self._inputs, self._impact
        k, b, club_speed, club_force = values[0], values[1], values[2], values[3]
        if k != inputs[0] or b != inputs[1] or club_speed != inputs[2] or club_force != inputs[3]:
            inputs = new(Inputs, (k, b, club_speed, club_force))
            problem = conflict_of_inputs(impact.parameters, inputs)
            if problem is not None:
                return problem
            try:
                impact = self._changed(inputs)
            except (ArithmeticError, ValueError) as error:
                reason = str(_not_computed(error))
                return Refusal(f"k = {k!r}, b = {b!r} are refused: {reason}", "k", k, reason)
        p, check_every_step = impact.parameters, False
        if impact.touch is None and (p.restitution_at_rest or club_force):
            problem = LAWS[p.law].refusal_of_touch(p, inputs)
            check_every_step = problem is not None
            left = impact.duration - impact.elapsed(instant)
            if problem is not None and left <= size * (1.0 + 1e-12):
                return problem
        self._check_every_step, self.origin = check_every_step, origin
        if inputs is not self._inputs and (impact is not self._impact or impact.touch is None):
            self._run(impact, inputs, instant, size)
        elif size != self.last_step:
            self._resize(self._present, instant, size)
        # Where they have no effect any more, the dense output stays.
        self._inputs = inputs
        self._count += 1.0
        return None

    def _changed(self, inputs: Inputs) -> Impact:
        """The impact that other inputs from now on lead to.

        A touch at this very instant hasn't been passed yet, so it is still undecided. Raises
        ArithmeticError or ValueError if the contact that follows can't be computed.
        """
        impact, instant = self._impact, self.instant()
        if impact.touch is None and impact.is_undecided(instant):
            club_speed = inputs.club_speed
            same = club_speed == self._inputs.club_speed
            return impact if same else impact.with_speed(club_speed, instant)
        return self.impact().changed(inputs, instant)

    def _why_not(self) -> Refusal | None:
        """Why no step is possible in this mode, or until a value is corrected; or None."""
        if self._mode == START_REFUSED:
            problem = self._start()
            if problem is not None:
                return _until_corrected(problem)
        elif self._mode == TERMINATED:
            return Refusal("a step after the end of the run is refused: reset the instance first")
        elif self._mode != STEPPING:
            return Refusal("a step before the end of initialization is refused")
        problem = together([*self._refused.values(), *self._illegal])
        self._illegal = ()
        return problem and _until_corrected(problem)

    def _refuse(self, refusal: Refusal) -> None:
        self._refused = {**self._refused, refusal.variable: refusal}
        self._size = nan
        self._report(refusal)

    def _corrected(self, name: str) -> None:
        if name in self._refused:
            self._refused = {n: one for n, one in self._refused.items() if n != name}

    def _refuse_call(self, sentence: str, name: str = "", value: Any = None) -> None:
        refusal = Refusal(sentence, name, value, sentence)
        self._illegal = (*self._illegal, refusal)[-8:]
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
                self._restored_values = None
            if value == self.values[place]:
                continue
            self.values[place] = value
            self._size = nan
            if self._mode < STEPPING:
                self._run(None, None, START, 0.0)

    def _accepts(self, reference: int, value: Any, type_: str) -> bool:
        """Whether a value may be set; if not, it is refused."""
        variable = SETTABLE.get(reference)
        if variable is None or variable.type != type_:
            names = (row.name for row in VARIABLES if row.reference == reference)
            what = next(names, f"value reference {reference}")
            self._refuse_call(f"{what} is no {type_} input or parameter: it can't be set")
        elif self._mode == TERMINATED:
            sentence = f"{variable.name} can't be set after the end of the run"
            self._refuse_call(sentence, variable.name, value)
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
                self._report(_not_computed(error))
                return [nan] * len(references)
        now = self._now
        if now is None:
            # As in `state`, without its call, 3 to 4 % of a read.
            motion, first, offset, pace, since, until = self._dense_output
            t = offset + (self._count - first) * pace
            now = self._now = motion(t) if since < t < until else self._evaluate()
        return now

    def discretes(self, references: list[int], type_: str) -> list:
        """Values of variables of another type ("Enumeration", "Boolean")."""
        _, pick = self.reading(tuple(references), type_)
        try:
            return pick(self)
        except (ArithmeticError, ValueError) as error:
            self._report(_not_computed(error))
            return [0] * len(references)

    def unknown(self, type_: str) -> float:
        """For a value reference that no variable of this type has."""
        self._refuse_call(f"a value reference that no {type_} variable has is refused")
        return nan if type_ == "Real" else 0

    def impact(self) -> Any:
        """The impact at the present instant, for outputs.

        Raises ArithmeticError or ValueError if the contact can't be computed.
        """
        if self._impact is None:
            self._preview()
        count = self._count
        instant = self._instant if count == self._counted else self.instant()
        self._present = present = advance(self._present, self._inputs, instant)
        return present

    def state(self) -> State:
        """The state at this communication point; before stepping, under the present values."""
        now = self._now
        if now is None:
            motion, first, offset, pace, since, until = self._dense_output
            t = offset + (self._count - first) * pace
            now = self._now = motion(t) if since < t < until else self._evaluate()
        return now

    def _preview(self) -> None:
        """Before stepping: the impact of the present values."""
        parameters, inputs = self._split()
        if conflict(parameters, inputs) is not None:
            # Bodies that never meet.
            inputs = Inputs(1.0, 0.0, parameters.ball_speed, 0.0)
        self._run(Impact.start(parameters, inputs.club_speed), inputs, START, 0.0)

    def _evaluate(self) -> State:
        try:
            impact = self.impact()
            if type(impact) is Contact:
                self._now = self._read_contact(impact)
            else:
                self._now = impact.state(self.instant())
        except (ArithmeticError, ValueError) as error:
            self._report(_not_computed(error))
            self._now = [nan] * len(MOTION)
        return self._now

    def _read_contact(self, contact: Contact) -> State:
        """The state in a contact; further steps of this size need its dense output alone.

        Kept are: that, the number of steps before the contact, the scaled time there and that of a
        step, and between which scaled times the dense output is the state: next to touch and
        separation the exact instant decides, and the state is clamped.
        """
        dense, scale = contact.phase.dense_output()
        begin, begin_low = contact.begin
        offset, first = (self._begin[0] - begin) + (self._begin[1] - begin_low), 0.0
        if offset < 0.0 and self.last_step:
            # Steps before the phase began would only cost digits.
            first = float(ceil(-offset / self.last_step - 1e-9))
            high, low = self._after(first)
            offset = (high - begin) + (low - begin_low)
        since, resolution = _CLOSE / contact.phase.rate, RESOLUTION * begin
        since = scale * (since if since > resolution else resolution)
        until = scale * contact.duration * (1.0 - _CLOSE)
        offset, pace = scale * offset, scale * self.last_step
        self._dense_output = dense, first, offset, pace, since, until
        state = dense(offset + (self._count - first) * pace)
        high, low = self.instant()
        t = (high - begin) + (low - begin_low)
        if t <= resolution or state[0] < 0.0 or state[5] < 0.0:
            contact.clamp(state, t if t > resolution else 0.0)
        return state

    def snapshot(self) -> Snapshot:
        """Everything, for `restore` in any instance of this process."""
        computed = self._present, self._dense_output
        return new(
            Snapshot,
            (
                tuple(self.values), self._mode, self._refused, self._illegal, self.start_time,
                self.origin, self._point, self._impact, self._inputs, self._begin, self.last_step,
                self._count, computed,
            ),
        )  # fmt: skip

    def restore(self, snapshot: Snapshot | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if not (isinstance(snapshot, Snapshot) and self._is_alike(snapshot)):
            self._refuse_call(
                "a state that this component didn't make is refused; it has no effect"
            )
            return
        (
            values, self._mode, self._refused, self._illegal, self.start_time, self.origin,
            self._point, self._impact, self._inputs, begin, size, count, computed,
        ) = snapshot  # fmt: skip
        self._resize(self._impact, begin, size)
        self._count = count
        if computed is not None:
            self._present, self._dense_output = computed
        self._restored_values = values
        self.values = list(values)
        self._point_is_free, self._check_every_step = True, False
        self._size = nan

    def _is_alike(self, snapshot: Snapshot) -> bool:
        """Whether the steps of a state are of the kind of this instance: not of Model Exchange."""
        return not isinstance(snapshot.impact, SolvedImpact)

    #: A snapshot as bytes, for another process, and back.
    packed = staticmethod(packed)
    unpacked = staticmethod(unpacked)
