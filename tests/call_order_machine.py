"""A hypothesis state machine over FMI 2.0 calls; a script, for a crash must not take pytest along.

    python call_order_machine.py FOLDER TRACE EXAMPLES STEPS SEED

FOLDER is the extracted FMU. Every call is written to TRACE before it is made. SEED 0: at random.
"""

import json
import math
import sys

import fmi2_calls
import hypothesis.strategies as st
from call_order import STEPPING, Session
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

INSTANCES, STATES, BYTES = ("0", "1", "2"), ("0", "1", "2", "3"), ("0", "1")

ODD_NUMBERS = (
    math.nan, math.inf, -math.inf, -1.0, -0.0, 0.0, 5e-324, -5e-324, 2.2e-308, 1e-160, 1e160, 1e300,
    -1e300, 1.7976931348623157e308,
)  # fmt: skip

#: Values by name, so few that some come twice.
USUAL = {
    "k": (1e6, 8e5, 3e6, 2e4),
    "b": (9.0, 0.0, 40.0, 700.0, 2e4),
    "club_speed": (35.0, 50.0, 1.0, 0.0, -5.0),
    "m_club": (0.21, 0.2, 0.046),
    "m_ball": (0.04593, 0.3),
    "ball_diameter": (0.04267, 0.05),
    "ball_speed": (0.0, 3.0, -20.0),
    "gap": (0.0, 0.001, 0.02, 1.0),
    "exponent": (1.0, 1.5, 1.615544, 3.0),
    "reference_compression": (0.005, 0.001),
    "restitution_at_rest": (0.0, 0.86),
    "restitution_slope": (0.0, 0.0029),
}
SIZES = (1e-4, 2.5e-5, 3e-6, 1e-4 / 3.0, 1e-3, 1e-9, 1.0)
ODD_SIZES = (
    0.0, -0.0, -1e-4, math.nan, math.inf, -math.inf, 5e-324, 1e-200, 1e-15, 1e30, 1e100, 1e101,
)  # fmt: skip
ODD_REFERENCES = (35, 36, 1000, 2**31 - 1, 2**31, 2**32 - 2, 2**32 - 1)

#: What a host reads at every step: force, positions and velocities.
MOVING = (13, 14, 15, 16, 17)

session = None

instances = st.sampled_from(INSTANCES)
types = st.sampled_from(("real", "integer", "boolean", "string"))


class CallOrder(RuleBasedStateMachine):
    """Legal and illegal calls to a few instances, their states and states as bytes."""

    def __init__(self):
        super().__init__()
        session.clear()
        for i in INSTANCES[:2]:
            session.new(i)
        # Most calls go on in an instance that steps: otherwise few sequences would come that far.
        self.start("0", 0.0, {})

    def start(self, i, start, values):
        session.reset(i)
        session.setup(i, start)
        session.enter(i)
        for name, value in values.items():
            self.put(i, [(name, value)])
        session.exit(i)

    def put(self, i, pairs):
        for name, value in pairs:
            type_ = "integer" if name == "law" else "real"
            session.set(i, type_, [(session.names[name], value)])

    def alive(self, data, label="instance"):
        return data.draw(st.sampled_from(sorted(session.models)), label)

    def mend(self, i):
        model = session.models[i]
        for name in sorted(model.refused - {"start time"}):
            self.put(i, [(name, model.values[session.names[name]])])
        if model.once:
            session.step(i, model.point, 1e-5)

    # Life

    @rule(i=instances)
    def new_or_free(self, i):
        if i not in session.models:
            session.new(i)
        elif len(session.models) > 1:
            session.free(i)

    @rule(
        data=st.data(), start=st.sampled_from((0.0, 0.0, 100.0, -3.0, 1e6)), law=st.integers(1, 2)
    )
    def begin(self, data, start, law):
        i = self.alive(data)
        values = {"law": law} | data.draw(
            st.fixed_dictionaries({}, optional={n: st.sampled_from(v) for n, v in USUAL.items()})
        )
        if law == 1:
            values |= {"exponent": 1.0, "restitution_at_rest": 0.0}
        self.start(i, start, values)
        # Looked at, a touch at this very instant is still decided by what is set now.
        if data.draw(st.booleans(), "look"):
            session.get(i, "real", MOVING)
        if data.draw(st.booleans(), "set"):
            self.put(i, [("club_speed", data.draw(st.sampled_from(USUAL["club_speed"])))])
            session.step(i, session.models[i].point, 1e-4)

    @rule(data=st.data(), call=st.sampled_from(("enter", "exit", "end", "reset")))
    def change_mode(self, data, call):
        getattr(session, call)(self.alive(data))

    @rule(data=st.data(), start=st.sampled_from((0.0, 2.0, -1e300, math.nan, math.inf)))
    def setup(self, data, start):
        session.setup(self.alive(data), start)

    # Values

    @rule(data=st.data(), name=st.sampled_from(tuple(USUAL)))
    def set_usual(self, data, name):
        self.put(self.alive(data), [(name, data.draw(st.sampled_from(USUAL[name])))])

    @rule(data=st.data(), name=st.sampled_from(("k", "b", "club_speed")))
    def set_input(self, data, name):
        self.put(self.alive(data), [(name, data.draw(st.sampled_from(USUAL[name])))])

    @rule(data=st.data(), name=st.sampled_from(tuple(USUAL)), value=st.sampled_from(ODD_NUMBERS))
    def set_odd_and_back(self, data, name, value):
        i = self.alive(data)
        before = session.models[i].values[session.names[name]]
        self.put(i, [(name, value)])
        if data.draw(st.booleans(), "step with it"):
            session.step(i, session.models[i].point, 1e-5)
        if data.draw(st.booleans(), "back"):
            self.put(i, [(name, before)])

    @rule(data=st.data(), value=st.sampled_from((0, 1, 2, 3, -1, 2**31 - 1, -(2**31))))
    def set_law(self, data, value):
        self.put(self.alive(data), [("law", value)])

    @rule(data=st.data(), type_=types, many=st.integers(0, 4))
    def set_anything(self, data, type_, many):
        reference = st.one_of(st.integers(0, 34), st.sampled_from(ODD_REFERENCES))
        values = {
            "real": st.one_of(st.floats(), st.sampled_from(ODD_NUMBERS)),
            "integer": st.integers(-(2**31), 2**31 - 1),
            "boolean": st.integers(-2, 2),
            "string": st.sampled_from(("", "1", "µ%s%n")),
        }[type_]
        pair = st.tuples(reference, values)
        session.set(
            self.alive(data), type_, data.draw(st.lists(pair, min_size=many, max_size=many))
        )

    @rule(data=st.data(), kind=st.sampled_from(("moving", "some", "all", "discrete")))
    def get(self, data, kind):
        i = self.alive(data)
        reals = [r for r, v in session.variables.items() if v.type == "real"]
        if kind == "moving":
            session.get(i, "real", range(13, 13 + data.draw(st.integers(1, 6))))
        elif kind == "some":
            some = st.lists(st.sampled_from(reals), min_size=1, max_size=6)
            session.get(i, "real", data.draw(some))
        elif kind == "all":
            session.get(i, "real", reals)
        else:
            session.get(i, "integer", [session.names["law"]])
            session.get(i, "boolean", [session.names[n] for n in ("touched", "separated")])

    @rule(data=st.data(), type_=types)
    def get_anything(self, data, type_):
        reference = st.one_of(st.integers(0, 34), st.sampled_from(ODD_REFERENCES))
        session.get(self.alive(data), type_, data.draw(st.lists(reference, max_size=4)))

    # Steps

    @rule(data=st.data(), size=st.sampled_from(SIZES), number=st.integers(1, 12))
    def steps(self, data, size, number):
        self.advance(data, size, number)

    @rule(data=st.data(), number=st.integers(1, 12))
    def steps_in_contact(self, data, number):
        self.advance(data, 2.5e-5, number)

    def advance(self, data, size, number):
        i = self.alive(data)
        if data.draw(st.booleans(), "mended before"):
            self.mend(i)
        read = data.draw(st.sampled_from(("nothing", "moving", "metrics")))
        for _ in range(number):
            session.step(i, session.models[i].point, size)
            if read == "moving":
                session.get(i, "real", MOVING)
            elif read == "metrics":
                session.get(i, "real", [24, 25, 26])

    @rule(
        data=st.data(),
        size=st.one_of(st.sampled_from(SIZES), st.sampled_from(ODD_SIZES), st.floats()),
        off=st.sampled_from(
            (0.0, 1e-7, -1e-7, 1e-3, -1.0, 5.0, 1e9, math.nan, math.inf, -math.inf)
        ),
    )
    def odd_step(self, data, size, off):
        i = self.alive(data)
        shift = off * size if abs(off) <= 1e-7 else off
        session.step(i, session.models[i].point + shift, size)

    # State

    @rule(data=st.data(), s=st.sampled_from(STATES))
    def save(self, data, s):
        i = self.alive(data)
        if s in session.states:
            session.drop(self.alive(data, "who frees it"), s)
        session.save(i, s)

    @precondition(lambda self: session.states)
    @rule(data=st.data())
    def restore(self, data):
        session.restore(self.alive(data), data.draw(st.sampled_from(sorted(session.states))))

    @rule(
        data=st.data(),
        before=st.integers(0, 6),
        after=st.integers(1, 6),
        odd=st.sampled_from(("nothing", "input", "bad input", "bad step", "reset")),
        number=st.integers(0, 5),
    )
    def rollback(self, data, before, after, odd, number):
        """As a host does it that looks ahead, reading all the time."""
        i = self.alive(data)
        self.mend(i)
        if session.models[i].mode != STEPPING:
            self.start(i, 0.0, {"law": data.draw(st.integers(1, 2), "law")})
        self.read_on(i, before)
        session.save(i, "rollback")
        self.read_on(i, after)
        if odd == "input":
            self.put(
                i, [("k", 8e5 if session.models[i].values[session.names["k"]] != 8e5 else 1e6)]
            )
        elif odd == "bad input":
            self.put(i, [("b", -1.0)])
        elif odd == "bad step":
            session.step(i, -1e9, 1e-5)
        elif odd == "reset":
            session.reset(i)
        session.restore(i, "rollback")
        session.drop(i, "rollback")
        session.get(i, "real", MOVING)
        self.read_on(i, number)
        session.compare(i)

    def read_on(self, i, number):
        for _ in range(number):
            session.step(i, session.models[i].point, 2.5e-5)
            session.get(i, "real", MOVING)

    @precondition(lambda self: session.states)
    @rule(data=st.data(), b=st.sampled_from(BYTES), s=st.sampled_from(STATES))
    def through_bytes(self, data, b, s):
        old = data.draw(st.sampled_from(sorted(session.states)), "state")
        session.pack(self.alive(data, "packed by"), old, b)
        if s in session.states:
            session.drop(self.alive(data, "freed by"), s)
        session.unpack(self.alive(data, "unpacked by"), b, s)

    @precondition(lambda self: session.states)
    @rule(
        data=st.data(), s=st.sampled_from(STATES), damage=st.sampled_from(("cut", "flip", "value"))
    )
    def damaged_bytes(self, data, s, damage):
        i = self.alive(data)
        session.pack(i, data.draw(st.sampled_from(sorted(session.states)), "state"), "0")
        before = session.packed("0")
        after = _damaged(before, damage, data) if before else b"x"
        if after == before:
            return
        session.fill("0", after)
        if s in session.states:
            session.drop(i, s)
        session.unpack(i, "0", s)
        session.restore(i, s)

    @rule(data=st.data(), s=st.sampled_from(STATES), junk=st.binary(max_size=40))
    def junk_bytes(self, data, s, junk):
        i = self.alive(data)
        session.fill("1", junk)
        if s in session.states:
            session.drop(i, s)
        session.unpack(i, "1", s)

    # The rest

    @rule(data=st.data(), name=st.sampled_from(fmi2_calls.EXTRA))
    def unsupported(self, data, name):
        session.extra(self.alive(data), name)

    @rule(data=st.data(), on=st.integers(0, 1))
    def logging(self, data, on):
        session.log(self.alive(data), on)

    @rule(data=st.data())
    def recovery(self, data):
        """Whatever was refused is put right: the run goes on as if it had never been."""
        i = self.alive(data)
        session.compare(i)
        self.mend(i)
        session.compare(i)
        session.step(i, session.models[i].point, 1e-5)
        session.compare(i)

    @invariant()
    def at_least_one(self):
        assert session.models

    def teardown(self):
        for i in sorted(session.models):
            session.compare(i)


def _damaged(data, how, draw):
    place = draw.draw(st.integers(0, len(data) - 1), "place")
    if how == "cut":
        return data[:place]
    if how == "flip":
        bit = 1 << draw.draw(st.integers(0, 7), "bit")
        return data[:place] + bytes([data[place] ^ bit]) + data[place + 1 :]
    items = json.loads(data)
    odd = st.sampled_from((None, -1, "\ud800%n", [], {}, math.nan, 1e308, 10**400, True))
    items[place % len(items)] = draw.draw(odd, "value")
    return json.dumps(items).encode()


def main(folder, trace, examples, steps, chosen):
    global session
    with open(trace, "wb", buffering=0) as stream:
        session = Session(folder, stream)
        machine = seed(chosen)(CallOrder) if chosen else CallOrder
        run_state_machine_as_test(
            machine,
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
        session.player.play("free", "fresh")


if __name__ == "__main__":
    folder, trace, *numbers = sys.argv[1:]
    main(folder, trace, *map(int, numbers))
