"""Instances of FMUs by fmpy, for tests that make the FMI calls themselves."""

import json
import math
from binascii import crc32
from functools import cache

import fmpy
from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave, fmi3Float64

#: A host reads a description once.
_described = cache(lambda folder: fmpy.read_model_description(folder, validate=False))


def make_instance(folder, name="one", kind=None, **options):
    """Instantiate an extracted FMU for co-simulation, or as `kind`.

    Returns:
        The instance, with `references` by variable name, value references `reals` and `flags`, and
        the logger's `messages`.
    """
    description = _described(str(folder))
    fmi3 = description.fmiVersion == "3.0"
    slave = (kind or (FMU3Slave if fmi3 else FMU2Slave))(
        guid=description.guid,
        unzipDirectory=str(folder),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName=name,
    )
    variables = description.modelVariables
    slave.references = {v.name: v.valueReference for v in variables}
    slave.reals = [v.valueReference for v in variables if v.type in ("Real", "Float64")]
    slave.flags = [v.valueReference for v in variables if v.type == "Boolean"]
    real, integer = ("Float64", "Int64") if fmi3 else ("Real", "Integer")
    slave.get_reals, slave.set_reals = getattr(slave, f"get{real}"), getattr(slave, f"set{real}")
    slave.set_integers = getattr(slave, f"set{integer}")
    slave.messages = []
    if fmi3:
        options["logMessage"] = lambda *words: slave.messages.append(words[-1].decode())
    slave.instantiate(**options)
    return slave


def logging_to(log):
    """FMI 2.0's callbacks with a logger, a function of status and message."""
    callbacks = fmi2CallbackFunctions.from_buffer_copy(defaultCallbacks)
    callbacks.logger = fmi2CallbackLoggerTYPE(
        lambda environment, name, status, category, message: log(status, message.decode())
    )
    return callbacks


def begin(slave, start=0.0, **values):
    """From instantiation to stepping."""
    if isinstance(slave, FMU2Slave):
        slave.setupExperiment(startTime=start)
        slave.enterInitializationMode()
    else:
        slave.enterInitializationMode(startTime=start)
    put(slave, **values)
    slave.exitInitializationMode()
    return slave


def put(slave, **values):
    for name, value in values.items():
        if isinstance(value, bool):
            set_ = slave.setBoolean
        else:
            set_ = slave.set_integers if name == "law" else slave.set_reals
        set_([slave.references[name]], [value])


def get(slave, *names):
    return slave.get_reals([slave.references[name] for name in names])


def get_all(slave):
    """All real and all Boolean variables."""
    return slave.get_reals(slave.reals), slave.getBoolean(slave.flags)


def place(model, time, *states):
    """Set time and continuous states of an instance for Model Exchange."""
    model.setTime(time)
    model.setContinuousStates((fmi3Float64 * 4)(*states), 4)


def vector(get, size=4):
    """What a function of FMI 3.0 writes into an array."""
    array = (fmi3Float64 * size)()
    get(array, size)
    return list(array)


def solve_by_scipy(model, stop, method, **tolerances):
    """Model Exchange of a club at 35 m/s from touch at 0 s to separation, or until `stop`, s."""
    from scipy.integrate import solve_ivp

    def slope(t, y):
        place(model, t, *y)
        return vector(model.getContinuousStateDerivatives)

    def separation(t, y):
        place(model, t, *y)
        return vector(model.getEventIndicators, 2)[1]

    separation.terminal = True
    model.updateDiscreteStates()
    start = [0.0, 0.0, 35.0, 0.0]
    run = solve_ivp(slope, (0.0, stop), start, method, events=separation, **tolerances)
    place(model, run.t[-1], *run.y[:, -1])
    return run


def discard(*slaves):
    for slave in slaves:
        slave.terminate()
        slave.freeInstance()


def with_checksum(body):
    """A state from its JSON without the end."""
    return body + f", {crc32(body)}]".encode()


def mutated(rng, state):
    """A state that no FMU has made: one item anywhere in it is removed or replaced."""
    content = json.loads(state)[:-1]
    places = [(content, key) for key in range(len(content))]
    for container, key in places:
        inner = container[key]
        keys = range(len(inner)) if isinstance(inner, list) else inner
        places += [(inner, one) for one in keys] if isinstance(inner, list | dict) else []
    container, key = rng.choice(places)
    others = [None, True, "x", 0, 7, -1.5, 1e308, math.nan, -math.inf, [], {}, [1.0], 10**400]
    if rng.random() < 0.2:
        del container[key]
    else:
        container[key] = rng.choice(others)
    return with_checksum(json.dumps(content).encode()[:-1])
