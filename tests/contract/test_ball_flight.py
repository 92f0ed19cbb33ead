"""BallFlight.fmu: an independent integration, published flights of the tour, borders."""

import math

import numpy as np
import pytest
from compare import assert_close
from conftest import some
from fmus import get, is_set, put
from scipy.integrate import solve_ivp

from golf_impact.data.measured import PGA

OF_FLIGHT = ("carry", "apex", "flight_time", "land_angle")

#: USGA's indoor test range, US patent 6,186,002 B1 (2001).
USGA = {
    "drag_constant": 0.2028, "drag_spin": -0.2159, "drag_spin_squared": 2.8466,
    "drag_reynolds": 0.0165, "lift_constant": 0.0860, "lift_spin": 0.6463,
    "lift_spin_squared": 1.4789, "lift_reynolds": -0.0122, "spin_ratio_limit": 0.22,
}  # fmt: skip

#: Backspin at which S leaves its limit, 0.75, at 60 m/s, rad/s.
LIMIT = 0.75 * 60.0 / (0.5 * 0.04267)

FLIGHTS = [
    (82.5, {}),
    (82.5, USGA),
    (50.0, USGA | {"launch_angle": 0.4, "backspin": 900.0}),
    (55.0, {"launch_angle": 0.3, "backspin": 700.0, "wind_speed": 10.0}),
    (55.0, USGA | {"launch_angle": 0.3, "backspin": 700.0, "wind_speed": -15.0}),
    (30.0, {"launch_angle": 0.7, "wind_speed": -3.0}),
    (74.65568, {"launch_angle": math.radians(10.9)}),
    (80.0, {"launch_angle": 0.2, "backspin": 0.0}),
    (10.0, {"launch_angle": 1.2}),
    (54.0, {"air_density": 0.0}),
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
    # It lands, and would rise again from 0.49 m below the ground.
    (
        81.69,
        dict.fromkeys(("drag_spin", "drag_reynolds", "drag_spin_squared", "spin_decay"), 0.0)
        | dict.fromkeys(("lift_spin", "lift_reynolds", "lift_spin_squared"), 0.0)
        | {"drag_constant": 0.00578, "lift_constant": 0.5449}
        | {"launch_angle": 0.0375, "backspin": 300.0},
    ),
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
    flight = companion("BallFlight", **values)
    put(flight, ball_velocity=speed, separated=True)
    flight.doStep(0.0, 1e-3)
    return flight


def integrated(flight, speed):
    """Carry, apex, time of flight, land angle by DOP853 at 1e-13: another method and code."""
    ball = ("m_ball", "ball_diameter", "launch_angle", "backspin", "spin_decay", "spin_ratio_limit")
    air = ("air_density", "kinematic_viscosity", "gravity", "wind_speed")
    drag = ("drag_constant", "drag_spin", "drag_spin_squared", "drag_reynolds")
    lift = ("lift_constant", "lift_spin", "lift_spin_squared", "lift_reynolds")
    m, d, angle, spin, decay, limit, rho, nu, g, wind = get(flight, *ball, *air)
    d0, d1, d2, d3, l0, l1, l2, l3 = get(flight, *drag, *lift)

    def slope(t, y):
        # A logarithmic profile with a roughness length of 3 cm.
        u = y[2] - wind * math.log1p(max(y[1], 0.0) / 0.03) / math.log1p(10.0 / 0.03)
        v = math.hypot(u, y[3])
        s, reynolds = min(0.5 * d * abs(y[4]) / v, limit), v * d / nu / 1e5
        c_d = d0 + d1 * s + d2 * s * s + d3 * reynolds
        c_l = l0 + l1 * s + l2 * s * s + l3 / reynolds**2
        c_l *= np.sign(spin)
        k = rho * math.pi * d * d / 4 / (2 * m) * v
        fall = -g - k * (c_d * y[3] - c_l * u)
        return [y[2], y[3], -k * (c_d * u + c_l * y[3]), fall, -decay * v * y[4] * 2 / d]

    def landing(t, y):
        return y[1] if t else 1.0

    def apex(t, y):
        return y[3]

    landing.terminal, landing.direction = True, -1
    start = [0.0, 0.0, speed * math.cos(angle), speed * math.sin(angle), spin]
    # Its step control alone lets 8e-12 pass where a ball is braked from 300 m/s.
    options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-13 * min(1.0, speed), "max_step": 0.01}
    solved = solve_ivp(slope, (0.0, 1e3), start, events=[landing, apex], **options)
    end = solved.t_events[0][0]
    # The state of an event is interpolated, which velocities show.
    *_, u, h, _ = solve_ivp(slope, (0.0, end), start, **options).y[:, -1]
    return solved.y_events[0][0][0], solved.y_events[1][0][1], end, math.atan2(-h, u)


@pytest.mark.parametrize("case", [*FLIGHTS, *GRID[::52], *some(0, GRID)])
def test_against_an_integration(companion, case):
    speed, values = case
    flight = flown(companion, speed, **values)
    found, expected = get(flight, *OF_FLIGHT), integrated(flight, speed)
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


def test_a_ball_that_is_launched_later_is_where_its_own_flight_has_it(companion):
    """From the instant of separation, touch_time + contact_time; until then it lies on the tee."""
    early, late = companion("BallFlight"), companion("BallFlight")
    put(early, ball_velocity=50.0, separated=True)
    put(late, ball_velocity=50.0, separated=True, touch_time=0.75, contact_time=0.25)
    late.doStep(0.0, 0.5)
    assert get(late, "distance", "height") == [0.0, 0.0]
    early.doStep(0.0, 1.5)
    late.doStep(0.5, 2.0)
    assert get(late, "distance", "height") == get(early, "distance", "height")
    assert get(late, *OF_FLIGHT) == get(early, *OF_FLIGHT)
    late.doStep(2.5, 5.0)
    assert is_set(late, "landed")
    assert get(late, "distance", "height") == [*get(late, "carry"), 0.0]


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
    launch = {"ball_velocity": 50.0, "launch_angle": math.radians(30.0), "backspin": 300.0}
    flight = companion("BallFlight", air_density=0.0, gravity=10.0)
    put(flight, **launch, separated=True)
    flight.doStep(0.0, 1.25)
    names = "carry", "apex", "flight_time", "land_angle", "distance", "height"
    root = 0.75**0.5
    expected = [250.0 * root, 31.25, 5.0, math.radians(30.0), 62.5 * root, 23.4375]
    assert get(flight, *names) == pytest.approx(expected, rel=1e-14)
