"""Comparisons of numbers whose failure is one line: variable, error, case, steps, seed."""

import math

import pytest
from golf_physics.values import SLOWEST

from golf_impact.data.quantities import START as DEFAULTS
from golf_impact.evidence.scales import TOLERANCE, Scales


def contact_scales(values, outputs):
    """The scales of an impact in one step of at least 1 s.

    `values` are all inputs and parameters, `outputs` those at the end: max_force, max_compression,
    impulse and contact_time, which is NaN if the bodies haven't separated.
    """
    closing = values["club_speed"] - values["ball_speed"]
    approach = values["gap"] / closing if closing > SLOWEST else 0.0
    return Scales(values, outputs, approach, approach + 1.0)


def assert_within(error, tolerance=TOLERANCE, name="", **where):
    """Fail unless an error, without unit, is within the tolerance; `where` says in which case."""
    __tracebackhide__ = True
    if not error <= tolerance:
        places = (f"{key} = {value}" for key, value in where.items())
        line = f"error {error:.1e} = {error / tolerance:.3g} × tolerance {tolerance:g}"
        pytest.fail("; ".join([f"{name}: {line}" if name else line, *places]), pytrace=False)


def assert_close(found, exact, scales=None, tolerance=TOLERANCE, **where):
    """Fail unless all values of `exact` are found within a tolerance of their scales.

    Args:
        found: numbers by name, or arrays of them.
        exact: the same; these names are compared, at least one.
        scales: `Scales`, or numbers by name; of names that aren't there, the exact value's size.
        tolerance: of each error, without unit.
        where: case, steps or seed, for the message.
    """
    __tracebackhide__ = True

    def error(name):
        if isinstance(scales, Scales):
            return scales.error(name, found[name], exact[name])
        off = abs(found[name] - exact[name])
        off = off.max() if hasattr(off, "max") else off
        scale = (scales or {}).get(name) or abs(exact[name])
        return float(off / scale) if off and scale else math.inf if off else 0.0

    errors = {name: error(name) for name in exact}
    # NaN is worst.
    name = max(errors, key=lambda name: (math.isnan(errors[name]), errors[name]))
    numbers = {"found": found[name], "exact": exact[name]}
    assert_within(errors[name], tolerance, name, **numbers, **where)


def assert_same_results(found, exact, cases):
    """Compare metrics of whole impacts by two ways: the same refusals, the same ones missing."""
    __tracebackhide__ = True
    for one, expected, values in zip(found, exact, cases, strict=True):
        assert isinstance(one, str) == isinstance(expected, str), (one, expected, values)
        if isinstance(expected, str):
            # The engine names what runs other laws.
            assert not one or one.startswith(expected), values
            continue
        known = {name: value for name, value in expected.items() if not math.isnan(value)}
        assert {n for n in one if not math.isnan(one[n])} == {*known}, values
        # A power law under a force is integrated.
        integrated = values.get("club_force") and values.get("exponent", 1.0) != 1.0
        scales = contact_scales(DEFAULTS | values, expected)
        assert_close(one, known, scales, 1e-10 if integrated else TOLERANCE, case=values)
