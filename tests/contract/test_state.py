"""The state of an instance as bytes: equal to the last bit in another process, or refused.

Rollback, states among other calls and damaged ones: test_lockstep.py.
"""

import json
from binascii import crc32
from contextlib import suppress

import fmus
import pytest
from cases import KINDS
from command import run_python
from conftest import HERE, some
from fmpy.fmi1 import FMICallException
from ways import FMUS

from golf_build.system import COMPANIONS

_SPEEDS = {"club_velocity": 24.0, "smash_factor": 50.0 / 35.0, "coefficient_of_restitution": 0.74}
_SEPARATED = {"separated": True, "ball_velocity": 50.0}
_IMPACTS = [values | {"club_force": 300.0} for values in KINDS.values()]

#: By model: values of runs, step size (s; a contact is some 300 steps), how many steps until the
#: state is saved, and inputs after some of these.
RUNS = {
    "ClubBallImpact": (_IMPACTS, 2e-6, 150, {60: {"k": 1.2e6}, 90: {"b": 14.0}, 300: {"k": 8e5}}),
    # Into the downswing, 2 ms before the ball.
    "Swing": ([{}, {"spin_loft": 0.2}], 3.2e-3, 300, {297: {"impulse": 3.0}}),
    "Launch": ([_SEPARATED | _SPEEDS, {}], 1e-3, 3, {}),
    "BallFlight": ([_SEPARATED, {}], 1e-3, 300, {}),
}

_OTHER = """
import json, sys
sys.path.insert(0, sys.argv[1])
import fmus
for folder, data, first, inputs, step in json.loads(sys.stdin.read()):
    slave = fmus.make_instance(folder)
    fmus.restore_packed(slave, bytes.fromhex(data))
    for n in range(first, first + 250):
        fmus.put(slave, **inputs.get(str(n), {}))
        slave.doStep(n * step, step)
        print(repr(fmus.read(slave)))
    fmus.discard(slave)
"""


@pytest.mark.parametrize("number", some(1, range(len(_IMPACTS))))
def test_a_state_moves_to_another_process_in_mid_contact(way_of, pytestconfig, number):
    tasks, expected = [], []
    native = [name for name in FMUS if "native" in name]
    for name in native if pytestconfig.getoption("--native") else (*FMUS, *COMPANIONS):
        way = way_of(name)
        cases, step, first, inputs = RUNS[way.model]
        for values in cases[number : number + 2]:
            way.begin(values)
            for n in range(first + 250):
                if n == first:
                    data = fmus.packed(way.slave).hex()
                    tasks.append([way.slave.unzipDirectory, data, first, inputs, step])
                way.set(**inputs.get(n, {}))
                assert way.step(step, n * step), way.messages
                if n >= first:
                    expected.append(repr(fmus.read(way.slave)))
    done = run_python(_OTHER, HERE, input=json.dumps(tasks))
    assert done.stdout.splitlines() == expected


def test_what_is_no_state_of_this_fmu_is_refused(any_fmu, way_of):
    """It costs a step, and has no other effect: bytes, and another FMU's memory."""
    other = way_of("Swing" if any_fmu.model != "Swing" else "Launch").begin()
    memory, body = fmus.call_state(other.slave, "get"), b'["golf-impact state 14", [1, 2]'
    way = any_fmu.begin()
    assert way.step(1e-4)
    whole, before = fmus.packed(way.slave), way.read()
    made = body + f", {crc32(body)}]".encode()
    for data in (whole + b" ", whole[:-1], b"", b"{}", b"[1, 2]", made, fmus.packed(other.slave)):
        with suppress(FMICallException):
            fmus.restore_packed(way.slave, data)
        assert "a state that this component didn't make" in way.messages[-1]
        assert not way.step(1e-4), data
        assert repr(way.read()) == repr(before)
    # The C layer of a plain FMU takes any pointer for a state.
    for call in ("serialize", "free") if "native" in way.slave.description.generationTool else ():
        with pytest.raises(FMICallException):
            fmus.call_state(way.slave, call, memory)
    with suppress(FMICallException):
        fmus.call_state(way.slave, "set", memory)
    assert not way.step(1e-4)
    assert repr(way.read()) == repr(before)
    assert way.step(1e-4)
    fmus.call_state(other.slave, "free", memory)
