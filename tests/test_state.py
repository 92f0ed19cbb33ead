"""Full state of an instance: rollback, other processes, and a random walk against a straight run.

Everything here is equal to the last bit: a state is all of an instance or it is nothing.
"""

import json
import random

import pytest
from command import run_python
from conftest import HERE, KINDS, some
from fmpy.fmi1 import FMICallException
from golf_physics.component.component import Component
from instances import begin, discard, get_all, make_instance, put

POINTS = 400
STEP = 2e-6  # the contact lasts about 300 of these


@pytest.fixture
def make(extracted):
    """Instances in stepping mode, terminated and freed at the end."""
    slaves = []

    def make(start=True, **values):
        slaves.append(make_instance(extracted, f"impact {len(slaves)}"))
        return begin(slaves[-1], **values) if start else slaves[-1]

    yield make
    discard(*slaves)


def inputs_at(n):
    """k and b, changed now and then, in contact too."""
    return {"k": 1e6 + 2e5 * ((n // 60) % 3), "b": 9.0 + 5.0 * ((n // 90) % 2)}


def advance(slave, n):
    put(slave, **inputs_at(n))
    slave.doStep(n * STEP, STEP)


@pytest.mark.parametrize("values", KINDS.values(), ids=KINDS)
def test_a_random_walk_equals_a_straight_run(make, values):
    straight, walker = make(**values), make(**values)
    path = [get_all(straight)]
    for n in range(POINTS):
        advance(straight, n)
        path.append(get_all(straight))
    choice = random.Random(4)
    saved = {0: walker.getFMUstate()}
    n = 0
    for _ in range(6 * POINTS):
        what = choice.random()
        if what < 0.86 and n < POINTS:
            advance(walker, n)
            n += 1
            if choice.random() < 0.5:
                assert get_all(walker) == path[n]
        elif what < 0.93:
            if n not in saved:
                saved[n] = walker.getFMUstate()
        else:
            n = choice.choice(list(saved))
            walker.setFMUstate(saved[n])
            assert get_all(walker) == path[n]
    while n < POINTS:
        advance(walker, n)
        n += 1
    assert get_all(walker) == path[POINTS]
    assert len(saved) > 20
    for state in saved.values():
        walker.freeFMUstate(state)


@pytest.mark.parametrize("values", KINDS.values(), ids=KINDS)
def test_a_state_moves_to_another_instance_as_bytes(make, values):
    first, second = make(**values), make()
    for n in range(150):
        advance(first, n)
    state = first.getFMUstate()
    packed = first.serializeFMUstate(state)
    first.freeFMUstate(state)
    state = second.deSerializeFMUstate(packed)
    second.setFMUstate(state)
    second.freeFMUstate(state)
    assert get_all(second) == get_all(first)
    for n in range(150, POINTS):
        advance(first, n)
        advance(second, n)
        assert get_all(second) == get_all(first)


_OTHER = """
import json, sys
sys.path.insert(0, sys.argv[1])
from instances import discard, get_all, make_instance, put
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
    touched, in_contact, separated = get_all(slave)[1]
    assert (touched, in_contact, separated) == (1, 1, 0)
    state = slave.getFMUstate()
    packed = slave.serializeFMUstate(state)
    slave.freeFMUstate(state)
    for n in range(150, POINTS):
        advance(slave, n)
    inputs = [inputs_at(n) for n in range(POINTS)]
    given = json.dumps([str(extracted), packed.hex(), 150, POINTS, STEP, inputs])
    done = run_python(_OTHER, HERE, input=given)
    reals, flags = json.loads(done.stdout.splitlines()[-1])
    assert (reals, flags) == get_all(slave)


@pytest.mark.parametrize(
    "damage",
    [b" ", b"nonsense", b"null", b"{}", b"[1, 2]", b"\xff\xfe", b'["golf-impact state 2"]'],
)
def test_bytes_that_are_no_state_are_refused(make, damage):
    slave = make()
    slave.doStep(0.0, 1e-4)
    before = get_all(slave)
    state = slave.deSerializeFMUstate(damage)
    slave.setFMUstate(state)
    slave.freeFMUstate(state)
    assert get_all(slave) == before
    with pytest.raises(FMICallException):
        slave.doStep(1e-4, 1e-4)
    slave.doStep(1e-4, 1e-4)


def test_damaged_bytes_are_refused_wherever_the_damage_is(make):
    """Cut anywhere, or any one bit wrong."""
    slave = make()
    slave.doStep(0.0, 1e-4)
    state = slave.getFMUstate()
    packed = slave.serializeFMUstate(state)
    slave.freeFMUstate(state)
    assert Component.unpacked(packed) is not None
    for n in range(len(packed)):
        assert Component.unpacked(packed[:n]) is None, n
        for bit in range(8):
            damaged = packed[:n] + bytes([packed[n] ^ 1 << bit]) + packed[n + 1 :]
            assert Component.unpacked(damaged) is None, (n, bit)


def test_a_state_before_the_first_step_and_before_initialization(make):
    slave = make(start=False)
    fresh = slave.getFMUstate()
    begin(slave, club_speed=50.0)
    ready = slave.getFMUstate()
    slave.doStep(0.0, 1.0)
    after = get_all(slave)
    slave.setFMUstate(ready)
    slave.doStep(0.0, 1.0)
    assert get_all(slave) == after
    slave.setFMUstate(fresh)
    begin(slave)
    slave.doStep(0.0, 1.0)
    other = make()
    other.doStep(0.0, 1.0)
    assert get_all(slave) == get_all(other)
    for state in (fresh, ready):
        slave.freeFMUstate(state)
