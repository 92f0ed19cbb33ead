"""Random impacts in the native FMU's library and in the Python physics; a script, for sanitizers.

    python native_cases.py LIBRARY TOKEN KIND COUNT SEED

Inputs change in mid-contact, and states move on as bytes, to another instance. Prints as JSON how
many values were read, and those that differ in any bit; messages and statuses must be equal.
"""

import json
import sys
from ctypes import (
    CDLL,
    CFUNCTYPE,
    Structure,
    byref,
    c_char_p,
    c_double,
    c_int,
    c_size_t,
    c_uint,
    c_void_p,
    cast,
    create_string_buffer,
)
from random import Random

from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME, VARIABLES

REALS = [row for row in VARIABLES if row.causality == "output" and row.type == "Real"]
FLAGS = [row for row in VARIABLES if row.type == "Boolean"]
KINDS = ("linear", "heavy", "pushed", "power", "power pushed")

_Logger = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)


class _Callbacks(Structure):
    _fields_ = [(name, c_void_p) for name in ("logger", "allocate", "free", "finished", "owner")]


def _array(type_, values):
    return (type_ * len(values))(*values)


class Native:
    """An instance, by FMI 2.0's functions."""

    def __init__(self, library, token):
        self._fmi, self.messages = library, []
        self._log = _Logger(lambda *words: self.messages.append(words[-1].decode()))
        self._callbacks = _Callbacks(cast(self._log, c_void_p).value)
        library.fmi2Instantiate.restype = c_void_p
        made = library.fmi2Instantiate(b"one", 1, token, None, byref(self._callbacks), 0, 0)
        self._instance = c_void_p(made)

    def _call(self, name, *arguments):
        return getattr(self._fmi, f"fmi2{name}")(self._instance, *arguments)

    def start(self):
        self._call("Reset")
        self._call("SetupExperiment", 0, c_double(), c_double(), 0, c_double())
        self._call("EnterInitializationMode")

    def begin(self):
        return self._call("ExitInitializationMode") == 0

    def set(self, name, value):
        row = BY_NAME[name]
        type_, call = (c_double, "SetReal") if row.type == "Real" else (c_int, "SetInteger")
        self._call(call, _array(c_uint, [row.reference]), c_size_t(1), _array(type_, [value]))

    def step(self, point, size):
        return self._call("DoStep", c_double(point), c_double(size), 1) == 0

    def read(self):
        found = []
        for call, rows, type_ in (("GetReal", REALS, c_double), ("GetBoolean", FLAGS, c_int)):
            values = (type_ * len(rows))()
            references = _array(c_uint, [row.reference for row in rows])
            self._call(call, references, c_size_t(len(rows)), values)
            found += values
        return found

    def packed(self):
        state, size = c_void_p(), c_size_t()
        self._call("GetFMUstate", byref(state))
        self._call("SerializedFMUstateSize", state, byref(size))
        data = create_string_buffer(size.value)
        self._call("SerializeFMUstate", state, data, size)
        self._call("FreeFMUstate", byref(state))
        return data

    def restore(self, data):
        state = c_void_p()
        assert self._call("DeSerializeFMUstate", data, c_size_t(len(data)), byref(state)) == 0
        assert self._call("SetFMUstate", state) == 0
        self._call("FreeFMUstate", byref(state))


class Python:
    """The same calls of the Python physics."""

    def __init__(self):
        self.messages = []

    def start(self):
        self._component = Component(lambda refusal: self.messages.append(str(refusal)))
        self._component.set_up(0.0)
        self._component.enter_initialization()

    def begin(self):
        return self._component.exit_initialization()

    def set(self, name, value):
        row = BY_NAME[name]
        self._component.set_values([row.reference], [value], row.type)

    def step(self, point, size):
        return self._component.step(point, size)

    def read(self):
        reals = self._component.reals([row.reference for row in REALS])[: len(REALS)]
        flags = self._component.discretes([row.reference for row in FLAGS], "Boolean")
        return [*reals, *map(int, flags)]

    def pass_on(self):
        packed = Component.packed(self._component.snapshot())
        self._component.restore(Component.unpacked(packed))


def case(rng, kind):
    """Values of an impact, and how long it takes, s, more or less."""
    law = 2 if "power" in kind else rng.choice([1, 2])
    values = {
        "law": law,
        "k": rng.choice([rng.uniform(2e5, 3e6), 10 ** rng.uniform(3, 9)]),
        "m_club": rng.uniform(0.05, 0.5),
        "m_ball": rng.uniform(0.02, 0.1),
        "club_speed": rng.uniform(1, 70),
        "ball_speed": rng.choice([0.0, 0.0, rng.uniform(-20, 0.9)]),
        "gap": rng.choice([0.0, 0.0, rng.uniform(0, 0.01)]),
    }
    mu = values["m_club"] * values["m_ball"] / (values["m_club"] + values["m_ball"])
    omega = (values["k"] / mu) ** 0.5
    zeta = 10 ** rng.uniform(-1, 4) if kind == "heavy" else rng.uniform(0, 0.3 * law)
    values["b"] = 2 * rng.choice([0.0, zeta, zeta]) * mu * omega
    if law == 2 and rng.random() < 0.15:
        line = rng.uniform(0.3, 0.95), rng.uniform(0, 0.002)
        values["restitution_at_rest"], values["restitution_slope"] = line
    if "power" in kind:
        values["exponent"] = rng.choice([1.5, rng.uniform(1, 4), rng.uniform(1, 12)])
    if "pushed" in kind:
        values["club_force"] = rng.uniform(-3000, 3000)
    closing = values["club_speed"] - values["ball_speed"]
    return values, values["gap"] / closing + (6e-4 if "power" in kind else 4.0 / omega)


def changed(rng, kind, values):
    """Inputs that change together."""
    yield "k", values["k"] * rng.uniform(0.3, 3)
    if rng.random() < 0.5:
        yield "b", values["b"] * rng.uniform(0, 1.5)
    if "pushed" in kind:
        yield "club_force", rng.uniform(-2000, 2000)
    if rng.random() < 0.05:
        yield "club_speed", rng.uniform(1, 70)


def compare(library, token, kind, count, seed):
    """How many values were read, and those that differ: (case, name, native, Python)."""
    rng, read, different = Random(seed), 0, []
    native, other = Native(library, token), Native(library, token)
    python = Python()
    names = [row.name for row in (*REALS, *FLAGS)]
    for n in range(count):
        values, end = case(rng, kind)
        for one in (native, python):
            one.messages.clear()
            one.start()
            for name, value in values.items():
                one.set(name, value)
        assert native.begin() == python.begin(), values
        point, equal = 0.0, rng.choice([None, None, end / rng.choice([1, 2, 7, 50])])
        while point < end:
            size = equal or end * 10 ** rng.uniform(-3, -0.5)
            if rng.random() < 0.15:
                for name, value in changed(rng, kind, values):
                    native.set(name, value)
                    python.set(name, value)
            accepted = python.step(point, size)
            assert native.step(point, size) == accepted, (n, native.messages, python.messages)
            if not accepted:
                break
            point += size
            if rng.random() < 0.05:
                other.restore(native.packed())
                other.messages = native.messages
                native, other = other, native
                python.pass_on()
            if rng.random() < 0.5 or point >= end:
                found = native.read(), python.read()
                read += len(names)
                if repr(found[0]) != repr(found[1]):
                    rows = zip(names, *found)
                    different += [(n, *row) for row in rows if repr(row[1]) != repr(row[2])]
        assert native.messages == python.messages, values
    return read, different


if __name__ == "__main__":
    path, token, kind, count, seed = sys.argv[1:]
    print(json.dumps(compare(CDLL(path), token.encode(), kind, int(count), int(seed))))
