"""The two ways to solve a linear contact check each other: the closed form in double precision, and
extended precision, which has no limits."""

import math
import random
from itertools import chain

import numpy as np
import pytest
from compare import assert_close
from golf_physics.laws import LAWS, closed_form
from golf_physics.laws.closed_form import ClosedFormContact
from golf_physics.laws.extended import ExtendedContact
from golf_physics.values import Inputs, Motion, Parameters
from random_cases import special_impact

from golf_impact.random_impacts import random_impact
from golf_impact.reference import Reference

#: On the scales of the tolerance table. The worst of 5,658 random ones was 6e-15: a contact time
#: under law 1, where the drag nearly keeps the bodies together.
TOLERANCE = 1e-14


def contact_of(law, k, b, m_club, m_ball, start):
    """The phase that the law makes."""
    parameters = Parameters(m_club, m_ball, 0.04, 0.0, 0.0, 1, 1.0, 0.005, 0.0, 0.0)
    return LAWS[law].contact(parameters, Inputs(k, b, 0.0, 0.0), start)


def motion(compression, v_club, v_ball, closing, x_club=0.0):
    return Motion(x_club, x_club - compression, v_club, v_ball, compression, closing)


def touch(club_speed, ball_speed=0.0):
    return motion(0.0, club_speed, ball_speed, club_speed - ball_speed)


def quantities(phase, duration):
    """Of the whole phase, and at instants up to a duration."""
    force, when = phase.largest("force", phase.duration)
    state, scale = phase.dense_output()
    states = [*(state(scale * x * duration) for x in (0.3, 0.9)), [0.0, *phase.end()[:5]]]
    short = 1e-3 * duration
    return {
        "contact_time": phase.duration,
        "max_force": force,
        "time_of_max_force": when,
        "max_compression": phase.largest("d", phase.duration)[0],
        "impulse": phase.impulse(0.0, phase.duration),
        "mean_force": phase.impulse(0.4 * duration, short) / short,
        **dict(zip(("force", "x_club", "x_ball", "v_club", "v_ball", "d"), np.array(states).T)),
    }


def check(closed, *case):
    """Compare a case's closed form with extended precision, on the tolerance table's scales."""
    phase, (_, k, *_, start) = closed.extended(), case
    exact = quantities(phase, phase.duration)
    deepest = exact["max_compression"]
    # A stiffness that has risen may throw the bodies apart faster than they came.
    ends = exact["v_club"][-1], exact["v_ball"][-1]
    speed = max(abs(start.v_club) + abs(start.v_ball), sum(map(abs, ends)))
    # A phase may be the rest of a contact; the scales are those of the whole contact.
    time, force = max(phase.duration, 1.0 / closed.rate), max(exact["max_force"], k * deepest)
    scales = dict.fromkeys(("contact_time", "time_of_max_force"), time) | {
        **dict.fromkeys(("max_force", "mean_force", "force"), force),
        **dict.fromkeys(("x_club", "x_ball"), speed * time),
        **dict.fromkeys(("v_club", "v_ball"), speed),
        **{"max_compression": deepest, "d": deepest, "impulse": force * time},
    }
    assert_close(quantities(closed, phase.duration), exact, scales, TOLERANCE, case=case)


def agree(*case):
    """Compare both ways for one contact; False unless it has a closed form."""
    phase = contact_of(*case)
    if closed := isinstance(phase, ClosedFormContact):
        check(phase, *case)
    return closed


def count_compared(impacts):
    """Compare contacts from touch, and where k and b change later; how many have closed forms."""
    closed = 0
    for number, impact in enumerate(impacts):
        v = impact.values
        law, k, b, m_club, m_ball = (v[name] for name in ("law", "k", "b", "m_club", "m_ball"))
        start = touch(v["club_speed"], v["ball_speed"])
        closed += agree(law, k, b, m_club, m_ball, start)
        phase = contact_of(law, k, b, m_club, m_ball, start)
        rng = random.Random(number)
        for segment in impact.segments[1:]:
            time = rng.random() * min(phase.duration, 10.0 / phase.rate)
            state, scale = phase.dense_output()
            _, _, _, v_club, v_ball, compression = state(scale * time)
            start = motion(compression, v_club, v_ball, phase.value("w", time))
            force = segment.k * compression + (law == 2) * segment.b * start.closing
            if compression <= 0.0 or force <= 0.0:
                break
            closed += agree(law, segment.k, segment.b, m_club, m_ball, start)
            phase = contact_of(law, segment.k, segment.b, m_club, m_ball, start)
    return closed


@pytest.mark.parametrize(
    ("randoms", "specials", "least"),
    [(250, 250, 150), pytest.param(5000, 1500, 2000, marks=pytest.mark.nightly)],
)
def test_random_impacts_and_special_points(randoms, specials, least):
    impacts = chain(
        (random_impact(20, number) for number in range(randoms)),
        (special_impact(20, number) for number in range(specials)),
    )
    assert count_compared(impacts) > least


def test_a_maximum_beside_the_start():
    """Newton's method would begin before it: extended precision finds it."""
    # The largest compression is 1.037 times that at the start.
    assert agree(1, 1e6, 400.0, 0.21, 0.16, motion(5e-3, -54.0, -60.0, 6.0))


@pytest.mark.parametrize(("law", "border"), [(1, 0.7), (2, 0.999)])
@pytest.mark.parametrize("m_ball", [0.105, 0.21, 4.0])
def test_the_border_of_damping_from_both_sides(law, border, m_ball):
    assert border == (None, closed_form.MOST_DRAG, closed_form.MOST_DAMPING)[law]
    mu = 0.21 * (m_ball / (0.21 + m_ball))
    b = 2.0 * border * math.sqrt(1e6 / mu) * mu
    phases = [
        contact_of(law, 1e6, b * (1.0 + side * 2.0**-49), 0.21, m_ball, touch(35.0))
        for side in (-1.0, 1.0)
    ]
    assert [type(phase) for phase in phases] == [ClosedFormContact, ExtendedContact]
    # b differs by 16 units in the last place.
    below, above = ([p.duration, *p.end(), *p.largest("force", p.duration)] for p in phases)
    assert below == pytest.approx(above, rel=2e-14, abs=1e-15)


def test_the_border_of_the_real_mode_from_both_sides():
    # The faster the common motion, the larger the share of the drag in the compression.
    def contact(ball_speed):
        return contact_of(1, 1e6, 60.0, 0.21, 0.04593, touch(ball_speed + 35.0, ball_speed))

    low, high = -1e3, 0.0
    assert isinstance(contact(high), ClosedFormContact)
    assert isinstance(contact(low), ExtendedContact)
    while (middle := 0.5 * (low + high)) not in (low, high):
        closed = isinstance(contact(middle), ClosedFormContact)
        low, high = (low, middle) if closed else (middle, high)
    ends = [contact(ball_speed).end() for ball_speed in (low, high)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-13, abs=1e-15)


# Law 1 alone


def test_a_late_separation():
    # The drag keeps the bodies together until d has decayed to 1e-320 m, where Newton's method for
    # d doesn't converge. Expected: 80-digit arithmetic.
    late = contact_of(1, 1033217.582605348, 1148.4834442997599, 0.21, 0.04593, touch(35.0))
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
    phase = contact_of(1, k, b, m_club, m_ball, touch(35.0))
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
        state, scale = contact_of(1, *law, touch(35.0, -3.0)).dense_output()
        for t in (1e-7, 1e-5, 1e-4, 2e-4):
            reference = Reference(values | {"club_speed": 35.0, "ball_speed": -3.0})
            reference.step(t)
            exact = reference.outputs()
            assert exact["in_contact"]
            _, _, _, v_club, v_ball, d = state(scale * t)
            # Measured: 7e-17 of the speeds and of the compression.
            found = {"club_velocity": v_club, "ball_velocity": v_ball, "compression": d}
            right = {name: exact[name] for name in found}
            scales = dict(zip(found, (38.0, 38.0, exact["max_compression"])))
            assert_close(found, right, scales, 1e-14, time=t, damping=factor)
