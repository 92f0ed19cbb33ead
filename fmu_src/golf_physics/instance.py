"""An instance of ClubBallImpact in this process: the calls of an FMI importer, without an FMU."""

from collections.abc import Sequence
from typing import Any

from .component.component import Component
from .values import Refusal
from .variables import BY_NAME, VARIABLES, Variable


class RefusedError(ValueError):
    """A value or a call that is refused.

    Args:
        message: in one sentence.
        variable: the name of the variable to be corrected; empty if it isn't a single one.
        value: the refused value.
        reason: the sentence without variable and value.
    """

    def __init__(
        self, message: str, variable: str = "", value: Any = None, reason: str = ""
    ) -> None:
        super().__init__(message)
        self.variable, self.value, self.reason = variable, value, reason


class Instance:
    """One instance with the clock, modes and outputs that an importer of the FMU sees.

    Its numbers are those of the FMU to the last bit. Methods raise `error`, with the arguments of a
    `RefusedError`, where the component refuses something.
    """

    error: Any = RefusedError

    def __init__(self) -> None:
        self._refusals: list[Refusal] = []
        self._component = Component(self._refusals.append)
        self._initial = self._component.snapshot()

    def default(self, name: str) -> float:
        """The start value of an input or parameter (SI units)."""
        return float(self._variable(name, "input", "parameter").start or 0.0)

    def start(self, **values: Any) -> None:
        """Begin a run at time 0 with these inputs and parameters (SI units; defaults otherwise)."""
        component = self._component
        component.restore(self._initial)
        component.enter_initialization()
        for name, value in values.items():
            row, value = self._variable(name, "input", "parameter"), float(value)
            if row.type == "Enumeration":
                if value != value // 1.0:
                    reason = "it must be a whole number, 1 or 2"
                    sentence = f"{name} = {value!r} is refused: {reason}"
                    raise self.error(sentence, name, value, reason)
                value = int(value)
            component.set_values([row.reference], [value], row.type)
        component.exit_initialization()
        self._check(True)

    def step(self, point: float, size: float) -> None:
        """Make a communication step of `size` s from `point`, s."""
        self._check(self._component.step(point, size))

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of Real outputs at this communication point, by name (SI units)."""
        references = [self._variable(name, "output").reference for name in names]
        # The list of values may be longer.
        values = dict(zip(names, self._component.reals(references)))
        self._check(True)
        return values

    def read_flag(self, name: str) -> bool:
        """Value of a Boolean output at this communication point."""
        (value,) = self._component.discretes([self._variable(name, "output").reference], "Boolean")
        return bool(value)

    def _variable(self, name: str, *causalities: str) -> Variable:
        row = BY_NAME.get(name)
        if row is not None and row.causality in causalities:
            return row
        known = ", ".join(row.name for row in VARIABLES if row.causality in causalities)
        raise self.error(f"there is no {' or '.join(causalities)} {name}: choose from {known}")

    def _check(self, accepted: bool) -> None:
        refusals = list(self._refusals)
        self._refusals.clear()
        if refusals or not accepted:
            sentence, variable, value, reason = refusals[0 if accepted else -1]
            raise self.error(sentence, variable, value, reason)
