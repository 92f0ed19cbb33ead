"""Linear contacts beside exact ones: random phases, and where little decides whether they end."""

import math
import random
from fractions import Fraction
from operator import mul

import pytest
from cases import Case, scales_of
from compare import assert_close, assert_within
from conftest import numbers
from golf_physics.laws.integrated import IntegratedContact
from golf_physics.laws.linear import (
    LinearContact,
    UnderdampedContact,
    offsets_of_real_rate,
)
from golf_physics.values import Motion

from golf_impact.evidence.reference import Contact, Reference, mp


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


def exact_contact(k, damper, drag, m_club, m_ball, start, push):
    """From the reference: `at` gives d, v_club, v_ball, x_ball, force and impulse."""
    values = {"law": 1 if drag else 2, "k": k, "b": drag or damper, "club_force": push}
    values |= {"m_club": m_club, "m_ball": m_ball}
    exact = {name: mp.mpf(value) for name, value in values.items()}
    return Contact(exact, [mp.mpf(x) for x in (start.compression, *start[2:4])])


@pytest.mark.parametrize("seed", numbers(24, 60, 320))
def test_a_random_phase(seed):
    """At its end and on the way, also integrated; measured: 7e-15 of 320."""
    given = random_contact(seed)
    k, damper, drag, m_club, m_ball, start, push = given
    exact, phases = exact_contact(*given), [LinearContact(*given)]
    if (underdamped := UnderdampedContact(*given)).duration:
        phases.append(underdamped)
    mu = m_club * (m_ball / (m_club + m_ball))
    if max(damper, drag) < 6.0 * math.sqrt(k * mu):
        force = lambda d, w: k * d + damper * w  # noqa: E731
        phases.append(IntegratedContact(force, drag, m_club, m_ball, start, push))
    end = min(phases[0].duration, 20.0 * math.sqrt(mu / k))
    for phase in phases:
        phase.state(end)  # an integration goes on until there
        if end == phases[0].duration:
            assert_within(float(abs(end / exact.duration - 1)), 1e-13, "end", given=given)
        speed = max(abs(start.v_club) + abs(start.v_ball), *map(abs, phase.state(end)[3:5]))
        scales = {
            "d": phase.largest("d", end)[0], "v_club": speed, "v_ball": speed,
            "x_ball": max(speed * end, start.x_club), "force": phase.largest("force", end)[0],
            "impulse": max(phase.impulse(0.0, end), mu * abs(start.closing)),
        }  # fmt: skip
        for t in (1e-3 * end, 0.4 * end, end):
            force, _, x_ball, *others = phase.state(t)
            found = (others[2], *others[:2], x_ball, force, phase.impulse(0.0, t))
            right = dict(zip(scales, exact.at(t)))
            assert_close(dict(zip(scales, found)), right, scales, t=t, given=given)


@pytest.mark.parametrize("law", ["absolute", "relative"])
def test_a_row_of_modes_is_level_real_mode_and_pair(law):
    """Over a period it touches the pair's amplitude, on the side of both signs."""
    rng, found = random.Random(5), 0
    for number in range(law == "relative", 200, 2):
        modes = LinearContact(*random_contact(number))._modes
        if not modes.oscillates or modes.trail > modes.second:
            continue
        found, row = found + 1, [rng.uniform(-1.0, 1.0) for _ in "esgj"]
        row[3] *= rng.choice((0.0, modes.r))
        begin, period = rng.uniform(0.0, 3.0), 2.0 * math.pi / modes.second
        shares = []
        for n in range(200):
            t = begin + n * period / 200
            level, real, pair = modes.parts(row, t)
            total = sum(map(mul, row, modes.at(t)))
            shares.append((total - level - real) / pair)
        assert (min(shares), max(shares)) == pytest.approx((-1.0, 1.0), abs=2e-4)
    assert found > 20


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
    """Twice the inputs' last digits over the root of the distance; measured: half of that, but
    more after a change.
    """
    bodies, before, border = BORDERS[name]
    later, end = {"b": border * (1.0 + distance)}, 2e-3
    tolerance = 1e-13 + 2e-16 / math.sqrt(abs(distance))
    case, steps = Case("grazes", bodies | later, end=end), [(end, {})]
    if before:
        case = Case("grazes", {**bodies, "b": before}, ((5e-5, later),), 5e-5 + end)
        tolerance, steps = 1e-9 if abs(distance) < 2e-12 else 1e-10, [(5e-5, {}), (end, later)]
    found = way_of("in process").path(case.given, steps)[-1]
    right = Reference(case.values, case.changes).outputs(case.end)
    scales = scales_of(case, {**right, "contact_time": end}, case.end)
    assert_close(found, right, scales, tolerance, case=case)
    assert right["separated"] == (distance < 0.0)


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


@pytest.mark.parametrize("ball", [1 / 32, 3 / 16, 3 / 4])
def test_the_real_rate_wherever_its_search_begins(ball):
    """It satisfies its equation for dampings close to each other."""
    less, more = sorted((Fraction(ball), 1 - Fraction(ball)))
    for zeta in (n / 256 for n in range(1, 360)):
        slow, x, y = map(Fraction, offsets_of_real_rate(ball, 1.0 - ball, zeta, float(more - less)))
        span = 2 * Fraction(zeta) * (more - less)
        assert abs((span - x) * (less + (slow + x) * x) - more * x) <= 2e-15 * more * x
        assert abs(x + y - span) <= 1e-15 * span
