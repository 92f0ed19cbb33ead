"""Reports of runs: their checks, and what they say."""

import pytest

from golf_impact.report.any_law import check_any_law
from golf_impact.report.report import Report


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
