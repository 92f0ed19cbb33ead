"""An instance of ClubBallImpact in this process: the calls of an FMI importer, without an FMU."""

from collections.abc import Iterable, Sequence
from typing import Any

from .component.component import Component
from .variables import ALL_REFERENCES, VARIABLES


class RefusedError(ValueError):
    """What a component refuses, and why."""

    def __init__(self, sentence: str, variable: str = "", value: Any = None, reason: str = ""):
        super().__init__(sentence)
        self.variable, self.value, self.reason = variable, value, reason


class Instance:
    """One instance with the clock, modes and outputs that an importer of the FMU sees.

    Its numbers are those of the FMU to the last bit. Methods raise `error` where the component
    refuses something.
    """

    error: type[Exception] = RefusedError

    def __init__(self) -> None:
        self._messages: list[str] = []
        self._component = Component(self._messages.append)
        self._initial = self._component.snapshot()

    def default(self, name: str) -> float:
        """The start value of an input or parameter (SI units)."""
        return float(VARIABLES[ALL_REFERENCES[name]].start or 0.0)

    def start(self, **values: Any) -> None:
        """Begin a run at time 0 with these inputs and parameters (SI units; defaults otherwise)."""
        component = self._component
        component.restore(self._initial)
        component.enter_initialization()
        for name, value in values.items():
            reference = self._reference(name, ("input", "parameter"))
            kind, value = VARIABLES[reference].type, float(value)
            if kind == "Enumeration":
                if value != value // 1.0:
                    raise self.error(
                        f"{name} = {value!r} is refused: it must be a whole number, 1 or 2"
                    )
                value = int(value)
            component.set_values([reference], [value], kind)
        component.exit_initialization()
        self._check(True)

    def step(self, point: float, size: float) -> None:
        """Make a communication step of `size` s from `point`, s."""
        self._check(self._component.step(point, size))

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Values of Real outputs at this communication point, by name (SI units)."""
        references = [self._reference(name, ("output",)) for name in names]
        # The list of values may be longer.
        values = dict(zip(names, self._component.reals(references)))
        self._check(True)
        return values

    def read_flag(self, name: str) -> bool:
        """Value of a Boolean output at this communication point."""
        return bool(self._component.discretes([self._reference(name, ("output",))], "Boolean")[0])

    def _reference(self, name: str, causalities: Iterable[str]) -> int:
        reference = ALL_REFERENCES.get(name, len(VARIABLES))
        if reference < len(VARIABLES) and VARIABLES[reference].causality in causalities:
            return reference
        known = ", ".join(row.name for row in VARIABLES if row.causality in causalities)
        kind = " or ".join(causalities)
        raise self.error(f"there is no {kind} {name!r}: choose from {known}")

    def _check(self, accepted: bool) -> None:
        messages = list(self._messages)
        self._messages.clear()
        if messages or not accepted:
            raise self.error(messages[0 if accepted else -1])
