"""What the companions share: variables made from tables, and state."""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, ClassVar

from .. import codec
from ..modes import FmiComponent
from ..values import Refusal
from ..variables import Variable

#: It changes with the layout of a state.
_VERSION = "golf-impact companion 8"


class Companion(FmiComponent):
    """A component whose variables are its attributes.

    `_begin` uses the parameters, `_step` takes a step; both may return why they can't. `rows` are
    the fields of a `Variable`, of each variable; `report` is that of `FmiComponent`.
    """

    #: Attributes of the state beside the variables, and the classes in them.
    inside: ClassVar[tuple[str, ...]] = ()
    classes: ClassVar[tuple[type, ...]] = ()

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """The variables."""

    def __init__(self, rows: Iterable[tuple[Any, ...]], report: Callable[[Refusal], Any]) -> None:
        super().__init__(report)
        self._rows = {(row.type, row.reference): row for row in (Variable(*row) for row in rows)}
        modes = "_mode", "point", "_refused", "_illegal"
        self._state_names = (*modes, *self.inside, *(row.name for row in self._rows.values()))
        for row in self._rows.values():
            zero = 0.0 if row.type == "Real" else False
            setattr(self, row.name, zero if row.start is None else row.start)

    def _store(self, row: Variable, value: Any) -> None:
        # An equal value changes nothing, not even the sign of 0.
        if value != self._value(row):
            setattr(self, row.name, value)

    def _value(self, row: Variable) -> Any:
        return getattr(self, row.name)

    def discretes(self, references: list[int], type_: str) -> list[Any]:
        """Values of variables of this type."""
        rows = [(n, self._rows.get((type_, n))) for n in references]
        return [self._value(row) if row else self.unknown(n, type_) for n, row in rows]

    def values(self) -> dict[str, Any]:
        """Of all variables at this instant."""
        return {row.name: self._value(row) for row in self._rows.values()}

    def step(self, point: float, size: float) -> bool:
        """One communication step from the host's communication point on, both in s.

        Returns whether it was accepted; if not, a message says why, and nothing has changed.
        """
        try:
            problem = self._why_not(point, size) or self._step(point, size)
        except (ArithmeticError, ValueError) as error:
            problem = Refusal(f"this step can't be computed: {error}")
        if problem is not None:
            return self._discard(problem)
        self.point, self._point_is_free = point + size, False
        return True

    def _step(self, point: float, size: float) -> Refusal | None:
        raise NotImplementedError

    def snapshot(self) -> dict[str, Any]:
        """Everything, for `restore` in any instance of this process."""
        return {name: getattr(self, name) for name in self._state_names}

    def restore(self, state: dict[str, Any] | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if not isinstance(state, dict) or tuple(state) != self._state_names:
            self._refuse_call("FOREIGN_STATE")
            return
        for name, value in state.items():
            setattr(self, name, value)
        self._point_is_free = True

    @staticmethod
    def packed(state: dict[str, Any] | None) -> bytes:
        """A snapshot as bytes, for another process; motions are computed again there."""
        return codec.packed(_VERSION, state) if state else b""

    @classmethod
    def unpacked(cls, data: bytes) -> dict[str, Any] | None:
        """The snapshot that became these bytes, or None if they are none of a companion's."""
        found: dict[str, Any] | None = codec.unpacked(_VERSION, data, (Refusal, *cls.classes))
        return found
