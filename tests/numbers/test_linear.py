"""Linear contacts beside exact ones: random phases, and where little decides whether they end."""

import math
import random

import pytest
from cases import Case, scales_of
from compare import assert_close, assert_within
from conftest import numbers, some
from golf_physics.laws.linear import LinearContact, UnderdampedContact, first_downward_zero
from golf_physics.values import Motion
from random_cases import coinciding_rates

from golf_impact.evidence.reference import Reference
from golf_impact.evidence.reference import mp as _mp

mp = _mp.clone()
mp.dps = 60


def random_contact(number):
    """Arguments of a contact in SI units: k 1e2...1e10, damping ratio to 1e4, mass ratio 1e±6."""
    rng = random.Random(number)
    decades = lambda low, high: 10.0 ** rng.uniform(low, high)  # noqa: E731
    ratio, mass, k, law = math.sqrt(decades(-6, 6)), decades(-2, 0), decades(2, 10), number % 2
    bodies = mass * ratio, mass / ratio
    mu = bodies[0] * (bodies[1] / sum(bodies))
    omega, closing = math.sqrt(k / mu), decades(-1, 2)
    zeta = rng.choice((0.0, decades(-4, 0), rng.uniform(0.5, 3.0), decades(-1, 4)))
    b, d = 2.0 * zeta * mu * omega, rng.choice((0.0, closing / omega * decades(-2, 0.5)))
    w = closing * rng.uniform(-1.0, 1.0) if d else closing
    if k * d + (0 if law else b) * w <= 0.0 and d:
        w = closing
    v_ball = rng.choice((0.0, 1.0, -1.0)) * closing * decades(-2, 2)
    v_club = v_ball + w
    push = rng.choice((0.0, 0.0, 1.0, -1.0)) * mu * omega * closing * decades(-3, 0.3)
    start = Motion(d, 0.0, v_club, v_ball, d, v_club - v_ball)
    return k, 0.0 if law else b, b if law else 0.0, *bodies, start, push


def exact_state(k, damper, drag, m_club, m_ball, start, push, t):
    """d, v_club, v_ball, x_ball, impulse: exp(A t) of the equations of motion."""
    force = [k, damper, -damper, 0, 0, 0]
    club, ball = [-mp.mpf(f) / m_club for f in force], [mp.mpf(f) / m_ball for f in force]
    club[1] -= mp.mpf(drag) / m_club
    club[5] += mp.mpf(push) / m_club
    ball[2] -= mp.mpf(drag) / m_ball
    matrix = [[0, 1, -1, 0, 0, 0], club, ball, [0, 0, 1, 0, 0, 0], force, [0] * 6]
    at_start = [start.compression, start.v_club, start.v_ball, start.x_ball, 0, 1]
    return list(mp.expm(mp.matrix(matrix) * t, method="pade") * mp.matrix(at_start))[:5]


@pytest.mark.parametrize("seed", numbers(15, 60, 320))
def test_a_random_phase(seed):
    """At its end and on the way; measured: 7e-15 of 320."""
    given = random_contact(seed)
    k, damper, _, m_club, m_ball, start, _ = given
    phases = [LinearContact(*given)]
    if (underdamped := UnderdampedContact(*given)).duration:
        phases.append(underdamped)
    mu = m_club * (m_ball / (m_club + m_ball))
    for phase in phases:
        end = min(phase.duration, 20.0 * math.sqrt(mu / k))
        most = phase.largest("force", end)[0], phase.largest("d", end)[0]
        speed = max(abs(start.v_club) + abs(start.v_ball), *map(abs, phase.state(end)[3:5]))
        impulse = max(phase.impulse(0.0, end), mu * abs(start.closing))
        scales = most[0], speed, speed, max(speed * end, start.x_club), impulse, most[1]
        for t in (1e-3 * end, 0.4 * end, end):
            exact_d, v_club, v_ball, x_ball, exact_impulse = exact_state(*given, t)
            exact_force = k * exact_d + damper * (v_club - v_ball)
            force, _, x, v_1, v_2, d = phase.state(t)
            exact = exact_force, v_club, v_ball, x_ball, exact_impulse, exact_d
            found = force, v_1, v_2, x, phase.impulse(0.0, t), d
            names = ("force", "v_club", "v_ball", "x_ball", "impulse", "d")
            for name, value, right, scale in zip(names, found, exact, scales, strict=True):
                assert_within(float(abs(value - right)) / scale, 1e-13, name, t=t, given=given)
            if t == phase.duration:
                # The zero itself, by the force there and its slope.
                later = exact_state(*given, t * (1.0 + 1e-6))
                slope = k * later[0] + damper * (later[1] - later[2]) - exact_force
                assert_within(float(abs(exact_force / slope)) * 1e-6, 1e-13, "end", given=given)
        shares = [0.5 * (1.0 - math.cos(math.pi * n / 200)) for n in range(1, 200)]
        assert all(phase.value("force", share * end) > 0.0 for share in shares)


@pytest.mark.parametrize("beside", some(1, [0.0, -1e-12, 1e-9, 1e-15, -1e-6]))
@pytest.mark.parametrize("ratio", some(2, [9.0, 3e3, 1e6]))
def test_two_rates_of_law_1_meet(ratio, beside):
    """Newton's method converges linearly there. Measured: 2.8e-14."""
    start = Motion(0.0, 0.0, 1.0, 0.0, 0.0, 1.0)
    for bodies in ((1.0, 1.0 / ratio), (1.0 / ratio, 1.0)):
        mu = 1.0 / (1.0 + ratio)
        for zeta in coinciding_rates(*bodies):
            given = mu, 0.0, 2.0 * zeta * (1.0 + beside) * mu, *bodies, start, 0.0
            phase = LinearContact(*given)
            for t in (0.02, 0.3, 2.0, 30.0):
                d, v_club, v_ball, *_ = exact_state(*given, t)
                _, _, _, v_1, v_2, found = phase.state(t)
                error = max(abs(v_1 - v_club), abs(v_2 - v_ball), abs(found - d))
                assert_within(float(error), 1e-13, zeta=zeta, bodies=bodies, t=t)


RATIO = {"m_club": 0.2, "m_ball": 0.03}
#: The bodies, b that is changed after 50 µs, if any, and by bisection with 80 digits the least drag
#: at which they don't part at once: the first minimum of the compression is almost 0.
BORDERS = {
    "light ball": (
        {"k": 16117789.071114834, "m_club": 0.6071995864143012, "m_ball": 0.011623107160009048,
         "club_speed": 11.250199389860274},
        None, 178.71473779030833,
    ),
    "ratio 0.15": (RATIO, None, 133.70074438691782),
    "after a change": (RATIO, 20.0, 133.42420948911285),
}  # fmt: skip


@pytest.mark.parametrize("distance", [s * 10.0**-n for n in range(13, 4, -2) for s in (1, -1)])
@pytest.mark.parametrize("name", BORDERS)
def test_the_right_branch_on_both_sides(way_of, name, distance):
    """The inputs' last digits over the root of the distance; measured: a fifth of that, but more
    after a change.
    """
    bodies, before, border = BORDERS[name]
    later, end = {"b": border * (1.0 + distance)}, 2e-3
    tolerance = 1e-13 + 1e-16 / math.sqrt(abs(distance))
    case, steps = Case("grazes", bodies | later, end=end), [(end, {})]
    if before:
        case = Case("grazes", {**bodies, "b": before}, ((5e-5, later),), 5e-5 + end)
        tolerance, steps = 1e-9 if abs(distance) < 2e-12 else 1e-10, [(5e-5, {}), (end, later)]
    found = way_of("in process").path(case.given, steps)[-1]
    right = Reference(case.values, case.changes).outputs(case.end)
    scales = scales_of(case, {**right, "contact_time": end}, case.end)
    assert_close(found, right, scales, tolerance, case=case)
    assert right["separated"] == (distance < 0.0)


@pytest.mark.parametrize(
    ("ratio", "zeta", "separates"),
    # The borders that theory gives: 2.9101 for the document's masses, 2 for equal ones, and a gap
    # between 0.414 and 0.846 for a mass ratio of 0.15.
    [
        (0.04593 / 0.21, 2.910, True), (0.04593 / 0.21, 2.911, False),
        (1.0, 1.9999, True), (1.0, 2.0001, False),
        (0.15, 0.41, True), (0.15, 0.42, False), (0.15, 0.84, False), (0.15, 0.85, True),
    ],
)  # fmt: skip
def test_law_1_separates_or_not(way_of, ratio, zeta, separates):
    mu = 0.21 * ratio / (1.0 + ratio)
    way = way_of("in process").begin({"m_ball": 0.21 * ratio, "b": 2.0 * zeta * (1e6 * mu) ** 0.5})
    assert way.step(100.0)
    assert way["separated"] == separates


def test_a_maximum_beside_the_start():
    """Newton's method would begin before it: a `LinearContact` finds it."""
    # The largest compression is 1.037 times that at the start.
    start = Motion(0.0, -5e-3, -54.0, -60.0, 5e-3, 6.0)
    closed = UnderdampedContact(1e6, 0.0, 400.0, 0.21, 0.16, start)
    assert closed.duration
    exact = closed.general()
    for name in ("force", "d"):
        found, expected = (phase.largest(name, exact.duration) for phase in (closed, exact))
        assert found == pytest.approx(expected, rel=1e-14)


def test_zeros_of_a_sine():
    """Without the real mode: a zero at 0 isn't the end of a contact that begins there."""
    for sine, zero in ((-1.0, 2.0 * math.pi), (1.0, math.pi)):
        assert first_downward_zero(0.1, 0.0, 0.0, sine) == zero
