"""What the companions share: variables made from tables, modes, refusals, and state.

The rules for a host's calls are those of ClubBallImpact: what is refused is reported and changes
nothing; a refused value must be set right before the next step, and an illegal call costs one step.
"""

from collections.abc import Callable, Iterable
from math import isfinite, nan
from typing import TYPE_CHECKING, Any, ClassVar

from .. import codec
from ..values import Refusal, rejected
from ..variables import Variable

#: It changes with the layout of a state.
_VERSION = "golf-impact companion 3"

#: Modes of an instance, in the order in which a host passes through them. Start refused:
#: initialization has ended on values that can't be used, so parameters may still be set.
INSTANTIATED, INITIALIZATION, START_REFUSED, STEPPING, TERMINATED = range(5)

#: How far (relative to the step) a host's communication point may lie from where its last step
#: ended.
_POINT_TOLERANCE = 1e-6

#: Of communication points and steps, s.
_LARGEST_TIME = 1e100


class Companion:
    """A component whose variables are its attributes.

    `_step` takes a step, or returns the reason for a refusal.

    Args:
        rows: a `Variable`, or its fields, of each variable.
        report: called with a `Refusal` whenever something is refused.
    """

    #: Attributes of the state beside the variables, with their types, and the classes in them.
    inside: ClassVar[dict[str, Any]] = {}
    classes: ClassVar[tuple[type, ...]] = ()
    #: How many steps have been accepted since the instance was made.
    steps = 0

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """The variables."""

    def __init__(self, rows: Iterable[tuple], report: Callable[[Refusal], Any]) -> None:
        self._report = report
        self._mode = INSTANTIATED
        #: Why steps are refused, by the variable to be corrected; never changed in place.
        self._refused: dict[str, Refusal] = {}
        #: Why the next step is refused: illegal calls, which nothing can correct.
        self._illegal: tuple[Refusal, ...] = ()
        #: Where the host's next step is expected to begin, s, or anywhere: after a restore.
        self._point, self._point_is_free = 0.0, False
        variables = [Variable(*row) for row in rows]
        for row in variables:
            zero = 0.0 if row.type == "Real" else False
            setattr(self, row.name, zero if row.start is None else row.start)
        self._state_names = tuple(self._types(variables))
        self._rows = {(row.type, row.reference): row for row in variables}

    @classmethod
    def _types(cls, variables: Iterable[Variable]) -> dict[str, Any]:
        """Of the attributes in a state, by name."""
        modes = {"_mode": int, "_point": float, "_refused": dict[str, Refusal]}
        values = {row.name: float if row.type == "Real" else bool for row in variables}
        return {**modes, "_illegal": tuple[Refusal, ...], **cls.inside, **values}

    def set_up(self, start_time: float) -> None:
        """The host's time at the start, s."""
        if self._mode != INSTANTIATED:
            self._refuse_call("set-up after initialization has begun is refused")
        elif not isfinite(start_time):
            self._refuse(rejected("start time", start_time, "it must be a finite number", " s"))
        else:
            self._corrected("start time")
            self._point = start_time

    def enter_initialization(self) -> None:
        """The beginning of initialization."""
        if self._mode == INSTANTIATED:
            self._mode = INITIALIZATION
        else:
            self._refuse_call("a second initialization is refused: reset the instance first")

    def exit_initialization(self) -> bool:
        """Fix the parameters if they can be used; returns whether all start values can."""
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
        parameters = {row.name for row in self._rows.values() if row.causality == "parameter"}
        problem = _together(one for name, one in self._refused.items() if name in parameters)
        problem = problem or self._begin()
        if problem is None:
            self._mode = STEPPING
        return problem

    def terminate(self) -> None:
        """The end of the run: values can still be read, nothing else."""
        self._mode = TERMINATED

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        """Set inputs and parameters that the host takes for this type; refused ones keep theirs."""
        for reference, value in zip(references, values):
            self._assign(type_, reference, value)

    def _assign(self, type_: str, reference: int, value: Any) -> None:
        row = self._rows.get((type_, reference))
        if row is None or row.causality == "output":
            names = (row.name for row in self._rows.values() if row.reference == reference)
            what = next(names, f"value reference {reference}")
            self._refuse_call(f"{what} is no {type_} input or parameter: it can't be set")
            return
        name = row.name
        if self._mode == TERMINATED:
            self._refuse_call(f"{name} can't be set after the end of the run", name, value)
        elif not row.low <= value <= row.high:
            self._refuse(rejected(name, value, f"it must be {row.low:g} to {row.high:g}"))
        elif value == (now := getattr(self, name)):
            self._corrected(name)
        elif row.causality == "parameter" and self._mode == STEPPING:
            why = f"a parameter is fixed once initialization has ended (at {now!r})"
            self._refuse(rejected(name, value, why))
        else:
            self._corrected(name)
            setattr(self, name, value)

    def _refuse(self, refusal: Refusal) -> None:
        self._refused = {**self._refused, refusal.variable: refusal}
        self._report(refusal)

    def _corrected(self, name: str) -> None:
        self._refused = {other: one for other, one in self._refused.items() if other != name}

    def _refuse_call(self, sentence: str, name: str = "", value: Any = None) -> None:
        refusal = Refusal(sentence, name, value, sentence)
        self._illegal = (*self._illegal, refusal)[-8:]
        self._report(refusal)

    def discretes(self, references: list[int], type_: str) -> list:
        """Values of variables of this type."""
        rows = [self._rows.get((type_, reference)) for reference in references]
        if None in rows:
            self._refuse_call(f"a value reference that no {type_} variable has is refused")
        unknown = nan if type_ == "Real" else 0
        return [getattr(self, row.name) if row else unknown for row in rows]

    def reals(self, references: list[int]) -> list[float]:
        """Values of Real variables."""
        return self.discretes(references, "Real")

    def step(self, point: float, size: float) -> bool:
        """One communication step from the host's communication point on, both in s.

        Returns whether it was accepted; if not, a message says why, and nothing has changed.
        """
        problem = self._why_not(point, size)
        try:
            problem = problem or self._step(point, size)
        except (ArithmeticError, ValueError) as error:
            problem = Refusal(f"this step can't be computed: {error}")
        if problem is not None:
            self._report(problem)
            return False
        self._point, self._point_is_free = point + size, False
        self.steps += 1
        return True

    def _why_not(self, point: float, size: float) -> Refusal | None:
        """Why a step isn't taken, whatever it leads to; or None."""
        if not 0.0 < size <= _LARGEST_TIME:
            return rejected("communication step size", size, "it must be > 0 and finite", " s")
        if self._mode == TERMINATED:
            return Refusal("a step after the end of the run is refused: reset the instance first")
        if self._mode < START_REFUSED:
            return Refusal("a step before the end of initialization is refused")
        problem = self._start() if self._mode == START_REFUSED else None
        if problem is None:
            problem = _together((*self._refused.values(), *self._illegal))
            self._illegal = ()
        if problem is not None:
            why = f"steps are refused until this is corrected: {problem}"
            return problem._replace(sentence=why)
        deviation, allowed = abs(point - self._point), _POINT_TOLERANCE * size
        if deviation <= allowed + 1e-15 * abs(self._point):
            return None
        if self._point_is_free and abs(point) <= _LARGEST_TIME:
            return None
        why = f"the last step ended at {self._point!r} s, and no state has been restored since"
        return rejected("communication point", point, why, " s")

    def _step(self, point: float, size: float) -> Refusal | None:
        raise NotImplementedError

    def _begin(self) -> Refusal | None:
        """Use the parameters; or return why they can't be used."""
        return None

    def snapshot(self) -> dict:
        """Everything, for `restore` in any instance of this process."""
        return {name: getattr(self, name) for name in self._state_names}

    def restore(self, state: dict | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if state is not None and tuple(state) == self._state_names:
            self.__dict__.update(state)
            self._point_is_free = True
            self.steps += 1
        else:
            self._refuse_call("a state that this FMU didn't make is refused; it has no effect")

    @staticmethod
    def packed(state: dict | None) -> bytes:
        """A snapshot as bytes, for another process."""
        # A motion is computed again from its initial values.
        return codec.packed(_VERSION, state) if state else b""

    @classmethod
    def unpacked(cls, data: bytes, rows: Iterable[tuple]) -> dict | None:
        """The snapshot that became these bytes, or None if they are none of this component's."""
        variables = [Variable(*row) for row in rows]
        types, classes = cls._types(variables), (Refusal, *cls.classes)
        state = codec.unpacked(_VERSION, data, classes, lambda class_, arguments: None)
        if not isinstance(state, dict) or tuple(state) != tuple(types):
            return None
        given = (row for row in variables if row.causality != "output")
        right = all(map(codec.fits, state.values(), types.values())) and all(
            row.low <= state[row.name] <= row.high for row in given
        )
        return state if right and INSTANTIATED <= state["_mode"] <= TERMINATED else None


def _together(refusals: Iterable[Refusal]) -> Refusal | None:
    """Several refusals as one, whose fields are those of the first; None if there are none."""
    several = list(refusals)
    if not several:
        return None
    return several[0]._replace(sentence="; ".join(map(str, several)))
