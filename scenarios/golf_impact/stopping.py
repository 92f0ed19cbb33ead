"""Ctrl-C, SIGTERM and SIGHUP end the process at once; nothing half-written is left.

No exception is raised, since one that passes through an FMU's code is fatal to it (pythonfmu). The
folder of all temporary files is removed; results are put in place while signals are held back.
"""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

#: Signals that request the end; a terminal, or a system shutting down, sends them to all processes.
SIGNALS = tuple(s for s in signal.Signals if s.name in ("SIGINT", "SIGTERM", "SIGHUP"))

_scratch = ""
_holding = 0
_requested = False


def listen() -> None:
    """Handle these signals from now on, except those that the caller ignores (nohup)."""
    for number in SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _end)


@contextmanager
def scratch_folder() -> Iterator[None]:
    """All temporary files of this process lie in one folder within the block; OSError: in none."""
    global _scratch
    # Not at the top: signals are handled before anything slow is imported.
    import tempfile

    before = tempfile.tempdir
    with tempfile.TemporaryDirectory(prefix="golf-impact-", ignore_cleanup_errors=True) as _scratch:
        tempfile.tempdir = _scratch
        try:
            yield
        finally:
            tempfile.tempdir = before


@contextmanager
def held() -> Iterator[Callable[[], bool]]:
    """Signals are handled at the end of this block; yields whether there was one, a function."""
    global _holding
    _holding += 1
    try:
        yield lambda: _requested
    finally:
        _holding -= 1
        if _requested:
            _end()


def _end(*_: object) -> None:
    global _requested
    _requested = True
    if _holding:
        return
    import shutil

    if _scratch:
        shutil.rmtree(_scratch, ignore_errors=True)
    # The line of a progress bar is cleared, and the cursor that it hid is shown.
    with suppress(OSError):
        clear = b"\r\x1b[2K\x1b[?25h" if os.isatty(2) else b""
        os.write(2, clear + b"Stopped; nothing half-written is left.\n")
    os._exit(130)
