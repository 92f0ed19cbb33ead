"""Where extended precision decides: law 1 beside the drag that keeps the bodies together.

There the compression's first minimum is almost 0: the contact either ends there or lasts many times
as long, and the time of separation varies with the root of the distance from the border.
"""

import pytest
from cases import Case, scales_of
from compare import assert_close
from golf_physics.laws.closed_form import ClosedFormContact
from golf_physics.values import Motion

from golf_impact.reference import Reference

RATIO = {"m_club": 0.2, "m_ball": 0.03}
#: The bodies, and by bisection with 80 digits the least drag at which they don't part at once.
BORDERS = {
    "light ball": (
        {"k": 16117789.071114834, "m_club": 0.6071995864143012, "m_ball": 0.011623107160009048,
         "club_speed": 11.250199389860274},
        178.71473779030833,
    ),
    "ratio 0.15": (RATIO, 133.70074438691782),
}  # fmt: skip
#: The same after 50 µs at b = 20.
CHANGED = 133.42420948911285

DISTANCES = [0.0, *(sign * 10.0**-n for n in range(13, 4, -2) for sign in (1, -1))]


def check(way, case, tolerance):
    """Compare at the end, 2 ms after the last change."""
    reference, before, inputs = Reference(case.values), 0.0, {}
    way.begin(case.given)
    for time, later in (*case.changes, (case.end, {})):
        way.set(**inputs)
        assert way.step(time - before)
        reference.step(time - before, **inputs)
        before, inputs = time, later
    right = reference.outputs()
    scales = scales_of(case, {**right, "contact_time": 2e-3}, case.end)
    assert_close(way.read(), right, scales, tolerance, case=case)
    return right["separated"]


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("name", BORDERS)
def test_the_right_branch_on_both_sides(way_of, name, distance):
    """Measured: 5e-16, once extended precision decides."""
    bodies, border = BORDERS[name]
    case = Case("grazes", {**bodies, "b": border * (1.0 + distance)}, end=2e-3)
    assert check(way_of("in process"), case, 1e-13) == (distance < 0.0)


@pytest.mark.parametrize("distance", DISTANCES[1:])
def test_the_right_branch_after_b_has_changed(way_of, distance):
    # The new phase begins from a state with an error of 1e-16: nearer to the border the inputs
    # don't determine the branch, and beside it the error is 1e-16 over the root of the distance.
    # Measured: 9e-11 at 1e-13.
    later = ((5e-5, {"b": CHANGED * (1.0 + distance)}),)
    case = Case("grazes", {**RATIO, "b": 20.0}, later, 2.05e-3)
    tolerance = 1e-9 if abs(distance) < 2e-12 else 1e-11
    assert check(way_of("in process"), case, tolerance) == (distance < 0.0)


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
    """Newton's method would begin before it: extended precision finds it."""
    # The largest compression is 1.037 times that at the start.
    start = Motion(0.0, -5e-3, -54.0, -60.0, 5e-3, 6.0)
    closed = ClosedFormContact(1e6, 0.0, 400.0, 0.21, 0.16, start)
    assert closed.duration
    exact = closed.extended()
    for name in ("force", "d"):
        found, expected = (phase.largest(name, exact.duration) for phase in (closed, exact))
        assert found == pytest.approx(expected, rel=1e-14)
