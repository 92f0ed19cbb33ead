"""The contact laws against the 25-digit references, on the scales of the tolerance table."""

import pytest
from compare import assert_close
from conftest import reference_cases
from golf_physics.laws import absolute
from test_two_ways import LAWS, contact_of, in_extended_precision, touch

from golf_impact.runs import PATH
from golf_impact.stress.reference import Reference

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
    scales = {"impulse": expected.get("impulse"), "force": force, "max_force": force}
    for name, scale in (("velocity", speed), ("position", speed * time)):
        scales |= {f"{body}_{name}": scale for body in ("club", "ball")}
    scales |= {"contact_time": time, "time_of_max_force": time}
    _, x_ball, v_club, v_ball, compression, _ = phase.end()
    largest, when = phase.largest("force", phase.duration)
    results = {"contact_time": phase.duration, "max_force": largest, "time_of_max_force": when}
    results |= {"impulse": phase.impulse(0.0, phase.duration)}
    results |= dict(zip(PATH, (0.0, x_ball + compression, x_ball, v_club, v_ball)))
    state, scale = phase.dense_output()
    path = [(point, dict(zip(PATH, state(scale * point["t"])))) for point in case.get("path", ())]
    for right, found in [(expected, results), *path]:
        right = {name: float(right[name]) for name in right.keys() & found.keys()}
        assert_close(found, right, scales)


def test_the_check_can_fail():
    case = dict(reference_cases("impacts")[0].values[0])
    case["k"] *= 1.0 + 1e-12
    with pytest.raises(pytest.fail.Exception, match="× tolerance"):
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
    # lie on either side.
    zeta = ((4 / 3 - (16 / 9 - 32 / 27) ** 0.5) / (16 / 27)) ** 0.5
    pq = 2.0 * zeta * zeta / 27.0
    p = 0.5 * (1.0 - (1.0 - 4.0 * pq) ** 0.5)
    m_ball, m_club, k = 0.3 * p, 0.3 * (1.0 - p), 1e6
    b = 2.0 * zeta * (k * 0.3 * pq) ** 0.5
    for factor in (1.0, 1.0 + 1e-9, 1.0 - 1e-6, 1.01, 0.9):
        law = (k, b * factor, m_club, m_ball)
        values = dict(zip(("k", "b", "m_club", "m_ball"), law), law=1, gap=0.0)
        state, scale = contact_of(absolute, *law, touch(35.0, -3.0)).dense_output()
        for t in (1e-7, 1e-5, 1e-4, 2e-4):
            reference = Reference(values | {"club_speed": 35.0, "ball_speed": -3.0})
            reference.step(t)
            exact = reference.outputs()
            assert exact["in_contact"]
            _, _, _, v_club, v_ball, d = state(scale * t)
            # Measured: 7e-17 of the speeds and of the compression.
            assert abs(v_club - exact["club_velocity"]) <= 38e-14
            assert abs(v_ball - exact["ball_velocity"]) <= 38e-14
            assert abs(d - exact["compression"]) <= 1e-14 * exact["max_compression"]
