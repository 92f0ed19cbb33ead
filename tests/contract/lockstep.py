"""FMI calls in lockstep: all FMUs of a model get the same ones, legal or not.

Three sources that share nothing say what is right:

- `Rules`, without physics: modes, ranges and refusals; which status a call returns;
- a fresh instance that gets the accepted calls alone: every value, and whether the physics of a
  step is refused;
- the other FMUs of the model: the same values to the last bit, and the same sentences.

Calls are lines of a script: see `Session.play`. Left out is what pythonfmu's C layer doesn't
survive: NULL as component, name, resource folder or state; what was freed; a string that isn't
UTF-8; any call after Fatal.
"""

import math
from contextlib import suppress
from copy import copy
from dataclasses import dataclass

import fmus
import hypothesis.strategies as st
import random_cases
from fmpy.fmi1 import FMICallException
from golf_physics.refusals import RULES
from golf_physics.variables import VARIABLES

from golf_build.system import COMPANIONS

OK, DISCARD, ERROR = 0, 2, 3
INSTANTIATED, INITIALIZATION, START_REFUSED, STEPPING, TERMINATED = range(5)

#: Smaller numbers are left over where larger ones cancel, as between bodies that stay together:
#: their last digits are those of no function.
LEFT_OVER = 1e-40


@dataclass
class Rules:
    """The interface of one instance: what it must answer, and the calls that it has accepted.

    A copy is a saved state: fields are replaced, never changed in place.
    """

    table: dict
    values: dict
    mode: int = INSTANTIATED
    #: Names of what must be corrected before the next step.
    refused: frozenset = frozenset()
    #: Whether the next step is refused for an illegal call.
    once: bool = False
    start: float = 0.0
    point: float = 0.0
    #: Whether the next step may begin anywhere: after a restore.
    free: bool = False
    #: The values with which stepping began, and the steps since then: point, size, inputs, and
    #: whether the point was free.
    begun: dict | None = None
    steps: tuple = ()

    @property
    def inputs(self):
        return {name for name, row in self.table.items() if row.causality == "input"}

    def begin(self):
        self.mode, self.begun = STEPPING, self.values

    def mark(self, name, is_refused):
        self.refused = self.refused | {name} if is_refused else self.refused - {name}

    def set(self, name, value):
        """Whether this is legal; a value out of range is."""
        row, now = self.table[name], self.values.get(name)
        if now is None or self.mode == TERMINATED:
            self.once = True
            return False
        fixed = row.causality == "parameter" and self.mode == STEPPING and value != now
        in_range = row.low <= value <= row.high
        self.mark(name, fixed or not in_range)
        if name not in self.refused and value != now:
            self.values = self.values | {name: value}
        return not (fixed and in_range)

    def refuses(self, point, size):
        """Whether this step is refused, whatever it leads to; the illegal calls are forgotten."""
        if not 0.0 < size <= 1e100 or self.mode != STEPPING:
            return True
        if self.refused or self.once:
            self.once = False
            return True
        time = abs(self.point)
        allowed = max(min(1e-6 * max(size, time), size / 4), 1e-15 * time)
        return not (abs(point - self.point) <= allowed or (self.free and abs(point) <= 1e100))


class Player:
    """An instance of an FMU, and the states that it, or one before it, has saved.

    Args:
        folder: of the extracted FMU.
        trace: a file to which every call is written before it is made.
    """

    def __init__(self, folder, trace):
        self.folder, self.trace, self.memory = folder, trace, {}
        self.renew()
        about = self.slave.description
        self.fmi3 = about.fmiVersion == "3.0"
        self.is_native = "(native)" in about.generationTool
        self.name = f"{about.generationTool}, FMI {about.fmiVersion}"

    def renew(self):
        """Another instance."""
        before = getattr(self, "slave", None)
        self.slave, self.start = fmus.make_instance(self.folder, loggingOn=True), 0.0
        if before:
            before.freeInstance()

    def play(self, call, *words):
        """Make a call, of this class or of fmpy's: its status, and what it returns."""
        self.trace.write(f"{self.name}: {call} {words!r}\n")
        self.slave.messages.clear()
        try:
            return OK, (getattr(self, call, None) or getattr(self.slave, call))(*words)
        except FMICallException as error:
            return error.status, None

    def close(self):
        for saved in self.memory.values():
            fmus.call_state(self.slave, "free", saved)
        self.slave.freeInstance()

    def reset(self):
        self.slave.reset()
        self.start = 0.0

    def setup(self, start, late=False):
        """In FMI 3.0 the start time is an argument of the next call."""
        self.start = start
        if not self.fmi3:
            self.slave.setupExperiment(startTime=start)
        elif late:
            self.enter()

    def enter(self):
        start = {"startTime": self.start} if self.fmi3 else {}
        self.slave.enterInitializationMode(**start)

    def set(self, values):
        fmus.put(self.slave, **values)

    def misuse(self, verb, kind, reference):
        """Get or set a variable of another type, or one that isn't there."""
        kind = {"Real": "Float64", "Integer": "Int64"}.get(kind, kind) if self.fmi3 else kind
        value = {"String": "1"}.get(kind, 1)
        getattr(self.slave, verb + kind)([reference], *([[value]] if verb == "set" else []))

    def read(self):
        """All variables by name."""
        return fmus.read(self.slave)

    def save(self, slot, as_bytes):
        state = fmus.saved(self.slave, as_bytes)
        if slot in self.memory:
            fmus.call_state(self.slave, "free", self.memory[slot])
        self.memory[slot] = state

    def restore(self, slot):
        fmus.call_state(self.slave, "set", self.memory[slot])

    def damage(self, place, cut):
        """Restore the present state from bytes that end, or have another bit, at this place."""
        data = fmus.packed(self.slave)
        at = int(place * len(data))
        end = b"" if cut else bytes([data[at] ^ 1 << at % 8]) + data[at + 1 :]
        fmus.restore_packed(self.slave, data[:at] + end)


class Session:
    """The FMUs of a model in lockstep; every call is checked in all of them.

    Args:
        model: its name.
        folders: of its extracted FMUs. An instance of the first gets the accepted calls alone.
        trace: see `Player`.
    """

    def __init__(self, model, folders, trace):
        self.model, self.counts = model, {"steps": 0, "refused": 0}
        self.players = [Player(folder, trace) for folder in folders]
        self.fresh = Player(folders[0], trace)
        rows = COMPANIONS[model].tables["rows"] if model in COMPANIONS else VARIABLES
        self.table = {row.name: row for row in rows}
        self.default = {row.name: row.start for row in rows if row.start is not None}
        self.states = {}
        self.reset()

    def close(self):
        for player in (*self.players, self.fresh):
            player.close()

    def play(self, script):
        """Play lines that end with ";": a method of this class, words and numbers, name=value."""

        def typed(word):
            with suppress(ValueError):
                return float(word)
            return word

        for line in script.split(";"):
            call, *words = line.split()
            pairs = dict(word.split("=") for word in words if "=" in word)
            values = {name: typed(value) for name, value in pairs.items()}
            getattr(self, call)(*(typed(word) for word in words if "=" not in word), **values)

    def all(self, expected, call, *words):
        """Make a call in all FMUs: the same sentences, and the expected status.

        A plain FMU can't return Error: its next step is refused.
        """
        first, self.dirty = None, True
        for player in self.players:
            status, _ = player.play(call, *words)
            wanted = OK if expected == ERROR and not player.is_native else expected
            assert status == wanted, (player.name, call, words, status, player.slave.messages)
            # In FMI 3.0 a second initialization is a late set-up as well.
            sentences = "\n".join(player.slave.messages)
            found = sentences.replace(RULES["ENTERED_TWICE"], RULES["LATE_SET_UP"])
            # In FMI 3.0 both are one call.
            if player.fmi3 and call in ("setup", "enter"):
                continue
            first = found if first is None else first
            assert found == first, (player.name, call, words)
        assert first or expected == OK or call == "exitInitializationMode", (call, words)

    # Life

    def reset(self, call="reset"):
        self.all(OK, call)
        self.rules = Rules(self.table, self.default)

    def renew(self):
        self.reset("renew")

    def setup(self, start):
        r = self.rules
        is_late = r.mode != INSTANTIATED
        self.all(ERROR if is_late else OK, "setup", start, is_late)
        r.once = r.once or is_late
        if not is_late:
            r.mark("start", not math.isfinite(start))
            r.start = r.point = start if math.isfinite(start) else r.start

    def enter(self):
        r = self.rules
        is_legal = r.mode == INSTANTIATED
        self.all(OK if is_legal else ERROR, "enter")
        r.mode = INITIALIZATION if is_legal else r.mode
        r.once = r.once or not is_legal

    def leave(self):
        r = self.rules
        is_legal = r.mode == INITIALIZATION
        if is_legal:
            r.mode = START_REFUSED
            self.begin_stepping()
            is_legal = r.mode == STEPPING and not r.refused
        else:
            r.once = True
        self.all(OK if is_legal else ERROR, "exitInitializationMode")

    def begin_stepping(self):
        """Fix the parameters if they agree: that is up to the physics, in the fresh instance."""
        if self.rules.refused <= self.rules.inputs | {"start"}:
            tried = copy(self.rules)
            tried.begin()
            self.dirty = True
            if self.replay(tried):
                self.rules.begin()

    def end(self):
        self.all(OK, "terminate")
        self.rules.mode = TERMINATED

    def begin(self, start=0.0, **values):
        """A new run."""
        self.reset()
        self.setup(start)
        self.enter()
        for name, value in values.items():
            self.set(**{name: value})
        self.leave()

    # Values

    def set(self, **values):
        """Set variables of one type in one call."""
        kinds = {"Boolean": bool, "Enumeration": int}
        values = {n: kinds.get(self.table[n].type, float)(value) for n, value in values.items()}
        legal = [self.rules.set(name, value) for name, value in values.items()]
        self.all(OK if all(legal) else ERROR, "set", values)

    def misuse(self, verb, kind, reference):
        self.all(ERROR, "misuse", verb, kind, int(reference))
        self.rules.once = True

    def correct(self):
        """Correct all that is refused."""
        r = self.rules
        for name in sorted(r.refused - {"start"}):
            self.set(**{name: r.values[name]})
        if r.once and r.mode == STEPPING:
            self.step(1e-5)

    def recover(self):
        """Once all is corrected, the run goes on as if nothing had been refused."""
        self.correct()
        self.step(1e-4)
        self.compare()

    # Steps

    def step(self, size, at=None, off=0.0):
        """From where the last step ended, so far off it, or at another point; s."""
        r = self.rules
        point = r.point + off if at is None else at
        if r.mode == START_REFUSED and 0.0 < size <= 1e100:
            self.begin_stepping()
        refused = r.refuses(point, size)
        # That a point may jump after a restore is a rule: the fresh instance goes on.
        jumped = r.free and point != r.point
        if not refused:
            self.sync()
            refused = self.fresh.play("doStep", r.point if jumped else point, size)[0] != OK
        self.counts["refused" if refused else "steps"] += 1
        self.all(DISCARD if refused else OK, "doStep", point, size)
        self.dirty = refused or jumped
        if not refused:
            r.steps = (*r.steps, (point, size, {n: r.values[n] for n in r.inputs}, jumped))
            r.point, r.free = point + size, False

    # State

    def save(self, slot, form=""):
        self.all(OK, "save", slot, form == "bytes")
        self.states[slot] = copy(self.rules)

    def restore(self, slot):
        self.all(OK, "restore", slot)
        self.rules = copy(self.states[slot])
        self.rules.free = True

    def damage(self, place, cut):
        self.all(ERROR, "damage", place, cut)
        self.rules.once = True

    # The fresh instance

    def replay(self, r):
        """Drive the fresh instance by the accepted calls alone; whether the parameters agree."""
        fresh, now, agree = self.fresh, dict(self.default), True

        def put(wanted):
            for name, value in wanted.items():
                if repr(value) == repr(now[name]):
                    continue
                # 0 and -0 are equal, so neither replaces the other.
                for one in (1.0, value) if value == now[name] else (value,):
                    assert fresh.play("set", {name: one})[0] == OK, (name, one)
                now[name] = value

        fresh.play("reset")
        fresh.play("setup", r.start)
        if r.begun or r.mode not in (INSTANTIATED, TERMINATED):
            fresh.play("enter")
        if r.begun is not None:
            put(r.begun)
            agree = fresh.play("exitInitializationMode")[0] == OK and not fresh.slave.messages
        for point, size, inputs, jumped in r.steps:
            put(inputs)
            if jumped:
                fresh.play("save", "jump", False)
                fresh.play("restore", "jump")
            assert fresh.play("doStep", point, size)[0] == OK
        # Until the next step outputs belong to the last one.
        before = fresh.play("read")[1] if r.mode == STEPPING and r.steps else {}
        put(r.values)
        now = fresh.play("read")[1] if before else {}
        assert not differing({n: v for n, v in now.items() if n not in r.values}, before), before
        if r.mode == TERMINATED:
            fresh.play("terminate")
        return agree

    def sync(self):
        if self.dirty:
            self.replay(self.rules)
            self.dirty = False

    def compare(self):
        """All variables of all FMUs beside those of the fresh instance."""
        self.sync()
        _, expected = self.fresh.play("read")
        for player in self.players:
            # In FMI 3.0 the start time comes with the initialization.
            before = self.rules.mode in (INSTANTIATED, TERMINATED) and self.rules.begun is None
            if player.fmi3 and before and self.rules.start:
                continue
            small = 0.0 if player.folder == self.fresh.folder else LEFT_OVER
            _, found = player.play("read")
            assert not (bad := differing(found, expected, small)), (player.name, bad, self.rules)


def differing(found, expected, small=0.0):
    """Variables of both that differ, but where both numbers are smaller than that."""
    pairs = {name: (one, expected.get(name, one)) for name, one in found.items()}
    return {
        name: (one, other)
        for name, (one, other) in pairs.items()
        # Zeros have a sign; a flag is True or 1.
        if (repr(one) != repr(other) if isinstance(one, float) else one != other)
        and not 0.0 < max(abs(one), abs(other)) < small
    }


# Random calls

#: Inputs and parameters that no model has a reason to refuse, but together.
USUAL = {
    "ClubBallImpact": """
        k=1e6 k=8e5 k=3e6 b=9 b=0 b=40 b=700 club_speed=35 club_speed=50 club_speed=-5 club_force=0
        club_force=500 club_force=-2e3 m_club=0.21 m_club=0.3 gap=0 gap=1e-3 law=1 law=2 exponent=1
        exponent=1.5 restitution_at_rest=0 restitution_at_rest=0.86""",
    "Swing": "impulse=0 impulse=0.05 gravity=9.806 gravity=9 club_mass=0.3 club_mass=0.31",
    "Launch": """
        separated=0 separated=1 ball_velocity=0 ball_velocity=50 friction=0.4 friction=0.3
        coefficient_of_restitution=0 coefficient_of_restitution=0.8 club_velocity=0
        club_velocity=20""",
    "BallFlight": """
        separated=0 separated=1 ball_velocity=0 ball_velocity=50 gravity=9.8 gravity=9
        launch_angle=0.2 launch_angle=0 touch_time=0 touch_time=1e-3""",
}

#: The longest steps, s: a longer one of Swing is refused until the ball is hit, after much work.
LONGEST = {"Swing": 0.1}

ODD = (math.nan, math.inf, -1.0, -0.0, 0.0, 5e-324, 1e160, -1e300, 1.7976931348623157e308)
SIZES = (2.5e-5, 2.5e-5, 1e-4, 3e-6, 1e-4 / 3.0, 1e-3, 1e-9, 1.0)
ODD_SIZES = (0.0, -1e-4, math.nan, math.inf, 5e-324, 1e30, 1e101)
#: Of points, s; the small ones relative to the step.
SHIFTS = (0.0, 0.9e-6, -0.9e-6, 1.1e-6, 1e-3, -1.0, 1e9, math.nan, math.inf)


def line(text, *places):
    """Lines of this form; in its places values of a list, or of a strategy."""
    chosen = (p if isinstance(p, st.SearchStrategy) else st.sampled_from(p) for p in places)
    return st.builds(text.format, *chosen)


def misuses(table):
    """Calls with a type or a reference that no variable has, or that can't be set."""
    for verb in ("get", "set"):
        for kind in ("Real", "Integer", "Boolean", "String"):
            rows = [r for r in table.values() if verb == "get" or r.start is not None]
            legal = {r.reference for r in rows if r.type.replace("Enumeration", "Integer") == kind}
            yield from (f"misuse {verb} {kind} {n}" for n in {*range(35), 99, 2**31 - 1} - legal)


def random_lines(model, table):
    """A line of a script, or some that belong together; states A and B have been saved."""
    usual, longest = USUAL[model].split(), LONGEST.get(model, math.inf)
    inputs = [pair for pair in usual if table[pair.partition("=")[0]].causality == "input"]
    reals = [name for name, row in table.items() if row.type == "Real"]
    starts = [f"{name}={table[name].start}" for name in reals if table[name].start is not None]
    sizes = [min(size, longest) for size in SIZES]
    odd_sizes = [size for size in ODD_SIZES if not longest < size < math.inf]
    odd_steps = [
        f"step {size} off={shift * size if abs(shift) < 1e-5 else shift}"
        for size in (*sizes, *odd_sizes)
        for shift in SHIFTS
    ]
    values = line("{} {} {}", usual, usual, usual)
    if model == "ClubBallImpact":
        impact = st.integers(0, 10**6).map(lambda n: random_cases.whole(n, pushed=0.3).items())
        values |= impact.map(lambda pairs: " ".join(f"{name}={value!r}" for name, value in pairs))
    change = line("set {}", [*usual, *inputs * 3])
    step = line("step {}; {}", sizes, ["compare", "correct"])
    steps = st.builds(lambda step, number: "; ".join([step] * number), step, st.integers(1, 19))
    return st.one_of(
        line("begin start={} {}", [0.0, 0.0, 100.0, -3.0], values),
        st.sampled_from(["enter", "leave", "end", "reset", "renew", "renew"]),
        line("setup {}", [0.0, 2.0, -1e300, math.nan, math.inf]),
        st.lists(change, min_size=1, max_size=3).map("; ".join),
        line("set {}={} {}; {}", reals, ODD, starts, ["step 1e-5; correct", "correct", "compare"]),
        st.sampled_from([*misuses(table)]),
        steps,
        st.sampled_from(odd_steps),
        line("save {} {}", "AB", ["", "bytes"]),
        line("restore {}; compare; {}", "AB", st.one_of(steps, st.just("compare"))),
        line("damage {} {}", st.floats(0.0, 0.999), [0, 1]),
        st.just("recover"),
    )
