"""The contact laws against the 25-digit references, on the scales of the tolerance table."""

import math

import pytest
from conftest import reference_cases
from golf_physics.laws import absolute, relative
from test_two_ways import LAWS, contact_of, in_extended_precision, motion, touch

#: Of every quantity with exponent 1. The worst case here is 6e-16 (a force on a path).
TOLERANCE = 1e-13


@pytest.mark.parametrize("contact", [contact_of, in_extended_precision])
@pytest.mark.parametrize("case", reference_cases("impacts", "extremes"))
def test_results_and_path(case, contact):
    start = touch(case["club_speed"], case["ball_speed"])
    law = LAWS[case["law"]]
    phase = contact(law, case["k"], case["b"], case["m_club"], case["m_ball"], start)
    expected = {name: float(value) for name, value in case["expected"].items()}
    speed = abs(case["club_speed"]) + abs(case["ball_speed"])
    time, force = expected["contact_time"], expected["max_force"]
    assert phase.duration == pytest.approx(time, rel=TOLERANCE, abs=0)
    _, x_ball, v_club, v_ball, compression, _ = phase.end()
    x_club = x_ball + compression
    assert v_club == pytest.approx(expected["club_velocity"], abs=TOLERANCE * speed)
    assert v_ball == pytest.approx(expected["ball_velocity"], abs=TOLERANCE * speed)
    assert x_ball == pytest.approx(expected["ball_position"], abs=TOLERANCE * speed * time)
    if "club_position" in expected:
        assert x_club == pytest.approx(expected["club_position"], abs=TOLERANCE * speed * time)
    largest, when = phase.largest("force", phase.duration)
    assert largest == pytest.approx(force, rel=TOLERANCE, abs=0)
    assert when == pytest.approx(expected["time_of_max_force"], abs=TOLERANCE * time)
    if "impulse" in expected:
        impulse = phase.impulse(0.0, phase.duration)
        assert impulse == pytest.approx(expected["impulse"], rel=TOLERANCE, abs=0)
    state, scale = phase.dense_output()
    for point in case.get("path", ()):
        f, x_club, x_ball, v_club, v_ball, _ = state(scale * point["t"])
        assert f == pytest.approx(float(point["force"]), abs=TOLERANCE * force)
        assert x_club == pytest.approx(float(point["club_position"]), abs=TOLERANCE * speed * time)
        assert x_ball == pytest.approx(float(point["ball_position"]), abs=TOLERANCE * speed * time)
        assert v_club == pytest.approx(float(point["club_velocity"]), abs=TOLERANCE * speed)
        assert v_ball == pytest.approx(float(point["ball_velocity"]), abs=TOLERANCE * speed)


def test_the_check_can_fail():
    case = dict(reference_cases("impacts")[0].values[0])
    case["k"] *= 1.0 + 1e-12
    with pytest.raises(AssertionError):
        test_results_and_path(case, contact_of)


def test_a_late_separation():
    # The drag keeps the bodies together until d has decayed to 1e-320 m, where Newton's method for
    # d doesn't converge. Expected: 80-digit arithmetic.
    late = contact_of(absolute, 1033217.582605348, 1148.4834442997599, 0.21, 0.04593, touch(35.0))
    assert late.duration == pytest.approx(0.22811617076004184129, rel=1e-10)


@pytest.mark.parametrize(
    ("ratio", "zeta", "separates"),
    # The borders that theory gives: 2.9101 for the document's masses, 2 for equal ones, and a gap
    # between 0.414 and 0.846 for a mass ratio of 0.15.
    [
        (0.04593 / 0.21, 2.910, True),
        (0.04593 / 0.21, 2.911, False),
        (1.0, 1.9999, True),
        (1.0, 2.0001, False),
        (0.15, 0.41, True),
        (0.15, 0.42, False),
        (0.15, 0.84, False),
        (0.15, 0.85, True),
    ],
)
def test_law_1_separates_or_not(ratio, zeta, separates):
    m_club, m_ball, k = 0.21, 0.21 * ratio, 1e6
    mu = m_club * m_ball / (m_club + m_ball)
    b = 2.0 * zeta * (k * mu) ** 0.5
    phase = contact_of(absolute, k, b, m_club, m_ball, touch(35.0))
    assert (phase.duration < float("inf")) == separates


def test_where_three_roots_of_law_1_meet():
    # ζ² and pq where the characteristic polynomial has one triple root; by rounding the cases
    # lie on either side. Against scaling and squaring of the matrix at 50 digits.
    import mpmath

    mp = mpmath.mp.clone()
    mp.dps = 50
    zeta = ((4 / 3 - (16 / 9 - 32 / 27) ** 0.5) / (16 / 27)) ** 0.5
    pq = 2.0 * zeta * zeta / 27.0
    p = 0.5 * (1.0 - (1.0 - 4.0 * pq) ** 0.5)
    m_ball, m_club, k = 0.3 * p, 0.3 * (1.0 - p), 1e6
    b = 2.0 * zeta * (k * 0.3 * pq) ** 0.5
    for factor in (1.0, 1.0 + 1e-9, 1.0 - 1e-6, 1.01, 0.9):
        start = motion(1e-3, 35.0, -3.0, 38.0)
        state, scale = contact_of(absolute, k, b * factor, m_club, m_ball, start).dense_output()
        c = mp.mpf(b * factor)
        matrix = mp.matrix(
            [
                [0, 1, -1],
                [-mp.mpf(k) / m_club, -c / m_club, 0],
                [mp.mpf(k) / m_ball, 0, -c / m_ball],
            ]
        )
        for t in (1e-7, 1e-5, 1e-4, 1e-3):
            exact = mp.expm(matrix * mp.mpf(t)) * mp.matrix([mp.mpf(1e-3), 35, -3])
            _, _, _, v_club, v_ball, d = state(scale * t)
            # Measured: 6e-16 of the speeds, 8e-16 of the compression.
            assert v_club == pytest.approx(float(exact[1]), abs=38e-14)
            assert v_ball == pytest.approx(float(exact[2]), abs=38e-14)
            assert d == pytest.approx(float(exact[0]), abs=4e-17)


@pytest.mark.parametrize("below", [1e-3, 1e-6, 1e-9, 1e-12, 0.0, -1e-9])
def test_law_2s_peak_just_after_touch(below):
    """At half of critical damping the force is largest at touch; just below, shortly after it."""
    k, m_club, m_ball = 1e6, 0.21, 0.04593
    mu = m_club * m_ball / (m_club + m_ball)
    zeta = 0.5 * (1.0 - below)
    b = 2.0 * zeta * (k * mu) ** 0.5
    phase = contact_of(relative, k, b, m_club, m_ball, touch(35.0))
    force, when = phase.largest("force", phase.duration)
    zeta = b / (2.0 * (k * mu) ** 0.5)
    # Schwager & Pöschel (2007): see physics of law 2, ω t_F from its tangent.
    rate = (1.0 - zeta * zeta) ** 0.5
    angle = math.atan2(rate * (1.0 - 2.0 * zeta) * (1.0 + 2.0 * zeta), zeta * (3.0 - 4.0 * zeta**2))
    expected = max(0.0, angle) / rate / (k / mu) ** 0.5
    assert when == pytest.approx(expected, abs=1e-15 * phase.duration)
    assert force == pytest.approx(b * 35.0 if below <= 1e-9 else force, rel=1e-15)
