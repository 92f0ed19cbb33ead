"""The contact law with an exponent: against quadrature with 40 digits, and integration.

This law's tolerance is 1e-10 on the scales of the tolerance table. Closed forms and series do much
better, so the tolerances here are tighter; the worst case measured stands beside each.
"""

import math
from itertools import pairwise
from operator import mul

import pytest
from cases import DEFAULTS
from compare import assert_close, assert_within
from conftest import some
from golf_physics.laws import power_law
from golf_physics.values import Motion, Parameters
from numpy.polynomial.legendre import leggauss
from quadrature import PowerLawContact, mp
from scipy.integrate import solve_ivp

#: That of exponent 1, which this law keeps too: rounding, and series of 18 terms.
TOLERANCE = 1e-13

#: Where the integration to compare with limits the accuracy: its relative tolerance is 3e-14.
INTEGRATION_TOLERANCE = 1e-12

M_CLUB, M_BALL, D_R = DEFAULTS["m_club"], DEFAULTS["m_ball"], DEFAULTS["reference_compression"]
MU = M_CLUB * M_BALL / (M_CLUB + M_BALL)
TOUCH = {"k": 8e5, "compression": 0.0, "v_club": 35.0, "v_ball": 0.0}


def phase_of(k, b, n, compression, v_club, v_ball):
    parameters = Parameters(M_CLUB, M_BALL, 0.04, 0.0, 0.0, 2, n, D_R, 0.0, 0.0)
    start = Motion(0.0, -compression, v_club, v_ball, compression, v_club - v_ball)
    return power_law.PowerLawContact(parameters, k, b, start)


def from_touch(**values):
    return phase_of(**TOUCH | values)


def state_of(phase, t):
    """Force, x_club, x_ball, v_club, v_ball, compression."""
    state, scale = phase.dense_output()
    return state(scale * t)


def damping(k, n, zeta):
    return 2.0 * zeta * math.sqrt(0.5 * (n + 1.0) * k * MU)


#: n and ζ; the first ten in every run.
DAMPED = [(1.5, zeta) for zeta in (0.1, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1e4)]
DAMPED += [(1.05, 0.8), (2.0, 0.7), (3.0, 0.3), (6.0, 0.82), (20.0, 0.2)]
DAMPED += [(1.5, zeta) for zeta in (1e-6, 0.5, 1.5, 30.0)]
DAMPED += [
    (n, zeta)
    for n in (1.0 + 1e-9, 10.0)
    for zeta in (1e-6, 0.1, 0.5, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.5, 30.0, 1e4)
]


def quantities(phase, t):
    force, *_, d = state_of(phase, t)
    w, impulse = phase.value("w", t), phase.impulse(0.0, t)
    return {"force": force, "compression": d, "closing": w, "impulse": impulse}


def scales_of(phase, speed):
    force, d = (phase.largest(name, phase.duration)[0] for name in ("force", "d"))
    return {"force": force, "compression": d, "closing": speed, "impulse": MU * speed}


@pytest.mark.parametrize("case", some(10, DAMPED))
def test_against_quadrature(case):
    n, zeta = case
    b, u = damping(8e5, n, zeta), TOUCH["v_club"]
    exact = PowerLawContact(**DEFAULTS | {"law": 2, "k": 8e5, "b": b, "exponent": n})
    phase = from_touch(b=b, n=n)
    largest, when = phase.largest("force", phase.duration)
    left, time = phase.end().compression, exact.time(exact.end)
    found = {"time": phase.duration, "left": left, "max_force": largest, "when": when}
    expected = {"time": time, "left": exact.compression(exact.end)}
    expected |= {"max_force": exact.force(exact.peak), "when": exact.time(exact.peak)}
    # Worst: 9e-16 (largest force; n = 10, ζ beside 1).
    assert_close(found, expected, {"when": time}, TOLERANCE, n_and_zeta=case)
    for fraction in ("1e-4", "0.25", "0.8", "0.995", "1"):
        sigma = exact.end * mp.mpf(fraction)
        rate, t = exact.motion(sigma)[1], exact.time(sigma)
        expected = {"force": exact.force(sigma), "compression": exact.compression(sigma)}
        expected |= {"closing": u * rate, "impulse": MU * u * (1 - rate)}
        # Worst: 6e-15 (force; n = 20).
        found = quantities(phase, float(t))
        assert_close(found, expected, scales_of(phase, u), TOLERANCE, n_and_zeta=case, at=fraction)


#: k, b, n, compression, v_club, v_ball.
IN_MID_CONTACT = {
    "as before": (8e5, 20.0, 1.5, 3e-3, 30.0, 8.0),
    "opening": (8e5, 20.0, 1.615544, 5e-3, 26.0, 38.0),
    "opening, undamped": (8e5, 0.0, 2.5, 2e-3, 20.0, 48.0),
    "barely touching": (8e5, 20.0, 1.5, 1e-5, 34.9, 0.1),
    "softened": (8e4, 20.0, 1.5, 5e-3, 28.0, 20.0),
    "stiffened": (8e7, 20.0, 3.0, 5e-3, 28.0, 20.0),
    "near critical": (8e5, damping(8e5, 1.5, 1.0), 1.5, 3e-3, 30.0, 8.0),
    "overdamped": (8e5, damping(8e5, 1.5, 7.0), 1.5, 3e-3, 30.0, 8.0),
    "at rest": (8e5, damping(8e5, 4.0, 0.6), 4.0, 6e-3, 30.0, 30.0),
    "nearly apart": (8e5, damping(8e5, 1.5, 0.9), 1.5, 5e-3, 24.0, 35.0),
}


@pytest.mark.parametrize("start", IN_MID_CONTACT.values(), ids=IN_MID_CONTACT)
def test_against_integration(start):
    """By Runge–Kutta of order 8, of the equations of motion as they stand."""
    k, b, n, compression, v_club, v_ball = start

    def force_of(d, w):
        relative = max(d, 0.0) / D_R
        return k * D_R * relative**n + b * relative ** (0.5 * (n - 1.0)) * w

    def rates(_, y):
        force = force_of(y[0], y[1])
        return [y[1], -force / MU, force]

    phase, speed = phase_of(*start), v_club + v_ball
    largest, when = phase.largest("force", phase.duration)
    scales = scales_of(phase, speed)
    # Spring and damper may nearly cancel.
    scales["force"] = max(largest, force_of(compression, 0.0))
    options = {"method": "DOP853", "rtol": 3e-14, "atol": [1e-16, 1e-13, 1e-15]}
    for t in (fraction * phase.duration for fraction in (0.05, 0.5, 0.9, 1.0)):
        first = [compression, v_club - v_ball, 0.0]
        d, w, impulse = solve_ivp(rates, (0.0, t), first, **options).y[:, -1]
        expected = {"force": force_of(d, w), "compression": d, "closing": w, "impulse": impulse}
        found = quantities(phase, t)
        # Worst: 4e-14 (speed; barely touching).
        assert_close(found, expected, scales, INTEGRATION_TOLERANCE, start=start, t=t)
        assert found["force"] <= largest
        *_, v_c, v_b, _ = state_of(phase, t)
        assert v_c - v_b == pytest.approx(found["closing"], abs=TOLERANCE * speed)
        momentum = M_CLUB * v_club + M_BALL * v_ball
        assert M_CLUB * v_c + M_BALL * v_b == pytest.approx(momentum, rel=1e-15)
    # A stationary maximum, or the force falls from the start.
    step = 1e-4 * phase.duration
    assert when == 0.0 or when > step
    assert max(state_of(phase, abs(when - step))[0], state_of(phase, when + step)[0]) < largest


def test_no_contact_is_a_phase_without_duration():
    # Suddenly damped so much that the force would be a pull.
    phase = phase_of(8e5, 1e4, 1.5, 1e-3, 20.0, 40.0)
    assert phase.duration == 0.0
    assert state_of(phase, 0.0)[:1] == [0.0]
    assert state_of(phase, 0.0)[3:] == [20.0, 40.0, 1e-3]
    assert phase.impulse(0.0, 0.0) == 0.0
    assert phase.largest("d", 0.0)[0] == 1e-3


@pytest.mark.parametrize("n", [1.0 + 1e-9, 1.5, 10.0])
@pytest.mark.parametrize("zeta", [0.0, 0.1, 1.0, 30.0])
def test_impulse_is_exact_relative_to_its_width(n, zeta):
    phase = from_touch(b=damping(8e5, n, zeta), n=n)
    time, case = phase.duration, {"n": n, "zeta": zeta}
    force, _ = phase.largest("force", time)
    nodes, weights = leggauss(8)
    for width in (1e-12 * time, 1e-6 * time, 1e-3 * time):
        for begin in (0.05 * time, 0.5 * time, 0.9 * time):
            # Against Gauss's quadrature of the force, which is smooth there: worst 6e-16.
            forces = [state_of(phase, begin + 0.5 * width * (1.0 + node))[0] for node in nodes]
            off = phase.impulse(begin, width) / width - 0.5 * sum(map(mul, weights, forces))
            assert_within(abs(off) / force, TOLERANCE, "mean force", width=width, **case)
        # From touch on, the pieces add up to the whole: worst 1.3e-15.
        pieces = sum(phase.impulse(width * i, width) for i in range(10))
        assert phase.impulse(0.0, 10.0 * width) == pytest.approx(pieces, rel=TOLERANCE)
    whole = MU * (TOUCH["v_club"] - phase.value("w", time))
    for count in (1, 4, 10, 25, 60):
        steps = pairwise(time * i / count for i in range(count + 1))
        # Worst: 3e-15 (n = 10, ζ = 1), where the formulas for short and long intervals meet.
        pieces = sum(phase.impulse(a, b - a) for a, b in steps)
        assert pieces == pytest.approx(whole, rel=TOLERANCE)


def test_the_ends_are_exact():
    phase = from_touch(b=20.0, n=1.5, v_club=35.1, v_ball=0.1)
    assert state_of(phase, 0.0) == [0.0, 0.0, 0.0, 35.1, 0.1, 0.0]
    _, *ball, closing = phase.end()
    end = state_of(phase, phase.duration)
    assert [0.0, *ball] == [end[0], *end[2:]]
    assert closing == phase.value("w", phase.duration)
    just_before = state_of(phase, math.nextafter(phase.duration, 0.0))
    for value, exact, scale in zip(just_before, end, (5e3, 0.02, 0.02, 35.0, 35.0, 7e-3)):
        assert value == pytest.approx(exact, abs=TOLERANCE * scale)
    later = phase_of(8e5, 20.0, 1.5, 1e-3, 35.1, 0.1)
    assert state_of(later, 0.0)[1:] == [0.0, -1e-3, 35.1, 0.1, 1e-3]
    # Just after touch d = v t, also where (d/L)^m, m = 6.5, has no double.
    early = state_of(from_touch(b=9.0, n=12.0), 1e-55)[5]
    assert early == pytest.approx(35e-55, rel=1e-12, abs=0.0)
    # Elastic: no compression remains, and it vanishes in proportion to the remaining time.
    elastic = from_touch(b=0.0, n=10.0)
    assert state_of(elastic, elastic.duration)[5] == 0.0
    left = 1e-9 * elastic.duration
    assert state_of(elastic, elastic.duration - left)[5] == pytest.approx(35.0 * left, rel=1e-6)
