"""FMI 2.0 calls as lines of text, and a player that makes them through fmpy's low level.

The C host tests/native_host/replay.c reads the same lines, so that one sequence can be played in
both and looked at by a person. A line is a call, the slots of what it acts on, and its arguments:

    new I                    make an instance          free I          end it
    setup I START            enter I, exit I, end I, reset I
    set I TYPE REF=VALUE ... get I TYPE REF ...        (TYPE: real, integer, boolean, string)
    step I POINT SIZE
    save I S                 state slot S              restore I S, drop I S
    pack I S B               state into bytes slot B   unpack I B S
    fill B HEX               fill a bytes slot         show B           print it
    extra I NAME             a call that pythonfmu doesn't support
    log I ON                 switch logging

Every line is answered by one: the status, then the values (numbers as C's %a).
"""

import sys
from ctypes import byref, c_double, c_int, c_size_t, create_string_buffer
from pathlib import Path

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2FMUstate,
    fmi2Status,
    fmi2String,
    fmi2ValueReference,
)

OK, WARNING, DISCARD, ERROR, FATAL = range(5)

_TYPES = {
    "real": ("Real", c_double),
    "integer": ("Integer", c_int),
    "boolean": ("Boolean", c_int),
    "string": ("String", fmi2String),
}

#: Calls without arguments.
_SIMPLE = {
    "enter": "enterInitializationMode",
    "exit": "exitInitializationMode",
    "end": "terminate",
    "reset": "reset",
}


def written(value):
    """A value as it stands in a line."""
    if isinstance(value, float):
        return value.hex()
    return value.decode() if isinstance(value, bytes) else str(value)


class Player:
    """Makes the calls of lines in instances of one extracted FMU.

    Args:
        folder: the extracted FMU.
        trace: a binary file, unbuffered, that each line is written to before its call and its
            answer after: what is left of it after a crash ends with the call that did it.
    """

    def __init__(self, folder, trace=None):
        self._folder = Path(folder).resolve()
        self._description = fmpy.read_model_description(str(folder))
        self._trace = trace
        self._slaves = {}
        self._states = {}
        self._bytes = {}
        self.messages = []

        def log(environment, instance, status, category, message):
            self.messages.append(message.decode())

        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(log)
        self._callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        self._callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)

    def play(self, *words):
        """Make one call: (status, values)."""
        words = [written(word) for word in words]
        self._note(" ".join(words))
        call, *rest = words
        try:
            if call in _SIMPLE:
                status, values = OK, getattr(self._slaves[rest[0]], _SIMPLE[call])() or []
            else:
                status, values = OK, getattr(self, f"_{call}")(*rest) or []
        except FMICallException as error:
            status, values = error.status, []
        self._note(" ".join(("=", str(status), *map(written, values))))
        return status, values

    def _note(self, text):
        if self._trace is not None:
            self._trace.write((text + "\n").encode())

    def state_bytes(self, slot):
        """What a bytes slot holds."""
        return self._bytes[str(slot)]

    def _new(self, i):
        slave = FMU2Slave(
            guid=self._description.guid,
            unzipDirectory=str(self._folder),
            modelIdentifier=self._description.coSimulation.modelIdentifier,
            instanceName=f"instance {i}",
        )
        slave.instantiate(callbacks=self._callbacks, loggingOn=True)
        self._slaves[i] = slave

    def _free(self, i):
        self._slaves.pop(i).freeInstance()

    def _setup(self, i, start):
        self._slaves[i].setupExperiment(startTime=_number(start))

    def _set(self, i, type_, *pairs):
        name, ctype = _TYPES[type_]
        slave, n = self._slaves[i], len(pairs)
        pairs = [pair.split("=", 1) for pair in pairs]
        convert = {"real": _number, "string": str.encode}.get(type_, int)
        references = (fmi2ValueReference * n)(*(int(reference) for reference, _ in pairs))
        values = (ctype * n)(*(convert(value) for _, value in pairs))
        getattr(slave, f"fmi2Set{name}")(slave.component, references, n, values)

    def _get(self, i, type_, *references):
        name, ctype = _TYPES[type_]
        slave, n = self._slaves[i], len(references)
        values = (ctype * n)()
        references = (fmi2ValueReference * n)(*map(int, references))
        getattr(slave, f"fmi2Get{name}")(slave.component, references, n, values)
        return list(values)

    def _step(self, i, point, size):
        self._slaves[i].doStep(_number(point), _number(size))

    def _save(self, i, s):
        state = fmi2FMUstate()
        slave = self._slaves[i]
        slave.fmi2GetFMUstate(slave.component, byref(state))
        self._states[s] = state

    def _restore(self, i, s):
        self._slaves[i].setFMUstate(self._states[s])

    def _drop(self, i, s):
        self._slaves[i].freeFMUstate(self._states.pop(s))

    def _pack(self, i, s, b):
        slave, state, size = self._slaves[i], self._states[s], c_size_t()
        slave.fmi2SerializedFMUstateSize(slave.component, state, byref(size))
        data = create_string_buffer(size.value)
        slave.fmi2SerializeFMUstate(slave.component, state, data, size)
        self._bytes[b] = data.raw

    def _unpack(self, i, b, s):
        self._states[s] = self._slaves[i].deSerializeFMUstate(self._bytes[b])

    def _fill(self, b, data=""):
        self._bytes[b] = bytes.fromhex(data)

    def _show(self, b):
        return [self._bytes[b].hex()]

    def _extra(self, i, name):
        slave = self._slaves[i]
        references = (fmi2ValueReference * 1)(0)
        values = (c_double * 1)(1.0)
        of_inputs = (references, 1, (c_int * 1)(1), values)
        getattr(slave, f"fmi2{name}")(
            slave.component,
            *{
                "CancelStep": (),
                "GetStatus": (0, byref(fmi2Status())),
                "GetIntegerStatus": (0, byref(c_int())),
                "GetBooleanStatus": (3, byref(c_int())),
                "GetStringStatus": (1, byref(fmi2String())),
                "SetRealInputDerivatives": of_inputs,
                "GetRealOutputDerivatives": of_inputs,
                "GetDirectionalDerivative": (references, 1, references, 1, values, values),
            }[name],
        )

    def _log(self, i, on):
        self._slaves[i].setDebugLogging(int(on), ["logAll", "", "no such category"])


#: What `extra` may name.
EXTRA = (
    "CancelStep",
    "GetStatus",
    "GetIntegerStatus",
    "GetBooleanStatus",
    "GetStringStatus",
    "SetRealInputDerivatives",
    "GetRealOutputDerivatives",
    "GetDirectionalDerivative",
)


def _number(text):
    return float(text) if text.strip("+-")[:1] in "ni" else float.fromhex(text)


def _replay(folder):
    player = Player(folder)
    for line in sys.stdin:
        print(line.strip(), *player.play(*line.split()), *player.messages, flush=True)
        player.messages.clear()


if __name__ == "__main__":
    # python fmi2_calls.py FOLDER < calls: a sequence again, call by call.
    _replay(sys.argv[1])
