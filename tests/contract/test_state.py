"""The state of an instance as bytes: equal to the last bit in another process, or refused.

Rollback and calls in any order: test_lockstep.py.
"""

import json
import random
from contextlib import suppress

import components
import fmus
import pytest
from cases import KINDS
from command import run_python
from conftest import HERE, some
from fmpy.fmi1 import FMICallException
from golf_physics.component.component import Component
from golf_physics.variables import VARIABLES

_SEPARATED = {"separated": True, "ball_velocity": 50.0}
_SPEEDS = {"club_velocity": 24.0, "smash_factor": 50.0 / 35.0, "coefficient_of_restitution": 0.74}
_IMPACTS = [values | {"club_force": 300.0} for values in KINDS.values()]

#: By model: values of runs, step size (s; a contact is some 300 steps), and how many steps.
RUNS = {
    "ClubBallImpact": (_IMPACTS, 2e-6, 150),
    # Into the downswing, 2 ms before the ball.
    "Swing": ([{}, {"spin_loft": 0.2}], 3.2e-3, 300),
    "Launch": ([_SEPARATED | _SPEEDS, {}], 1e-3, 3),
    "BallFlight": ([_SEPARATED, {}], 1e-3, 300),
}


def inputs_at(model, n):
    """k and b, changed now and then, in contact too; of a swing an impulse on the head."""
    if model == "Swing":
        return {"impulse": 3.0 if n >= 297 else 0.0}
    if model != "ClubBallImpact":
        return {}
    return {"k": 1e6 + 2e5 * ((n // 60) % 3), "b": 9.0 + 5.0 * ((n // 90) % 2)}


def run_to_middle(way, values):
    """Into contact; how many steps, and their size (s)."""
    model = way.slave.description.modelName
    _, step, number = RUNS[model]
    way.begin(values)
    for n in range(number):
        way.set(**inputs_at(model, n))
        assert way.step(step), way.messages
    return number, step


_OTHER = """
import json, sys
sys.path.insert(0, sys.argv[1])
import fmus
for folder, data, first, inputs, step in json.loads(sys.stdin.read()):
    slave = fmus.make_instance(folder)
    fmus.restore_packed(slave, bytes.fromhex(data))
    for n, one in enumerate(inputs, first):
        fmus.put(slave, **one)
        slave.doStep(n * step, step)
        print(repr(fmus.get_all(slave)))
    fmus.discard(slave)
"""


@pytest.mark.parametrize("number", some(1, range(len(_IMPACTS))))
def test_a_state_moves_to_another_process_in_mid_contact(any_fmu, number):
    model = any_fmu.slave.description.modelName
    cases, expected = RUNS[model][0], []
    tasks = []
    for values in cases[number : number + 2]:
        first, step = run_to_middle(any_fmu, values)
        data = fmus.packed(any_fmu.slave)
        inputs = [inputs_at(model, n) for n in range(first, first + 250)]
        for n, one in enumerate(inputs, first):
            any_fmu.set(**one)
            assert any_fmu.step(step, n * step)
            expected.append(repr(fmus.get_all(any_fmu.slave)))
        tasks.append([any_fmu.slave.unzipDirectory, data.hex(), first, inputs, step])
    done = run_python(_OTHER, HERE, input=json.dumps(tasks))
    assert done.stdout.splitlines() == expected


def test_after_a_restore_the_time_may_be_another(any_fmu):
    """Once: the next step begins where that one ended."""
    values = RUNS[any_fmu.slave.description.modelName][0][0]
    run_to_middle(any_fmu, values)
    any_fmu.restore(any_fmu.save())
    assert any_fmu.step(1e-5, 7.0)
    assert not any_fmu.step(1e-5, 8.0)


def refuse(way, data):
    """Bytes that are no state have no effect, but for one refused step."""
    with suppress(FMICallException):
        fmus.restore_packed(way.slave, data)
        assert not way.step(1e-3), data
        assert "a state" in way.messages[-1]


def test_any_damage_is_detected(any_fmu):
    """Cut anywhere, any bit wrong, longer, of another FMU: it has no effect."""
    way = any_fmu
    model = way.slave.description.modelName
    values = RUNS[model][0][0]
    run_to_middle(way, values)
    whole = fmus.packed(way.slave)
    assert way.step(1e-3)
    undisturbed = repr(fmus.get_all(way.slave))
    way.begin(values)
    run_to_middle(way, values)
    wrong = [bytes([*whole[:n], b ^ 1 << n % 8, *whole[n + 1 :]]) for n, b in enumerate(whole)]
    others = [whole + b" ", b"", b"{}", b"[1, 2]", fmus.with_checksum(b'["Swing", 1')]
    for data in (*wrong, *(whole[:n] for n in range(0, len(whole), 5)), *others):
        refuse(way, data)
    assert way.step(1e-3)
    assert repr(fmus.get_all(way.slave)) == undisturbed


def test_a_state_of_another_fmu_is_refused(way_of):
    """Its bytes and its memory."""
    swing = way_of("Swing").begin()
    memory, data = fmus.call_state(swing.slave, "get"), fmus.packed(swing.slave)
    for name in ("BallFlight", "FMI 2.0", "native, FMI 2.0"):
        way = way_of(name).begin()
        refuse(way, data)
        with suppress(FMICallException):
            fmus.call_state(way.slave, "set", memory)
        assert not way.step(1e-3)
        assert way.step(1e-3)
    fmus.call_state(swing.slave, "free", memory)


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
