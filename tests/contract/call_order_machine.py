"""A hypothesis state machine over FMI 2.0 calls; a script, so that a crash doesn't end pytest.

    python call_order_machine.py FOLDER TRACE EXAMPLES STEPS SEED

FOLDER is the extracted FMU. Every call is written to TRACE before it is made. SEED 0: at random.
"""

import json
import math
import sys

import hypothesis.strategies as st
from call_order import STEPPING, Session
from fmi2_calls import EXTRA
from fmpy import read_model_description
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule, run_state_machine_as_test

INSTANCES, STATES, BYTES = ("0", "1", "2"), ("0", "1", "2", "3"), ("0", "1")

ODD_NUMBERS = (
    math.nan, math.inf, -math.inf, -1.0, -0.0, 0.0, 5e-324, -5e-324, 2.2e-308, 1e-160, 1e160, 1e300,
    -1e300, 1.7976931348623157e308,
)  # fmt: skip
ODD_LAWS = (0, 3, -1, 2**31 - 1, -(2**31))

#: 2.5e-5 s: some 20 steps in contact.
SIZES = (2.5e-5, 2.5e-5, 2.5e-5, 1e-4, 3e-6, 1e-4 / 3.0, 1e-3, 1e-9, 1.0)
ODD_SIZES = (
    0.0, -0.0, -1e-4, math.nan, math.inf, -math.inf, 5e-324, 1e-200, 1e-15, 1e30, 1e100, 1e101,
)  # fmt: skip
ODD_SHIFTS = (0.0, 1e-7, -1e-7, 1e-3, -1.0, 5.0, 1e9, math.nan, math.inf, -math.inf)
ODD_REFERENCES = (35, 36, 1000, 2**31 - 1, 2**31, 2**32 - 2, 2**32 - 1)

session = None

types = st.sampled_from(("real", "integer", "boolean", "string"))
any_reference = st.one_of(st.integers(0, 34), st.sampled_from(ODD_REFERENCES))


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

    def step_and_read(self, i, size, number, references=None):
        for _ in range(number):
            session.step(i, session.models[i].point, size)
            if references != ():
                self.read(i, references)

    def read(self, i, references=None):
        real = session.by_type["real"]
        moving = session.physics.moving if references is None else references
        session.get(i, "real", [reference for reference in moving if reference in real])

    def usual(self, data, names):
        """A variable among these and a value of it."""
        name = data.draw(st.sampled_from(tuple(names)), "name")
        return name, data.draw(st.sampled_from(session.physics.usual[name]), "value")

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
        optional = {n: st.sampled_from(values) for n, values in session.physics.usual.items()}
        fixed = {"law": optional.pop("law")} if "law" in optional else {}
        values = data.draw(st.fixed_dictionaries(fixed, optional=optional))
        if values.get("law") == 1:
            values |= {"exponent": 1.0, "restitution_at_rest": 0.0}
        self.start(i, start, values)
        # A touch at this very instant is decided by what is set now, even if it has been read.
        if data.draw(st.booleans(), "read"):
            self.read(i)
        if data.draw(st.booleans(), "set"):
            self.put(i, *self.usual(data, session.physics.inputs[-1:]))
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
        names = (*session.physics.usual, *session.physics.inputs * 4)
        self.put(self.any_instance(data), *self.usual(data, names))

    @rule(data=st.data())
    def set_odd_and_back(self, data):
        i = self.any_instance(data)
        name, _ = self.usual(data, session.physics.usual)
        before = session.models[i].values[session.names[name]]
        odd = {"integer": ODD_LAWS, "boolean": (True, False), "real": ODD_NUMBERS}
        odd = odd[session.variables[session.names[name]].type]
        self.put(i, name, data.draw(st.sampled_from(odd)))
        if data.draw(st.booleans(), "step with it"):
            session.step(i, session.models[i].point, 1e-5)
        if data.draw(st.booleans(), "back"):
            self.put(i, name, before)

    @rule(data=st.data(), type_=types)
    def set_anything(self, data, type_):
        values = {
            "real": st.one_of(st.floats(), st.sampled_from(ODD_NUMBERS)),
            "integer": st.integers(-(2**31), 2**31 - 1),
            "boolean": st.integers(-2, 2),
            "string": st.sampled_from(("", "1", "µ%s%n")),
        }[type_]
        pairs = st.lists(st.tuples(any_reference, values), max_size=4)
        session.set(self.any_instance(data), type_, data.draw(pairs))

    @rule(data=st.data(), type_=st.sampled_from(("real", "real", "real", "integer", "boolean")))
    def get(self, data, type_):
        all_ = session.by_type[type_]
        some = st.lists(st.sampled_from(all_), min_size=1, max_size=6) if all_ else st.just([])
        first = next(r for r in session.physics.moving if r in session.by_type["real"])
        moving = st.integers(1, 6).map(lambda count: range(first, first + count))
        choice = st.one_of(st.just(all_), some, *[moving] * (type_ == "real"))
        session.get(self.any_instance(data), type_, data.draw(choice))

    @rule(data=st.data(), type_=types, references=st.lists(any_reference, max_size=4))
    def get_anything(self, data, type_, references):
        session.get(self.any_instance(data), type_, references)

    # Steps

    @rule(data=st.data(), size=st.sampled_from(SIZES), number=st.integers(1, 24))
    def steps(self, data, size, number):
        i = self.any_instance(data)
        if data.draw(st.booleans(), "corrected before"):
            self.correct(i)
        references = data.draw(st.sampled_from(((), None, session.physics.metrics)))
        self.step_and_read(i, size, number, references)

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
            name = session.physics.inputs[0]
            one, two, *_ = session.physics.usual[name]
            same = session.models[i].values[session.names[name]] == two
            self.put(i, name, one if same else two)
        elif odd == "bad input":
            self.put(i, session.physics.inputs[1 % len(session.physics.inputs)], math.nan)
        elif odd == "bad step":
            session.step(i, -1e9, 1e-5)
        elif odd == "reset":
            session.reset(i)
        session.restore(i, "rollback")
        session.drop(i, "rollback")
        self.read(i)
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
        """Cut or others: tests/contract/test_state.py has more kinds of damage."""
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
        session = Session(folder, stream, read_model_description(folder).modelName)
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
        session.play("free", "fresh")


if __name__ == "__main__":
    folder, trace, *numbers = sys.argv[1:]
    main(folder, trace, *map(int, numbers))
