"""What the companions share: variables made from tables, refusals, and state.

A refused value leaves the old one; steps are refused until the variable is set right.
"""

from collections.abc import Callable, Iterable
from math import isfinite
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from .. import codec
from ..values import Refusal, rejected

#: It changes with the layout of a state.
_VERSION = "golf-impact companion 2"

#: Stands in `_refused` for a state that is refused: until the next step only.
_STATE = "state"


class Variable(NamedTuple):
    """One variable: its attributes in FMI and its allowed values."""

    reference: int
    name: str
    causality: str
    type: str  #: Real or Boolean
    unit: str
    start: float | None
    low: float
    high: float
    display: str | None
    description: str
    allowed: str = ""
    nominal: float | None = None


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
        #: Why steps are refused, by the variable to be corrected.
        self._refused: dict[str, Refusal] = {}
        #: Whether parameters can't be set any more.
        self._fixed = False
        variables = [Variable(*row) for row in rows]
        for row in variables:
            zero = 0.0 if row.type == "Real" else False
            setattr(self, row.name, zero if row.start is None else row.start)
        self._state_names = "_fixed", "_refused", *self.inside, *(row.name for row in variables)
        self._rows = {(row.type, row.reference): row for row in variables}

    def enter_initialization(self) -> None:
        """Has no effect."""

    def exit_initialization(self) -> bool:
        """Fix the parameters if they can be used; returns whether they can."""
        problem = self._problem()
        if problem and not self._refused:
            self._report(problem)
        return not problem

    def terminate(self) -> None:
        """Has no effect."""

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        """Set inputs and parameters of this type; refused ones keep theirs."""
        for reference, value in zip(references, values):
            self._assign(self._rows[type_, reference], value)

    def _assign(self, row: Variable, value: Any) -> None:
        name, refused, why = row.name, dict(self._refused), ""
        refused.pop(name, None)
        if row.causality == "output":
            self._report(Refusal("an output can't be set", row.name, value))
        elif value == getattr(self, name):
            pass
        elif not row.low <= value <= row.high:
            why = f"it must be {row.low:g} to {row.high:g}"
        elif row.causality == "parameter" and self._fixed:
            why = "a parameter is fixed now"
        else:
            setattr(self, name, value)
        if why:
            refused[name] = rejected(name, value, why)
            self._report(refused[name])
        self._refused = refused

    def discretes(self, references: list[int], type_: str) -> list:
        """Values of variables of this type."""
        return [getattr(self, self._rows[type_, reference].name) for reference in references]

    def reals(self, references: list[int]) -> list[float]:
        """Values of Real variables."""
        return self.discretes(references, "Real")

    def step(self, point: float, size: float) -> bool:
        """One communication step from the host's communication point on, both in s.

        Returns whether it was accepted; if not, a message says why, and nothing has changed.
        """
        problem = self._problem()
        if not (size > 0.0 and isfinite(point + size)):
            problem = rejected("step size", size, "it must be > 0", " s")
        try:
            problem = problem or self._step(point, size)
        except (ArithmeticError, ValueError) as error:
            problem = Refusal(f"this step can't be computed: {error}")
        if problem:
            self._report(problem)
            self._refused = {name: one for name, one in self._refused.items() if name != _STATE}
        else:
            self.steps += 1
        return not problem

    def _step(self, point: float, size: float) -> Refusal | None:
        raise NotImplementedError

    def _problem(self) -> Refusal | None:
        """Why no step can be taken; if one can, the parameters are fixed."""
        if self._refused:
            first, *_ = refused = list(self._refused.values())
            return first._replace(sentence="; ".join(map(str, refused)))
        problem = None if self._fixed else self._begin()
        self._fixed = not problem
        return problem

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
            self.steps += 1
            return
        foreign = Refusal("a state that this FMU didn't make is refused; it has no effect")
        self._refused = {**self._refused, _STATE: foreign}
        self._report(foreign)

    @staticmethod
    def packed(state: dict | None) -> bytes:
        """A snapshot as bytes, for another process."""
        # A motion is computed again from its initial values.
        return codec.packed(_VERSION, state) if state else b""

    @classmethod
    def unpacked(cls, data: bytes, rows: Iterable[tuple]) -> dict | None:
        """The snapshot that became these bytes, or None if they are none of this component's."""
        variables = [Variable(*row) for row in rows]
        types = {"_fixed": bool, "_refused": dict[str, Refusal], **cls.inside}
        types |= {row.name: float if row.type == "Real" else bool for row in variables}
        classes = Refusal, *cls.classes
        state = codec.unpacked(_VERSION, data, classes, lambda class_, arguments: None)
        if not isinstance(state, dict) or tuple(state) != tuple(types):
            return None
        given = (row for row in variables if row.causality != "output")
        right = all(map(codec.fits, state.values(), types.values())) and all(
            row.low <= state[row.name] <= row.high for row in given
        )
        return state if right else None
