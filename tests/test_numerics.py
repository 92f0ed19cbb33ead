"""Functions of decimals, zeros and series, which the physics uses."""

import math
from decimal import Decimal
from functools import partial

import mpmath
import numpy as np
import pytest
from golf_physics.companions import taylor
from golf_physics.numerics import chebyshev, zeros
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
    ("series", "zero"),
    [
        ([0.0, 1.0, -2.0], 0.5),  # from 0 it rises first
        ([0.0, -1.0], 0.0),
        ([0.0, 1.0], None),
        ([1.0, -2.0], 0.5),
        ([1.0, 1.0], None),
        ([1.0, -1.0], 1.0),
        ([0.24, -1.0, 1.0], 0.4),  # a minimum below 0 inside
        ([0.26, -1.0, 1.0], None),  # and above
        ([0.0, -0.5, 1.0], None),  # from 0 it falls first
    ],
)
def test_the_first_zero_of_a_series(series, zero):
    found = taylor.first_zero(
        partial(taylor.value, series), partial(taylor.value, taylor.slope(series)), 1.0
    )
    assert found == (zero if zero is None else pytest.approx(zero, abs=1e-15))
