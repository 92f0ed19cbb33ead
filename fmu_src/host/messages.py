"""Messages of a slave: for the host's logger, and on stderr where pythonfmu drops them."""

import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from pythonfmu.enums import Fmi2Status
from pythonfmu.logmsg import LogMsg

#: Offset of `debugLogging_` in pythonfmu 0.7's PyLogger (src/pythonfmu/Logger.hpp): it comes after
#: the pointer to the virtual functions.
_DEBUG_LOGGING = 8


class Messages:
    """Reports refusals: called with one, it queues its text for the runtime.

    pythonfmu 0.7 drops all messages unless the host has switched debug logging on, and no host does
    by default: a refused start value would end in unexplained results. So while logging is off
    a message is written to stderr, once: not again while the same refusal stands.

    Args:
        queue: the slave's `log_queue`.
        options: the slave's keyword arguments. pythonfmu gives the address of its logger there;
            without one all messages reach the host.
        now: anything that changes when a step is accepted: then no refusal stands any more.
    """

    def __init__(self, queue: list, options: dict[str, Any], now: Callable[[], Any]) -> None:
        self._queue, self._now = queue, now
        self._name, self._logger = options["instance_name"], options.get("logger")
        self._written: list[str] = []
        self._written_at: Any = None

    def __call__(self, message: Any) -> None:
        text = str(message)
        status = Fmi2Status[message.status.lower()]
        self._queue.append(LogMsg(status, f"logStatus{message.status}", text))
        if self._logger is None:
            return
        # Not above: a host's Python may lack it.
        from ctypes import c_bool

        if c_bool.from_address(self._logger + _DEBUG_LOGGING).value:
            return
        now = self._now()
        if now != self._written_at:
            self._written, self._written_at = [], now
        # A message that contains an earlier one only adds refused steps or other refused values.
        if not any(written in text for written in self._written):
            self._written.append(text)
            # A host may have none, or a closed one.
            with suppress(AttributeError, OSError, ValueError):
                sys.stderr.write(f"{self._name}: {text}\n")
                sys.stderr.flush()
