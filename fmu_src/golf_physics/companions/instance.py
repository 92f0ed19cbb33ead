"""An instance of a companion in this process: the calls of an FMI importer, without an FMU."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from ..instance import RefusedError
from .companion import Companion, Refusal, Variable


class CompanionInstance:
    """One instance with the methods of `golf_physics.instance.Instance`.

    Its numbers are those of the FMU to the last bit. Methods raise `error` where the component
    refuses something.

    Args:
        kind: the component's class.
        rows: its variables.
    """

    error: type[Exception] = RefusedError

    def __init__(
        self, kind: Callable[[Iterable[tuple], Callable], Companion], rows: Sequence[tuple]
    ) -> None:
        self._refusals: list[Refusal] = []
        self._component = kind(rows, self._refusals.append)
        self._initial = self._component.snapshot()
        self._variables = {row.name: row for row in (Variable(*row) for row in rows)}

    def default(self, name: str) -> float:
        """The start value of an input or parameter (SI units)."""
        return float(self._variables[name].start or 0.0)

    def start(self, **values: Any) -> None:
        """Begin a run at time 0 with these inputs and parameters (SI units; defaults otherwise)."""
        component = self._component
        component.restore(self._initial)
        component.enter_initialization()
        for name, value in values.items():
            row = self._variable(name, ("input", "parameter"))
            value = float(value) if row.type == "Real" else bool(value)
            component.set_values([row.reference], [value], row.type)
        component.exit_initialization()
        self._check(True)

    def step(self, point: float, size: float) -> None:
        """Make a communication step of `size` s from `point`, s."""
        self._check(self._component.step(point, size))

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of Real outputs at this communication point, by name (SI units)."""
        references = [self._variable(name, ("output",)).reference for name in names]
        return dict(zip(names, self._component.reals(references)))

    def read_flag(self, name: str) -> bool:
        """Value of a Boolean output at this communication point."""
        reference = self._variable(name, ("output",)).reference
        return bool(self._component.discretes([reference], "Boolean")[0])

    def _variable(self, name: str, causalities: Iterable[str]) -> Variable:
        row = self._variables.get(name)
        if row and row.causality in causalities:
            return row
        known = ", ".join(n for n, row in self._variables.items() if row.causality in causalities)
        kind = " or ".join(causalities)
        raise self.error(f"there is no {kind} {name!r}: choose from {known}")

    def _check(self, accepted: bool) -> None:
        refusals = list(self._refusals)
        self._refusals.clear()
        if refusals or not accepted:
            raise self.error(*refusals[0 if accepted else -1])
