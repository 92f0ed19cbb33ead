"""One instance of the component: its variables, modes, clock and state, for any interface.

A communication step only moves the clock. Outputs are evaluated when they are read, each at most
once per communication point. Whatever a host does wrong is answered by a message and a refused
step, never by an exception: an interface has no way back from one.
"""

import json
from binascii import crc32
from collections.abc import Callable
from math import isfinite, nan
from operator import itemgetter
from typing import Any

from . import results
from .impact import Impact, State
from .parameters import (
    INPUTS,
    SETTABLE,
    Inputs,
    Parameters,
    conflict,
    ordinary,
    refusal,
    usual,
)
from .variables import VARIABLES

#: Modes of an instance, in the order in which a host passes through them. Blocked: initialization
#: has ended on values that can't be used, so parameters may still be set.
INSTANTIATED, INITIALIZATION, BLOCKED, STEPPING, TERMINATED = range(5)

_START_VALUES = tuple(variable.start for variable in VARIABLES[:SETTABLE])
_LOW = [variable.low for variable in VARIABLES[:INPUTS]]
_HIGH = [variable.high for variable in VARIABLES[:INPUTS]]

#: How far (relative to the step) a host's communication point may lie from where its last step
#: ended: enough for sums of rounded steps, far too little for a step left out.
_POINT_TOLERANCE = 1e-6

#: How to read each distinct list of references of Real variables; a host has a few. The elements of
#: `Impact.state`, where it asks for nothing else, or each variable's function (None: held).
_real_plans: dict[tuple[int, ...], tuple[Callable[[State], list[float]] | None, tuple, tuple]] = {}
_MAX_PLANS = 256

#: Equal to no list of references.
_NONE: list = [None]

#: First item of a serialized state: another layout must have another one.
_FORMAT = "golf-impact state 2"

#: First item of every snapshot: those of another version of this component, loaded in the same
#: process, have another one.
_OWN = object()


def _no_motion(t: float) -> State:
    raise AssertionError("no phase has been looked at yet")


def _is_own(snapshot: object) -> bool:
    return type(snapshot) is tuple and len(snapshot) > 0 and snapshot[0] is _OWN


def _with_checksum(body: bytes) -> bytes:
    """A JSON list without its end, ended by a checksum."""
    return body + f", {crc32(body)}]".encode()


def _listed(pick: Callable[[State], tuple]) -> Callable[[State], list[float]]:
    return lambda state: list(pick(state))


class Component:
    """An instance between instantiation and termination.

    Args:
        report: called with a message whenever something is refused.
    """

    __slots__ = (
        "_anchored",
        "_asked",
        "_asked_whole",
        "_count",
        "_impact",
        "_last_phase",
        "_memo",
        "_memo_of",
        "_mode",
        "_motion",
        "_now",
        "_offset",
        "_once",
        "_ordinary",
        "_pace",
        "_pick",
        "_plan",
        "_point",
        "_quick",
        "_refused",
        "_report",
        "_scale",
        "_size",
        "_until",
        "_values",
        "_watched",
        "carry",
        "clock",
        "last_step",
        "origin",
        "start_time",
    )

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._mode = INSTANTIATED
        #: Values as the host sees them: inputs and parameters in the table's order.
        self._values: list[Any] = list(_START_VALUES)
        #: Why steps are refused until it is corrected, by variable name; never changed in place.
        self._refused: dict[str, str] = {}
        #: Why the next step is refused: calls that nothing can correct.
        self._once: tuple[str, ...] = ()
        #: Before stepping: a preview for the present values, made when it is read.
        self._impact: Impact | None = None
        #: The sum of the accepted steps, s, as a pair, but for the last `_count` of one size. The
        #: size is NaN while something else than the clock must be looked at in the next step.
        self.clock = 0.0
        self.carry = 0.0
        self._count = 0.0
        self._size = nan
        #: The last accepted step, s.
        self.last_step = 0.0
        #: The host's time at the start of the run, s.
        self.start_time = 0.0
        #: The host's time when the clock stood at 0, s.
        self.origin = 0.0
        #: Where the host's next step is expected to begin, s; anywhere after a restore.
        self._point = 0.0
        self._anchored = True
        self._ordinary = False
        #: Whether every step must be looked at: a touch is ahead that would be refused.
        self._watched = False
        #: The present phase: its state, how long it had lasted when the steps were counted from 0,
        #: and its end (NaN: unknown), as the state wants time; its growth in a second and a step.
        self._last_phase: object = None
        self._motion: Callable[[float], State] = _no_motion
        self._offset = 0.0
        self._until = nan
        self._scale = self._pace = 1.0
        #: The state at this communication point, once it has been read, and the results of it.
        self._now: State | None = None
        self._memo: dict[int, Any] = {}
        self._memo_of: State | None = None
        #: The last list of references read, and how.
        self._asked: list[int] = []
        #: The same if they are the first ones of `Impact.state`: its list is then given as it is.
        self._asked_whole = _NONE
        self._pick: Callable[[State], list[float]] | None = None
        self._quick: tuple = ()
        self._plan: tuple = ()

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

    def exit_initialization(self) -> None:
        """From here on parameters are fixed, as soon as they can be used."""
        if self._mode != INITIALIZATION:
            self._refuse_once("the end of an initialization that wasn't entered is refused")
            return
        self._mode = BLOCKED
        problem = self._begin()
        if problem is not None:
            self._report(problem)

    def _begin(self) -> str | None:
        """Fix the parameters; or say why they can't be used."""
        unusable = [m for name, m in self._refused.items() if name in Parameters.__slots__]
        parameters, inputs = self._split()
        problem = "; ".join(unusable) or conflict(parameters, inputs)
        if problem is None:
            self._mode = STEPPING
            self._until = nan
            self._ordinary = ordinary(parameters, inputs)
            self._impact = Impact(parameters, inputs)
            self._now = None
        return problem

    def terminate(self) -> None:
        """The end of the run: values can still be read, nothing else."""
        self._mode = TERMINATED
        self._fold()

    def _split(self) -> tuple[Parameters, Inputs]:
        values = self._values
        return Parameters(*values[INPUTS:]), tuple(values[:INPUTS])

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
        problem = self._problem(point, size)
        if self._count:
            self._fold()
        if problem is not None:
            self._size = nan
            self._report(problem)
            return False
        self._size = self.last_step = size
        if self._until == self._until:
            self._pace = size * self._scale
            self._count = 1.0
        else:
            self._tick(size)
        self._point = point + size
        self._now = None
        if self._watched:
            self._fold()
        return True

    def _fold(self) -> None:
        """Add the steps that were only counted to the clock; the next step is looked at closely."""
        count, size = self._count, self._size
        if count == 1:
            self._tick(size)
            self._count = 0.0
        elif count:
            # Two factors of at most 26 bits have an exact product.
            high = 134217729.0 * size
            high -= high - size
            self._tick(count * high)
            self._tick(count * (size - high))
            self._count = 0.0
        self._size = self._until = nan

    def _fold_clock(self) -> None:
        """The same, where nothing but the clock has to be known: equal steps go on."""
        size = self._size
        self._fold()
        self._size = size

    def _tick(self, elapsed: float) -> None:
        # Two-sum: 10⁶ steps are as exact as one.
        clock = self.clock
        total = clock + elapsed
        back = total - clock
        carry = self.carry + ((clock - (total - back)) + (elapsed - back))
        # The larger part is the sum's nearest double: the same one, however the steps were added.
        self.clock = total + carry
        self.carry = carry - (self.clock - total)

    def _problem(self, point: float, size: float) -> str | None:
        """Whatever a step in a row of equal ones needn't look at; why it is refused, or None."""
        if self._mode != STEPPING:
            problem = self._not_stepping()
            if problem is not None:
                return problem
        if not 0.0 < size <= 1e100:
            return f"communication step size = {size!r} s is refused: it must be > 0 and finite"
        if self._refused or self._once:
            problems = "; ".join((*self._refused.values(), *self._once))
            self._once = ()
            return f"steps are refused until this is corrected: {problems}"
        off = point - self._point
        if off and not abs(off) <= _POINT_TOLERANCE * size + 1e-15 * abs(self._point):
            if self._anchored or not abs(point) <= 1e100:
                return (
                    f"communication point = {point!r} s is refused: the last step ended at "
                    f"{self._point!r} s, and no state has been restored since"
                )
            self._move_origin(point)
        values = self._values
        inputs = values[0], values[1], values[2]
        impact = self._impact
        assert impact is not None
        if impact.parameters.restitution_at_rest:
            if self._count:
                self._fold()
            self._watched, problem = impact.refusal_of_touch(self.clock, self.carry, inputs, size)
            if problem is not None:
                return problem
        if inputs != impact.in_force:
            if not (self._ordinary and usual(inputs)):
                problem = conflict(impact.parameters, inputs)
                if problem is not None:
                    return problem
            if self._count:
                self._fold()
            self._until = nan
            try:
                impact.hold(self.clock, self.carry, inputs)
            except (ArithmeticError, ValueError) as error:
                return f"steps are refused: this impact leaves the range of a double ({error})"
        self._anchored = True
        return None

    def _not_stepping(self) -> str | None:
        if self._mode == BLOCKED:
            problem = self._begin()
            return problem and f"steps are refused until this is corrected: {problem}"
        if self._mode == TERMINATED:
            return "a step after the end of the run is refused: reset the instance first"
        return "a step before the end of initialization is refused"

    def _move_origin(self, point: float) -> None:
        """After a restore the host's time may go on from anywhere; a touch to come moves along."""
        assert self._impact is not None
        # A touch that is past must be known, whether anybody has read an output since or not.
        self._evaluate()
        touch = self._impact.touch
        if touch is None or touch[0] >= self.clock:
            self.origin = point - self.clock

    # Refusals

    def _refuse(self, name: str, message: str) -> None:
        self._refused = {**self._refused, name: message}
        self._fold()
        self._report(message)

    def _corrected(self, name: str) -> None:
        if name in self._refused:
            self._refused = {n: text for n, text in self._refused.items() if n != name}

    def _refuse_once(self, message: str) -> None:
        self._once = (*self._once, message)[-8:]
        self._fold()
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
            if (
                -1 < reference < INPUTS
                and self._mode == STEPPING
                and type_ == "Real"
                and _LOW[reference] <= value <= _HIGH[reference]
                and not self._refused
            ):
                # An input in the middle of a run: what a host does again and again.
                if value != self._values[reference]:
                    self._values[reference] = value
                    if self._count:
                        self._fold()
                    self._size = nan
                continue
            variable = VARIABLES[reference] if 0 <= reference < SETTABLE else None
            if variable is None or variable.type != type_:
                known = 0 <= reference < len(VARIABLES)
                what = VARIABLES[reference].name if known else f"value reference {reference}"
                self._refuse_once(f"{what} is no {type_} input or parameter: it can't be set")
            elif self._mode == TERMINATED:
                self._refuse_once(f"{variable.name} can't be set after the end of the run")
            elif not variable.low <= value <= variable.high:
                self._refuse(variable.name, refusal(variable, value))
            elif value == self._values[reference]:
                self._corrected(variable.name)
            elif reference >= INPUTS and self._mode == STEPPING:
                self._refuse(
                    variable.name,
                    f"{variable.name} = {value!r} is refused: a parameter is fixed once "
                    f"initialization has ended (at {self._values[reference]!r})",
                )
            else:
                self._corrected(variable.name)
                self._values[reference] = value
                self._fold()
                if self._mode < STEPPING:
                    self._impact = self._now = None

    def reals(self, references: list[int]) -> list[float]:
        """Values of Real variables, evaluated now unless they have been at this point.

        The list may go on after the values asked for; it must not be changed.
        """
        if references == self._asked_whole:
            # The fastest read: what a phase's function of time gives, as it is.
            now = self._now
            if now is None:
                t = self._offset + self._count * self._pace
                now = self._now = self._motion(t) if t < self._until else self._evaluate()
            return now
        if references != self._asked:
            self._ask(references)
        pick = self._pick
        if pick is not None:
            now = self._now
            if now is None:
                t = self._offset + self._count * self._pace
                now = self._now = self._motion(t) if t < self._until else self._evaluate()
            return pick(now)
        if self._quick:
            now = self._now or self._evaluate()
            impact = self._impact
            found = []
            for result in self._quick:
                found.append(result(impact, now, self))
            return found
        return self._read(self._plan)

    def discretes(self, references: list[int], type_: str) -> list:
        """Values of variables of another type ("Enumeration", "Boolean")."""
        return self._read(self._functions(references, type_))

    def _ask(self, references: list[int]) -> None:
        """Work out how to read these variables; a host asks for a few lists again and again."""
        key = tuple(references)
        if key not in _real_plans:
            plan = self._functions(references, "Real")
            pick: Callable[[State], list[float]] | None = None
            if len(key) > 1 and all(reference in results.MOVING for reference in key):
                first = results.MOVING.start
                if key == tuple(range(key[0], key[0] + len(key))):
                    pick = itemgetter(slice(key[0] - first, key[0] - first + len(key)))
                else:
                    pick = _listed(itemgetter(*(reference - first for reference in key)))
            if len(_real_plans) >= _MAX_PLANS:
                _real_plans.clear()
            quick = tuple(
                result
                for reference, result in plan
                if reference >= SETTABLE and reference not in results.CLOCKED
            )
            _real_plans[key] = pick, quick if len(quick) == len(plan) else (), plan
        self._pick, self._quick, self._plan = _real_plans[key]
        self._asked = list(references)
        whole = len(key) > 4 and key == tuple(results.MOVING)[: len(key)]
        self._asked_whole = self._asked if whole else _NONE

    def _functions(self, references: list[int], type_: str) -> tuple:
        functions: list[tuple[int, Any]] = []
        for reference in references:
            if 0 <= reference < len(VARIABLES) and VARIABLES[reference].type == type_:
                functions.append((reference, results.BY_REFERENCE.get(reference)))
            else:
                functions.append((-1, type_))
        return tuple(functions)

    def _read(self, functions: tuple) -> list:
        state = self._now or self._evaluate()
        if self._count:
            # The state may have come straight from its function of time; results ask for the clock.
            self._fold_clock()
        impact = self._impact
        memo = self._memo
        if self._memo_of is not state:
            memo.clear()
            self._memo_of = state
        found = []
        for reference, result in functions:
            if reference in memo:
                value = memo[reference]
            elif result is None:
                value = self._values[reference]
            elif reference < 0:
                self._refuse_once(f"a value reference that no {result} variable has is refused")
                value = nan if result == "Real" else 0
            else:
                try:
                    value = result(impact, state, self)
                except (ArithmeticError, ValueError) as error:
                    self._refuse_once(f"this impact leaves the range of a double ({error})")
                    value = nan
                if reference in results.CLOCKED:
                    memo[reference] = value
            found.append(value)
        return found

    def _evaluate(self) -> State:
        if self._count:
            self._fold_clock()
        impact = self._impact
        if impact is None:
            parameters, inputs = self._split()
            if conflict(parameters, inputs) is not None:
                # Nothing to show but bodies that never meet.
                inputs = (1.0, 0.0, parameters.ball_speed)
            impact = self._impact = Impact(parameters, inputs)
        try:
            now = impact.state(self.clock, self.carry)
        except (ArithmeticError, ValueError) as error:
            self._refuse_once(f"this impact leaves the range of a double ({error})")
            now = [nan] * len(results.MOVING)
        self._now = now
        if impact.phase is self._last_phase:
            # The second read in one phase: from now on straight from its function of time.
            self._motion, self._offset, self._until, self._scale = impact.course(
                self.clock, self.carry
            )
            self._pace = self._size * self._scale
        else:
            self._last_phase = impact.phase
        return now

    # State

    def snapshot(self) -> tuple:
        """Everything, for `restore` in any instance of this process."""
        self._fold_clock()
        return (
            _OWN,
            self._mode,
            tuple(self._values),
            self._refused,
            self._once,
            self.clock,
            self.carry,
            self.last_step,
            self.start_time,
            self.origin,
            self._point,
            self._ordinary,
            self._impact.snapshot() if self._mode >= STEPPING and self._impact else None,
        )

    def restore(self, snapshot: tuple | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if type(snapshot) is not tuple or not snapshot or snapshot[0] is not _OWN:
            self._refuse_once(
                "a state that this component didn't make is refused; it has no effect"
            )
            return
        (
            _,
            self._mode,
            values,
            self._refused,
            self._once,
            self.clock,
            self.carry,
            self.last_step,
            self.start_time,
            self.origin,
            self._point,
            self._ordinary,
            impact,
        ) = snapshot
        self._values = list(values)
        if impact is None:
            self._impact = None
        elif type(self._impact) is Impact:
            self._impact.restore(impact)
        else:
            self._impact = Impact.restored(impact)
        self._anchored = self._watched = False
        self._count = 0.0
        self._size = self._until = nan
        self._now = None

    @staticmethod
    def packed(snapshot: tuple) -> bytes:
        """A snapshot as bytes, for another process: a JSON list whose last item is a checksum."""
        if not _is_own(snapshot):
            return b""
        _, *plain, impact = snapshot
        if impact is not None:
            impact = Impact.restored(impact).packed()
        return _with_checksum(json.dumps([_FORMAT, *plain, impact])[:-1].encode())

    @staticmethod
    def unpacked(data: bytes) -> tuple | None:
        """The snapshot that became these bytes, or None if they are none of this component's."""
        try:
            # Looked at before anything else is: damaged bytes could stand for any numbers.
            body = data.rpartition(b", ")[0]
            if data != _with_checksum(body):
                return None
            form, mode, values, refused, once, *numbers, impact = json.loads(body + b"]")
            if form != _FORMAT:
                return None
            allowed = zip(VARIABLES[:SETTABLE], values, strict=True)
            if not all(variable.low <= value <= variable.high for variable, value in allowed):
                return None
            if impact is not None:
                made = Impact.unpacked(impact)
                if conflict(made.parameters, made.in_force) is not None:
                    return None
                impact = made.snapshot()
            return (_OWN, mode, tuple(values), refused, tuple(once), *numbers, impact)
        except (ArithmeticError, TypeError, ValueError):
            return None
