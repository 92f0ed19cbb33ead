"""The state of an instance as bytes: equal to the last bit in another process, or refused.

Rollback and calls in any order: test_call_order.py.
"""

import json

import pytest
from command import run_python
from conftest import HERE, KINDS, some
from golf_physics.component.component import Component
from instances import begin, discard, get_all, make_instance, put

POINTS = 400
STEP = 2e-6  # the contact lasts about 300 of these


@pytest.fixture
def make(extracted):
    """Instances in stepping mode, terminated and freed at the end."""
    slaves = []

    def make(**values):
        slaves.append(make_instance(extracted, f"impact {len(slaves)}"))
        return begin(slaves[-1], **values)

    yield make
    discard(*slaves)


def inputs_at(n):
    """k and b, changed now and then, in contact too."""
    return {"k": 1e6 + 2e5 * ((n // 60) % 3), "b": 9.0 + 5.0 * ((n // 90) % 2)}


def advance(slave, n):
    put(slave, **inputs_at(n))
    slave.doStep(n * STEP, STEP)


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
    arguments = json.dumps([str(extracted), packed.hex(), 150, POINTS, STEP, inputs])
    done = run_python(_OTHER, HERE, input=arguments)
    reals, flags = json.loads(done.stdout.splitlines()[-1])
    assert (reals, flags) == get_all(slave)


def test_any_damage_is_detected(make):
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
