"""What the faces for FMI 2.0 and 3.0 have alike; each brings the names of its own runtime."""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from .thread_state import Hold


def accessors(type_: str, made: Callable = lambda value: value) -> tuple[Callable, Callable]:
    """A slave's get_… and set_… for one type of the table; `made` is what the runtime wants."""

    def get(self, vrs):
        return [made(value) for value in self._component.discretes(vrs, type_)]

    def put(self, vrs, values):
        self._component.set_values(vrs, values, type_)

    return get, put


class Face:
    """A slave around one component."""

    _component: Any
    _hold: Hold | None = None

    def enter_initialization_mode(self):
        # Not earlier: see Hold.
        self._hold = Hold()
        self._component.enter_initialization()

    def exit_initialization_mode(self):
        self._component.exit_initialization()

    def terminate(self):
        self._component.terminate()
        if self._hold is not None:
            self._hold.release()

    get_boolean, set_boolean = accessors("Boolean")
    get_string, set_string = accessors("String", str)


def registered(
    rows: Iterable[Any], kinds: Mapping[str, Any], causality: Any, variability: Any, **initial: Any
) -> OrderedDict:
    """The table as a runtime knows variables: one set for all instances, which never change it.

    Args:
        rows: of the table.
        kinds: the runtime's classes by the table's types.
        causality: its enumeration of these.
        variability: likewise.
        initial: what it is told of a causality's variables.
    """
    variables = OrderedDict()
    for reference, row in enumerate(rows):
        changes = "continuous" if row.type == "Real" else "discrete"
        variables[reference] = variable = kinds[row.type](
            row.name,
            causality=causality[row.causality],
            variability=variability["fixed" if row.causality == "parameter" else changes],
            initial=initial.get(row.causality),
            description=row.description,
        )
        variable.value_reference = reference
    return variables
