"""Ctrl-C, SIGTERM and SIGHUP end the process at once; nothing half-written is left.

No exception is raised: one that passes through an FMU's code is fatal to it (pythonfmu), and what
would free the instance afterwards may crash. Instead all temporary files lie in one folder, which
is removed, and results are put in place while signals are held back.
"""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress

#: What requests the end: a terminal and a system that shuts down send them to all processes.
SIGNALS = tuple(one for one in signal.Signals if one.name in ("SIGINT", "SIGTERM", "SIGHUP"))

_scratch = ""
_holding = 0
_requested = False


def listen() -> None:
    """Handle these signals from now on, but for those that the caller ignores (nohup)."""
    for number in SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _handle)


@contextmanager
def scratch_folder() -> Iterator[None]:
    """All temporary files of this process and its children lie in one folder within the block.

    It is removed at the end. OSError: it can't be made.
    """
    global _scratch
    # Not at the top: signals are handled before anything slow is imported.
    import tempfile

    before, variables = tempfile.tempdir, dict(os.environ)
    _scratch = tempfile.mkdtemp(prefix="golf-impact-run-")
    tempfile.tempdir = os.environ["TMPDIR"] = _scratch
    try:
        yield
    finally:
        _remove_scratch()
        tempfile.tempdir = before
        os.environ.pop("TMPDIR")
        os.environ.update(variables)


def _remove_scratch() -> None:
    import shutil

    if _scratch:
        shutil.rmtree(_scratch, ignore_errors=True)


@contextmanager
def held() -> Iterator[None]:
    """Signals are handled at the end of this block: keep it short, or check `is_requested`."""
    global _holding
    _holding += 1
    try:
        yield
    finally:
        _holding -= 1
        if _requested:
            _handle()


def is_requested() -> bool:
    """Whether there was a signal, which is held back."""
    return _requested


def _handle(*_: object) -> None:
    global _requested
    _requested = True
    if _holding:
        return
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    _remove_scratch()
    # The line of a progress bar is cleared, and the cursor that it hid is shown.
    with suppress(OSError):
        clear = b"\r\x1b[2K\x1b[?25h" if os.isatty(2) else b""
        os.write(2, clear + b"Stopped; nothing half-written is left.\n")
    os._exit(130)
