"""Invalid input: the old value remains, a message gives the reason, and the run can continue."""

import math
from contextlib import nullcontext, suppress

import pytest
from fmpy.fmi1 import FMICallException
from fmus import initialize

from golf_impact.runs import METRICS


def begin(fmu, **values):
    """As ImpactFmu.start, without an error: the test checks the messages of the FMU."""
    fmu.messages.clear()
    fmu.slave.setFMUstate(fmu._initial)
    initialize(fmu.slave, **values)


def is_discarded(fmu, point=0.0, size=1e-4):
    with pytest.raises(FMICallException) as error:
        fmu.slave.doStep(point, size)
    return error.value.status == 2


BAD = [
    *(("k", value, "> 0") for value in (0.0, -1.0, math.nan, math.inf)),
    *((name, 0.0, "> 0") for name in ("m_club", "ball_diameter", "reference_compression")),
    ("m_ball", -0.1, "> 0"),
    *((name, -1e-9, ">= 0") for name in ("b", "gap", "restitution_slope")),
    *(("club_speed", value, "finite") for value in (math.nan, math.inf)),
    *((name, -math.inf, allowed) for name, allowed in (("b", ">= 0"), ("ball_speed", "finite"))),
    ("exponent", 0.5, "between 1 and 12"),
    ("restitution_at_rest", 1.5, "between 0 and 1"),
]


@pytest.mark.parametrize(("name", "value", "allowed"), BAD)
def test_out_of_range_before_the_run(fmu, name, value, allowed):
    good = float(fmu.variables[name].start)
    begin(fmu, **{name: value})
    message = fmu.messages[0]
    assert name in message
    assert allowed in message
    assert fmu.read([name])[name] == good
    with suppress(FMICallException):
        fmu.slave.exitInitializationMode()
    assert is_discarded(fmu)
    assert is_discarded(fmu), "refused until corrected"
    fmu.set({name: good})
    fmu.slave.doStep(0.0, 1.0)
    assert fmu.read(METRICS) == fmu.impact()


STEPS = [
    *((1e-4, size, "step size") for size in (0.0, -1e-6, math.nan, math.inf, -math.inf)),
    *(
        (point, 1e-4, "communication point")
        for point in (0.0, 2e-4, 1.5e-4, 1.00000101e-4, 0.99999899e-4, -1e-4, math.nan, math.inf)
    ),
]


@pytest.mark.parametrize(("point", "size", "reason"), STEPS)
def test_invalid_steps(fmu, point, size, reason):
    begin(fmu)
    with suppress(FMICallException):
        fmu.slave.exitInitializationMode()
    fmu.slave.doStep(0.0, 1e-4)
    assert is_discarded(fmu, point, size)
    assert reason in fmu.messages[-1]
    # A millionth of the step is allowed.
    fmu.slave.doStep(1.00000099e-4, 1e-4)
    fmu.slave.doStep(2e-4, 1.0)
    assert fmu.read(METRICS) == pytest.approx(fmu.impact(), rel=1e-13)


def test_calls_in_the_wrong_state(fmu, is_native):
    slave = fmu.slave
    slave.setFMUstate(fmu._initial)
    assert is_discarded(fmu)
    assert "before the end of initialization" in fmu.messages[-1]
    begin(fmu)
    slave.exitInitializationMode()
    slave.doStep(0.0, 1.0)
    last = fmu.read(METRICS)
    slave.terminate()
    assert fmu.read(METRICS) == last
    assert is_discarded(fmu, 1.0)
    with pytest.raises(FMICallException) if is_native else nullcontext():
        fmu.set({"k": 2e6})
    assert "after the end of the run" in fmu.messages[-1]
    assert fmu.impact() == last
