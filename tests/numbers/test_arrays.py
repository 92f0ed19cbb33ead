"""Impacts by arrays beside the scalar physics; random ones of all kinds: test_impacts.py."""

import numpy as np
import pytest
from compare import assert_same_results

import golf_impact
from golf_impact.arrays.impacts import MOMENTARY
from golf_impact.ball import BALLS
from golf_impact.runs import FLAGS, METRICS


def check(way_of, values):
    """All outputs of cases, of any shapes; returns which are closed."""
    shape = np.broadcast_shapes(*map(np.shape, values.values()))
    rows = zip(*(np.broadcast_to(value, shape).ravel().tolist() for value in values.values()))
    cases = [dict(zip(values, row)) for row in rows]
    alone, arrays = (way_of(name).outputs(cases) for name in ("alone", "arrays"))
    assert_same_results(arrays, alone, cases)
    return golf_impact.run_impacts(["impulse"], **values).closed


def test_nearly_equal_masses_that_hardly_close(way_of):
    """Nearly all is in law 1's real mode, whose rates differ in few digits from the drags."""
    closing = 10.0 ** np.random.default_rng(36).uniform(-3, 0, 300)
    values = {"law": 1, "m_club": 0.2, "m_ball": 0.2000001, "club_speed": 40.0, "b": 150.0}
    assert check(way_of, {**values, "ball_speed": 40.0 - closing}).all()


BALL = dict(BALLS["roh-lee-tsuji"].values)

#: Values, one of them, and where it is inside and outside the closed forms.
BORDERS = {
    "law 1, damping": ({"law": 1}, "b", 9.0, 400.0),
    # The end is near the pair's zero beyond the limit of ζ, too.
    "law 1, heavy ball": (
        {"law": 1, "k": 7.85e6, "m_club": 0.19, "m_ball": 0.687, "club_speed": 12, "ball_speed": 4},
        *("b", 100.0, 2051.0),
    ),
    "law 2, damping": ({"law": 2}, "b", 9.0, 400.0),
    "law 2, COR": ({"law": 2}, "restitution_at_rest", 0.8, 0.01),
    "exponent, damping": (BALL, "b", 9.0, 400.0),
    "exponent, COR": (BALL, "restitution_at_rest", 0.8, 0.01),
    "exponent": ({"law": 2, "exponent": 1.5}, "exponent", 1.5, 12.5),
    "slow": ({"law": 2}, "ball_speed", 0.0, 35.0),
    "slow club": ({"law": 1, "ball_speed": -20.0}, "club_speed", 1.0, 0.0),
    "long approach": ({"law": 2, "club_speed": 0.5}, "gap", 0.0, 500.0),
    "soft": ({"law": 1, "b": 0.01}, "k", 1e6, 0.1),
    "stiff": (BALL, "k", 1e6, 1e14),
    "light": ({"law": 1}, "m_ball", 0.04593, 1e-6),
    "heavy": ({"law": 2}, "m_club", 0.2, 1e6),
}


@pytest.mark.parametrize("border", BORDERS)
def test_borders_from_both_sides(way_of, border):
    values, name, inside, outside = BORDERS[border]
    while (middle := 0.5 * (inside + outside)) not in (inside, outside):
        closed = golf_impact.run_impacts(["impulse"], **values | {name: middle}).closed
        inside, outside = (middle, outside) if closed else (inside, middle)
    both = np.array([inside, outside])
    assert check(way_of, values | {name: both}).tolist() == [True, False]


def test_momentary_outputs_are_those_of_the_scalar_physics():
    speeds = [30.0, 40.0, -1.0]
    found = golf_impact.run_impacts(MOMENTARY, club_speed=speeds)
    expected = [golf_impact.run_impact(MOMENTARY, club_speed=speed) for speed in speeds]
    for name in MOMENTARY:
        assert found[name].tolist() == [one[name] for one in expected]


@pytest.mark.parametrize(
    "values",
    [
        {"law": 1},
        {"law": 2, "b": 150.0},
        dict(BALLS["penner"].values),
        {**BALL, "exponent": 6.0, "b": 0.0},
        {**BALL, "exponent": 12.0},
    ],
)
def test_forces_of_a_contact(values):
    contact = golf_impact.arrays.impacts.closed_contact(values)
    end = contact.contact_time
    times = np.random.default_rng(1).permutation(np.linspace(-0.1, 1.1, 100) * end)
    forces = contact.forces(times)
    begun = np.maximum(times, 0.0)
    exact = golf_impact.run_trajectory(outputs=["force"], times=begun, **values)["force"]
    inside = (times > 0.0) & (times < end)
    assert (forces[~inside] == 0.0).all()
    assert np.abs(forces - exact)[inside].max() < 1e-13 * contact.max_force
    assert golf_impact.arrays.impacts.closed_contact({"law": 2, "b": 1e3}) is None


# The public functions


def test_shapes_and_cases_without_a_contact():
    k, speed = np.array([5e5, 1e6, 2e6, 4e6]), np.array([[20.0], [40.0], [-1.0]])
    outputs = ("smash_factor", "contact_time", "touched", "separated")
    got = golf_impact.run_impacts(outputs, law=2, k=k, club_speed=speed)
    shapes = [(name, value.shape, value.dtype) for name, value in got.items()]
    assert shapes == [(name, (3, 4), bool if name in FLAGS else float) for name in outputs]
    assert got["touched"].tolist() == got["separated"].tolist() == [[True] * 4] * 2 + [[False] * 4]
    assert np.isnan(got["smash_factor"]).tolist() == (~got["touched"]).tolist()
    assert got.refused.tolist() == [[False] * 4] * 3
    one = golf_impact.run_impacts(law=2)
    assert [value.shape for value in one.values()] == [()] * len(METRICS)
    assert golf_impact.run_impacts(["impulse"], k=np.empty((0, 2)))["impulse"].shape == (0, 2)


def test_refused_cases_and_the_first_reason_are_those_of_the_scalar_physics():
    values = {
        "b": np.array([9.0, -1.0, 9.0, np.nan, 9.0, np.inf, 9.0, 9.0]),
        "k": np.array([1e6, -1.0, -1.0, 1e6, 1e6, 1e6, 1e6, 1e6]),
        "law": np.array([2, 2, 2, 2, 1.5, 2, 1, 99]),
        "exponent": np.array([1, 1, 1, 1, 1, 1, 1.5, 1]),
    }
    got = golf_impact.run_impacts(**values)
    assert got.refused.tolist() == [False] + [True] * 7
    assert np.isnan(got["impulse"]).tolist() == got.refused.tolist()
    for n in range(1, 8):
        with pytest.raises(golf_impact.UserError) as caught:
            golf_impact.run_impact(**{name: value[n] for name, value in values.items()})
        assert n > 1 or got.reason == str(caught.value)
    line = golf_impact.run_impacts(law=2, restitution_at_rest=[0.9, 0.1], restitution_slope=0.003)
    assert line.refused.tolist() == [False, True]
    assert "at touch" in line.reason
    # A law that doesn't exist, then a case without a contact: nothing of the first one is left.
    got = golf_impact.run_impacts(["ball_velocity"], law=[1.5, 1.0], club_speed=-5.0)
    assert (got.refused.tolist(), got["ball_velocity"][1]) == ([True, False], 0.0)
    masked = np.ma.array([1e6, 2e6], mask=[False, True])
    assert golf_impact.run_impacts(k=masked).refused.tolist() == [False, True]


def test_values_that_are_refused():
    for values, message in (
        ({"k": 1j}, "k is refused: it must be a number"),
        ({"k": [1e6, 2e6], "b": [1, 2, 3]}, r"k \(2,\), b \(3,\)"),
    ):
        with pytest.raises(golf_impact.UserError, match=message):
            golf_impact.run_impacts(**values)


def test_instants_in_any_order():
    path = golf_impact.run_trajectory(80, law=2, gap=1e-3)
    order = np.random.default_rng(1).permutation(80).reshape(4, 20)
    got = golf_impact.run_trajectory(times=path["time"][order], law=2, gap=1e-3)
    for name, values in path.items():
        np.testing.assert_allclose(got[name], values[order], atol=1e-13 * np.abs(values).max())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"times": [-1e-9]}, "times with -1e-09 are refused: each must be a number of 0 to 1e"),
        ({"times": [1.0000001e100]}, "0 to 1e"),
        *(({"points": n}, rf"points = {n} is refused: .* at least 2") for n in (1, 2.5)),
        ({"times": "soon"}, "times is refused"),
        ({"times": [0.0], "outputs": ["mean_force"]}, "use points"),
        ({"times": [0.0], "k": -1.0}, r"k = -1\.0"),
        ({"times": [1.0], "law": 2, "restitution_at_rest": 0.1, "restitution_slope": 1.0}, "touch"),
    ],
)
def test_trajectories_that_are_refused(arguments, message):
    with pytest.raises(golf_impact.UserError, match=message) as caught:
        golf_impact.run_trajectory(**arguments)
    assert caught.value.reason
    assert caught.value.variable
    assert len(golf_impact.run_trajectory(points=2)["time"]) == 2
