"""Common parts of the FMI adapters, and what keeps a thread's Python state."""

import threading  # it must not be first imported by a thread whose state is kept
from collections.abc import Callable
from typing import Any

_this_thread = threading.local()


class _ThreadState:
    """Keeps the Python thread state of the thread that made this, until `release` in that thread.

    A thread that Python didn't start has no thread state, so PyGILState_Ensure makes one at every
    FMI call and PyGILState_Release drops it: that is ten times the cost of the call. While one more
    Ensure is outstanding, the state stays. Released elsewhere, or never, it stays until Python
    ends: a few kilobytes. In a thread of Python's own all this is one number that goes up and down.

    The `threading` module waits, when Python ends, for the thread that first imported it. So the
    call of the host that imported it must be over before one of these is made: never while an
    instance is made.
    """

    def __init__(self) -> None:
        self._release = None
        try:
            from ctypes import pythonapi

            ensure, release = pythonapi.PyGILState_Ensure, pythonapi.PyGILState_Release
        except (ImportError, AttributeError):
            # No ctypes in this Python, or its library is hidden: calls stay as slow as they are.
            return
        # The mark lives and dies with the thread state; a thread's number would be used again.
        self._mark = _this_thread.__dict__.setdefault("mark", object())
        outer = ensure()
        self._release = lambda: release(outer)

    def release(self) -> None:
        release, self._release = self._release, None
        if release and getattr(_this_thread, "mark", None) is self._mark:
            release()

    __del__ = release


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
    _thread_state: _ThreadState | None = None

    def enter_initialization_mode(self):
        # Not earlier: see _ThreadState.
        self._thread_state = _ThreadState()
        self._component.enter_initialization()

    def exit_initialization_mode(self):
        self._component.exit_initialization()

    def terminate(self):
        self._component.terminate()
        if self._thread_state is not None:
            self._thread_state.release()

    get_boolean, set_boolean = accessors("Boolean")
    get_string, set_string = accessors("String", str)
