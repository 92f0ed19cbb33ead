"""The end of pythonfmu's library: dropping its state in time, without keeping the library loaded.

The library holds its state in a static pointer. On Linux its `finalizePythonInterpreter`, which
drops that state, runs once more at the very end of the process, after the pointer's destructor, in
memory that has been freed: the process may die of "corrupted double-linked list", after all
results. State that was dropped earlier can't be dropped again.
"""

import os
import sys

from .interrupts import defer_interrupts

#: Attributes of `sys`, which all FMUs share: the path of the library that stays, and the library.
_KEEPER, _KEPT = "_golf_impact_keeper", "_golf_impact_kept"


def prepare_process(resources: str, library: str) -> None:
    """Drop the state of this FMU's library at once, or when the process ends; defer interrupts.

    Called while an instance is made, each time: that is when the library makes the state.

    The state does nothing unless this library has started Python: then it ends Python as well, and
    must stay until C's __cxa_atexit, which runs before any destructor. (Python's own atexit runs
    from there, when the state of other FMUs may be gone.) The library stays loaded, too: unloading
    it would end Python for all FMUs.

    Args:
        resources: the folder of that name in the extracted FMU.
        library: the path of the library in the folder binaries.
    """
    path = os.path.realpath(os.path.join(resources, "..", "binaries", library))
    try:
        import _ctypes
        import ctypes

        loaded = ctypes.PyDLL(path, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        drop = loaded.finalizePythonInterpreter
    except (AttributeError, ImportError, OSError):
        # Another system, another version of pythonfmu, or no ctypes: it ends as it always did.
        return
    # Only a process that isn't a Python program has no arguments of one. There the first of these
    # FMUs has started Python, unless the host has: then that FMU is kept for nothing.
    if sys.orig_argv or sys.__dict__.setdefault(_KEEPER, path) != path:
        drop()
        _ctypes.dlclose(loaded._handle)
    elif _KEPT not in sys.__dict__:
        sys.__dict__[_KEPT] = loaded
        ctypes.CDLL(None).__cxa_atexit(drop, None, None)
    defer_interrupts()
