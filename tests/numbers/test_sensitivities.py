"""Partial derivatives against differences: of the reference with 80 digits, of results themselves.

Tolerance: 1e-8 of output/variable, or of the derivative if that is larger. Cases without
derivatives, and what is refused: transcripts/python.md.
"""

import numpy as np
import pytest
from compare import assert_within

import golf_impact
from golf_impact.data.balls import BALLS
from golf_impact.data.quantities import START as DEFAULTS
from golf_impact.data.runs import METRICS
from golf_impact.evidence.reference import Reference, mp

BALL, PENNER = (dict(BALLS[name].values) for name in ("roh-lee", "penner"))
STRAIGHT = {"law": 2, "restitution_at_rest": 0.86, "restitution_slope": 1e-3}
LINE = ("restitution_at_rest", "restitution_slope")


def assert_slope(values, output, variable, found, slope, size):
    """Of an output of this size."""
    value = float(values.get(variable, DEFAULTS[variable]))
    scale = max(abs(slope), abs(size / (value or 1.0))) or 1.0
    error = float(abs(found.item() - slope) / scale)
    assert_within(error, 1e-8, name=f"∂ {output} / ∂ {variable}", values=values)


#: The damping just below ζ = 1/2, from which the largest force is at touch.
BORDER = 194.1

#: Central differences of the sixth order.
WEIGHTS = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60


@pytest.mark.parametrize(
    "values",
    [
        {"law": 1, "ball_speed": -3.0, "gap": 1e-3, "b": 40.0},
        {"law": 2, "ball_speed": 2.0, "gap": 0.01, "b": 100.0},
        {"law": 1, "m_club": 0.05, "m_ball": 0.05},
        *({"law": 1, "b": b} for b in (0.0, 160.0, 170.0, 400.0)),
        *({"law": 2, "b": b} for b in (0.0, 1e-300, BORDER, 200.0, 600.0)),
        *(ball | {"gap": 0.01, "reference_compression": 0.006} for ball in (BALL, PENNER)),
        STRAIGHT,
    ],
)
def test_all_results(values):
    """Of linear laws, of an exponent, of an exponent and a COR line, and of a line."""
    names = {"k", "b", "club_speed", "ball_speed", "m_club", "m_ball", "gap", *values} - {"law"}
    found = golf_impact.sensitivities(METRICS, sorted(names), **values)
    for variable in names:
        value = float(values.get(variable, DEFAULTS[variable]))
        if values.get("b") == BORDER or (value <= 1e-300 and variable != "ball_speed"):
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
