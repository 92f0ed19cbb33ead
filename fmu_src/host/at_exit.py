"""A clean end of the process for pythonfmu's library; the companion FMUs have this file, too.

The library keeps its own state in a static pointer. On Linux its `finalizePythonInterpreter` drops
that state a second time at the very end of the process, after the pointer's destructor, in memory
that has been freed: the process may die of "corrupted double-linked list", after all results. State
that is dropped earlier can't be dropped again.
"""

import os

#: Whether a library is pythonfmu's and registered, by its path.
_known: dict[str, bool] = {}


def release_at_exit(resources: str, library: str) -> bool:
    """Drop the state of this FMU's library when the process ends, before static destructors run.

    It is registered with C's __cxa_atexit: Python's atexit runs too late in a process with several
    FMUs that isn't Python. There the FMU that started Python finalizes it from its destructor, when
    the pointers of the others may be gone.

    Args:
        resources: the folder of that name in the extracted FMU.
        library: the path of the library in the folder binaries.

    Returns:
        Whether the library is pythonfmu's.
    """
    path = os.path.join(resources, "..", "binaries", library)
    if path not in _known:
        _known[path] = _register(path)
    return _known[path]


def _register(path: str) -> bool:
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
