"""BallFlight.fmu: an independent integration, published flights of the tour, borders."""

import math

import integrations
import pytest
from compare import assert_close
from conftest import some
from fmus import get, is_set, put

from golf_impact.data.measured import PGA

OF_FLIGHT = ("carry", "apex", "flight_time", "land_angle")

#: USGA's indoor test range, US patent 6,186,002 B1 (2001).
USGA = {
    "drag_constant": 0.2028, "drag_spin": -0.2159, "drag_spin_squared": 2.8466,
    "drag_reynolds": 0.0165, "lift_constant": 0.0860, "lift_spin": 0.6463,
    "lift_spin_squared": 1.4789, "lift_reynolds": -0.0122, "spin_ratio_limit": 0.22,
}  # fmt: skip

#: Constant drag and lift, under which it lands, and would rise again from 0.49 m below the ground.
DIVING = dict.fromkeys(USGA, 0.0) | {
    "drag_constant": 0.00578, "lift_constant": 0.5449, "spin_decay": 0.0,
    "launch_angle": 0.0375, "backspin": 300.0,
}  # fmt: skip

#: Backspin at which S leaves its limit, 0.75, at 60 m/s, rad/s.
LIMIT = 0.75 * 60.0 / (0.5 * 0.04267)

FLIGHTS = [
    (82.5, {}),
    (82.5, USGA),
    (55.0, {"launch_angle": 0.3, "backspin": 700.0, "wind_speed": 10.0}),
    (55.0, USGA | {"launch_angle": 0.3, "backspin": 700.0, "wind_speed": -15.0}),
    (30.0, {"launch_angle": 0.7, "wind_speed": -3.0}),
    (300.0, {"launch_angle": 0.8, "drag_constant": 2.5}),
    (60.0, {"launch_angle": 0.3, "backspin": 700.0, "spin_decay": 1e-4}),
    (0.001, {"launch_angle": 0.5, "backspin": 0.0}),
    (60.0, {"launch_angle": 0.3, "backspin": -100.0}),
    *((60.0, {"launch_angle": 0.3, "backspin": LIMIT * (1.0 + n)}) for n in (-1e-12, 0.0, 1e-12)),
    (60.0, {"launch_angle": 0.3, "backspin": LIMIT * 1.5, "spin_decay": 0.0}),
    # S is at its limit from the launch on, without spin and with it.
    (74.65568, {"backspin": 0.0, "spin_ratio_limit": 0.0}),
    (74.65568, {"spin_ratio_limit": 0.0}),
    # The spin is lost within a thousandth of the flight; the lift of hardly any spin remains.
    (74.65568, {"spin_decay": 1.0}),
    (74.65568, {"spin_decay": 1.0, "spin_ratio_limit": 0.2}),
    # S falls below its limit shortly before the landing.
    (2.3, {"launch_angle": 0.8, "backspin": 62.0, "spin_decay": 1e-4}),
    (81.69, DIVING),
]

#: Launches of every kind of club. Near-vertical ones may land behind the ball.
GRID = [
    (speed, {"launch_angle": angle, "backspin": spin})
    for speed in (5.0, 20.0, 45.0, 70.0, 90.0)
    for angle in (0.02, 0.2, 0.45, 0.8, 1.2, 1.5)
    for spin in (0.0, 30.0, 280.0, 700.0, 1000.0, 2000.0)
]


def flown(companion, speed, **values):
    """BallFlight after its first step, which computes the flight."""
    flight = companion("BallFlight", ball_velocity=speed, separated=True, **values)
    flight.doStep(0.0, 1e-3)
    return flight


@pytest.mark.parametrize("case", [*FLIGHTS, *GRID[::52], *some(0, GRID)])
def test_against_an_integration(companion, case):
    speed, values = case
    flight = flown(companion, speed, **values)
    found, expected = get(flight, *OF_FLIGHT), integrations.flight(flight)
    found, expected = (dict(zip(OF_FLIGHT, values)) for values in (found, expected))
    assert_close(found, expected, tolerance=1e-8, case=case)
    assert found["flight_time"] > 0.0


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


def test_a_flight_by_hand(companion):
    """In a vacuum: v² sin 2θ / g, v² sin² θ / (2 g), 2 v sin θ / g."""
    angle, root = math.radians(30.0), 0.75**0.5
    flight = flown(companion, 50.0, launch_angle=angle, air_density=0.0, gravity=10.0)
    flight.doStep(1e-3, 1.249)
    expected = [250.0 * root, 31.25, 5.0, angle, 62.5 * root, 23.4375]
    assert get(flight, *OF_FLIGHT, "distance", "height") == pytest.approx(expected, rel=1e-14)
