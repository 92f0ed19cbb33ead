"""A clean end of the process for pythonfmu's library; the companion FMUs have this file, too.

The library keeps its own state in a static pointer and drops it when it is unloaded. On Linux
nothing unloads it before the very end of the process: after the pointer's destructor, in memory
that has been freed. Now and then the process died of "corrupted double-linked list" then, after all
results. What is dropped before, when Python ends, can't be dropped again.
"""

import atexit
import os

#: Libraries that have been seen to.
_known: set[str] = set()


def release_at_exit(resources: str, library: str) -> None:
    """Let the library of this FMU drop its own state when Python ends.

    Args:
        resources: the folder of that name in the extracted FMU.
        library: the path of the library in the folder binaries.
    """
    path = os.path.join(resources, "..", "binaries", library)
    if path in _known:
        return
    _known.add(path)
    try:
        import ctypes

        loaded = ctypes.CDLL(path, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
        release = loaded.finalizePythonInterpreter
    except (AttributeError, ImportError, OSError):
        # Another system, another version of pythonfmu, or no ctypes: it ends as it always did.
        return
    release.argtypes, release.restype = (), None
    atexit.register(release)
