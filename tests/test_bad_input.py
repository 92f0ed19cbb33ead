"""Invalid input: the old value remains, a message gives the reason, and the run can continue."""

import json
import math

import pytest
from fmpy.fmi1 import FMICallException

from golf_impact.fmu.impact_fmu import METRICS


def set_real(fmu, name, value):
    fmu.slave.setReal(fmu.references([name]), [value])


def begin(fmu, **values):
    """As ImpactFmu.start, without an error: the test checks the messages of the FMU."""
    slave = fmu.slave
    slave.setFMUstate(fmu._fresh)
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    fmu.messages.clear()
    for name, value in values.items():
        if name == "law":
            slave.setInteger(fmu.references([name]), [value])
        else:
            set_real(fmu, name, value)


def is_discarded(fmu, point=0.0, size=1e-4):
    with pytest.raises(FMICallException) as error:
        fmu.slave.doStep(point, size)
    return error.value.status == 2


BAD = [
    ("k", 0.0, "> 0"),
    ("k", -1.0, "> 0"),
    ("k", math.nan, "> 0"),
    ("k", math.inf, "> 0"),
    ("b", -1e-9, ">= 0"),
    ("b", -math.inf, ">= 0"),
    ("club_speed", math.nan, "finite"),
    ("club_speed", math.inf, "finite"),
    ("m_club", 0.0, "> 0"),
    ("m_ball", -0.1, "> 0"),
    ("ball_diameter", 0.0, "> 0"),
    ("ball_speed", -math.inf, "finite"),
    ("gap", -0.01, ">= 0"),
    ("exponent", 0.5, ">= 1"),
    ("reference_compression", 0.0, "> 0"),
    ("restitution_at_rest", 1.5, "between 0 and 1"),
    ("restitution_slope", -1.0, ">= 0"),
]


@pytest.mark.parametrize(("name", "value", "allowed"), BAD)
def test_out_of_range_before_the_run(fmu, name, value, allowed):
    good = float(fmu.variables[name].start)
    begin(fmu, **{name: value})
    message = fmu.messages[0]
    assert name in message
    assert allowed in message
    assert fmu.read([name])[name] == good
    fmu.end_initialization()
    assert is_discarded(fmu)
    assert is_discarded(fmu), "it stays refused until it is corrected"
    set_real(fmu, name, good)
    fmu.slave.doStep(0.0, 1.0)
    assert fmu.read(METRICS) == fmu.impact()


@pytest.mark.parametrize("law", [0, 3, -1])
def test_no_such_law(fmu, law):
    begin(fmu, law=law)
    assert "law" in fmu.messages[0]
    assert "1 (absolute) or 2 (relative)" in fmu.messages[0]
    fmu.end_initialization()
    assert is_discarded(fmu)
    fmu.slave.setInteger(fmu.references(["law"]), [2])
    fmu.slave.doStep(0.0, 1.0)
    assert fmu.read(METRICS) == fmu.impact(law=2)


@pytest.mark.parametrize(("name", "value", "allowed"), [row for row in BAD if row[0] in "kb"])
def test_out_of_range_in_mid_contact(fmu, name, value, allowed):
    begin(fmu)
    fmu.end_initialization()
    fmu.slave.doStep(0.0, 3e-4)
    before = fmu.read(METRICS)
    set_real(fmu, name, value)
    assert allowed in fmu.messages[-1]
    assert is_discarded(fmu, 3e-4)
    assert fmu.read(METRICS) == before
    set_real(fmu, name, float(fmu.variables[name].start))
    fmu.slave.doStep(3e-4, 1.0)
    after = fmu.read(METRICS)
    fmu.start()
    fmu.step(0.0, 3e-4)
    fmu.step(3e-4, 1.0)
    assert after == fmu.read(METRICS)


@pytest.mark.parametrize("size", [0.0, -1e-6, math.nan, math.inf, -math.inf])
def test_step_sizes(fmu, size):
    begin(fmu)
    fmu.end_initialization()
    fmu.slave.doStep(0.0, 1e-4)
    assert is_discarded(fmu, 1e-4, size)
    assert "step size" in fmu.messages[-1]
    fmu.slave.doStep(1e-4, 1.0)
    assert fmu.read(METRICS) == pytest.approx(fmu.impact(), rel=1e-13)


@pytest.mark.parametrize("point", [0.0, 2e-4, 1.5e-4, -1e-4, math.nan, math.inf])
def test_a_communication_point_that_jumps(fmu, point):
    begin(fmu)
    fmu.end_initialization()
    fmu.slave.doStep(0.0, 1e-4)
    assert is_discarded(fmu, point)
    assert "communication point" in fmu.messages[-1]
    fmu.slave.doStep(1e-4 * (1.0 + 1e-9), 1e-4)


def test_any_communication_point_after_a_restored_state(fmu):
    begin(fmu, gap=0.35)
    fmu.end_initialization()
    state = fmu.slave.getFMUstate()
    fmu.slave.doStep(0.0, 0.5)
    fmu.slave.setFMUstate(state)
    fmu.slave.doStep(7.0, 0.5)
    fmu.slave.freeFMUstate(state)
    assert fmu.read(["touch_time"])["touch_time"] == pytest.approx(7.01, abs=1e-14)


def test_exponent_needs_law_2(fmu):
    begin(fmu, exponent=1.5)
    assert fmu.messages == []
    fmu.end_initialization()
    assert "exponent" in fmu.messages[0]
    assert is_discarded(fmu)
    set_real(fmu, "exponent", 1.0)
    fmu.slave.doStep(0.0, 1.0)
    assert fmu.read(METRICS) == fmu.impact()


def test_a_parameter_is_fixed_after_initialization(fmu):
    begin(fmu)
    fmu.end_initialization()
    set_real(fmu, "m_club", 0.3)
    assert "m_club" in fmu.messages[0]
    assert fmu.read(["m_club"])["m_club"] == 0.21
    assert is_discarded(fmu)
    set_real(fmu, "m_club", 0.21)
    fmu.slave.doStep(0.0, 1.0)
    assert fmu.read(METRICS) == fmu.impact()


def test_calls_in_the_wrong_state(fmu):
    slave = fmu.slave
    slave.setFMUstate(fmu._fresh)
    assert is_discarded(fmu)
    assert "before the end of initialization" in fmu.messages[-1]
    begin(fmu)
    slave.exitInitializationMode()
    slave.doStep(0.0, 1.0)
    last = fmu.read(METRICS)
    slave.terminate()
    assert fmu.read(METRICS) == last
    assert is_discarded(fmu, 1.0)
    set_real(fmu, "k", 2e6)
    assert "after the end of the run" in fmu.messages[-1]
    assert fmu.impact() == last


def test_outputs_cannot_be_set(fmu):
    begin(fmu)
    set_real(fmu, "force", 1.0)
    fmu.end_initialization()
    assert is_discarded(fmu)
    fmu.slave.doStep(0.0, 1.0)
    assert fmu.read(METRICS) == fmu.impact()


@pytest.mark.parametrize(
    "values", [{"k": 1e300}, {"m_ball": 1e-300}, {"club_speed": 1e200}, {"b": 1e300}, {"k": 5e-324}]
)
def test_values_that_overflow_together(fmu, values):
    """Allowed separately, but results leave the range of a double: rejected with the numbers."""
    begin(fmu, **values)
    fmu.end_initialization()
    assert "range of a double" in fmu.messages[0]
    assert is_discarded(fmu)


def serialized(fmu):
    state = fmu.slave.getFMUstate()
    data = fmu.slave.serializeFMUstate(state)
    fmu.slave.freeFMUstate(state)
    return data


@pytest.mark.parametrize("law", [1, 2])
@pytest.mark.parametrize("through_bytes", [False, True])
def test_state_in_mid_contact(fmu, law, through_bytes):
    names = [v for v in fmu.variables if fmu.variables[v].type == "Real"]

    def finish():
        fmu.slave.doStep(4e-4, 1e-4)
        first = fmu.read(names)
        set_real(fmu, "k", 1.3e6)
        fmu.slave.doStep(5e-4, 1.0)
        return first, fmu.read(names)

    fmu.start(law=law, gap=0.001)
    fmu.step(0.0, 1e-4)
    set_real(fmu, "b", 20.0)
    fmu.step(1e-4, 3e-4)
    state = fmu.slave.getFMUstate()
    data = serialized(fmu)
    now = fmu.read(names)
    straight = finish()
    fmu.start(law=3 - law, m_club=0.3)
    fmu.step(0.0, 2e-4)
    if through_bytes:
        fmu.slave.freeFMUstate(state)
        state = fmu.slave.deSerializeFMUstate(data)
    fmu.slave.setFMUstate(state)
    assert fmu.read(names) == now
    assert finish() == straight
    fmu.slave.freeFMUstate(state)


@pytest.mark.parametrize(
    "data", [b"", b"nonsense", b"[]", b'["another component", 1]', b"\xff\xfe", b"null"]
)
def test_bytes_that_are_not_a_state(fmu, data):
    begin(fmu)
    fmu.end_initialization()
    state = fmu.slave.deSerializeFMUstate(data)
    fmu.slave.setFMUstate(state)
    assert "state" in fmu.messages[-1]
    assert is_discarded(fmu)
    fmu.slave.doStep(0.0, 1.0)
    assert fmu.read(METRICS) == fmu.impact()


def test_a_state_is_json(fmu):
    fmu.start(gap=1.0)
    assert json.loads(serialized(fmu))[0].startswith("golf-impact state")


def test_reset_is_a_new_instance(fmu):
    slave = fmu.slave
    fmu.start(law=2, k=2e6)
    fmu.step(0.0, 1.0)
    slave.reset()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.doStep(0.0, 1.0)
    assert fmu.read(METRICS) == fmu.impact()


@pytest.mark.parametrize("reference", [2**32 - 1, 2**32 - 2, 1000])
def test_an_unknown_value_reference(fmu, reference):
    """pythonfmu passes a large unsigned reference as a negative one."""
    begin(fmu)
    fmu.end_initialization()
    fmu.slave.doStep(0.0, 1e-4)
    fmu.slave.setReal([reference], [50.0])
    assert "can't be set" in fmu.messages[-1]
    assert fmu.read(["k", "b", "club_speed"]) == {"k": 1e6, "b": 9.0, "club_speed": 35.0}
    assert is_discarded(fmu, 1e-4)
    fmu.slave.doStep(1e-4, 1.0)
