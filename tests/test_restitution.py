"""Damping chosen at touch, so that the coefficient of restitution falls with the approach speed."""

import math

import pytest
from fmpy.fmi1 import FMICallException
from golf_physics.laws.relative import damping_ratio
from quadrature import restitution

from golf_impact.errors import UserError
from golf_impact.runs import METRICS

AT_REST, SLOPE = 0.86, 0.0029
LINE = {"law": 2, "restitution_at_rest": AT_REST, "restitution_slope": SLOPE}
M_CLUB, M_BALL = 0.210, 0.04593
MU = M_CLUB * M_BALL / (M_CLUB + M_BALL)


@pytest.mark.parametrize(
    "coefficient",
    [
        *(1.0, 1.0 - 2.0**-53, 1.0 - 1e-9, 0.93, 0.7585, 0.3),
        *(math.exp(-2.0), 0.1353, 1e-3, 1e-12, 1e-29),
    ],
)
def test_damping_ratio(coefficient):
    assert abs(restitution(damping_ratio(coefficient)) - coefficient) < 4e-16 * coefficient**0.5


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0, 12.0])
@pytest.mark.parametrize(("club", "ball"), [(1e-3, 0.0), (35.0, 0.0), (60.0, 10.0), (290.0, 0.0)])
def test_the_line_is_met(fmu, exponent, club, ball):
    outputs = fmu.impact(**LINE, exponent=exponent, club_speed=club, ball_speed=ball)
    expected = AT_REST - SLOPE * (club - ball)
    assert outputs["coefficient_of_restitution"] == pytest.approx(expected, abs=1e-14)


def test_damping_itself_is_not_used(fmu):
    outputs = fmu.impact(**LINE, b=9.0)
    assert fmu.impact(**LINE, b=1e300) == outputs
    # Nor if it changes in mid-contact, to the last bit.
    fmu.start(**LINE)
    fmu.step(0.0, 3e-4)
    fmu.slave.setReal(fmu.references(["b"]), [500.0])
    fmu.step(3e-4, 1.0)
    changed = fmu.read(METRICS)
    fmu.start(**LINE)
    fmu.step(0.0, 3e-4)
    fmu.step(3e-4, 1.0)
    assert fmu.read(METRICS) == changed


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_stiffness_that_changes_keeps_the_damping_ratio(fmu, exponent):
    zeta = damping_ratio(AT_REST - SLOPE * 35.0)

    def b(k):
        return 2.0 * zeta * math.sqrt(0.5 * (exponent + 1.0) * k * MU)

    fmu.start(**LINE, exponent=exponent, k=1e6)
    fmu.step(0.0, 2e-4)
    fmu.slave.setReal(fmu.references(["k"]), [2e6])
    fmu.step(2e-4, 1.0)
    by_line = fmu.read(METRICS)
    fmu.start(law=2, exponent=exponent, k=1e6, b=b(1e6))
    fmu.step(0.0, 2e-4)
    fmu.slave.setReal(fmu.references(["k", "b"]), [2e6, b(2e6)])
    fmu.step(2e-4, 1.0)
    assert by_line == pytest.approx(fmu.read(METRICS), rel=1e-13)


@pytest.mark.parametrize("gap", [0.0, 0.05])
@pytest.mark.parametrize("read_outputs", [False, True])
def test_a_restitution_out_of_reach_is_refused_at_touch(fmu, gap, read_outputs):
    fmu.start(**LINE, club_speed=400.0, gap=gap)
    point, steps = 0.0, 0
    while steps < 1000:
        if read_outputs:
            fmu.read(["force", "compression"])
        try:
            fmu.slave.doStep(point, 1e-5)
        except FMICallException:
            break
        point += 1e-5
        steps += 1
    assert "club_speed = 400.0 m/s is refused at touch" in fmu.messages[-1]
    assert "-0.29999999999999993 must be above 0" in fmu.messages[-1]
    # The touch is at gap / 400 m/s = 125 µs: the step that would reach it is refused, none before.
    assert steps == round(gap / 400.0 / 1e-5 - 0.5)
    assert not fmu.read_flag("touched") or not gap
    with pytest.raises(FMICallException):
        fmu.slave.doStep(point, 1e-5)
    # A slower club may continue, as if the faster speed had never been set.
    fmu.slave.setReal(fmu.references(["club_speed"]), [40.0])
    fmu.step(point, 1.0)
    outputs = fmu.read(METRICS)
    left = gap - 400.0 * point
    assert outputs["coefficient_of_restitution"] == pytest.approx(AT_REST - SLOPE * 40.0, abs=1e-14)
    assert outputs["touch_time"] == pytest.approx(point + left / 40.0, abs=1e-15)


def test_a_speed_out_of_reach_long_before_touch_does_no_harm(fmu):
    fmu.start(**LINE, club_speed=400.0, gap=1.0)
    for n in range(10):
        fmu.step(n * 1e-4, 1e-4)
    fmu.slave.setReal(fmu.references(["club_speed"]), [30.0])
    fmu.step(1e-3, 1.0)
    outputs = fmu.read(METRICS)
    assert outputs["coefficient_of_restitution"] == pytest.approx(AT_REST - SLOPE * 30.0, abs=1e-14)
    # In contact and after it the input club_speed has no influence.
    fmu.slave.setReal(fmu.references(["club_speed"]), [400.0])
    fmu.step(1.001, 1.0)
    assert fmu.read(["smash_factor"])["smash_factor"] == outputs["smash_factor"]


def test_only_under_law_2(fmu):
    with pytest.raises(UserError, match=r"restitution_at_rest = 0\.86 is refused with law = 1"):
        fmu.start(restitution_at_rest=0.86)


def test_off_by_default(fmu):
    assert fmu.impact(law=2, restitution_slope=0.5) == fmu.impact(law=2)
