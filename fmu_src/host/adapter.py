"""Common parts of the FMI adapters."""

from collections.abc import Callable
from typing import Any

from .thread_state import Hold


def accessors(type_: str, convert: Callable = lambda value: value) -> tuple[Callable, Callable]:
    """A slave's get_… and set_… for a type of the table; `convert` gives the runtime's type."""

    def get(self, vrs):
        return [convert(value) for value in self._component.discretes(vrs, type_)]

    def put(self, vrs, values):
        self._component.set_values(vrs, values, type_)

    return get, put


class Adapter:
    """A slave around one component."""

    _component: Any
    _hold: Hold | None = None

    def enter_initialization_mode(self):
        # Not earlier: see Hold.
        self._hold = Hold()
        self._component.enter_initialization()

    def exit_initialization_mode(self):
        # pythonfmu drops it; the standalone FMU's loader returns Error if it is false.
        return self._component.exit_initialization()

    def terminate(self):
        self._component.terminate()
        if self._hold is not None:
            self._hold.release()

    get_boolean, set_boolean = accessors("Boolean")
    get_string, set_string = accessors("String", str)
