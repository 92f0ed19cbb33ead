"""What the FMU must answer to any order of FMI calls, legal or not, and a session that checks it.

The model here knows only the rules of the interface (modes, ranges, refusals), no physics: the
numbers it expects are those of another instance of the FMU, made anew and driven by nothing but the
calls that were accepted. Equal means equal to the last bit.
"""

import copy
import math
import struct
from dataclasses import dataclass, field

import fmi2_calls
import fmpy
from fmi2_calls import DISCARD, ERROR, OK, WARNING

INSTANTIATED, INITIALIZATION, BLOCKED, STEPPING, TERMINATED = range(5)

#: Slot of the instance that is driven by the accepted calls only, and of its state.
_FRESH = "fresh"

#: s; the clock's 32 digits then reach far below those of a contact.
_LONG = 1e3

#: How far a communication point may lie from where the last step ended, relative to the step.
_POINT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Variable:
    """One row of modelDescription.xml."""

    reference: int
    name: str
    type: str
    causality: str
    start: float | int | None
    low: float
    high: float

    def allows(self, value):
        return self.low <= value <= self.high


#: Bounds that the XML can't say: it knows no open interval.
_ABOVE_ZERO = {"k", "m_club", "m_ball", "ball_diameter", "reference_compression"}
_LARGEST = 1.7976931348623157e308


def variables(folder):
    """The variables of an extracted FMU, by value reference."""
    rows = {}
    for v in fmpy.read_model_description(str(folder)).modelVariables:
        convert = int if v.type == "Integer" else float
        low = convert(v.min) if v.min is not None else -_LARGEST
        high = convert(v.max) if v.max is not None else _LARGEST
        if v.name in _ABOVE_ZERO:
            low = 5e-324
        start = convert(v.start) if v.start is not None and v.causality != "output" else None
        type_ = v.type.lower()
        rows[v.valueReference] = Variable(
            v.valueReference, v.name, type_, v.causality, start, low, high
        )
    return rows


@dataclass
class Model:
    """What an instance should be like.

    Attributes:
        values: of inputs and parameters, by value reference.
        refused: names of what must be corrected before the next step.
        once: whether the next step is refused for a call that nothing can correct.
        begun: (start time, values) with which stepping began, or None.
        steps: the accepted ones since then: (point, size, inputs, whether the point jumped).
        wild: after values that may leave the range of a double: it may refuse what it likes then,
            and is only asked for no crash (tests/test_values.py looks at its numbers).
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

    def copied(self):
        return copy.deepcopy(self)


class Session:
    """Plays calls, keeps a model of every instance, and compares.

    Args:
        folder: the extracted FMU.
        trace: see Player.
    """

    def __init__(self, folder, trace=None):
        self.variables = variables(folder)
        self.player = fmi2_calls.Player(folder, trace)
        self.inputs = [v.reference for v in self.variables.values() if v.causality == "input"]
        settable = [v for v in self.variables.values() if v.causality != "output"]
        self._start = {v.reference: v.start for v in settable}
        self.parameters = [r for r in self._start if r not in self.inputs]
        by_type = {"real": [], "integer": [], "boolean": []}
        for v in self.variables.values():
            by_type[v.type].append(v.reference)
        self._by_type = by_type
        names = {v.name: v.reference for v in self.variables.values()}
        self.names = names
        self.models = {}
        self.states = {}
        self.bytes = {}
        self.counts = {"calls": 0, "accepted steps": 0, "refused steps": 0, "comparisons": 0}
        self._play("new", _FRESH)

    def _play(self, *words):
        self.counts["calls"] += 1
        status, values = self.player.play(*words)
        assert status in (OK, WARNING, DISCARD) or (
            status == ERROR and words[0] in ("extra", "exit")
        ), f"{words}: status {status}, {self.player.messages[-1:]}"
        self.player.messages.clear()
        return status, values

    def _ok(self, *words):
        status, values = self._play(*words)
        assert status == OK, f"{words}: status {status}"
        return values

    # Life

    def new(self, i):
        self._ok("new", i)
        self.models[i] = Model(dict(self._start))

    def free(self, i):
        self._ok("free", i)
        del self.models[i]

    def reset(self, i):
        self._ok("reset", i)
        self.models[i] = Model(dict(self._start))

    def setup(self, i, start):
        self._ok("setup", i, start)
        model = self.models[i]
        if model.mode != INSTANTIATED:
            model.once = True
        elif not math.isfinite(start):
            model.refused.add("start time")
        else:
            model.refused.discard("start time")
            model.start_time = model.point = start

    def enter(self, i):
        self._ok("enter", i)
        model = self.models[i]
        if model.mode == INSTANTIATED:
            model.mode = INITIALIZATION
        else:
            model.once = True

    def exit(self, i):
        status, _ = self._play("exit", i)
        model = self.models[i]
        if model.mode == INITIALIZATION:
            model.mode = BLOCKED
            begun = self._begin(model) and not model.refused
            # Not from pythonfmu. Which extreme values are in conflict this model doesn't compute.
            assert status == OK or (status == ERROR and (model.wild or not begun))
        else:
            assert status == OK
            model.once = True

    def _begin(self, model):
        """Stepping begins if the parameters can stand together."""
        v = {name: model.values[r] for name, r in self.names.items() if r in model.values}
        # Two rules between variables; whether the rest stays a double only the FMU can tell.
        clash = v["law"] == 1 and (v["exponent"] != 1.0 or v["restitution_at_rest"] > 0.0)
        refused = any(self.variables[r].name in model.refused for r in self.parameters)
        if clash or refused or v["exponent"] > 12.0:
            return False
        model.wild = model.wild or not _ordinary(v)
        model.mode = STEPPING
        model.begun = (model.start_time, dict(model.values))
        return True

    def end(self, i):
        self._ok("end", i)
        self.models[i].mode = TERMINATED

    # Values

    def set(self, i, type_, pairs):
        """Set (reference, value) pairs."""
        self._ok("set", i, type_, *(f"{r}={fmi2_calls.written(value)}" for r, value in pairs))
        model = self.models[i]
        for reference, value in pairs:
            self._set_one(model, type_, reference, value)

    def _set_one(self, model, type_, reference, value):
        variable = self.variables.get(reference)
        settable = reference in model.values and variable.type == type_
        if not settable or model.mode == TERMINATED:
            model.once = True
        elif not variable.allows(value):
            model.refused.add(variable.name)
        elif value == model.values[reference]:
            model.refused.discard(variable.name)
        elif reference not in self.inputs and model.mode == STEPPING:
            model.refused.add(variable.name)
        else:
            model.refused.discard(variable.name)
            model.values[reference] = value

    def get(self, i, type_, references):
        """Read, and compare with the fresh instance."""
        answers = self._ok("get", i, type_, *references)
        model = self.models[i]
        known = [r in self.variables and self.variables[r].type == type_ for r in references]
        if not all(known):
            model.once = True
        for reference, good, value in zip(references, known, answers, strict=True):
            if not good:
                assert value in (0, b"0") or math.isnan(value)
            elif reference in model.values:
                assert value == model.values[reference]
        if not model.wild and all(known) and type_ != "string":
            self._replay(model)
            expected = self._ok("get", _FRESH, type_, *references)
            assert _same(answers, expected), (references, answers, expected, model)
        return answers

    def step(self, i, point, size):
        """One communication step: its status must be the one that the model expects."""
        status, _ = self._play("step", i, point, size)
        model = self.models[i]
        refused, jumped = self._expected(model, point, size)
        if refused:
            assert status == DISCARD, f"accepted: {point!r}, {size!r}, {model}"
        elif status == DISCARD:
            # Only what the model doesn't know may have spoken: physics at the ends of the doubles.
            assert model.wild or not self._usual(model), f"refused: {point!r}, {size!r}, {model}"
        if status == OK:
            inputs = {r: model.values[r] for r in self.inputs}
            # The clock is a pair of doubles: what comes after years is known to fewer digits.
            model.wild = model.wild or not self._usual(model) or size > _LONG
            model.steps = (*model.steps, (point, size, inputs, jumped))
            model.point = point + size
            model.anchored = True
            self.counts["accepted steps"] += 1
        else:
            self.counts["refused steps"] += 1

    def _usual(self, model):
        return _ordinary({n: model.values[r] for n, r in self.names.items() if r in model.values})

    def _expected(self, model, point, size):
        """Whether this step must be refused, and whether its point jumps after a restore."""
        if model.mode == BLOCKED and not self._begin(model):
            return True, False
        if model.mode != STEPPING or not 0.0 < size <= 1e100:
            return True, False
        if model.refused or model.once:
            model.once = False
            return True, False
        off = point - model.point
        if not off or abs(off) <= _POINT_TOLERANCE * size + 1e-15 * abs(model.point):
            return False, False
        if model.anchored or not abs(point) <= 1e100:
            return True, False
        return False, True

    # State

    def save(self, i, s):
        self._ok("save", i, s)
        self.states[s] = self.models[i].copied()

    def restore(self, i, s):
        self._ok("restore", i, s)
        model = self.states[s]
        if model is None:
            self.models[i].once = True
            return
        self.models[i] = model.copied()
        self.models[i].anchored = False

    def drop(self, i, s):
        self._ok("drop", i, s)
        del self.states[s]

    def pack(self, i, s, b):
        self._ok("pack", i, s, b)
        self.bytes[b] = self.states[s] and self.states[s].copied()

    def unpack(self, i, b, s):
        self._ok("unpack", i, b, s)
        self.states[s] = self.bytes[b] and self.bytes[b].copied()

    def fill(self, b, data):
        """Bytes that are no state."""
        self._ok("fill", b, data.hex())
        self.bytes[b] = None

    def packed(self, b):
        return self.player.state_bytes(b)

    # Other calls

    def extra(self, i, name):
        self._play("extra", i, name)

    def log(self, i, on):
        self._ok("log", i, on)

    # Comparison

    def compare(self, i):
        """Every variable of an instance against the fresh one's, to the last bit."""
        model = self.models[i]
        if model.wild:
            self._everything(i)
            return
        # What was read before at this point mustn't decide how it is evaluated.
        self._ok("save", i, "now")
        self._ok("restore", i, "now")
        self._ok("drop", i, "now")
        model.anchored = False
        self._replay(model)
        self.counts["comparisons"] += 1
        answers, expected = self._everything(i), self._everything(_FRESH)
        different = {
            self.variables[reference].name: (a, b)
            for references, some, others in zip(self._by_type.values(), answers, expected)
            for reference, a, b in zip(references, some, others, strict=True)
            if not _same_bits(a, b)
        }
        assert not different, (different, model)

    def _everything(self, i):
        return [self._ok("get", i, type_, *refs) for type_, refs in self._by_type.items()]

    def _replay(self, model):
        """Drive the fresh instance by the accepted calls alone."""
        self._ok("reset", _FRESH)
        self._ok("setup", _FRESH, model.start_time)
        values = dict(self._start)
        if model.mode != INSTANTIATED and (model.begun or model.mode != TERMINATED):
            self._ok("enter", _FRESH)
        if model.begun is not None:
            self._put(values, model.begun[1])
            self._ok("exit", _FRESH)
        for point, size, inputs, jumped in model.steps:
            self._put(values, inputs)
            if jumped:
                self._ok("save", _FRESH, "now")
                self._ok("restore", _FRESH, "now")
                self._ok("drop", _FRESH, "now")
            self._ok("step", _FRESH, point, size)
        self._put(values, model.values)
        if model.mode == BLOCKED:
            assert self._play("exit", _FRESH)[0] in (OK, ERROR)
        elif model.mode == TERMINATED:
            self._ok("end", _FRESH)

    def _put(self, values, wanted):
        for reference, value in wanted.items():
            type_ = self.variables[reference].type
            if value == 0.0 == values[reference] and not _same_bits(value, values[reference]):
                # 0 and -0 are equal, so neither replaces the other.
                self._ok("set", _FRESH, type_, f"{reference}={fmi2_calls.written(1.0)}")
                values[reference] = 1.0
            if value != values[reference]:
                self._ok("set", _FRESH, type_, f"{reference}={fmi2_calls.written(value)}")
                values[reference] = value

    def clear(self):
        """Give back everything that a sequence has left."""
        for s in list(self.states):
            self.drop(_FRESH, s)
        for i in list(self.models):
            self.free(i)
        self.bytes.clear()
        # A new one begins: the trace is cut here.
        self._ok("fill", "new-sequence", "")


def _ordinary(v):
    """Values for which the FMU has no reason to refuse anything."""
    return (
        1e-3 <= v["m_club"] <= 1e3
        and 1e-3 <= v["m_ball"] <= 1e3
        and abs(v["ball_speed"]) <= 1e6
        and abs(v["club_speed"]) <= 1e6
        and v["gap"] <= 1e3
        and 1.0 <= v["k"] <= 1e12
        and v["b"] <= 1e5
        and v["exponent"] <= 12.0
        and 1e-6 <= v["reference_compression"] <= 1e3
        # Under a power law bodies that hardly close leave no double for their compression.
        and (v["exponent"] == 1.0 or not 0.0 < v["club_speed"] - v["ball_speed"] < 1e-200)
        and _in_reach(v)
    )


def _in_reach(v):
    """Whether the line of COR over approach speed, if there is one, leads to a COR in this case."""
    closing = max(0.0, v["club_speed"] - v["ball_speed"])
    coefficient = v["restitution_at_rest"] - v["restitution_slope"] * closing
    return v["restitution_at_rest"] == 0.0 or 0.01 <= coefficient <= 1.0


def _same(answers, expected):
    return len(answers) == len(expected) and all(map(_same_bits, answers, expected))


def _same_bits(a, b):
    if isinstance(a, float):
        return struct.pack("d", a) == struct.pack("d", b) or (a != a and b != b)
    return a == b
