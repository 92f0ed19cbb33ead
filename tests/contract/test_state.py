"""The state of an instance as bytes: equal to the last bit in another process, or refused.

Rollback and calls in any order: test_call_order.py.
"""

import json
import math
import random

import components
import pytest
from cases import KINDS
from command import run_python
from components import initialized
from conftest import HERE, some
from fmpy.fmi1 import FMICallException
from fmus import begin, get_all, mutated, put, with_checksum
from golf_physics.component.component import Component
from golf_physics.component.hybrid import HybridComponent
from golf_physics.variables import VARIABLES

REALS = [row.reference for row in VARIABLES if (row.causality, row.type) == ("output", "Real")]
POINTS = 400
STEP = 2e-6  # the contact lasts about 300 of these


@pytest.fixture
def make(extracted, made):
    def make(**values):
        return begin(made(extracted), **values)

    return make


def inputs_at(n):
    """k and b, changed now and then, in contact too."""
    return {"k": 1e6 + 2e5 * ((n // 60) % 3), "b": 9.0 + 5.0 * ((n // 90) % 2)}


def advance(slave, n):
    put(slave, **inputs_at(n))
    slave.doStep(n * STEP, STEP)


_OTHER = """
import json, sys
sys.path.insert(0, sys.argv[1])
from fmus import discard, get_all, make_instance, put
extracted, packed, begin, end, step, inputs = json.loads(sys.stdin.read())
slave = make_instance(extracted)
state = slave.deSerializeFMUstate(bytes.fromhex(packed))
slave.setFMUstate(state)
slave.freeFMUstate(state)
for n in range(begin, end):
    put(slave, **inputs[n])
    slave.doStep(n * step, step)
print(json.dumps(get_all(slave)))
discard(slave)
"""


@pytest.mark.parametrize("values", some(3, KINDS))
def test_a_state_moves_to_another_process_in_mid_contact(make, extracted, values):
    slave = make(**values)
    for n in range(150):
        advance(slave, n)
    assert get_all(slave)[1] == [1, 1, 0]
    state = slave.getFMUstate()
    packed = slave.serializeFMUstate(state)
    slave.freeFMUstate(state)
    for n in range(150, POINTS):
        advance(slave, n)
    inputs = [inputs_at(n) for n in range(POINTS)]
    arguments = json.dumps([str(extracted), packed.hex(), 150, POINTS, STEP, inputs])
    done = run_python(_OTHER, HERE, input=arguments)
    reals, flags = json.loads(done.stdout.splitlines()[-1])
    assert (reals, flags) == get_all(slave)


def is_accepted(slave, is_native, data):
    """Whether these bytes are those of a state."""
    if not is_native:
        return Component.unpacked(data) is not None
    try:
        slave.freeFMUstate(slave.deSerializeFMUstate(data))
    except FMICallException:
        return False
    return True


def test_any_damage_is_detected(make, is_native):
    """Cut anywhere, or any one bit wrong."""
    slave = make()
    slave.doStep(0.0, 1e-4)
    state = slave.getFMUstate()
    packed = slave.serializeFMUstate(state)
    slave.freeFMUstate(state)
    assert is_accepted(slave, is_native, packed)
    for n in range(len(packed)):
        assert not is_accepted(slave, is_native, packed[:n]), n
        for bit in range(8):
            damaged = packed[:n] + bytes([packed[n] ^ 1 << bit]) + packed[n + 1 :]
            assert not is_accepted(slave, is_native, damaged), (n, bit)


# States that no instance has made

STATES = {name: values for name, values in KINDS.items() if name != "never separates"}


def solve(component, time):
    """Model Exchange: the calls of a solver that stays where it is."""
    component.set_time(time)
    component.set_states(component.states())
    component.derivatives()
    component.indicators()
    component.update()


def states():
    """Serialized states of both components: approach, contact, changed contact, flight, solved."""
    for kind in (Component, HybridComponent):
        for values in STATES.values():
            component = initialized(kind, **{**values, "gap": 0.002})
            for n in range(4):
                components.put(component, k=1e6 + 1e5 * n, club_force=100.0 * n)
                component.step(n * 1e-4, 1e-4)
                yield kind, kind.packed(component.snapshot())
            component.step(4e-4, 1e-3)
            components.put(component, k=-1.0)
            yield kind, kind.packed(component.snapshot())
    component = initialized(HybridComponent, gap=0.0)
    solve(component, 0.0)
    yield HybridComponent, HybridComponent.packed(component.snapshot())


@pytest.mark.parametrize("seed", some(1, range(20), 4))
def test_states_of_any_content_are_refused_or_restored(seed):
    rng, accepted, tried = random.Random(seed), 0, 0
    for kind, data in states():
        assert kind.unpacked(data) is not None
        for _ in range(20):
            component, tried = initialized(kind), tried + 1
            snapshot = kind.unpacked(mutated(rng, data))
            component.restore(snapshot)
            accepted += snapshot is not None
            component.step(0.9, 1e-4)
            component.reals(list(range(20)) + list(range(23, 35)))
            component.discretes([20, 21, 22], "Boolean")
            if kind is HybridComponent:
                component.step_to_event(1.0, 1e-4, True)
                solve(component, 2.0)
    assert 0.1 < accepted / tried < 0.6


def random_run(rng):
    """Values, and steps (s) with the inputs set before each."""
    values = {"law": rng.choice([1, 2]), "b": rng.choice([0.0, rng.uniform(1.0, 60.0)])}
    values["gap"] = rng.choice([0.0, 1e-4])
    if values["law"] == 2 and rng.random() < 0.7:
        values["exponent"] = rng.choice([1.5, rng.uniform(1.0, 3.0)])
    values["club_force"] = rng.choice([0.0, rng.uniform(-500.0, 800.0)])
    chances = {
        "k": (0.2, (5e5, 2e6)),
        "b": (0.1, (0.0, 60.0)),
        "club_force": (0.3, (-500.0, 800.0)),
    }
    steps = []
    for _ in range(rng.randint(1, 8)):
        inputs = {n: rng.uniform(*span) for n, (p, span) in chances.items() if rng.random() < p}
        steps.append((rng.choice([2e-5, 1e-4, 3e-4]), inputs))
    return values, steps


@pytest.mark.parametrize("seed", some(2, range(40), 12))
def test_the_first_read_of_a_restored_state(seed):
    """A phase is a value: what an instance reads doesn't depend on what was read before."""
    rng = random.Random(seed)
    for _ in range(5):
        values, steps = random_run(rng)
        kind, time, expected, saved = rng.choice([Component, HybridComponent]), 0.0, [], []
        component = initialized(kind, **values)
        for size, inputs in steps:
            components.put(component, **inputs)
            assert component.step(time, size)
            time += size
            # Some of the states are of an instance that has never been read.
            if rng.random() < 0.6:
                expected.append((component.reals(REALS), len(saved)))
            saved.append(kind.packed(component.snapshot()))
        expected.append((component.reals(REALS), len(saved) - 1))
        for reals, place in expected:
            other = kind(pytest.fail)
            other.restore(kind.unpacked(saved[place]))
            assert other.reals(REALS) == reals, (values, steps, place)


def test_runs_of_a_restored_initialization_equal_those_of_fresh_instances():
    """What an instance keeps for the next such run isn't seen in a result, nor the sign of zero."""
    rng, read = random.Random(5), [row.reference for row in VARIABLES if row.type == "Real"]
    fresh = Component(pytest.fail)
    fresh.enter_initialization()
    components.put(fresh, ball_speed=1.0, gap=0.01)
    start, reused = fresh.snapshot(), Component(pytest.fail)
    choices = {"k": (5e5, 1e6), "club_speed": (0.0, -0.0, 35.0), "ball_speed": (0.0, -0.0)}
    for _ in range(300):
        values = {name: rng.choice(some) for name, some in choices.items() if rng.random() < 0.5}
        outputs = []
        for component in reused, Component(pytest.fail):
            component.restore(start)
            components.put(component, **values)
            component.exit_initialization()
            component.step(0.0, 1e-3)
            outputs.append(repr(component.reals(read)))
        assert outputs[0] == outputs[1], values


def test_a_deep_state_is_refused():
    assert Component.unpacked(with_checksum(b"[" * 100_000)) is None


def test_co_simulation_and_model_exchange_keep_their_states_apart():
    messages = []
    stepped = initialized(HybridComponent, messages.append)
    solved = initialized(HybridComponent, messages.append)
    stepped.step(0.0, 1e-4)
    solve(solved, 0.0)
    saved = stepped.snapshot(), solved.snapshot()
    before = stepped.reals([13, 17]), solved.states()
    stepped.restore(saved[1])
    solved.restore(saved[0])
    assert len(messages) == 2
    assert "a state that this component didn't make is refused" in str(messages[0])
    assert (stepped.reals([13, 17]), solved.states()) == before
    # An instance that is neither may become both.
    fresh = initialized(HybridComponent, messages.append)
    fresh.restore(saved[0])
    solve(fresh, 1e-4)
    assert "this instance has made steps" in str(messages[-1])
    assert all(map(math.isnan, fresh.derivatives()))
    plain = initialized(Component, messages.append)
    plain.restore(saved[1])
    assert "a state that this component didn't make is refused" in str(messages[-1])
