"""Reports of runs: their checks, and what they say."""

import math

import numpy as np
import pytest

from golf_impact.report.any_law import check_any_law
from golf_impact.report.own_cases import own_cases
from golf_impact.report.report import Report
from golf_impact.report.uncertainty import gradient, standard_errors


def checked(fmu, change, **values):
    report = Report("a case", fmu)
    metrics = report.impact("a case", **values)
    before = len(report.checks)
    check_any_law(report, "a case", report.starts | values, {**metrics, **change(metrics)})
    return report.checks[before:]


@pytest.mark.parametrize("b", [9.0, 300.0])
def test_balances_that_hold_for_any_law_hold_under_drag(fmu, b):
    """Law 1 has it; its terms are some per mille and some ten per cent of the balances."""
    given = {"b": b, "gap": 0.001, "ball_speed": 3.0, "club_force": 500.0}
    checks = checked(fmu, lambda metrics: {}, **given)
    assert len(checks) == 8
    assert all(check.passed for check in checks)
    checks = checked(fmu, lambda now: {"impulse": now["impulse"] * (1.0 + 1e-6)}, **given)
    assert not all(check.passed for check in checks)


def test_a_case_has_the_command_that_opens_it(fmu):
    report = Report("cases", fmu)
    report.impact("plain")
    report.impact("stiff", k=2e6, law=2)
    assert report.commands == {
        "plain": "golf-impact explore --set law=1",
        "stiff": "golf-impact explore --set k=2000000 --set law=2",
    }
    assert report.describe(k=2e6) == "law 1, k = 2 MN/m, b = 9 N·s/m"
    tour = {"law": 2, "exponent": 1.5, "restitution_at_rest": 0.86, "restitution_slope": 0.003}
    assert report.describe(**tour) == "law 2, k = 1 MN/m, n = 1.5, COR = 0.86 − 0.003 s/m · v"


def test_orders_are_strict():
    report = Report.__new__(Report)
    report.checks = []
    for values in ([1.0, 2.0], [2.0, 1.0], [1.0, 1.0]):
        for check in (report.rises, report.falls, report.stays):
            check("x", values)
    passed = [check.passed for check in report.checks]
    assert passed == [True, False, False, False, True, False, False, False, True]


def test_gradients_stay_in_the_range_of_a_parameter():
    """Of x²: exact by central differences, one-sided at the end of a range."""
    square = gradient(lambda values: np.array([values["k"] ** 2]), {"k": 3.0}, ["k"])
    assert square == pytest.approx(np.array([[6.0]]), rel=1e-9)
    seen = []
    gradient(lambda v: seen.append(v["exponent"]) or np.zeros(1), {"exponent": 1.0}, ["exponent"])
    assert seen == [1.0, 1.0001]
    slopes = np.array([[3.0], [4.0]])
    assert standard_errors(slopes, np.diag([1.0, 4.0])) == pytest.approx([math.sqrt(73.0)])


@pytest.mark.parametrize(
    ("values", "integrated"), [({"law": 1}, False), ({"law": 2}, False), ({"exponent": 1.6}, True)]
)
def test_cases_without_a_closed_form_or_a_balance_are_integrated(fmu, values, integrated):
    _, report = own_cases(fmu, {"law": 2, **values}, [])
    assert any("CVODE" in check.claim for check in report.checks) == integrated
    assert all(check.passed for check in report.checks)
