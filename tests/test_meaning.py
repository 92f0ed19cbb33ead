"""What numbers mean: units by dimension, the level of intervals, digits of a source."""

import re
from importlib.resources import files

import numpy as np
import pytest
from page import evaluator  # noqa: F401

from golf_build import BY_NAME, UNITS
from golf_impact.calibration.fit import ContactLaw, Fit
from golf_impact.calibration.measurements import measurements
from golf_impact.facts.toml import read_toml


def dimension(*factors):
    """Of a product of variables, by exponents: (name, 1) or (name, -1)."""
    base = {}
    for name, power in factors:
        for unit, exponent in UNITS[BY_NAME[name].unit].base.items():
            base[unit] = base.get(unit, 0) + power * exponent
    return {unit: exponent for unit, exponent in base.items() if exponent}


@pytest.mark.parametrize(
    ("name", "factors"),
    [
        ("impulse", [("force", 1), ("contact_time", 1)]),
        ("momentum", [("m_club", 1), ("club_velocity", 1)]),
        ("kinetic_energy", [("force", 1), ("compression", 1)]),
        ("k", [("force", 1), ("compression", -1)]),
        ("b", [("force", 1), ("club_velocity", -1)]),
        ("club_speed", [("gap", 1), ("contact_time", -1)]),
        ("club_force", [("k", 1), ("gap", 1)]),
        ("mean_force", [("impulse", 1), ("contact_time", -1)]),
        ("smash_factor", [("ball_velocity", 1), ("club_speed", -1)]),
        ("restitution_slope", [("club_speed", -1)]),
        ("reference_compression", [("compression", 1)]),
    ],
)
def test_units_by_dimension(name, factors):
    assert dimension((name, 1)) == dimension(*factors)


def test_95_percent_of_intervals_contain_the_truth():
    """Lines of COR through four points: Student's t with two degrees of freedom.

    Of 600 intervals 95 % hold with a standard deviation of 0.9 %; with the 90 % quantile 90 %.
    """
    speeds, true, held = np.array([20.0, 30.0, 40.0, 50.0]), (0.86, 0.0029), []
    for seed in range(300):
        noise = np.random.default_rng(seed).normal(0.0, 2e-3, 4)
        cors = true[0] - true[1] * speeds + noise
        found = Fit(measurements({}, cor_speeds=(speeds, cors)), ContactLaw(2, 1.0))
        for estimate, value in zip(found.parameters.values(), true, strict=True):
            held.append(abs(estimate.value - value) <= found.coverage * estimate.standard_error)
    assert 0.925 < np.mean(held) < 0.975, f"{np.mean(held):.3f} of {len(held)} intervals"


def test_a_yard_is_0_9144_m(evaluator):  # noqa: F811
    shown = evaluator({"values": {"law": 2, "dynamic_loft": 0.3}})
    (carry,) = (row for row in shown["readouts"] if row["metric"] == "carry")
    (yards,) = re.findall(r"(\d+) yd", carry["meaning"])
    assert int(yards) == round(shown["metrics"]["carry"] / 0.9144)


def test_coefficients_of_flight_have_the_digits_of_their_source():
    """Ferguson, McNally & McPhee, ISEA 2022, doi:10.5703/1288284317493."""
    printed = {
        "drag_constant": 0.1304, "drag_spin": 0.9287, "drag_spin_squared": -0.8259,
        "drag_reynolds": 0.0, "lift_constant": 0.0504, "lift_spin": 1.2031,
        "lift_spin_squared": -1.1490, "lift_reynolds": 0.0, "spin_ratio_limit": 0.75,
    }  # fmt: skip
    rows = read_toml(files("golf_physics.companions") / "ball_flight.toml")["parameter"]
    assert {name: rows[name][2] for name in printed} == printed
