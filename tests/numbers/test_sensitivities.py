"""Partial derivatives against those of the references, which are differences with 80 digits.

Tolerance: 1e-8 of output/variable, or of the derivative if that is larger; WORST measured.
"""

import numpy as np
import pytest
from compare import assert_within

import golf_impact
from golf_impact.data.balls import BALLS
from golf_impact.data.quantities import START as DEFAULTS
from golf_impact.evidence.reference import Reference, mp

OUTPUTS = (
    "touch_time", "smash_factor", "coefficient_of_restitution", "energy_efficiency",
    "club_velocity", "ball_velocity", "contact_time", "max_force", "time_of_max_force",
    "max_compression", "contact_displacement", "impulse", "momentum", "kinetic_energy",
)  # fmt: skip
BALL = dict(BALLS["roh-lee"].values)


def at_the_end(values):
    return Reference(values).outputs(1)


def exact_slopes(values, variable, step):
    """By output: central differences, or one-sided ones where a variable can't be below 0."""
    values = {name: mp.mpf(float(value)) for name, value in (DEFAULTS | values).items()}
    value = values[variable]
    signs = (1, -1) if value or variable == "ball_speed" else (1, 0)
    above, below = (at_the_end(values | {variable: value + sign * step}) for sign in signs)
    return {
        name: ((above[name] - below[name]) / ((signs[0] - signs[1]) * step), above[name])
        for name in OUTPUTS
        if name in above
    }


def check(values, variable, step):
    got = golf_impact.sensitivities(OUTPUTS, [variable], **values)
    value = float(values.get(variable, DEFAULTS[variable]))
    for name, (slope, output) in exact_slopes(values, variable, step).items():
        scale = max(abs(slope), abs(output / (value or 1.0))) or 1.0
        error = float(abs(got[name][variable].item() - slope) / scale)
        assert_within(error, 1e-8, name=f"∂ {name} / ∂ {variable}", values=values)


@pytest.mark.parametrize(
    "values",
    [
        {"law": 1, "ball_speed": -3.0, "gap": 1e-3, "b": 40.0},
        {"law": 1, "b": 0.0},
        {"law": 1, "b": 160.0},
        {"law": 1, "b": 170.0},
        {"law": 1, "b": 400.0},
        {"law": 2, "b": 194.1},
        {"law": 2, "b": 600.0},
        {"law": 1, "m_club": 0.05, "m_ball": 0.05},
        {"law": 2, "b": 100.0, "gap": 0.01, "ball_speed": 2.0},
        {"law": 2, "b": 200.0},
        {"law": 2, "b": 0.0},
        {"law": 2, "b": 1e-300},
    ],
)
def test_linear_laws(values):
    for variable in ("k", "b", "club_speed", "ball_speed", "m_club", "m_ball", "gap"):
        check(values, variable, mp.mpf(10) ** -25)


LINE = ("restitution_at_rest", "restitution_slope")
PENNER, STRAIGHT = dict(BALLS["penner"].values), {"law": 2, "restitution_at_rest": 0.86}
#: By turns of an exponent, of an exponent and a COR line, and of a line.
RELATIVE = [
    (BALL, "exponent"), (PENNER, LINE[1]), (STRAIGHT, "ball_speed"),
    (BALL, "b"), (PENNER, "exponent"), (STRAIGHT, LINE[0]),
    (BALL, "club_speed"), (PENNER, "m_club"), (STRAIGHT, "k"),
    (BALL, "reference_compression"), (PENNER, "k"), (STRAIGHT, "b"),
    (BALL, "m_ball"), (PENNER, "club_speed"), (STRAIGHT, LINE[1]),
    (BALL, "k"), (PENNER, LINE[0]), (STRAIGHT, "m_club"), (PENNER, "b"),
]  # fmt: skip


@pytest.mark.parametrize(("values", "variable"), RELATIVE[:6])
def test_exponents_and_cor_lines(values, variable):
    check(values, variable, mp.mpf(10) ** -14)


@pytest.mark.ci
@pytest.mark.parametrize(("values", "variable"), RELATIVE[6:])
def test_further_slopes(values, variable):
    check(values, variable, mp.mpf(10) ** -14)


def test_cases_without_sensitivities():
    """They are NaN, with the reason of the first; the others are as if they were alone."""
    k, speed = np.array([1e6, -1.0, 2e6, 1e6]), np.array([[35.0], [-1.0]])
    got = golf_impact.sensitivities(["impulse"], ["k", "club_speed"], k=k, club_speed=speed)
    assert list(got) == ["impulse"]
    assert list(got["impulse"]) == ["k", "club_speed"]
    # Refused, and without a contact.
    for slope in got["impulse"].values():
        assert np.isnan(slope).tolist() == [[False, True, False, False], [True] * 4]
    assert got.refused.tolist() == [[False, True, False, False]] * 2
    assert got.reason.startswith("k = -1 N/m is refused")
    alone = golf_impact.sensitivities(["impulse"], ["k"], k=2e6)
    assert alone["impulse"]["k"].shape == ()
    assert alone["impulse"]["k"] == pytest.approx(got["impulse"]["k"][0, 2], rel=1e-13)
    assert alone.reason == ""


#: Output, variable, values of two cases, and which of them has no derivative, why.
WITHOUT = [
    ("impulse", "k", {"club_speed": [35.0, -1.0]}, 1, "the bodies don't touch"),
    ("impulse", "exponent", {"law": [1, 2]}, 0, "exponent = "),
    ("smash_factor", "k", {"b": [9.0, 2000.0]}, 1, "smash_factor doesn't exist"),
    ("impulse", LINE[0], {"law": 2, LINE[0]: [0.8, 0.0]}, 1, "slope over restitution"),
    ("contact_time", "b", {**BALL, "b": [9.0, 0.0]}, 1, "contact_time has no finite slope over b"),
]


@pytest.mark.parametrize(("output", "variable", "values", "which", "reason"), WITHOUT)
def test_where_there_are_none(output, variable, values, which, reason):
    got = golf_impact.sensitivities(output, variable, **values)
    assert np.isnan(got[output][variable]).tolist() == [which == 0, which == 1]
    assert reason in got.reason
    assert not got.refused.any()


@pytest.mark.parametrize(
    ("output", "variable", "name"),
    [
        *((name, "k", name) for name in ("touched", "force", "ball_position")),
        *(("impulse", name, name) for name in ("law", "club_force")),
    ],
)
def test_names_that_are_refused(output, variable, name):
    with pytest.raises(golf_impact.UserError, match=f"{name} is refused"):
        golf_impact.sensitivities(output, variable)


#: Values at a limit, an output, a variable, and the slope on the side that is allowed.
LIMITS = [
    ({"law": 2, LINE[0]: 1.0}, "ball_velocity", LINE[0], 35.0 * 0.21 / 0.25593),
    ({"law": 2, LINE[0]: 1.0}, "coefficient_of_restitution", LINE[0], 1.0),
    ({"law": 2, LINE[0]: 0.1, LINE[1]: 0.1 / 35.0 * (1.0 - 1e-7)}, "coefficient_of_restitution",
     "club_speed", -0.1 / 35.0 * (1.0 - 1e-7)),
    ({"law": 2, LINE[0]: 0.8}, "coefficient_of_restitution", LINE[1], -35.0),
    ({"law": 2, "exponent": 12.0, LINE[0]: 0.8}, "coefficient_of_restitution", "exponent", 0.0),
    ({"law": 2, "exponent": 1.0, LINE[0]: 0.8}, "impulse", "exponent", 0.0),
    ({"law": 2, "gap": 0.0}, "touch_time", "gap", 1.0 / 35.0),
]  # fmt: skip


@pytest.mark.parametrize(("values", "output", "variable", "slope"), LIMITS)
def test_one_sided_at_a_limit(values, output, variable, slope):
    got = golf_impact.sensitivities(output, variable, **values)[output][variable]
    size = golf_impact.run_impact([output], **values)[output]
    scale = max(abs(slope), abs(size / (values.get(variable) or 1.0)))
    assert_within(abs(got - slope) / scale, 1e-8, name=f"∂ {output} / ∂ {variable}", values=values)


def test_the_damping_from_which_the_force_falls_from_touch_on():
    """There, at ζ = 1/2, the largest force b v has its slope, as beyond."""
    values = {"law": 2, "m_club": 2.0, "m_ball": 2.0, "k": 4.0, "b": [2.0, 2.0 + 1e-9]}
    slopes = golf_impact.sensitivities(["max_force"], ["b"], **values, club_speed=1.0)
    assert slopes["max_force"]["b"] == pytest.approx([1.0, 1.0], abs=1e-8)


def test_an_elastic_power_law_has_slopes_over_what_leaves_it_elastic():
    values = {**BALL, "b": 0.0}
    slopes = golf_impact.sensitivities(["contact_time", "max_force"], ["k"], **values)
    impact = golf_impact.run_impact(**values)
    # T ~ k^(-1/(n+1)), F ~ k^(1/(n+1)).
    share = 1.0 / (BALL["exponent"] + 1.0) / BALL["k"]
    assert slopes["contact_time"]["k"] == pytest.approx(-share * impact["contact_time"])
    assert slopes["max_force"]["k"] == pytest.approx(share * impact["max_force"])
