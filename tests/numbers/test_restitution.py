"""Damping chosen at touch, so that the coefficient of restitution falls with the approach speed."""

import math

import pytest
from fmpy.fmi1 import FMICallException
from golf_physics.restitution import damping_ratio
from quadrature import restitution

from golf_impact.runs import METRICS

AT_REST, SLOPE = 0.86, 0.0029
LINE = {"law": 2, "restitution_at_rest": AT_REST, "restitution_slope": SLOPE}
M_CLUB, M_BALL = 0.210, 0.04593
MU = M_CLUB * M_BALL / (M_CLUB + M_BALL)


@pytest.mark.parametrize(
    "coefficient",
    [
        *(1.0, 1.0 - 2.0**-53, 1.0 - 1e-9, 0.93, 0.7585, 0.3),
        # The iteration begins at critical damping: exp(-π).
        math.exp(-math.pi),
        *(math.exp(-2.0), 0.1353, 1e-3, 1e-12, 1e-29),
    ],
)
def test_damping_ratio(coefficient):
    assert abs(restitution(damping_ratio(coefficient)) - coefficient) < 4e-16 * coefficient**0.5


def changed(fmu, start, later):
    """The results of law 2 with inputs that change at 200 µs."""
    fmu.start(**start)
    fmu.step(0.0, 2e-4)
    fmu.set(later)
    fmu.step(2e-4, 1.0)
    return fmu.read(METRICS)


def test_damping_itself_is_not_used(fmu):
    """To the last bit, nor if it changes in contact."""
    assert fmu.impact(**LINE, b=9.0) == fmu.impact(**LINE, b=1e300)
    assert changed(fmu, LINE, {"b": 500.0}) == changed(fmu, LINE, {})


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_stiffness_that_changes_keeps_the_damping_ratio(fmu, exponent):
    moving = {"ball_speed": -5.0, "exponent": exponent}
    zeta = damping_ratio(AT_REST - SLOPE * 40.0)

    def b(k):
        return 2.0 * zeta * math.sqrt(0.5 * (exponent + 1.0) * k * MU)

    by_line = changed(fmu, LINE | moving, {"k": 2e6})
    values = {"law": 2, "b": b(1e6)} | moving
    assert by_line == pytest.approx(changed(fmu, values, {"k": 2e6, "b": b(2e6)}), rel=1e-13)


def test_a_line_at_1_is_elastic(fmu):
    elastic = fmu.impact(METRICS, law=2, b=0.0)
    assert fmu.impact(METRICS, law=2, restitution_at_rest=1.0) == elastic


@pytest.mark.parametrize("gap", [0.0, 0.0503])
@pytest.mark.parametrize("read_outputs", [False, True])
def test_a_restitution_out_of_reach_is_refused_at_touch(fmu, gap, read_outputs):
    fmu.start(**LINE, club_speed=400.0, gap=gap)
    for steps in range(1000):
        if read_outputs:
            fmu.read(["force", "compression"])
        try:
            fmu.slave.doStep(steps * 1e-5, 1e-5)
        except FMICallException:
            break
    assert "club_speed = 400.0 m/s is refused at touch" in fmu.messages[-1]
    # The touch is at gap / 400 m/s = 126 µs: the step that would reach it is refused, none before.
    assert steps == round(gap / 400.0 / 1e-5 - 0.5)
    with pytest.raises(FMICallException):
        fmu.slave.doStep(steps * 1e-5, 1e-5)
    # A slower club may continue, as if the faster speed had never been set.
    fmu.set({"club_speed": 40.0})
    fmu.step(steps * 1e-5, 1.0)
    outputs = fmu.read(METRICS)
    touch = steps * 1e-5 + (gap - 400.0 * steps * 1e-5) / 40.0
    assert outputs["coefficient_of_restitution"] == pytest.approx(AT_REST - SLOPE * 40.0, abs=1e-14)
    assert outputs["touch_time"] == pytest.approx(touch, abs=1e-15)
    # In contact and after it the input club_speed has no influence.
    fmu.slave.setReal(fmu.references(["club_speed"]), [400.0])
    fmu.step(steps * 1e-5 + 1.0, 1.0)
    assert fmu.read(["smash_factor"])["smash_factor"] == outputs["smash_factor"]
