"""The tolerance table: scales of errors, by hand for round numbers."""

import math

import pytest
from compare import contact_scales

from golf_impact.evidence.scales import Scales

#: μ = 0.04 kg, ω = 5000/s, a kinetic energy of 90 J.
GIVEN = {
    "m_club": 0.2, "m_ball": 0.05, "k": 1e6, "b": 0.0, "law": 2, "club_speed": 30.0,
    "ball_speed": 0.0, "gap": 0.003, "exponent": 1.0, "restitution_at_rest": 0.0,
    "reference_compression": 0.005, "club_force": 0.0, "start_time": 0.0,
}  # fmt: skip
ENDS = {"max_force": 6000.0, "max_compression": 6e-3, "impulse": 2.4, "contact_time": 6e-4}


def test_scales_of_an_impact():
    scales = contact_scales({**GIVEN, "ball_speed": -10.0}, ENDS)
    expected = {
        "club_velocity": 40.0, "smash_factor": 4 / 3, "coefficient_of_restitution": 1.0,
        "mean_force": 6000.0, "compression": 6e-3, "impulse": 2.4, "ball_position": 0.024,
        "touch_time": 6e-4, "kinetic_energy": 92.5, "energy_efficiency": 1.0, "momentum": 10.0,
    }  # fmt: skip
    assert {name: scales.of(name) for name in expected} == pytest.approx(expected)
    assert (scales.approach, scales.span) == pytest.approx((7.5e-5, 1.000075))
    assert scales.fastest == pytest.approx(5000.0)
    # 4e-16 of the approach in contact, of all the time for a position.
    assert scales.rounding_of_time("force") == pytest.approx(4e-16 * 7.5e-5 * 5000.0)
    assert scales.rounding_of_time("mean_force") == pytest.approx(4e-16 * 1.000075 / 6e-4)
    late = contact_scales({**GIVEN, "start_time": -3.0}, ENDS)
    assert late.rounding_of_time("touch_time") == pytest.approx(4e-16 * 3.0001 / 6e-4)


@pytest.mark.parametrize(
    ("values", "fastest"),
    [
        ({"b": 800.0}, 2e4),  # b/μ
        ({"exponent": 3.0}, 5e3 * math.sqrt(3.0 * 1.2**2)),  # at 6 mm, of 5 mm for k
        ({"exponent": 3.0, "reference_compression": 0.05}, 5e3),
    ],
)
def test_the_fastest_rate_of_a_contact(values, fastest):
    assert contact_scales({**GIVEN, **values}, ENDS).fastest == pytest.approx(fastest)


def test_inputs_that_change():
    """The speed at touch counts, and the fastest contact; or speeds and energy afterwards."""
    changes = [
        (2e-4, {"club_speed": 60.0}),
        (9e-4, {"club_speed": 90.0, "k": 4e6}),
        (1e-3, {"k": 1.0}),
    ]
    slow = {"club_velocity": 1.0, "ball_velocity": -3.0, "kinetic_energy": 0.3}
    scales = Scales(GIVEN, ENDS | slow, 8e-4, 2e-3, changes)
    assert scales.of("club_velocity") == 60.0
    more = {"club_velocity": 50.0, "ball_velocity": -30.0, "kinetic_energy": 720.0}
    gained = Scales(GIVEN, ENDS | more, 8e-4, 2e-3, changes)
    assert [gained.of(n) for n in ("ball_velocity", "energy_efficiency")] == [80.0, 2.0]
    assert scales.fastest == pytest.approx(1e4)
    lasting = Scales(GIVEN, {**ENDS, "contact_time": 0.0}, 8e-4, 2e-3)
    assert lasting.of("touch_time") == pytest.approx(1.2e-3)


def test_errors_in_their_scales():
    scales = contact_scales({**GIVEN, "gap": 0.0}, {**ENDS, "contact_time": math.nan})
    assert scales.of("contact_time") == 1.0
    assert scales.error("force", 6000.6, 6000.0) == pytest.approx(1e-4)
    assert scales.error("touched", True, False) == math.inf
    assert scales.error("touched", True, True) == 0.0
