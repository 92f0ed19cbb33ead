"""Common parts of the FMI adapters, and what keeps a thread's Python state."""

import threading  # it must not be first imported by a thread whose state is kept
from collections.abc import Callable
from typing import Any

from pythonfmu import Fmi2Slave

from .at_exit import prepare_process
from .messages import Messages

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


class Adapter(Fmi2Slave):
    """A slave around one component, of this `kind`, made with these arguments."""

    # Frequent calls are bound to the component in slots: pythonfmu resolves them by name each time,
    # and a slot is found without searching the instance's dictionary.
    __slots__ = (
        "_component", "_get_fmu_state", "_set_fmu_state", "_thread_state", "do_step", "set_real",
    )  # fmt: skip

    kind: type[Any]
    _thread_state: _ThreadState | None

    def __init__(self, *arguments: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        report = Messages(self.log_queue, kwargs, lambda: component.point)
        component = self._component = self.kind(*arguments, report)
        prepare_process(self.resources, f"linux64/{self.modelName}.so")
        self._thread_state = None
        self.do_step = component.step
        self.set_real = component.set_values
        self._get_fmu_state = component.snapshot
        self._set_fmu_state = component.restore

    # The library calls these by the class.

    @classmethod
    def _fmu_state_to_bytes(cls, state):
        return cls.kind.packed(state)

    @classmethod
    def _fmu_state_from_bytes(cls, data):
        return cls.kind.unpacked(data)

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        self._component.set_up(start_time)

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
