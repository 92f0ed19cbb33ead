"""A player that makes FMI 2.0 calls through fmpy's low level and writes them as lines of text.

The C host native_host/replay.c reads these lines, so that one sequence can be played in both and
read by a person. A line is a call, the slots of what it acts on, and its arguments:

    new I                    make an instance          free I          end it
    setup I START            enter I, exit I, end I, reset I
    set I TYPE REF=VALUE ... get I TYPE REF ...        (TYPE: real, integer, boolean, string)
    step I POINT SIZE
    save I S                 state slot S              restore I S, drop I S
    pack I S B               state into bytes slot B   unpack I B S
    fill B HEX               fill a bytes slot         show B          print it (replay.c only)
    extra I NAME             a call that pythonfmu doesn't support
    log I ON                 switch logging

The result of each is one line: the status, then the values (numbers as C's %a).
"""

from ctypes import byref, c_double, c_int
from pathlib import Path

from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Status, fmi2String, fmi2ValueReference
from instances import logging_to, make_instance

OK, DISCARD, ERROR = 0, 2, 3

#: Calls without arguments.
_SIMPLE = {
    "enter": "enterInitializationMode",
    "exit": "exitInitializationMode",
    "end": "terminate",
    "reset": "reset",
}

_reference, _order, _value = (fmi2ValueReference * 1)(0), (c_int * 1)(1), (c_double * 1)(1.0)

#: What `extra` may name, and the arguments.
EXTRA = {
    "CancelStep": (),
    "GetStatus": (0, byref(fmi2Status())),
    "GetIntegerStatus": (0, byref(c_int())),
    "GetBooleanStatus": (3, byref(c_int())),
    "GetStringStatus": (1, byref(fmi2String())),
    "SetRealInputDerivatives": (_reference, 1, _order, _value),
    "GetRealOutputDerivatives": (_reference, 1, _order, _value),
    "GetDirectionalDerivative": (_reference, 1, _reference, 1, _value, _value),
}


def to_word(value):
    """A value as it stands in a line; (reference, value) as REF=VALUE."""
    if isinstance(value, tuple):
        return "=".join(map(to_word, value))
    if isinstance(value, float):
        return value.hex()
    return value.decode() if isinstance(value, bytes) else str(value)


class Player:
    """Makes calls in instances of one extracted FMU.

    Args:
        folder: the extracted FMU.
        trace: a binary file, unbuffered, that each line is written to before its call and the
            result after: what is left of it after a crash ends with the call that did it.
    """

    def __init__(self, folder, trace=None):
        self._folder = Path(folder).resolve()
        self._trace = trace
        self._slaves = {}
        self._states = {}
        self.bytes = {}
        self.messages = []

        self._callbacks = logging_to(lambda status, text: self.messages.append(text))

    def play(self, call, *arguments):
        """Make one call: (status, values)."""
        self._note(call, *arguments)
        status, values = OK, []
        try:
            if call in _SIMPLE:
                getattr(self._slaves[arguments[0]], _SIMPLE[call])()
            else:
                values = getattr(self, f"_{call}")(*arguments) or []
        except FMICallException as error:
            status = error.status
        self._note("=", status, *values)
        return status, values

    def _note(self, *words):
        if self._trace is not None:
            self._trace.write((" ".join(map(to_word, words)) + "\n").encode())

    def _new(self, i):
        options = {"callbacks": self._callbacks, "loggingOn": True}
        self._slaves[i] = make_instance(self._folder, f"instance {i}", **options)

    def _free(self, i):
        self._slaves.pop(i).freeInstance()

    def _setup(self, i, start):
        self._slaves[i].setupExperiment(startTime=start)

    def _set(self, i, type_, *pairs):
        references, values = [reference for reference, _ in pairs], [value for _, value in pairs]
        getattr(self._slaves[i], f"set{type_.title()}")(references, values)

    def _get(self, i, type_, *references):
        return getattr(self._slaves[i], f"get{type_.title()}")(references)

    def _step(self, i, point, size):
        self._slaves[i].doStep(point, size)

    def _save(self, i, s):
        self._states[s] = self._slaves[i].getFMUstate()

    def _restore(self, i, s):
        self._slaves[i].setFMUstate(self._states[s])

    def _drop(self, i, s):
        self._slaves[i].freeFMUstate(self._states.pop(s))

    def _pack(self, i, s, b):
        self.bytes[b] = self._slaves[i].serializeFMUstate(self._states[s])

    def _unpack(self, i, b, s):
        self._states[s] = self._slaves[i].deSerializeFMUstate(self.bytes[b])

    def _fill(self, b, data=""):
        self.bytes[b] = bytes.fromhex(data)

    def _extra(self, i, name):
        slave = self._slaves[i]
        getattr(slave, f"fmi2{name}")(slave.component, *EXTRA[name])

    def _log(self, i, on):
        self._slaves[i].setDebugLogging(on, ["logAll", "", "no such category"])
