"""Runs an FMU with nothing but ctypes and prints, as JSON, the modules that it has loaded.

    python imported.py FOLDER MODEL_IDENTIFIER GUID

A script of its own, in a process of its own: fmpy would load numpy before any FMU.
"""

from __future__ import annotations

import ctypes
import json
import sys
from pathlib import Path


class _Callbacks(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("log", "allocate", "free", "done", "host")]


def _library(folder: Path, identifier: str) -> ctypes.CDLL:
    name = f"win64/{identifier}.dll" if sys.platform == "win32" else f"linux64/{identifier}.so"
    return ctypes.PyDLL(str(folder / "binaries" / name))


def main(folder: Path, identifier: str, guid: str) -> list[str]:
    """One step of one run; the names of modules loaded by it."""
    before = set(sys.modules)
    fmu = _library(folder, identifier)

    @ctypes.CFUNCTYPE(None, ctypes.c_void_p)
    def ignore(_: int | None) -> None:
        pass

    address = ctypes.cast(ignore, ctypes.c_void_p).value
    callbacks = _Callbacks(address, address, address, address, None)
    fmu.fmi2Instantiate.restype = ctypes.c_void_p
    where = (folder / "resources").as_uri().encode()
    component = ctypes.c_void_p(
        fmu.fmi2Instantiate(b"impact", 1, guid.encode(), where, ctypes.byref(callbacks), 0, 0)
    )
    if not component:
        raise SystemExit("the FMU can't be instantiated")
    number = ctypes.c_double
    calls = [
        fmu.fmi2SetupExperiment(component, 0, number(0.0), number(0.0), 0, number(0.0)),
        fmu.fmi2EnterInitializationMode(component),
        fmu.fmi2ExitInitializationMode(component),
        fmu.fmi2DoStep(component, number(0.0), number(1e-3), 0),
    ]
    value, reference = number(), ctypes.c_uint(13)
    calls.append(fmu.fmi2GetReal(component, ctypes.byref(reference), 1, ctypes.byref(value)))
    loaded = sorted(set(sys.modules) - before)
    fmu.fmi2Terminate(component)
    fmu.fmi2FreeInstance(component)
    if any(calls):
        raise SystemExit(f"the FMU answered {calls}")
    return loaded


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]), *sys.argv[2:])))
