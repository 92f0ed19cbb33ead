"""FMUs by fmpy, call by call: instances of any of ours, in both versions of FMI.

What an instance of fmpy lacks is here: calls by the names of variables, and its messages. Programs
of tests use it, too, without golf_impact.
"""

import ctypes
import platform
import sys
from functools import cache

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    defaultCallbacks,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.fmi3 import FMU3Slave

#: A host reads a description once.
_described = cache(lambda folder: fmpy.read_model_description(folder, validate=False))


def make_instance(folder, name="one", kind=None, **options):
    """Instantiate an extracted FMU for co-simulation, or as `kind`.

    Each call of a native one fails that raises a floating-point exception.

    Returns:
        The instance, with `variables` by name, value references `reals` and `flags`, and the
        logger's `messages`: of FMI 2.0 only with `loggingOn`.
    """
    description = _described(str(folder))
    fmi3 = description.fmiVersion == "3.0"
    slave = (kind or (FMU3Slave if fmi3 else FMU2Slave))(
        guid=description.guid,
        unzipDirectory=str(folder),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName=name,
    )
    slave.description = description
    slave.variables = {v.name: v for v in description.modelVariables}
    # As fmpy's functions are called.
    slave.types = {
        name: "Int64" if v.type == "Enumeration" else v.type for name, v in slave.variables.items()
    }
    slave.references = {v.name: v.valueReference for v in description.modelVariables}
    slave.real = "Float64" if fmi3 else "Real"
    slave.reals, slave.flags = (
        [slave.references[name] for name, of_type in slave.types.items() if of_type == wanted]
        for wanted in (slave.real, "Boolean")
    )
    slave.get_reals = getattr(slave, f"get{slave.real}")
    slave.messages = []
    if fmi3:
        options.setdefault("logMessage", lambda *words: slave.messages.append(words[-1].decode()))
    elif options.get("loggingOn"):
        options.setdefault("callbacks", logging_to(lambda *words: slave.messages.append(words[1])))
    is_native = "(native)" in description.generationTool
    if is_native and (sys.platform, platform.machine()) == ("linux", "x86_64"):
        _watch(slave)
    slave.instantiate(**options)
    return slave


#: FE_INVALID, FE_DIVBYZERO and FE_OVERFLOW of x86-64.
_EXCEPTIONS = 0x1 | 0x4 | 0x8


def _watch(slave):
    """Let each call fail that raises a floating-point exception: a host may trap them."""
    libm, call = ctypes.PyDLL("libm.so.6"), slave._call
    clear, raised = libm.feclearexcept, libm.fetestexcept

    def watched(name, *arguments):
        clear(_EXCEPTIONS)
        try:
            return call(name, *arguments)
        finally:
            if raised(_EXCEPTIONS):
                raise FloatingPointError(f"{name} {arguments}")

    slave._call = watched


def logging_to(log):
    """FMI 2.0's callbacks with a logger, a function of status, message, category."""
    callbacks = fmi2CallbackFunctions.from_buffer_copy(defaultCallbacks)
    callbacks.logger = fmi2CallbackLoggerTYPE(
        lambda _, name, status, category, text: log(status, text.decode(), category)
    )
    return callbacks


def begin(slave, start=0.0, **values):
    """From instantiation to stepping."""
    initialize(slave, start, **values)
    slave.exitInitializationMode()
    return slave


def initialize(slave, start=0.0, stop=None, **values):
    """From instantiation into initialization mode."""
    times = {"startTime": start, "stopTime": stop}
    if slave.real == "Real":
        slave.setupExperiment(**times)
        slave.enterInitializationMode()
    else:
        slave.enterInitializationMode(**times)
    put(slave, **values)


def put(slave, **values):
    """Set variables, those of one type by one call."""
    for of_type, names in _by_type(slave, values):
        references = [slave.references[name] for name in names]
        getattr(slave, f"set{of_type}")(references, [values[name] for name in names])


def read(slave):
    """All variables by name."""
    found = {}
    for of_type, names in _by_type(slave, slave.types):
        values = getattr(slave, f"get{of_type}")([slave.references[name] for name in names])
        found |= dict(zip(names, values))
    return found


def _by_type(slave, names):
    for of_type in dict.fromkeys(slave.types[name] for name in names):
        yield of_type, [name for name in names if slave.types[name] == of_type]


def get(slave, *names):
    """Values of floating point variables."""
    return slave.get_reals([slave.references[name] for name in names])


def is_set(slave, name):
    """Whether a Boolean variable is true."""
    return bool(slave.getBoolean([slave.references[name]])[0])


def step_status(slave, point, size):
    """What doStep returns: OK, or an error's number."""
    try:
        slave.doStep(point, size)
    except FMICallException as error:
        return error.status
    return 0


def call_state(slave, what, *arguments):
    """Get, set, free, serialize or deserialize a state, which FMI 2.0 and 3.0 spell in two ways."""
    if slave.real == "Real":
        return getattr(slave, f"{what.replace('des', 'deS')}FMUstate")(*arguments)
    return getattr(slave, f"{what}FMUState")(*arguments)


def packed(slave):
    """The state of an instance as bytes."""
    state = call_state(slave, "get")
    data = bytes(call_state(slave, "serialize", state))
    call_state(slave, "free", state)
    return data


def saved(slave, as_bytes=False):
    """Its state, through bytes if asked for."""
    if as_bytes:
        return call_state(slave, "deserialize", packed(slave))
    return call_state(slave, "get")


def restore_packed(slave, data):
    """Restore a state from bytes; what the native FMU refuses is an exception."""
    state = call_state(slave, "deserialize", data)
    call_state(slave, "set", state)
    call_state(slave, "free", state)


def discard(*slaves):
    for slave in slaves:
        slave.terminate()
        slave.freeInstance()
