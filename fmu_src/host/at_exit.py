"""What a process with pythonfmu's library needs: a clean end, and interrupts that can wait.

The library keeps its own state in a static pointer. On Linux its `finalizePythonInterpreter` drops
that state a second time at the very end of the process, after the pointer's destructor, in memory
that has been freed: the process may die of "corrupted double-linked list", after all results. State
that is dropped earlier can't be dropped again.
"""

import os
from functools import cache

from .interrupts import defer_interrupts


def prepare_process(resources: str, library: str) -> None:
    """Drop the state of this FMU's library when the process ends, and defer interrupts.

    Args:
        resources: the folder of that name in the extracted FMU.
        library: the path of the library in the folder binaries.
    """
    if _release_at_exit(os.path.join(resources, "..", "binaries", library)):
        defer_interrupts()


@cache
def _release_at_exit(path: str) -> bool:
    """Register the release with C's __cxa_atexit, once; returns whether the library is pythonfmu's.

    Python's atexit runs too late in a process with several FMUs that isn't Python. There the FMU
    that started Python finalizes it from its destructor, when the pointers of the others may be
    gone.
    """
    try:
        import ctypes

        # This handle is never closed: the library must be there when the process ends.
        loaded = ctypes.CDLL(path, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        release = loaded.finalizePythonInterpreter
        register = ctypes.CDLL(None).__cxa_atexit
    except (AttributeError, ImportError, OSError):
        # Another system, another version of pythonfmu, or no ctypes: it ends as it always did.
        return False
    register(release, None, None)
    return True
