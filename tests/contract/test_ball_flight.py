"""BallFlight.fmu: an independent integration, published flights of the tour, borders."""

import math

import integrations
import pytest
from compare import assert_close
from conftest import some
from fmus import get, is_set, put

from golf_impact.data.measured import PGA

OF_FLIGHT = ("carry", "apex", "flight_time", "land_angle")

#: Backspin at which S leaves its limit, 0.75, at 60 m/s, rad/s.
LIMIT = 0.75 * 60.0 / (0.5 * 0.04267)

BORDERS = {
    "slow": {"ball_velocity": 1e-3, "launch_angle": 0.5, "backspin": 0.0},
    **{
        f"S leaves its limit {n:+}": {"ball_velocity": 60.0, "backspin": LIMIT * (1.0 + n)}
        for n in (-1e-12, 0.0, 1e-12)
    },
    "neither spin nor limit": {"ball_velocity": 75.0, "backspin": 0.0, "spin_ratio_limit": 0.0},
    # Within a thousandth of the flight; the lift of hardly any spin remains.
    "the spin is lost": {"ball_velocity": 75.0, "spin_decay": 1.0, "spin_ratio_limit": 0.2},
    "S falls below its limit shortly before the landing": {
        "ball_velocity": 2.3, "launch_angle": 0.8, "backspin": 62.0, "spin_decay": 1e-4,
    },
    # Constant drag and lift, under which it would rise again from 0.49 m below the ground.
    "diving": {
        "ball_velocity": 81.69, "launch_angle": 0.0375, "backspin": 300.0, "spin_decay": 0.0,
        "drag_constant": 0.00578, "drag_spin": 0.0, "drag_spin_squared": 0.0,
        "lift_constant": 0.5449, "lift_spin": 0.0, "lift_spin_squared": 0.0,
    },
}  # fmt: skip


def flown(companion, ball_velocity, **values):
    """BallFlight after its first step, which computes the flight."""
    flight = companion("BallFlight", ball_velocity=ball_velocity, separated=True, **values)
    flight.doStep(0.0, 1e-3)
    return flight


@pytest.mark.parametrize("case", [*BORDERS, *some(20, range(300))])
def test_against_an_integration(companion, case):
    """Also on the way: it is launched at touch_time + contact_time."""
    values = BORDERS[case] if case in BORDERS else integrations.drawn("BallFlight", case)
    flight, now = flown(companion, **values), 1.0
    results, path = integrations.flight(flight)
    now += 0.4 * results[2]
    flight.doStep(1e-3, now - 1e-3)
    time = now - values.get("touch_time", 0.0) - values.get("contact_time", 0.0)
    exact = dict(zip(OF_FLIGHT, results)) | dict(zip(("distance", "height"), path(time)))
    if is_landed := time >= results[2]:
        exact |= {"distance": results[0], "height": 0.0}
    assert is_set(flight, "landed") == is_landed
    found = dict(zip(exact, get(flight, *exact)))
    assert_close(found, exact, {"height": results[1]}, 1e-8, case=case)


@pytest.mark.parametrize("club", PGA)
def test_the_clubs_of_the_tour_fly_as_published(companion, club):
    stroke = PGA[club]
    launch = {"launch_angle": stroke.launch_angle, "backspin": stroke.backspin}
    carry, apex, _, land_angle = get(flown(companion, stroke.ball_speed, **launch), *OF_FLIGHT)
    # Measured: -4.6 (7-iron) to 3.6 % (3-wood), -10.3 (5-iron) to 2.1 % (hybrid), -7.7 degrees.
    assert -0.047 < carry / stroke.carry - 1.0 < 0.037
    assert -0.104 < apex / stroke.apex - 1.0 < 0.022
    assert -7.8 < math.degrees(land_angle - stroke.land_angle) < 0.0


def test_the_flight_is_that_of_the_instant_of_separation(companion):
    """By any steps; touch_time + contact_time. Later shots have no effect."""
    early, late = flown(companion, 50.0), companion("BallFlight", ball_velocity=50.0)
    late.doStep(0.0, 0.25)
    assert get(late, *OF_FLIGHT, "distance", "height") == [0.0] * 6
    put(late, separated=True, touch_time=0.75, contact_time=0.25)
    late.doStep(0.25, 0.25)
    assert get(late, "distance", "height") == [0.0, 0.0]
    early.doStep(1e-3, 1.499)
    late.doStep(0.5, 2.0)
    names = *OF_FLIGHT, "distance", "height"
    assert get(late, *names) == get(early, *names)
    assert not is_set(late, "landed")
    put(late, ball_velocity=20.0, touch_time=2.0)
    late.doStep(2.5, 5.0)
    assert get(late, *names) == [*get(early, *OF_FLIGHT, "carry"), 0.0]
    assert is_set(late, "landed")


# Borders


@pytest.mark.parametrize(("spin", "rises"), [(280.0, True), (0.0, False)])
def test_a_level_launch_rises_if_lift_exceeds_weight(companion, spin, rises):
    below, level, above = (
        get(flown(companion, 74.0, launch_angle=angle, backspin=spin), "carry", "apex")
        for angle in (-1e-12, 0.0, 1e-12)
    )
    assert below == [0.0, 0.0]
    # Without lift a ball at 1e-12 rad flies for 1.1e-9 m.
    assert level == pytest.approx(above, rel=1e-10, abs=2e-9)
    assert (level[0] > 150.0) is rises


@pytest.mark.parametrize(("speed", "angle"), [(0.0, 0.6), (-3.0, 0.6), (50.0, 0.0)])
def test_a_ball_that_does_not_fly_lands_where_it_is(companion, speed, angle):
    flight = flown(companion, speed, launch_angle=angle, backspin=0.0)
    assert get(flight, *OF_FLIGHT, "height") == [0.0] * 5
    assert is_set(flight, "landed")
