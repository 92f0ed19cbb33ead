"""Partial derivatives against differences: of the reference with 80 digits, of results themselves.

Tolerance: 1e-8 of output/variable, or of the derivative if that is larger. Cases without
derivatives, and what is refused: transcripts/python.md.
"""

import numpy as np
import pytest
from cases import BASE
from compare import assert_within
from golf_physics.variables import BY_NAME

import golf_impact
from golf_impact.data.balls import BALLS
from golf_impact.data.quantities import START as DEFAULTS
from golf_impact.data.runs import METRICS
from golf_impact.evidence.reference import Reference, mp

BALL, PENNER = (dict(BALLS[name].values) for name in ("roh-lee", "penner"))
LINE = ("restitution_at_rest", "restitution_slope")


def assert_slope(values, output, variable, found, slope, size):
    """Of an output of this size."""
    value = float(values.get(variable, DEFAULTS[variable]))
    scale = max(abs(slope), abs(size / (value or 1.0))) or 1.0
    error = float(abs(found.item() - slope) / scale)
    assert_within(error, 1e-8, name=f"∂ {output} / ∂ {variable}", values=values)


def test_dimensions():
    """Euler's theorem of every result: its slopes follow its dimensions in kg, m and s."""
    rng, number = np.random.default_rng(1), 100
    law = rng.integers(1, 3, number)
    at_rest = np.where(law == 2, rng.choice([0.0, 0.8], number), 0.0)
    values = {
        "k": 10.0 ** rng.uniform(4.0, 7.0, number),
        "b": rng.choice([0.0, 1.0, 10.0, 1000.0], number) * rng.random(number),
        "club_speed": rng.uniform(1.0, 60.0, number),
        "ball_speed": rng.choice([0.0, -1.0, 0.5], number) * rng.random(number),
        "m_club": rng.uniform(0.05, 1.0, number),
        "m_ball": rng.uniform(0.02, 0.1, number),
        "gap": rng.choice([0.0, 0.1], number) * rng.random(number),
        "reference_compression": rng.uniform(1e-3, 1e-2, number),
        "restitution_slope": np.where(at_rest > 0.0, 2e-3 * rng.random(number), 0.0),
    }
    exponent = np.where(law == 2, rng.choice([1.0, 1.5, 2.3], number), 1.0)
    given = values | {"law": law, "exponent": exponent, "restitution_at_rest": at_rest}
    results = golf_impact.run_impacts(("separated", *METRICS), **given)
    slopes = golf_impact.sensitivities(METRICS, values, **given)
    for name in METRICS:
        for unit in ("kg", "m", "s"):
            power = {of: BASE[BY_NAME[of].unit].get(unit, 0) for of in (name, *values)}
            terms = np.array([power[of] * values[of] * slopes[name][of] for of in values])
            size = np.abs([*terms, results[name]]).sum(axis=0) + 1e-300
            errors = np.abs(terms.sum(axis=0) - power[name] * results[name]) / size
            # Without a separation velocities depend on the length of the run, too.
            errors = errors[results["separated"]]
            # Over a damping of 0, with an exponent.
            assert np.isnan(errors).sum() == 4 * (name in ("contact_time", "contact_displacement"))
            assert_within(np.nanmax(errors), 2e-10, name, unit=unit)
            # Of central differences of eighth order: ten times as accurate as one-sided ones.
            assert_within(np.nanmedian(errors), 1e-12, name, unit=unit)


#: The damping just below ζ = 1/2, from which the largest force is at touch.
BORDER = 194.1

#: Central differences of the sixth order.
WEIGHTS = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60


@pytest.mark.parametrize(
    "values",
    [
        *({"law": 1, "b": b} for b in (160.0, 400.0)),
        *({"law": 2, "b": b} for b in (0.0, BORDER, 200.0)),
        *(ball | {"gap": 0.01, "club_force": 300.0} for ball in (BALL, PENNER)),
    ],
)
def test_all_results(values):
    """Of linear laws, of an exponent, of an exponent and a COR line."""
    names = {"k", "b", "club_speed", "ball_speed", "m_club", "m_ball", "gap", *values}
    names -= {"law", "club_force"}
    found = golf_impact.sensitivities(METRICS, sorted(names), **values)
    for variable in names:
        value = float(values.get(variable, DEFAULTS[variable]))
        if values.get("b") == BORDER or (value == 0.0 and variable != "ball_speed"):
            step, exact = mp.mpf(10) ** -25, DEFAULTS | values
            low, high = max(value - step, 0), value + step
            ends = [Reference(exact | {variable: end}).outputs(1) for end in (low, high)]
            slopes = {name: (ends[1][name] - ends[0][name]) / (high - low) for name in METRICS}
        else:
            step = 2e-3 * (value or 1.0)
            nearby = {**values, variable: value + step * np.arange(-3, 4)}
            results = golf_impact.run_impacts(METRICS, **nearby)
            slopes = {name: WEIGHTS @ results[name] / step for name in METRICS}
        sizes = golf_impact.run_impact(METRICS, **values)
        for name, slope in slopes.items():
            assert_slope(values, name, variable, found[name][variable], slope, sizes[name])


#: ζ = 1/2, from which the force falls from touch on: there and beyond the largest is b v.
HALF = {"law": 2, "m_club": 2.0, "m_ball": 2.0, "k": 4.0, "club_speed": 1.0}
#: Values at a limit or a kink, an output, a variable, and the slope on the side that exists.
LIMITS = [
    ({"law": 2, LINE[0]: 1.0}, "ball_velocity", LINE[0], 35.0 * 0.21 / 0.25593),
    ({"law": 2, LINE[0]: 1.0}, "coefficient_of_restitution", LINE[0], 1.0),
    ({"law": 2, LINE[0]: 0.1, LINE[1]: 0.1 / 35.0 * (1.0 - 1e-7)}, "coefficient_of_restitution",
     "club_speed", -0.1 / 35.0 * (1.0 - 1e-7)),
    ({"law": 2, LINE[0]: 0.8}, "coefficient_of_restitution", LINE[1], -35.0),
    ({"law": 2, "exponent": 12.0, LINE[0]: 0.8}, "coefficient_of_restitution", "exponent", 0.0),
    ({"law": 2, "exponent": 1.0, LINE[0]: 0.8}, "impulse", "exponent", 0.0),
    ({"law": 2, "gap": 0.0}, "touch_time", "gap", 1.0 / 35.0),
    *(({**HALF, "b": b}, "max_force", "b", 1.0) for b in (2.0, 2.0 + 1e-9)),
]  # fmt: skip


@pytest.mark.parametrize(("values", "output", "variable", "slope"), LIMITS)
def test_one_sided(values, output, variable, slope):
    got = golf_impact.sensitivities(output, variable, **values)[output][variable]
    size = golf_impact.run_impact([output], **values)[output]
    assert_slope(values, output, variable, got, slope, size)


def test_an_elastic_power_law_has_slopes_over_what_leaves_it_elastic():
    values = {**BALL, "b": 0.0}
    slopes = golf_impact.sensitivities(["contact_time", "max_force"], ["k"], **values)
    impact = golf_impact.run_impact(**values)
    # T ~ k^(-1/(n+1)), F ~ k^(1/(n+1)).
    share = 1.0 / (BALL["exponent"] + 1.0) / BALL["k"]
    assert slopes["contact_time"]["k"] == pytest.approx(-share * impact["contact_time"])
    assert slopes["max_force"]["k"] == pytest.approx(share * impact["max_force"])
