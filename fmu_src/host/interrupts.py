"""Ctrl-C in a host that is a Python: KeyboardInterrupt in the host, never inside the FMU.

Python runs its signal handler between two bytecodes, which may be those of a slave. pythonfmu takes
the KeyboardInterrupt of a slave for a fatal error, and the host crashes when it frees the instance.
"""

import re
import threading
from contextlib import suppress

#: Modules of these FMUs: each has the digest of its build in its name.
_ours = re.compile(r"\w+_[0-9a-f]{16}(\.|$)")

#: s until the next attempt: some hundred calls.
_AGAIN = 1e-3


def defer_interrupts() -> None:
    """Let Ctrl-C wait until the call into the FMU is over.

    Takes the place of Python's own handler of SIGINT and does the same outside the FMU. It does
    nothing where a host has a handler of its own, and in threads that can't set one.
    """
    try:
        from _thread import interrupt_main
        from signal import SIGINT, default_int_handler, getsignal, signal
    except ImportError:
        return
    if getsignal(SIGINT) is not default_int_handler:
        return

    def handle(number, frame):
        caller = frame
        while caller is not None:
            if _ours.match(caller.f_globals.get("__name__", "")):
                # Raised again in this thread, it would be handled within this very call.
                again = threading.Timer(_AGAIN, interrupt_main)
                again.daemon = True
                again.start()
                return
            caller = caller.f_back
        default_int_handler(number, frame)

    with suppress(ValueError):
        signal(SIGINT, handle)
