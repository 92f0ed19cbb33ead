"""Ctrl-C in a host that is a Python: KeyboardInterrupt in the host, never inside the FMU.

Python runs its signal handler between two bytecodes, which may be those of a slave. pythonfmu takes
the KeyboardInterrupt of a slave for a fatal error, and the host crashes when it frees the instance.
"""

import re
import threading
from _thread import interrupt_main
from contextlib import suppress
from signal import SIGINT, default_int_handler, getsignal, signal

#: Modules of these FMUs: each has the digest of its build in its name.
_ours = re.compile(r"\w+_[0-9a-f]{16}(\.|$)")

#: s until the next attempt: some hundred calls.
_AGAIN = 1e-3


def defer_interrupts() -> None:
    """Let Ctrl-C wait until the call into the FMU is over.

    Takes the place of Python's own handler of SIGINT and does the same outside the FMU. It does
    nothing where a host has a handler of its own, and in threads that can't set one.
    """

    def handle(number, frame):
        caller = frame
        while caller and not _ours.match(caller.f_globals.get("__name__", "")):
            caller = caller.f_back
        if not caller:
            default_int_handler(number, frame)
        # Raised again in this thread, it would be handled within this very call.
        again = threading.Timer(_AGAIN, interrupt_main)
        again.daemon = True
        again.start()

    if getsignal(SIGINT) is default_int_handler:
        with suppress(ValueError):
            signal(SIGINT, handle)
