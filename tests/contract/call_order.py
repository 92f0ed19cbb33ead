"""The rules of FMI 2.0 for calls in any order, legal or not, and a session that checks them.

They are the same for ClubBallImpact and its companions.

`Model` has only the rules of the interface (modes, ranges, refusals), no physics: the expected
numbers are those of a second instance of the FMU, driven by the accepted calls alone. Equal means
equal to the last bit.
"""

import copy
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import fmpy
from fmi2_calls import DISCARD, ERROR, OK, Player
from golf_physics.variables import VARIABLES

from golf_build.system import COMPANIONS

INSTANTIATED, INITIALIZATION, BLOCKED, STEPPING, TERMINATED = range(5)

#: Slot of the instance that is driven by the accepted calls only.
_FRESH = "fresh"

#: s; the clock's 32 digits then reach far below those of a contact.
_LONG = 1e3

#: How far a communication point may lie from where the last step ended, relative to the step.
_POINT_TOLERANCE = 1e-6

#: Types that the calls have, where they aren't those of the table.
_TYPES = {"Enumeration": "integer"}


class Physics(NamedTuple):
    """What the rules need of a model.

    Attributes:
        rows: its variables.
        usual: values by name, so few that some come twice.
        inputs: what hosts set at every step.
        conflict: whether values, by name, can't begin a run.
        ordinary: whether the physics has no reason to refuse values.
        longest: step that it doesn't refuse, s.
        moving, metrics: references of what a host reads at every step, and at the end.
    """

    rows: list
    usual: dict
    inputs: tuple
    conflict: Callable
    ordinary: Callable
    longest: float
    moving: tuple
    metrics: tuple


@dataclass
class Model:
    """The expected state of an instance.

    Attributes:
        values: of inputs and parameters, by value reference.
        refused: names of what must be corrected before the next step.
        once: whether the next step is refused for a call that nothing can correct.
        begun: (start time, values) with which stepping began, or None.
        steps: the accepted ones since then: (point, size, inputs, whether the point jumped).
        wild: after values that may leave the range of a double: then any refusal is right, and
            only crashes are errors (tests/numbers/test_values.py checks the numbers).
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
    """Plays calls, keeps a model of every instance, and compares.

    Args:
        folder: the extracted FMU.
        trace: see Player.
        name: of the model.
    """

    def __init__(self, folder, trace=None, name="ClubBallImpact"):
        self.physics = physics = PHYSICS[name]
        self.variables = {
            v.reference: v._replace(type=_TYPES.get(v.type, v.type.lower())) for v in physics.rows
        }
        self.names = {v.name: r for r, v in self.variables.items()}
        self.by_type = {"real": [], "integer": [], "boolean": []}
        for r, v in self.variables.items():
            self.by_type[v.type].append(r)
        self._start = {r: v.start for r, v in self.variables.items() if v.start is not None}
        self._inputs = [r for r, v in self.variables.items() if v.causality == "input"]
        self.player = Player(folder, trace)
        #: The native FMU returns Error for an illegal call.
        self.is_native = "(native)" in fmpy.read_model_description(str(folder)).generationTool
        self.models = {}
        self.states = {}
        self.bytes = {}
        self.counts = Counter()
        self.play("new", _FRESH)

    def play(self, *words):
        """Make a call that may be refused, but never end in Fatal: (status, values)."""
        self.counts["calls"] += 1
        status, values = self.player.play(*words)
        may_fail = self.is_native or words[0] in ("extra", "exit")
        allowed = (OK, DISCARD, ERROR) if may_fail else (OK, DISCARD)
        assert status in allowed, f"{words}: status {status}, {self.player.messages[-1:]}"
        self.player.messages.clear()
        return status, values

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
        model = self.models[i]
        self.call(model.mode == INSTANTIATED, "setup", i, start)
        if model.mode != INSTANTIATED:
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
        if model.refused & fixed or self.physics.conflict(v):
            return False
        model.wild = model.wild or not self.physics.ordinary(v)
        model.mode = STEPPING
        model.begun = (model.start_time, dict(model.values))
        return True

    def _by_name(self, model):
        return {self.variables[r].name: value for r, value in model.values.items()}

    def end(self, i):
        self.ok("end", i)
        self.models[i].mode = TERMINATED

    # Values

    def set(self, i, type_, pairs):
        """Set (reference, value) pairs."""
        model = self.models[i]
        legal = [self._set_one(model, type_, reference, value) for reference, value in pairs]
        self.call(all(legal), "set", i, type_, *pairs)

    def _set_one(self, model, type_, reference, value):
        """Whether the call is legal: a value out of range is."""
        variable = self.variables.get(reference)
        settable = reference in model.values and variable.type == type_
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

    def get(self, i, type_, references):
        """Read, and compare with the fresh instance."""
        model = self.models[i]
        known = [r in self.variables and self.variables[r].type == type_ for r in references]
        found = self.call(all(known), "get", i, type_, *references)
        model.once = model.once or not all(known)
        if self.is_native and not all(known):
            return
        for reference, good, value in zip(references, known, found, strict=True):
            if not good:
                assert value in (0, b"0") or math.isnan(value)
            elif reference in model.values:
                assert value == model.values[reference]
        if not model.wild and all(known) and type_ != "string":
            self._replay(model)
            expected = self.ok("get", _FRESH, type_, *references)
            assert repr(found) == repr(expected), (references, found, expected, model)

    def step(self, i, point, size):
        """One communication step: its status must be the one that the model expects."""
        status, _ = self.play("step", i, point, size)
        model = self.models[i]
        refused, jumped = self._expected(model, point, size)
        # The limits of physics near the largest and smallest doubles aren't computed here.
        ordinary = size <= self.physics.longest and self.physics.ordinary(self._by_name(model))
        unknown = not refused and (model.wild or not ordinary)
        assert unknown or (status == DISCARD) == refused, f"{point!r}, {size!r}: {status}, {model}"
        self.counts["accepted steps" if status == OK else "refused steps"] += 1
        if status == OK:
            inputs = {r: model.values[r] for r in self._inputs}
            # The clock is a pair of doubles: it has fewer digits after years.
            model.wild = model.wild or not ordinary or size > _LONG
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
        if not error or abs(error) <= _POINT_TOLERANCE * size + 1e-15 * abs(model.point):
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
        return self.player.bytes[b]

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
        found, expected = self._read_all(i), self._read_all(_FRESH)
        different = {
            self.variables[r].name: (value, expected[r])
            for r, value in found.items()
            if repr(value) != repr(expected[r])
        }
        assert not different, (different, model)

    def _read_all(self, i):
        return {
            reference: value
            for type_, references in self.by_type.items()
            for reference, value in zip(references, self.ok("get", i, type_, *references))
        }

    def _save_and_restore(self, i):
        for call in ("save", "restore", "drop"):
            self.ok(call, i, "now")

    def _replay(self, model):
        """Drive the fresh instance by the accepted calls alone."""
        self.ok("reset", _FRESH)
        self.ok("setup", _FRESH, model.start_time)
        values = dict(self._start)
        if model.mode != INSTANTIATED and (model.begun or model.mode != TERMINATED):
            self.ok("enter", _FRESH)
        if model.begun is not None:
            self._put(values, model.begun[1])
            self.ok("exit", _FRESH)
        for point, size, inputs, jumped in model.steps:
            self._put(values, inputs)
            if jumped:
                self._save_and_restore(_FRESH)
            self.ok("step", _FRESH, point, size)
        self._put(values, model.values)
        if model.mode == BLOCKED:
            self.play("exit", _FRESH)
        elif model.mode == TERMINATED:
            self.ok("end", _FRESH)

    def _put(self, values, wanted):
        for reference, value in wanted.items():
            type_ = self.variables[reference].type
            if value == values[reference] == 0.0 and repr(value) != repr(values[reference]):
                # 0 and -0 are equal, so neither replaces the other.
                self.ok("set", _FRESH, type_, (reference, 1.0))
                values[reference] = 1.0
            if value != values[reference]:
                self.ok("set", _FRESH, type_, (reference, value))
                values[reference] = value

    def clear(self):
        """Free everything that a sequence has left; the next one begins in the trace."""
        for s in list(self.states):
            self.drop(_FRESH, s)
        for i in list(self.models):
            self.free(i)
        self.bytes.clear()
        self.ok("fill", "new-sequence", "")


def _conflict_of_impact(v):
    clash = v["law"] == 1 and (v["exponent"] != 1.0 or v["restitution_at_rest"] > 0.0)
    return clash or v["exponent"] > 12.0


def _ordinary_impact(v):
    """Values for which the FMU has no reason to refuse anything."""
    closing = max(0.0, v["club_speed"] - v["ball_speed"])
    coefficient = v["restitution_at_rest"] - v["restitution_slope"] * closing
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
        and (v["exponent"] == 1.0 or not 0.0 < closing < 1e-200)
        # The line of COR over approach speed, if there is one, gives a COR.
        and (v["restitution_at_rest"] == 0.0 or 0.01 <= coefficient <= 1.0)
    )


def _companion(name, usual, inputs, moving, longest=1e100, ordinary=lambda v: True):
    rows = COMPANIONS[name].tables["rows"]
    references = tuple(row.reference for row in rows if row.name in moving)
    start = {row.name: row.start for row in rows if row.start is not None}

    def usual_only(v):
        return all(v[n] in (start[n], *usual.get(n, ())) for n in start) and ordinary(v)

    return Physics(
        rows, usual, inputs, lambda v: False, usual_only, longest, references, references[:1]
    )


#: By the names of the models.
PHYSICS = {
    "ClubBallImpact": Physics(
        VARIABLES,
        {
            "k": (1e6, 8e5, 3e6, 2e4),
            "b": (9.0, 0.0, 40.0, 700.0, 2e4),
            "club_speed": (35.0, 50.0, 1.0, 0.0, -5.0),
            "m_club": (0.21, 0.2, 0.046),
            "m_ball": (0.04593, 0.3),
            "ball_diameter": (0.04267, 0.05),
            "ball_speed": (0.0, 3.0, -20.0),
            "gap": (0.0, 0.001, 0.02, 1.0),
            "law": (1, 2),
            "exponent": (1.0, 1.5, 1.615544, 3.0),
            "reference_compression": (0.005, 0.001),
            "restitution_at_rest": (0.0, 0.86),
            "restitution_slope": (0.0, 0.0029),
        },
        ("k", "b", "club_speed"),
        _conflict_of_impact,
        _ordinary_impact,
        1e100,
        (13, 14, 15, 16, 17),
        (24, 25, 26),
    ),
    "Swing": _companion(
        "Swing",
        {
            "impulse": (0.0, 0.05, 1.0),
            "gravity": (9.806, 9.0),
            "club_mass": (0.3, 0.31),
            "spin_loft": (0.0, 0.2),
            "prescribed_speed": (0.0, 40.0),
        },
        ("impulse",),
        ("club_speed", "head_speed", "arm_angle", "hand_force", "reaction_work"),
        # A longer one is refused until the ball is hit.
        longest=0.1,
    ),
    "Launch": _companion(
        "Launch",
        {
            "separated": (False, True),
            "ball_velocity": (0.0, 50.0, 60.0),
            "club_velocity": (0.0, 20.0),
            "smash_factor": (0.0, 1.4),
            "coefficient_of_restitution": (0.0, 0.8),
            "dynamic_loft": (0.2, 0.5),
            "friction": (0.4, 0.3),
        },
        ("separated", "ball_velocity", "coefficient_of_restitution"),
        ("launched", "ball_speed", "launch_angle", "backspin"),
        ordinary=lambda v: (
            not v["separated"]
            or (v["coefficient_of_restitution"] > 0.0 and v["ball_velocity"] > v["club_velocity"])
        ),
    ),
    "BallFlight": _companion(
        "BallFlight",
        {
            "separated": (False, True),
            "ball_velocity": (0.0, 50.0, 70.0),
            "launch_angle": (0.2, 0.0),
            "touch_time": (0.0, 1e-3),
            "wind_speed": (0.0, 5.0),
            "gravity": (9.80665, 9.0),
        },
        ("separated", "ball_velocity", "launch_angle"),
        ("distance", "height", "carry"),
    ),
}
