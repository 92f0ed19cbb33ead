"""One instance: its variables and clock; its modes are those of every component (`modes`).

A communication step only advances the clock; outputs are evaluated when they are read. A refused
call changes nothing: its effects are computed first, and take place only as a whole.
"""

from collections.abc import Callable
from math import ceil, inf, nan
from types import MappingProxyType
from typing import Any

from ..conflicts import conflict
from ..impact import RESOLUTION, Approach, Contact, Impact, advance
from ..laws import LAWS
from ..modes import POINT_TOLERANCE, STEPPING, FmiComponent
from ..refusals import refusal
from ..values import START, Inputs, Instant, Parameters, Refusal, State, added, new
from ..variables import INPUTS, MOTION, SETTABLE, VARIABLES, Variable
from .outputs import PLACES, reading
from .state import Snapshot, packed, unpacked

_START_VALUES = tuple(row.start for row in SETTABLE.values())
#: Next to touch and separation (relative) force and compression may be all rounding error.
_CLOSE = 1e-12

#: No contact's dense output: see `Component._evaluate`.
_NO_DENSE_OUTPUT: Any = list, 0.0, 0.0, 0.0, inf, -inf


def not_computed(error: Exception) -> Refusal:
    # A phase's own reason; other classes are those of Python's arithmetic.
    rule = "NOT_COMPUTABLE" if type(error) is ArithmeticError else "BEYOND_DOUBLES"
    return refusal(rule, why=error)


class Component(FmiComponent):
    """An instance of the impact."""

    _rows = MappingProxyType({(row.type, row.reference): row for row in VARIABLES})

    def __init__(self, report: Callable[[Refusal], Any]) -> None:
        super().__init__(report)
        #: Values as the host sees them: inputs and parameters in the table's order.
        self.values: list[Any] = list(_START_VALUES)
        #: The host's time at the start of the run and when the clock stood at 0, s.
        self.start_time = self.origin = 0.0
        self._run(None, None, START, 0.0)
        #: The last list of references read, and how: see `outputs.reading`.
        self._requested, self._pick = reading((), "Real")

    def _run(self, impact: Any, inputs: Inputs | None, begin: Instant, size: float) -> None:
        """Steps of this size (s; 0: none yet) from an instant on, with this impact and inputs.

        The impact is that of the instant or before; None, before stepping: that of the values.
        """
        self._impact = impact
        self._inputs: Any = inputs
        self._resize(impact, begin, size)

    def _resize(self, present: Any, begin: Instant, size: float) -> None:
        """The same by steps of another size; `present` is the impact from some phase on."""
        self._begun, self.last_step, self._count = begin, size, 0.0
        #: The last number of steps whose instant was computed, and that.
        self._counted, self._instant = 0.0, begin
        #: The impact from a phase on, at most that of the present instant.
        self._present = present
        self._dense_output = _NO_DENSE_OUTPUT
        #: The state at this communication point, once it has been read.
        self._now: State | None = None

    def _set_start_time(self, start_time: float) -> None:
        self.start_time = self.origin = self.point = start_time

    def _begin(self) -> Refusal | None:
        values = self.values
        parameters, inputs = Parameters(*values[INPUTS:]), new(Inputs, values[:INPUTS])
        problem = conflict(parameters, inputs)
        if problem is not None:
            # Outputs are those of bodies that never meet.
            inputs = Inputs(1.0, 0.0, parameters.ball_speed, 0.0)
        start = START, 0.0, -parameters.gap, 0.0
        self._run(Approach(parameters, inputs.club_speed, *start), inputs, START, 0.0)
        return problem

    def step(self, point: float, size: float) -> bool:
        """One communication step from the host's communication point on, both in s.

        Returns whether it was accepted; if not, a message says why, and nothing has changed.
        """
        if size == self._size and (
            point == self.point or abs(point - self.point) <= POINT_TOLERANCE * size
        ):
            self._count += 1.0
            self.point = point + size
            self._now = None
            return True
        problem = self._check(point, size)
        if problem is not None:
            return self._discard(problem)
        self._now = None
        self.point = point + size
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
            return added(self._begun, size)
        # Two factors of at most 26 bits have an exact product.
        high = 134217729.0 * size
        high -= high - size
        return added(added(self._begun, count * high), count * (size - high))

    def _check(self, point: float, size: float) -> Refusal | None:
        """Why a step is refused; or None, and it is counted."""
        problem = self._why_not(point, size)
        if problem is not None:
            return problem
        instant, origin = self.instant(), self.origin
        if point != self.point and not self._goes_on(point, size):
            # After a restore the host's time may go on from anywhere; a touch to come moves.
            try:
                touch = self.impact().touch
            except (ArithmeticError, ValueError) as error:
                return not_computed(error)
            if touch is None or touch.instant[0] >= instant[0]:
                origin = point - instant[0]
        values, inputs, impact = self.values, self._inputs, self._impact
        # Faster than a slice.
        given = values[0], values[1], values[2], values[3]
        if given != inputs:
            inputs = new(Inputs, given)
            problem = conflict(impact.parameters, inputs)
            if problem is not None:
                return problem
            try:
                impact = self._changed(inputs)
            except (ArithmeticError, ValueError) as error:
                why = error if type(error) is ArithmeticError else not_computed(error)
                k, b, *_ = inputs
                return refusal("CHANGE_REFUSED", k=k, b=b, why=why)
        p, is_ahead = impact.parameters, False
        if impact.touch is None and (p.restitution_at_rest or inputs.club_force):
            problem = LAWS[p.law].refusal_of_touch(p, inputs)
            is_ahead = problem is not None
            left = impact.duration - impact.elapsed(instant)
            if is_ahead and left <= size * (1.0 + 1e-12):
                return problem
        if inputs is not self._inputs:
            self._run(impact, inputs, instant, size)
        elif size != self.last_step:
            self._resize(self._present, instant, size)
        self.origin = origin
        self._count += 1.0
        # A touch ahead that would be refused is checked at every step.
        self._size = nan if is_ahead else size
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

    def _store(self, row: Variable, value: Any) -> None:
        place = PLACES[row.reference]
        if value == self.values[place]:
            return
        self.values[place] = value
        self._size = nan
        if self._mode < STEPPING:
            self._run(None, None, START, 0.0)

    def _value(self, row: Variable) -> Any:
        return self.values[PLACES[row.reference]]

    def reals(self, references: list[int]) -> list[float]:
        """Values of Real variables; the list may go on after them, and must not be changed."""
        if references != self._requested:
            self._requested, self._pick = reading(tuple(references), "Real")
        pick = self._pick
        return self.state() if pick is None else pick(self)

    def discretes(self, references: list[int], type_: str) -> list[Any]:
        """Values of variables of another type ("Enumeration", "Boolean")."""
        values: list[Any] = reading(tuple(references), type_)[1](self)
        return values

    def report_failure(self, error: Exception) -> None:
        """Why values that are read can't be computed."""
        self._report(not_computed(error))

    def impact(self) -> Any:
        """The impact at the present instant, for outputs.

        Raises ArithmeticError or ValueError if the contact can't be computed.
        """
        if self._impact is None:
            self._begin()
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

    def _evaluate(self) -> State:
        try:
            impact = self.impact()
            if type(impact) is Contact:
                self._now = self._read_contact(impact)
            else:
                self._now = impact.state(self.instant())
        except (ArithmeticError, ValueError) as error:
            self.report_failure(error)
            self._now = [nan] * len(MOTION)
        return self._now

    def _read_contact(self, contact: Contact) -> State:
        """The state in a contact; further steps of this size need its dense output alone.

        Kept are: that, the number of steps before the contact, the scaled time there and that of a
        step, and between which scaled times the dense output is the state: next to touch and
        separation the exact instant decides, and the state is clamped.
        """
        dense, scale = contact.dense_output()
        begin, begin_low = contact.begin
        offset, first = (self._begun[0] - begin) + (self._begun[1] - begin_low), 0.0
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
            contact.clamp(state, t if t > resolution else 0.0, contact.touch.x_ball)
        return state

    def snapshot(self) -> Snapshot:
        """Everything, for `restore` in any instance of this process."""
        computed = self._present, self._dense_output
        return new(
            Snapshot,
            (
                tuple(self.values), self._mode, self._refused, self._illegal, self.start_time,
                self.origin, self.point, self._impact, self._inputs, self._begun, self.last_step,
                self._count, computed,
            ),
        )  # fmt: skip

    def restore(self, snapshot: Any) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if not isinstance(snapshot, Snapshot):
            self._refuse_call("FOREIGN_STATE")
            return
        (
            values, self._mode, self._refused, self._illegal, self.start_time, self.origin,
            self.point, self._impact, self._inputs, begin, size, count, computed,
        ) = snapshot  # fmt: skip
        self._resize(self._impact, begin, size)
        self._count = count
        if computed is not None:
            self._present, self._dense_output = computed
        self.values = list(values)
        self._point_is_free = True
        self._size = nan

    #: A snapshot as bytes, for another process, and back.
    packed = staticmethod(packed)
    unpacked = staticmethod(unpacked)
