"""FMI calls in any order, legal or not: a hypothesis state machine, and the rules it checks by.

    python call_order.py FOLDER TRACE EXAMPLES STEPS SEED

A script, so that a crash doesn't end pytest; FOLDER is an extracted FMU of any of ours, SEED 0: at
random. The rules are those of the interface (modes, ranges, refusals), the same for all FMUs, and
have no physics: the expected numbers are those of a second instance, driven by the accepted calls
alone. Equal means equal to the last bit.

Every call is written to TRACE before it is made, its result after it: what is left after a crash
ends with the call that did it, and hosts/native_host/replay.c makes those of FMI 2.0 again. A line
is a call, the slots of what it acts on, and its arguments:

    new I                    make an instance          free I          end it
    setup I START            enter I, exit I, end I, reset I
    set I TYPE REF=VALUE ... get I TYPE REF ...        (TYPE: real, integer, boolean, string)
    step I POINT SIZE
    save I S                 state slot S              restore I S, drop I S
    pack I S B               state into bytes slot B   unpack I B S
    fill B HEX               fill a bytes slot         show B          print it (replay.c only)
    extra I NAME             a call that isn't supported
    log I ON                 switch logging

The result of each is one line: the status, then the values (numbers as C's %a).
"""

import copy
import json
import math
import sys
from collections import Counter
from ctypes import byref, c_double, c_int
from dataclasses import dataclass, field

import hypothesis.strategies as st
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Status, fmi2String, fmi2ValueReference
from fmus import call_state, make_instance
from golf_physics.variables import MORE_VARIABLES, VARIABLES
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule, run_state_machine_as_test

from golf_build.system import COMPANIONS

OK, DISCARD, ERROR = 0, 2, 3
INSTANTIATED, INITIALIZATION, BLOCKED, STEPPING, TERMINATED = range(5)

#: Slot of the instance that is driven by the accepted calls only.
FRESH = "fresh"

#: Types of the calls, by that of the table, and what FMI 3.0 calls them.
TYPES = {"Real": "real", "UInt64": "uint64", "Enumeration": "integer", "Boolean": "boolean"}
CALLED_BY_FMI3 = {"real": "Float64", "integer": "Int64"}

_reference, _order, _value = (fmi2ValueReference * 1)(0), (c_int * 1)(1), (c_double * 1)(1.0)

#: What `extra` may name, of FMI 2.0, and the arguments.
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

#: By model: values of inputs and parameters, so few that some come twice, by which impacts and
#: companions have no reason to refuse a step, but for values that conflict.
USUAL = {
    "ClubBallImpact": {
        "k": (1e6, 8e5, 3e6, 2e4), "b": (9.0, 0.0, 40.0, 700.0, 2e4),
        "club_speed": (35.0, 50.0, 1.0, 0.0, -5.0), "m_club": (0.21, 0.2, 0.046),
        "m_ball": (0.04593, 0.3), "ball_diameter": (0.04267, 0.05),
        "ball_speed": (0.0, 3.0, -20.0), "gap": (0.0, 0.001, 0.02, 1.0), "law": (1, 2),
        "exponent": (1.0, 1.5, 1.615544, 3.0), "reference_compression": (0.005, 0.001),
        "restitution_at_rest": (0.0, 0.86), "restitution_slope": (0.0, 0.0029),
    },
    "Swing": {
        "impulse": (0.0, 0.05, 1.0), "gravity": (9.806, 9.0), "club_mass": (0.3, 0.31),
        "spin_loft": (0.0, 0.2), "prescribed_speed": (0.0, 40.0),
    },
    "Launch": {
        "separated": (False, True), "ball_velocity": (0.0, 50.0, 60.0),
        "coefficient_of_restitution": (0.0, 0.8), "club_velocity": (0.0, 20.0),
        "smash_factor": (0.0, 1.4), "dynamic_loft": (0.2, 0.5), "friction": (0.4, 0.3),
    },
    "BallFlight": {
        "separated": (False, True), "ball_velocity": (0.0, 50.0, 70.0), "launch_angle": (0.2, 0.0),
        "touch_time": (0.0, 1e-3), "wind_speed": (0.0, 5.0), "gravity": (9.80665, 9.0),
    },
}  # fmt: skip

#: What hosts set at every step: the first ones above.
INPUTS = {"ClubBallImpact": 3, "Swing": 1, "Launch": 3, "BallFlight": 3}

#: A longer step (s) of a swing is refused until the ball is hit; the clock's 32 digits don't reach
#: far below a contact after years.
LONGEST = {"Swing": 0.1}
LONG = 1e3


def conflict(v):
    """Whether values of an impact, by name, can't begin a run."""
    return v.get("law") == 1 and (v["exponent"] != 1.0 or v["restitution_at_rest"] > 0.0)


def launches_backwards(v):
    """Whether a launch has reason to refuse a step."""
    return (
        v.get("separated", False)
        and "coefficient_of_restitution" in v
        and not (v["coefficient_of_restitution"] > 0.0 and v["ball_velocity"] > v["club_velocity"])
    )


def to_word(value):
    """A value as it stands in a line; (reference, value) as REF=VALUE."""
    if isinstance(value, tuple):
        return "=".join(map(to_word, value))
    if isinstance(value, float):
        return value.hex()
    return value.decode() if isinstance(value, bytes) else str(value)


@dataclass
class Model:
    """The expected state of an instance.

    Attributes:
        values: of inputs and parameters, by value reference.
        refused: names of what must be corrected before the next step.
        once: whether the next step is refused for a call that nothing can correct.
        anchored: whether no state has been restored since the last step.
        begun: (start time, values) with which stepping began, or None.
        steps: the accepted ones since then: (point, size, inputs, whether the point jumped).
        wild: after values that may leave the range of a double: then any refusal is right, and
            only crashes are errors (tests/numbers checks the numbers).
    """

    values: dict
    mode: int = INSTANTIATED
    refused: set = field(default_factory=set)
    once: bool = False
    start_time: float = 0.0
    point: float = 0.0
    anchored: bool = True
    begun: tuple | None = None
    steps: tuple = ()
    wild: bool = False


class Session:
    """Makes calls in instances of one FMU, keeps a model of each, and compares.

    Args:
        folder: the extracted FMU.
        trace: a binary file, unbuffered, for the calls and their results.
    """

    def __init__(self, folder, trace=None):
        self._folder, self._trace = folder, trace
        self._slaves, self._memory, self._start_times, self.data = {}, {}, {}, {}
        self.models, self.states, self.bytes, self.counts = {}, {}, {}, Counter()
        self.is_native = False
        self.ok("new", FRESH)
        description = self._slaves[FRESH].description
        self.name, self.fmi3 = description.modelName, description.fmiVersion == "3.0"
        #: The native FMU returns Error for an illegal call.
        self.is_native = "(native)" in description.generationTool
        self.usual = USUAL[self.name]
        self.inputs = tuple(self.usual)[: INPUTS[self.name]]
        rows = VARIABLES + MORE_VARIABLES[not self.fmi3 :] * self.is_native
        if self.name in COMPANIONS:
            rows = COMPANIONS[self.name].tables["rows"]
        self.variables = {row.reference: row._replace(type=TYPES[row.type]) for row in rows}
        self.names = {row.name: row.reference for row in rows}
        self.by_type = {
            of_type: [r for r, v in self.variables.items() if v.type == of_type]
            for of_type in ("real", "integer", "boolean")
        }
        self._start = {r: v.start for r, v in self.variables.items() if v.start is not None}
        self._inputs = [r for r, v in self.variables.items() if v.causality == "input"]
        moving = [row.name for row in rows if (row.causality, row.type) == ("output", "Real")]
        #: What hosts read at every step.
        self.moving = [self.names[name] for name in moving[:5]]

    # Calls

    def play(self, *words):
        """Make a call that may be refused, but never end in Fatal: (status, values)."""
        self.counts["calls"] += 1
        self._note(*words)
        status, values = OK, []
        try:
            values = self._make(*words)
        except FMICallException as error:
            status = error.status
        self._note("=", status, *values)
        may_fail = self.is_native or words[0] in ("extra", "exit")
        assert status in ((OK, DISCARD, ERROR) if may_fail else (OK, DISCARD)), (words, status)
        return status, values

    def _note(self, *words):
        if self._trace is not None:
            self._trace.write((" ".join(map(to_word, words)) + "\n").encode())

    def _make(self, call, i, *arguments):
        slave, memory, values = self._slaves.get(i), self._memory, []
        match call, *arguments:
            case ["new"]:
                self._start_times.pop(i, None)
                self._slaves[i] = make_instance(self._folder, f"instance {i}", loggingOn=True)
            case ["free"]:
                self._slaves.pop(i).freeInstance()
            case ["exit"]:
                slave.exitInitializationMode()
            case ["end"]:
                slave.terminate()
            case ["reset"]:
                self._start_times.pop(i, None)
                slave.reset()
            case "setup", start:
                if self.fmi3:
                    self._start_times[i] = start
                else:
                    slave.setupExperiment(startTime=start)
            case ["enter"]:
                start = {"startTime": self._start_times.get(i, 0.0)} if self.fmi3 else {}
                slave.enterInitializationMode(**start)
            case "set", of_type, *pairs:
                columns = ([pair[n] for pair in pairs] for n in (0, 1))
                getattr(slave, f"set{self._called(of_type)}")(*columns)
            case "get", of_type, *references:
                values = getattr(slave, f"get{self._called(of_type)}")(references)
            case "step", point, size:
                slave.doStep(point, size)
            case "save", s:
                memory[s] = call_state(slave, "get")
            case "restore", s:
                call_state(slave, "set", memory[s])
            case "drop", s:
                call_state(slave, "free", memory.pop(s))
            case "pack", s, b:
                self.data[b] = bytes(call_state(slave, "serialize", memory[s]))
            case "unpack", b, s:
                memory[s] = call_state(slave, "deserialize", self.data[b])
            case "fill", data:
                self.data[i] = bytes.fromhex(data)
            case "extra", name:
                getattr(slave, f"fmi2{name}")(slave.component, *EXTRA[name])
            case "log", on:
                slave.setDebugLogging(on, ["logAll", "", "no such category"])
            case _:
                raise ValueError(f"{call} is no call")
        return values

    def _called(self, of_type):
        return (CALLED_BY_FMI3 if self.fmi3 else {}).get(of_type, of_type.title())

    def ok(self, *words):
        """Make a call whose status is always OK; its values."""
        status, values = self.play(*words)
        assert status == OK, f"{words}: status {status}"
        return values

    def call(self, is_legal, *words):
        """Make a call that is legal or not; its values."""
        status, values = self.play(*words)
        illegal = ERROR if self.is_native else OK
        assert status == (OK if is_legal else illegal), f"{words}: status {status}"
        return values

    # Life

    def new(self, i, call="new"):
        self.ok(call, i)
        self.models[i] = Model(dict(self._start))

    def reset(self, i):
        self.new(i, "reset")

    def free(self, i):
        self.ok("free", i)
        del self.models[i]

    def setup(self, i, start):
        """In FMI 3.0 the start time is an argument of "enter"."""
        model = self.models[i]
        legal = model.mode == INSTANTIATED
        if self.fmi3 and not (legal and math.isfinite(start)):
            return
        self.call(legal, "setup", i, start)
        if not legal:
            model.once = True
        elif not math.isfinite(start):
            model.refused.add("start time")
        else:
            model.refused.discard("start time")
            model.start_time = model.point = start

    def enter(self, i):
        model = self.models[i]
        self.call(model.mode == INSTANTIATED, "enter", i)
        if model.mode == INSTANTIATED:
            model.mode = INITIALIZATION
        else:
            model.once = True

    def exit(self, i):
        status, _ = self.play("exit", i)
        model = self.models[i]
        if model.mode == INITIALIZATION:
            model.mode = BLOCKED
            begun = self._begin(model) and not model.refused
            # Error is the native FMU's. Which extreme values conflict isn't computed here.
            assert status == OK or (status == ERROR and (model.wild or not begun))
        else:
            assert status == (ERROR if self.is_native else OK)
            model.once = True

    def _begin(self, model):
        """Stepping begins if no parameter is refused and all of them agree."""
        v = self._by_name(model)
        fixed = v.keys() - {self.variables[r].name for r in self._inputs}
        if model.refused & fixed or conflict(v):
            return False
        model.wild = model.wild or not self._ordinary(v)
        model.mode = STEPPING
        model.begun = (model.start_time, dict(model.values))
        return True

    def _by_name(self, model):
        return {self.variables[r].name: value for r, value in model.values.items()}

    def _ordinary(self, v):
        """Whether physics has no reason to refuse these values."""
        start = {self.variables[r].name: value for r, value in self._start.items()}
        usual = all(x in (start[name], *self.usual.get(name, ())) for name, x in v.items())
        return usual and not launches_backwards(v)

    def end(self, i):
        self.ok("end", i)
        self.models[i].mode = TERMINATED

    # Values

    def set(self, i, of_type, pairs):
        """Set (reference, value) pairs."""
        model = self.models[i]
        legal = [self._set_one(model, of_type, reference, value) for reference, value in pairs]
        self.call(all(legal), "set", i, of_type, *pairs)

    def _set_one(self, model, of_type, reference, value):
        """Whether the call is legal: a value out of range is."""
        variable = self.variables.get(reference)
        settable = reference in model.values and variable.type == of_type
        if not settable or model.mode == TERMINATED:
            model.once = True
            return False
        if not variable.low <= value <= variable.high:
            model.refused.add(variable.name)
        elif value == model.values[reference]:
            model.refused.discard(variable.name)
        elif reference not in self._inputs and model.mode == STEPPING:
            model.refused.add(variable.name)
            return False
        else:
            model.refused.discard(variable.name)
            model.values[reference] = value
        return True

    def get(self, i, of_type, references):
        """Read, and compare with the fresh instance."""
        model = self.models[i]
        known = all(r in self.by_type.get(of_type, ()) for r in references)
        found = self.call(known, "get", i, of_type, *references)
        model.once = model.once or not known
        if not known:
            return
        for reference, value in zip(references, found, strict=True):
            assert reference not in model.values or value == model.values[reference]
        if not model.wild:
            self._replay(model)
            expected = self.ok("get", FRESH, of_type, *references)
            assert repr(found) == repr(expected), (references, found, expected, model)

    def step(self, i, point, size):
        """One communication step: its status must be the one that the model expects."""
        status, _ = self.play("step", i, point, size)
        model = self.models[i]
        refused, jumped = self._expected(model, point, size)
        # The limits of physics near the largest and smallest doubles aren't computed here.
        ordinary = size <= LONGEST.get(self.name, 1e100) and self._ordinary(self._by_name(model))
        unknown = not refused and (model.wild or not ordinary)
        assert unknown or (status == DISCARD) == refused, f"{point!r}, {size!r}: {status}, {model}"
        self.counts["accepted steps" if status == OK else "refused steps"] += 1
        if status == OK:
            inputs = {r: model.values[r] for r in self._inputs}
            model.wild = model.wild or not ordinary or size > LONG
            model.steps = (*model.steps, (point, size, inputs, jumped))
            model.point = point + size
            model.anchored = True

    def _expected(self, model, point, size):
        """Whether this step must be refused, and whether its point jumps after a restore."""
        if model.mode == BLOCKED and not self._begin(model):
            return True, False
        if model.mode != STEPPING or not 0.0 < size <= 1e100:
            return True, False
        if model.refused or model.once:
            model.once = False
            return True, False
        error = point - model.point
        # How far a communication point may lie from where the last step ended.
        time = abs(model.point)
        allowed = min(1e-6 * max(size, time), size / 4)
        if not error or abs(error) <= max(allowed, 1e-15 * time):
            return False, False
        if model.anchored or not abs(point) <= 1e100:
            return True, False
        return False, True

    # State; None for what came from damaged bytes

    def save(self, i, s):
        self.ok("save", i, s)
        self.states[s] = copy.deepcopy(self.models[i])

    def restore(self, i, s):
        if s not in self.states:
            return
        self.ok("restore", i, s)
        if self.states[s] is None:
            self.models[i].once = True
        else:
            self.models[i] = copy.deepcopy(self.states[s])
            self.models[i].anchored = False

    def drop(self, i, s):
        self.ok("drop", i, s)
        del self.states[s]

    def pack(self, i, s, b):
        """Serialize a state; returns the bytes."""
        self.ok("pack", i, s, b)
        self.bytes[b] = copy.deepcopy(self.states[s])
        return self.data[b]

    def unpack(self, i, b, s):
        self.call(self.bytes[b] is not None, "unpack", i, b, s)
        if self.bytes[b] is not None or not self.is_native:
            self.states[s] = copy.deepcopy(self.bytes[b])

    def fill(self, b, data):
        self.ok("fill", b, data.hex())
        self.bytes[b] = None

    # Comparison

    def compare(self, i):
        """Every variable of an instance against the fresh one's, to the last bit."""
        model = self.models[i]
        if model.wild:
            self._read_all(i)
            return
        # Earlier reads at this point mustn't decide how it is evaluated.
        self._save_and_restore(i)
        model.anchored = False
        self._replay(model)
        self.counts["comparisons"] += 1
        found, expected = self._read_all(i), self._read_all(FRESH)
        different = {
            self.variables[r].name: (value, expected[r])
            for r, value in found.items()
            if repr(value) != repr(expected[r])
        }
        assert not different, (different, model)

    def _read_all(self, i):
        return {
            reference: value
            for of_type, references in self.by_type.items()
            for reference, value in zip(references, self.ok("get", i, of_type, *references))
        }

    def _save_and_restore(self, i):
        for call in ("save", "restore", "drop"):
            self.ok(call, i, "now")

    def _replay(self, model):
        """Drive the fresh instance by the accepted calls alone."""
        self.ok("reset", FRESH)
        self.ok("setup", FRESH, model.start_time)
        values = dict(self._start)
        if model.mode != INSTANTIATED and (model.begun or model.mode != TERMINATED):
            self.ok("enter", FRESH)
        if model.begun is not None:
            self._put(values, model.begun[1])
            self.ok("exit", FRESH)
        for point, size, inputs, jumped in model.steps:
            self._put(values, inputs)
            if jumped:
                self._save_and_restore(FRESH)
            self.ok("step", FRESH, point, size)
        self._put(values, model.values)
        if model.mode == BLOCKED:
            self.play("exit", FRESH)
        elif model.mode == TERMINATED:
            self.ok("end", FRESH)

    def _put(self, values, wanted):
        for reference, value in wanted.items():
            of_type = self.variables[reference].type
            if value == values[reference] == 0.0 and repr(value) != repr(values[reference]):
                # 0 and -0 are equal, so neither replaces the other.
                self.ok("set", FRESH, of_type, (reference, 1.0))
                values[reference] = 1.0
            if value != values[reference]:
                self.ok("set", FRESH, of_type, (reference, value))
                values[reference] = value

    def clear(self):
        """Free everything that a sequence has left; the next one begins in the trace."""
        for s in list(self.states):
            self.drop(FRESH, s)
        for i in list(self.models):
            self.free(i)
        self.bytes.clear()
        self.ok("fill", "new-sequence", "")


INSTANCES, STATES, BYTES = ("0", "1", "2"), ("0", "1", "2", "3"), ("0", "1")

ODD_NUMBERS = (
    math.nan, math.inf, -math.inf, -1.0, -0.0, 0.0, 5e-324, -5e-324, 2.2e-308, 1e-160, 1e160, 1e300,
    -1e300, 1.7976931348623157e308,
)  # fmt: skip
ODD = {"real": ODD_NUMBERS, "integer": (0, 3, -1, 2**31 - 1, -(2**31)), "boolean": (True, False)}

#: 2.5e-5 s: some 20 steps in contact.
SIZES = (2.5e-5, 2.5e-5, 2.5e-5, 1e-4, 3e-6, 1e-4 / 3.0, 1e-3, 1e-9, 1.0)
ODD_SIZES = (
    0.0, -0.0, -1e-4, math.nan, math.inf, -math.inf, 5e-324, 1e-200, 1e-15, 1e30, 1e100, 1e101,
)  # fmt: skip
ODD_SHIFTS = (0.0, 1e-7, -1e-7, 1e-3, -1.0, 5.0, 1e9, math.nan, math.inf, -math.inf)
ODD_REFERENCES = (35, 36, 1000, 2**31 - 1, 2**31, 2**32 - 2, 2**32 - 1)

types = st.sampled_from(("real", "integer", "boolean", "string"))
any_reference = st.one_of(st.integers(0, 34), st.sampled_from(ODD_REFERENCES))

session = None


class CallOrder(RuleBasedStateMachine):
    """Legal and illegal calls to a few instances, their states and states as bytes."""

    def __init__(self):
        super().__init__()
        session.clear()
        for i in INSTANCES[:2]:
            session.new(i)
        # One instance starts in stepping mode: otherwise few sequences would reach it.
        self.start("0", 0.0, {})

    def start(self, i, start, values):
        session.reset(i)
        session.setup(i, start)
        session.enter(i)
        for name, value in values.items():
            self.put(i, name, value)
        session.exit(i)

    def put(self, i, name, value):
        reference = session.names[name]
        session.set(i, session.variables[reference].type, [(reference, value)])

    def any_instance(self, data, label="instance"):
        return data.draw(st.sampled_from(sorted(session.models)), label)

    def any_state(self, data):
        return data.draw(st.sampled_from(sorted(session.states)), "state")

    def correct(self, i):
        """Correct everything that was refused."""
        model = session.models[i]
        for name in sorted(model.refused - {"start time"}):
            self.put(i, name, model.values[session.names[name]])
        if model.once:
            session.step(i, model.point, 1e-5)

    def step_and_read(self, i, size, number, read=True):
        for _ in range(number):
            session.step(i, session.models[i].point, size)
            if read:
                session.get(i, "real", session.moving)

    def usual(self, data, names):
        """A variable among these and a value of it."""
        name = data.draw(st.sampled_from(tuple(names)), "name")
        return name, data.draw(st.sampled_from(session.usual[name]), "value")

    # Life

    @rule(i=st.sampled_from(INSTANCES))
    def new_or_free(self, i):
        if i not in session.models:
            session.new(i)
        elif len(session.models) > 1:
            session.free(i)

    @rule(data=st.data(), start=st.sampled_from((0.0, 0.0, 100.0, -3.0, 1e6)))
    def begin(self, data, start):
        i = self.any_instance(data)
        optional = {name: st.sampled_from(values) for name, values in session.usual.items()}
        fixed = {"law": optional.pop("law")} if "law" in optional else {}
        values = data.draw(st.fixed_dictionaries(fixed, optional=optional))
        if values.get("law") == 1:
            values |= {"exponent": 1.0, "restitution_at_rest": 0.0}
        self.start(i, start, values)
        # A touch at this very instant is decided by what is set now, even if it has been read.
        if data.draw(st.booleans(), "read"):
            session.get(i, "real", session.moving)
        if data.draw(st.booleans(), "set"):
            self.put(i, *self.usual(data, session.inputs[-1:]))
            session.step(i, session.models[i].point, 1e-4)

    @rule(data=st.data(), call=st.sampled_from(("enter", "exit", "end", "reset")))
    def change_mode(self, data, call):
        getattr(session, call)(self.any_instance(data))

    @rule(data=st.data(), start=st.sampled_from((0.0, 2.0, -1e300, math.nan, math.inf)))
    def setup(self, data, start):
        session.setup(self.any_instance(data), start)

    # Values

    @rule(data=st.data())
    def set_usual(self, data):
        names = (*session.usual, *session.inputs * 4)
        self.put(self.any_instance(data), *self.usual(data, names))

    @rule(data=st.data())
    def set_odd_and_back(self, data):
        i = self.any_instance(data)
        name, _ = self.usual(data, session.usual)
        reference = session.names[name]
        before = session.models[i].values[reference]
        odd = ODD[session.variables[reference].type]
        self.put(i, name, data.draw(st.sampled_from(odd)))
        if data.draw(st.booleans(), "step with it"):
            session.step(i, session.models[i].point, 1e-5)
        if data.draw(st.booleans(), "back"):
            self.put(i, name, before)

    @rule(data=st.data(), of_type=types)
    def set_anything(self, data, of_type):
        values = {
            "real": st.one_of(st.floats(), st.sampled_from(ODD_NUMBERS)),
            "integer": st.integers(-(2**31), 2**31 - 1),
            "boolean": st.integers(-2, 2),
            "string": st.sampled_from(("", "1", "µ%s%n")),
        }[of_type]
        pairs = st.lists(st.tuples(any_reference, values), max_size=4)
        session.set(self.any_instance(data), of_type, data.draw(pairs))

    @rule(data=st.data(), of_type=st.sampled_from(("real", "real", "integer", "boolean")))
    def get(self, data, of_type):
        known = session.by_type[of_type]
        some = st.lists(st.sampled_from(known), max_size=6) if known else st.just([])
        references = data.draw(st.one_of(st.just(known), some))
        session.get(self.any_instance(data), of_type, references)

    @rule(data=st.data(), of_type=types, references=st.lists(any_reference, max_size=4))
    def get_anything(self, data, of_type, references):
        session.get(self.any_instance(data), of_type, references)

    # Steps

    @rule(data=st.data(), size=st.sampled_from(SIZES), number=st.integers(1, 24))
    def steps(self, data, size, number):
        i = self.any_instance(data)
        if data.draw(st.booleans(), "corrected before"):
            self.correct(i)
        self.step_and_read(i, size, number, read=data.draw(st.booleans(), "read"))

    @rule(
        data=st.data(),
        size=st.one_of(*[st.sampled_from(SIZES)] * 3, st.sampled_from(ODD_SIZES), st.floats()),
        shift=st.sampled_from(ODD_SHIFTS),
    )
    def odd_step(self, data, size, shift):
        i = self.any_instance(data)
        shift = shift * size if abs(shift) <= 1e-7 else shift
        session.step(i, session.models[i].point + shift, size)

    # State

    @rule(data=st.data(), s=st.sampled_from(STATES))
    def save(self, data, s):
        i = self.any_instance(data)
        self.drop(data, s)
        session.save(i, s)

    def drop(self, data, s):
        if s in session.states:
            session.drop(self.any_instance(data, "freed by"), s)

    @precondition(lambda self: session.states)
    @rule(data=st.data())
    def restore(self, data):
        session.restore(self.any_instance(data), self.any_state(data))

    @rule(
        data=st.data(),
        before=st.integers(0, 6),
        after=st.integers(1, 6),
        odd=st.sampled_from(("nothing", "input", "bad input", "bad step", "reset")),
        number=st.integers(0, 5),
    )
    def rollback(self, data, before, after, odd, number):
        """As a host does that steps ahead, reading all the time."""
        i = self.any_instance(data)
        self.correct(i)
        if session.models[i].mode != STEPPING:
            law = {"law": data.draw(st.integers(1, 2), "law")} if "law" in session.names else {}
            self.start(i, 0.0, law)
        self.step_and_read(i, 2.5e-5, before)
        session.save(i, "rollback")
        self.step_and_read(i, 2.5e-5, after)
        if odd == "input":
            name = session.inputs[0]
            one, two, *_ = session.usual[name]
            same = session.models[i].values[session.names[name]] == two
            self.put(i, name, one if same else two)
        elif odd == "bad input":
            self.put(i, session.inputs[-1], math.nan)
        elif odd == "bad step":
            session.step(i, -1e9, 1e-5)
        elif odd == "reset":
            session.reset(i)
        session.restore(i, "rollback")
        session.drop(i, "rollback")
        session.get(i, "real", session.moving)
        self.step_and_read(i, 2.5e-5, number)
        session.compare(i)

    @precondition(lambda self: session.states)
    @rule(data=st.data(), b=st.sampled_from(BYTES), s=st.sampled_from(STATES))
    def through_bytes(self, data, b, s):
        old = self.any_state(data)
        session.pack(self.any_instance(data, "packed by"), old, b)
        self.drop(data, s)
        session.unpack(self.any_instance(data, "unpacked by"), b, s)

    @rule(data=st.data(), s=st.sampled_from(STATES))
    def damaged_bytes(self, data, s):
        """Cut or others: test_state.py has more kinds of damage."""
        i = self.any_instance(data)
        whole = session.pack(i, self.any_state(data), "0") if session.states else b""
        cut = st.integers(0, len(whole)).map(lambda n: whole[:n])
        damaged = data.draw(st.one_of(st.binary(max_size=40), cut), "bytes")
        if damaged == whole:
            return
        session.fill("0", damaged)
        self.drop(data, s)
        session.unpack(i, "0", s)
        session.restore(i, s)

    # Other calls

    @precondition(lambda self: not session.fmi3)
    @rule(data=st.data(), name=st.sampled_from(tuple(EXTRA)), on=st.integers(0, 1))
    def unsupported_calls_and_logging(self, data, name, on):
        i = self.any_instance(data)
        session.play("extra", i, name)
        session.ok("log", i, on)

    @rule(data=st.data())
    def recovery(self, data):
        """Once everything is corrected, the run goes on as if nothing had been refused."""
        i = self.any_instance(data)
        session.compare(i)
        self.correct(i)
        session.compare(i)
        session.step(i, session.models[i].point, 1e-5)
        session.compare(i)

    def teardown(self):
        for i in sorted(session.models):
            session.compare(i)


def main(folder, trace, examples, steps, chosen):
    global session
    with open(trace, "wb", buffering=0) as stream:
        session = Session(folder, stream)
        run_state_machine_as_test(
            seed(chosen)(CallOrder) if chosen else CallOrder,
            settings=settings(
                max_examples=examples,
                stateful_step_count=steps,
                deadline=None,
                database=None,
                derandomize=False,
                phases=(Phase.generate, Phase.shrink),
                suppress_health_check=list(HealthCheck),
                print_blob=False,
                report_multiple_bugs=False,
            ),
        )
        print(json.dumps(session.counts), flush=True)
        session.clear()
        session.play("free", FRESH)


if __name__ == "__main__":
    folder, trace, *numbers = sys.argv[1:]
    main(folder, trace, *map(int, numbers))
