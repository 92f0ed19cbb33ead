"""Ctrl-C and SIGTERM end the process at once, from wherever it is, and leave nothing half-written.

No exception is raised: one that passes through an FMU's code is fatal to it (pythonfmu), and what
would free the instance afterwards may crash. Instead all that is temporary lies in one folder,
which is removed, and a result is put in its place while the signal is held back.
"""

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

#: What asks to stop: a terminal and a system's end send them to all processes.
SIGNALS = tuple(one for one in signal.Signals if one.name in ("SIGINT", "SIGTERM", "SIGHUP"))

_PREFIX = "golf-impact-run-"

#: s; a folder that is younger may not be locked yet by the process that made it.
_SETTLED = 60.0

_owner = 0
_base: str | None = None
_variable: str | None = None
_scratch: str | None = None
_lock = ExitStack()
_holding = 0
_asked = False


def listen() -> None:
    """Answer Ctrl-C, SIGTERM and SIGHUP from now on, but for those that the caller ignores."""
    global _owner
    _owner = os.getpid()
    for number in SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _stop)


def open_scratch() -> None:
    """Have all temporary files of this process and its children in one folder.

    Those of processes that were killed are removed. OSError: there is none for temporary files.
    """
    global _base, _scratch, _variable
    # Not at the top: signals are answered before anything slow is imported.
    import tempfile

    _base, _variable = tempfile.gettempdir(), os.environ.get("TMPDIR")
    _remove_left_behind(_base)
    with held():
        _scratch = tempfile.mkdtemp(prefix=_PREFIX)
        # Where folders can't be locked, none is taken for left behind either.
        with suppress(OSError):
            _lock.enter_context(locked(_scratch))
    tempfile.tempdir = os.environ["TMPDIR"] = _scratch


def close_scratch() -> None:
    """Remove that folder; temporary files go where they went before."""
    global _base, _scratch
    if _scratch is None or os.getpid() != _owner:
        return
    import shutil
    import tempfile

    tempfile.tempdir, _base = _base, None
    os.environ.pop("TMPDIR", None)
    if _variable is not None:
        os.environ["TMPDIR"] = _variable

    # A child that hasn't noticed yet may write into it once more.
    for _ in range(3):
        shutil.rmtree(_scratch, ignore_errors=True)
        if not os.path.exists(_scratch):
            break
    _scratch = None
    _lock.close()


def temporary_folder() -> str:
    """Where this system keeps temporary files."""
    import tempfile

    return _base or tempfile.gettempdir()


@contextmanager
def held() -> Iterator[None]:
    """Signals that come within this block are answered at its end; keep it short."""
    global _holding
    _holding += 1
    try:
        yield
    finally:
        _holding -= 1
        if _asked and not _holding:
            _leave()


@contextmanager
def locked(folder: str | os.PathLike[str], wait: bool = False) -> Iterator[None]:
    """A folder that no other process of ours locks within this block.

    One that has is waited for, or an OSError. A file system without locks gets none where that is
    waited for, Windows never.
    """
    if fcntl is None:
        yield
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | (0 if wait else os.O_NOFOLLOW))
    try:
        if wait:
            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX)
        else:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(handle)


def _stop(number: int, frame: object) -> None:
    global _asked
    _asked = True
    if not _holding:
        _leave()


def _leave() -> None:
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    if os.getpid() == _owner:
        close_scratch()
        # The line of a progress bar is cleared, and the cursor that it hid is shown.
        with suppress(OSError):
            bar = b"\r\x1b[2K\x1b[?25h" if os.isatty(2) else b""
            os.write(2, bar + b"Stopped; nothing half-written is left.\n")
    os._exit(130)


def _remove_left_behind(base: str) -> None:
    """Folders of processes that didn't come to remove them: nobody holds their lock any more."""
    if fcntl is None:
        return
    import glob
    import shutil
    import time

    for folder in glob.glob(os.path.join(glob.escape(base), f"{_PREFIX}*")):
        with suppress(OSError):
            about = os.lstat(folder)
            if about.st_uid == os.getuid() and time.time() - about.st_mtime >= _SETTLED:
                with locked(folder):
                    shutil.rmtree(folder, ignore_errors=True)
