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
from fmus import logging_to, make_instance

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
            values = self._make(call, *arguments)
        except FMICallException as error:
            status = error.status
        self._note("=", status, *values)
        return status, values

    def _note(self, *words):
        if self._trace is not None:
            self._trace.write((" ".join(map(to_word, words)) + "\n").encode())

    def _make(self, call, i, *arguments):
        slave, states, values = self._slaves.get(i), self._states, []
        match call, *arguments:
            case ["new"]:
                options = {"callbacks": self._callbacks, "loggingOn": True}
                self._slaves[i] = make_instance(self._folder, f"instance {i}", **options)
            case ["free"]:
                self._slaves.pop(i).freeInstance()
            case ["enter" | "exit" | "end" | "reset"]:
                getattr(slave, _SIMPLE[call])()
            case "setup", start:
                slave.setupExperiment(startTime=start)
            case "set", type_, *pairs:
                columns = ([pair[n] for pair in pairs] for n in (0, 1))
                getattr(slave, f"set{type_.title()}")(*columns)
            case "get", type_, *references:
                values = getattr(slave, f"get{type_.title()}")(references)
            case "step", point, size:
                slave.doStep(point, size)
            case "save", s:
                states[s] = slave.getFMUstate()
            case "restore", s:
                slave.setFMUstate(states[s])
            case "drop", s:
                slave.freeFMUstate(states.pop(s))
            case "pack", s, b:
                self.bytes[b] = slave.serializeFMUstate(states[s])
            case "unpack", b, s:
                states[s] = slave.deSerializeFMUstate(self.bytes[b])
            case "fill", data:
                self.bytes[i] = bytes.fromhex(data)
            case "extra", name:
                getattr(slave, f"fmi2{name}")(slave.component, *EXTRA[name])
            case "log", on:
                slave.setDebugLogging(on, ["logAll", "", "no such category"])
            case _:
                raise ValueError(f"{call} is no call")
        return values
