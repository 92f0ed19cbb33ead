"""A host that is a Python of any version, with nothing but its standard library.

usage: python python_host.py FOLDER GUID SMASH_FACTOR BALL_VELOCITY    (the last two: references)

Prints both values, and how many private Pythons are in the process.
"""

import ctypes
import sys
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p

folder, guid = sys.argv[1:3]
references = (c_uint * 2)(*map(int, sys.argv[3:]))
LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
ALLOCATE = ctypes.CFUNCTYPE(c_void_p, c_size_t, c_size_t)
FREE = ctypes.CFUNCTYPE(None, c_void_p)


class Callbacks(ctypes.Structure):
    _fields_ = [
        ("logger", LOGGER),
        ("allocate", c_void_p),
        ("free", c_void_p),
        ("step_finished", c_void_p),
        ("environment", c_void_p),
    ]


fmu = ctypes.CDLL(folder + "/binaries/linux64/ClubBallImpact.so")
fmu.fmi2Instantiate.restype = c_void_p
fmu.fmi2Instantiate.argtypes = [
    *(c_char_p, c_int, c_char_p, c_char_p, POINTER(Callbacks), c_int, c_int)
]
callbacks = Callbacks(LOGGER(lambda *words: None))
place = ("file://" + folder + "/resources").encode()
component = c_void_p(fmu.fmi2Instantiate(b"one", 1, guid.encode(), place, byref(callbacks), 0, 0))
assert component
assert fmu.fmi2SetupExperiment(component, 0, c_double(0), c_double(0), 0, c_double(0)) == 0
assert fmu.fmi2EnterInitializationMode(component) == 0
assert fmu.fmi2ExitInitializationMode(component) == 0
for n in range(50):
    assert fmu.fmi2DoStep(component, c_double(n * 1e-4), c_double(1e-4), 1) == 0
values = (c_double * 2)()
assert fmu.fmi2GetReal(component, references, c_size_t(2), values) == 0
assert fmu.fmi2Terminate(component) == 0
fmu.fmi2FreeInstance(component)
with open("/proc/self/maps") as maps:
    libraries = {line.split(None, 5)[-1] for line in maps if "/golf-python-" in line}
print(repr(values[0]), repr(values[1]), len(libraries))
