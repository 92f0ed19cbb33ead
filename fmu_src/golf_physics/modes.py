"""FMI's modes of an instance and what is refused: the same for all components.

What is refused is reported by a message and changes nothing; it is never an exception, which would
be fatal in FMI. Steps are refused until a refused value is corrected; an illegal call costs one
step.
"""

from collections.abc import Callable, Iterable, Mapping
from math import isfinite, nan
from typing import Any

from .refusals import refusal
from .values import Refusal
from .variables import Variable

#: Modes of an instance, in the order in which a host passes through them. Start refused:
#: initialization has ended on values that can't be used, so parameters may still be set.
INSTANTIATED, INITIALIZATION, START_REFUSED, STEPPING, TERMINATED = range(5)

#: How far (relative to the step, or to the time) a host's communication point may lie from where
#: its last step ended: enough for sums of rounded steps and for times in single precision.
POINT_TOLERANCE = 1e-6

#: And how far at most, relative to the step: too little for a step left out.
MOST_OF_STEP = 0.25

#: Of communication points and steps, s.
LARGEST_TIME = 1e100

#: Illegal calls that are named when the next step is refused: the last ones.
_MOST_ILLEGAL = 8


class FmiComponent:
    """An instance with modes; `report` is called with a `Refusal` whenever something is refused."""

    #: The variables by type and value reference.
    _rows: Mapping[tuple[str, int], Variable]

    def __init__(self, report: Callable[[Refusal], Any]) -> None:
        self._report = report
        self._mode = INSTANTIATED
        #: Why steps are refused until it is corrected, by variable name; never changed in place.
        self._refused: dict[str, Refusal] = {}
        #: Why the next step is refused: illegal calls, which nothing can correct.
        self._illegal: tuple[Refusal, ...] = ()
        #: Where the host's next step is expected to begin, s, or anywhere: after a restore.
        self.point = 0.0
        self._point_is_free = False
        #: The last step size, s, if another such step needs only its communication point checked.
        self._size = nan

    def set_up(self, start_time: float) -> None:
        """The host's time at the start, s."""
        if self._mode != INSTANTIATED:
            self._refuse_call("LATE_SET_UP")
        elif not isfinite(start_time):
            self._refuse(refusal("START_TIME", "start time", start_time))
        else:
            self._corrected("start time")
            self._set_start_time(start_time)

    def _set_start_time(self, start_time: float) -> None:
        self.point = start_time

    def enter_initialization(self) -> None:
        """From here on outputs are those of the present values."""
        if self._mode == INSTANTIATED:
            self._mode = INITIALIZATION
        else:
            self._refuse_call("ENTERED_TWICE")

    def exit_initialization(self) -> bool:
        """Fix the parameters, as soon as they can be used.

        Returns whether all start values can be used; if not, steps are refused until they can.
        """
        if self._mode != INITIALIZATION:
            self._refuse_call("NOT_ENTERED")
            return True
        self._mode = START_REFUSED
        problem = self._start()
        # A refused value has been reported when it was set.
        if problem is not None and problem.variable not in self._refused:
            self._report(problem)
        return problem is None and not self._refused

    def _start(self) -> Refusal | None:
        """Fix the parameters; or return why they can't be used."""
        fixed = {row.name for row in self._rows.values() if row.causality == "parameter"}
        problem = together(one for name, one in self._refused.items() if name in fixed)
        problem = problem or self._begin()
        if problem is None:
            self._mode = STEPPING
        return problem

    def _begin(self) -> Refusal | None:
        """Use the values; or return why they can't be used together."""
        return None

    def terminate(self) -> None:
        """The end of the run: values can still be read, nothing else."""
        self._mode = TERMINATED
        self._size = nan

    def set_values(self, references: list[int], values: list[Any], type_: str = "Real") -> None:
        """Set inputs and parameters that the host takes for this type; refused ones keep theirs."""
        for reference, value in zip(references, values):
            row = self._accepted(reference, value, type_)
            if row is not None:
                self._store(row, value)

    def _accepted(self, reference: int, value: Any, type_: str) -> Variable | None:
        """The input or parameter that may be set to this value; None: it is refused."""
        row = self._rows.get((type_, reference))
        if row is None or row.causality not in ("input", "parameter"):
            self._refuse_call("NOT_SETTABLE", name=self._name_of(reference), type=type_)
        elif self._mode == TERMINATED:
            self._refuse_call("SET_AFTER_END", row.name, value)
        elif not row.low <= value <= row.high:
            self._refuse(refusal("OUT_OF_RANGE", row.name, value, **words_on_range(row)))
        elif (
            row.causality == "parameter"
            and self._mode == STEPPING
            and value != (now := self._value(row))
        ):
            self._refuse(refusal("FIXED", row.name, value, now=now))
        else:
            if self._refused:
                self._corrected(row.name)
            return row
        return None

    def _store(self, row: Variable, value: Any) -> None:
        """Set an input or parameter."""
        raise NotImplementedError

    def _value(self, row: Variable) -> Any:
        """Of an input or parameter."""
        raise NotImplementedError

    def _name_of(self, reference: int) -> str:
        names = (row.name for row in self._rows.values() if row.reference == reference)
        return next(names, f"value reference {reference}")

    def unknown(self, reference: int, type_: str) -> float:
        """For a value reference that no variable of this type has."""
        self._refuse_call("NOT_READABLE", name=self._name_of(reference), type=type_)
        return nan if type_ == "Real" else 0

    def _refuse(self, problem: Refusal) -> None:
        self._refused = {**self._refused, problem.variable: problem}
        self._size = nan
        self._report(problem)

    def _corrected(self, name: str) -> None:
        self._refused = {other: one for other, one in self._refused.items() if other != name}

    def _refuse_call(self, rule: str, variable: str = "", value: Any = None, **words: Any) -> None:
        problem = refusal(rule, variable, value, **words)
        self._illegal = (*self._illegal, problem)[-_MOST_ILLEGAL:]
        self._size = nan
        self._report(problem)

    def _discard(self, problem: Refusal) -> bool:
        """Report why a step isn't made; returns False."""
        self._size = nan
        self._report(problem._replace(status="Discard"))
        return False

    def _why_not(self, point: float, size: float) -> Refusal | None:
        """Why a step isn't taken, whatever it leads to; or None."""
        if not 0.0 < size <= LARGEST_TIME:
            return refusal("STEP_SIZE", value=size)
        if self._mode != STEPPING or self._refused or self._illegal:
            if self._mode == TERMINATED:
                return refusal("STEP_AFTER_END")
            if self._mode < START_REFUSED:
                return refusal("STEP_BEFORE_START")
            problem = self._start() if self._mode == START_REFUSED else None
            if problem is None:
                problem = together((*self._refused.values(), *self._illegal))
                self._illegal = ()
            if problem is not None:
                return refusal("UNTIL_CORRECTED", why=problem)
        if point == self.point or self._goes_on(point, size):
            return None
        if self._point_is_free and abs(point) <= LARGEST_TIME:
            return None
        return refusal("POINT_JUMPS", value=point, point=self.point)

    def _goes_on(self, point: float, size: float) -> bool:
        """Whether a step begins where the last one ended, within the host's rounding errors."""
        time = abs(self.point)
        allowed = min(POINT_TOLERANCE * max(size, time), MOST_OF_STEP * size)
        # Far from 0 doubles themselves may be further apart than steps.
        return abs(point - self.point) <= max(allowed, 1e-15 * time)


def words_on_range(variable: Variable) -> dict[str, str]:
    """The unit and the range as a sentence has them."""
    unit = f" {variable.unit}" if variable.unit not in ("", "1") else ""
    allowed = variable.allowed
    if variable.type != "Enumeration":
        allowed = f"between {variable.low:g} and {variable.high:g}"
    return {"unit": unit, "allowed": allowed}


def together(refusals: Iterable[Refusal]) -> Refusal | None:
    """Several refusals as one, whose fields are those of the first; None if there are none."""
    several = list(refusals)
    if not several:
        return None
    return several[0]._replace(sentence="; ".join(map(str, several)))
