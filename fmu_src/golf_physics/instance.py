"""Instances in this process: the calls of an FMI importer, without an FMU."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from .component.component import Component
from .variables import VARIABLES


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

    Its numbers are those of the FMU to the last bit. Methods raise `error` where the component
    refuses something.

    Args:
        kind: makes the component from a function that takes its refusals; by default
            ClubBallImpact.
        rows: its variables.
    """

    error: Any = RefusedError

    def __init__(
        self, kind: Callable[[Callable], Any] = Component, rows: Iterable[Any] = VARIABLES
    ) -> None:
        self._refusals: list[Any] = []
        self._rows = {row.name: row for row in rows}
        self._component = kind(self._refusals.append)
        self._initial = self._component.snapshot()

    def default(self, name: str) -> float:
        """The start value of an input or parameter (SI units)."""
        return float(self._rows[name].start or 0.0)

    def start(self, **values: Any) -> None:
        """Begin a run at time 0 with these inputs and parameters (SI units; defaults otherwise)."""
        component = self._component
        # Those of a start that ended early, at a name or a law that doesn't exist.
        self._refusals.clear()
        component.restore(self._initial)
        component.enter_initialization()
        for name, value in values.items():
            reference = self._reference(name, ("input", "parameter"))
            kind, value = self._rows[name].type, float(value)
            if kind == "Enumeration":
                if value != value // 1.0:
                    why = "it must be a whole number, 1 or 2"
                    raise self.error(f"{name} = {value!r} is refused: {why}", name, value, why)
                value = int(value)
            component.set_values([reference], [bool(value) if kind == "Boolean" else value], kind)
        component.exit_initialization()
        self._check(True)

    def step(self, point: float, size: float) -> None:
        """Make a communication step of `size` s from `point`, s."""
        self._check(self._component.step(point, size))

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of Real outputs at this communication point, by name (SI units)."""
        references = [self._reference(name, ("output",), "Real") for name in names]
        # The list of values may be longer.
        values = dict(zip(names, self._component.reals(references)))
        self._check(True)
        return values

    def read_flag(self, name: str) -> bool:
        """Value of a Boolean output at this communication point."""
        reference = self._reference(name, ("output",), "Boolean")
        return bool(self._component.discretes([reference], "Boolean")[0])

    def _reference(self, name: str, causalities: Iterable[str], type_: str = "") -> int:
        def fits(row: Any) -> bool:
            return row.causality in causalities and type_ in ("", row.type)

        row = self._rows.get(name)
        if row is not None and fits(row):
            return row.reference
        known = ", ".join(n for n, one in self._rows.items() if fits(one))
        kind = " or ".join(causalities)
        other = f" of type {type_}" if row is not None and row.causality in causalities else ""
        raise self.error(f"there is no {kind} {name!r}{other}: choose from {known}")

    def _check(self, accepted: bool) -> None:
        refusals = list(self._refusals)
        self._refusals.clear()
        if refusals or not accepted:
            refusal = refusals[0 if accepted else -1]
            raise self.error(*refusal)
