"""Events and solutions of equations, where they are hard to find."""

import math

import numpy as np
import pytest
from golf_physics.numerics import events, ode, runge_kutta


@pytest.mark.parametrize(
    ("series", "fall"),
    [
        ([0.0, 1.0, -2.0], 0.5),  # from 0 it rises first
        ([0.0, 1.0], None),
        ([1.0, -2.0], 0.5),
        ([1.0, 1.0], None),
        ([1.0, -1.0], 1.0),
        ([0.24, -1.0, 1.0], 0.4),  # a minimum below 0 between two times
        ([0.26, -1.0, 1.0], None),  # and above
        ([-1.0], 0.0),  # at the first time itself, not at the double after it
        ([0.0, 0.0, -1.0], 0.0),
    ],
)
def test_where_a_function_first_falls_to_zero(series, fall):
    f = np.polynomial.Polynomial(series)
    found = events.first_fall(f, f.deriv(), [0.0, 0.3, 0.9, 1.0])
    assert found == (fall if fall is None else pytest.approx(fall, rel=2e-15, abs=0.0))


def test_a_jump_and_a_kink_inside_a_panel():
    """Panels become short there; the rates are right on both sides. Measured: 3e-15."""

    def accelerations(motion):
        t = motion[0]
        return [0.0, 1.0 if t < 0.3 else -2.0, math.sqrt(abs(t - 0.7))]

    t, width, now = 0.0, 1.0, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    while t < 1.0:
        panel, width = ode.next_panel(accelerations, t, min(width, 1.0 - t), now, lambda width: 1.0)
        t, now = panel.end, panel.at(panel.end)
    expected = [1.0, 0.3 - 1.4, (0.7**1.5 + 0.3**1.5) / 1.5]
    assert now[3:] == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("slope", [math.nan, math.inf])
def test_equations_without_numbers_are_refused(slope):
    with pytest.raises(ArithmeticError, match="no numbers after t = 0"):
        ode.next_panel(lambda motion: [slope], 0.0, 1.0, [0.0, 1.0], lambda width: 1.0)
    nowhere = runge_kutta.Solution(
        lambda y: [slope], [0.0], 1.0, lambda y: [1e-12], lambda y: 1.0, lambda y: 0.0
    )
    with pytest.raises(ArithmeticError, match="no numbers after t = 0"):
        nowhere.covers(1.0)


@pytest.mark.parametrize("first", [100.0, 1e-3])
def test_steps_become_as_long_as_the_tolerance_allows(first):
    """One that leaves the domain is tried again; there are 660, 2000 at most."""
    solution = runge_kutta.Solution(
        lambda y: (y[1], -y[0] + 0.0 * math.sqrt(11.0 - y[2]), 1.0), (0.0, 1.0, 0.0), first,
        lambda y: (1e-12, 1e-12, 1e-12), lambda y: 10.0 - y[2], lambda y: -1.0,
    )  # fmt: skip
    assert not solution.covers(20.0)
    assert solution.end == pytest.approx(10.0, rel=1e-14)
    assert solution.at(9.0)[0] == pytest.approx(math.sin(9.0), abs=1e-10)
