"""Functions of decimals, zeros, series and solutions of equations, which the physics uses."""

import math
from decimal import Decimal

import mpmath
import numpy as np
import pytest
from golf_physics.numerics import chebyshev, events, ode, zeros
from golf_physics.numerics.decimals import arithmetic


@pytest.mark.parametrize("digits", [57, 95])
def test_functions_of_decimals(digits):
    """Stated: halvings cost e^x some 4 digits."""
    in_use, exp, cos_sin = arithmetic(digits)
    with in_use(), mpmath.workdps(digits + 20):
        for x in map(Decimal, ("0", "1e-20", "-0.7", "3.3", "-2345.6", "700.25")):
            found = [mpmath.mpf(str(number)) for number in (exp(x), *cos_sin(x))]
            at = mpmath.mpf(str(x))
            assert abs(found[0] / mpmath.exp(at) - 1) < mpmath.mpf(10) ** (5 - digits)
            assert abs(found[1] - mpmath.cos(at)) < mpmath.mpf(10) ** (5 - digits)
            assert abs(found[2] - mpmath.sin(at)) < mpmath.mpf(10) ** (5 - digits)


def test_derivative_and_integral_of_a_chebyshev_series():
    series, known = np.random.default_rng(1).normal(size=chebyshev.ORDER), np.polynomial.chebyshev
    slopes = known.chebder(series[::-1])[::-1]
    assert chebyshev.differentiate([*series]) == pytest.approx(slopes, rel=1e-12)
    integral = 0.5 * known.chebint(series[::-1], lbnd=-1.0)[::-1]
    integral[-1] += 2.0
    assert chebyshev.integrate([*series], 2.0, 0.5) == pytest.approx(integral, rel=1e-12)


def test_a_zero_without_a_slope_is_found_by_halving():
    place = Decimal("0.3")
    found = zeros.zero_between(
        lambda t: ((t < place) - (t >= place), 0, 0), 0 * place, place + 1, 1
    )
    assert abs(found - place) < Decimal("1e-26")


def test_zeros_of_a_sine():
    """Without the exponential term: a zero at 0 isn't the end of a contact that begins there."""
    for sine, zero in ((-1.0, 2.0 * math.pi), (1.0, math.pi)):
        assert zeros.first_downward_zero(0.1, 0.0, 0.0, sine) == zero


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
    ],
)
def test_where_a_function_first_falls_to_zero(series, fall):
    f = np.polynomial.Polynomial(series)
    found = events.first_fall(f, f.deriv(), [0.0, 0.3, 0.9, 1.0])
    assert found == (fall if fall is None else pytest.approx(fall, abs=1e-15))


def panels_to(end, f, width, start, positions, scales):
    t, found = 0.0, []
    while t < end:
        panel, width = ode.next_panel(f, t, min(width, end - t), start, positions, scales)
        t, start = panel.end, panel.at(panel.end)
        found.append(panel)
    return found


def test_an_oscillator_that_begins_without_a_force():
    """Where slopes are 0 at the start alone, an iteration that changes nothing hasn't converged."""
    panels = panels_to(
        10.0, lambda t, motion: [-motion[0]], 10.0, [0.0, 1.0], 1, lambda width: [1.0]
    )
    assert 2 < len(panels) < 12
    for panel in panels:
        for t in panel.times():
            assert panel.at(t) == pytest.approx([math.sin(t), math.cos(t)], abs=2e-14)


def test_a_jump_and_a_kink_inside_a_panel():
    """Panels become short there; the integral is right on both sides. Measured: 3e-15."""

    def slopes(t, motion):
        return [1.0 if t < 0.3 else -2.0, math.sqrt(abs(t - 0.7))]

    last = panels_to(1.0, slopes, 1.0, [0.0, 0.0], 0, lambda width: [1.0, 1.0])[-1]
    expected = [0.3 - 1.4, (0.7**1.5 + 0.3**1.5) / 1.5]
    assert last.at(1.0) == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("slope", [math.nan, math.inf])
def test_equations_without_numbers_are_refused(slope):
    with pytest.raises(ArithmeticError, match="no numbers after t = 0"):
        ode.next_panel(lambda t, motion: [slope], 0.0, 1.0, [1.0], 0, lambda width: [1.0])
