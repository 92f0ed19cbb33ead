"""Avoids a new Python thread state at every call of a host that isn't Python.

A thread that Python didn't start has no thread state, so PyGILState_Ensure makes one at every FMI
call and PyGILState_Release drops it: that is ten times the cost of the call. While one more Ensure
is outstanding, the state stays.
"""

import threading  # before any hold: it must not be first imported by a thread that is held

_this_thread = threading.local()


class Hold:
    """Keeps the state of the thread that made this, until `release` in that very thread.

    Released elsewhere, or never, the state stays until Python ends: a few kilobytes. In a thread
    of Python's own all this is one number that goes up and down.

    The `threading` module waits, when Python ends, for the thread that first imported it. So the
    call of the host that imported it must be over before a hold is made: never make one while an
    instance is made.
    """

    __slots__ = ("_release", "_thread")

    def __init__(self) -> None:
        self._release = None
        try:
            import ctypes

            ensure = ctypes.pythonapi.PyGILState_Ensure
            release = ctypes.pythonapi.PyGILState_Release
        except (ImportError, AttributeError):
            # No ctypes in this Python, or its library is hidden: calls stay as slow as they are.
            return
        # The mark lives and dies with the thread state; a thread's number would be used again.
        self._thread = getattr(_this_thread, "mark", None)
        if self._thread is None:
            self._thread = _this_thread.mark = object()
        outer = ensure()
        self._release = lambda: release(outer)

    def release(self) -> None:
        """Release the thread state."""
        release, self._release = self._release, None
        if release is not None and getattr(_this_thread, "mark", None) is self._thread:
            release()

    __del__ = release
