"""The law with an exponent: inputs that change in contact, forces, ends; COR lines.

Contacts with constant inputs: `cases.CASES`, by quadrature.
"""

import math
from operator import mul

import pytest
from cases import integrated, restitution
from compare import assert_close, assert_within
from golf_physics.laws import integrated as integrated_law
from golf_physics.restitution import damping_ratio
from numpy.polynomial.legendre import leggauss

import golf_impact

MU = 0.21 * 0.04593 / (0.21 + 0.04593)


def damping(k, n, zeta):
    return 2.0 * zeta * math.sqrt(0.5 * (n + 1.0) * k * MU)


#: Values, and inputs that change at an instant, s.
CHANGED = {
    "as before": ({"k": 8e5, "b": 20.0, "exponent": 1.5}, 1e-4, {"b": 20.1}),
    "opening": ({"k": 8e5, "b": 20.0, "exponent": 1.615544}, 4e-4, {"k": 9e5}),
    "opening, undamped": ({"k": 8e5, "b": 20.0, "exponent": 2.5}, 5e-4, {"b": 0.0}),
    "barely touching": ({"k": 8e5, "b": 20.0, "exponent": 1.5}, 3e-7, {"b": 30.0}),
    "softened": ({"k": 8e5, "b": 20.0, "exponent": 1.5}, 2e-4, {"k": 8e4}),
    "stiffened": ({"k": 8e5, "b": 20.0, "exponent": 3.0}, 2e-4, {"k": 8e7}),
    "near critical": ({"k": 8e5, "exponent": 1.5}, 1e-4, {"b": damping(8e5, 1.5, 1.0)}),
    "overdamped": ({"k": 8e5, "exponent": 1.5}, 1e-4, {"b": damping(8e5, 1.5, 7.0)}),
    "hardly stiff": ({"k": 8e5, "exponent": 4.0}, 3e-4, {"b": damping(8e5, 4.0, 0.6)}),
    "nearly apart": ({"k": 8e5, "exponent": 1.5}, 4.5e-4, {"b": damping(8e5, 1.5, 0.4)}),
    "a force": ({"k": 8e5, "b": 30.0, "exponent": 1.2, "club_force": 900.0}, 1e-4, {"k": 9e5}),
    "a force later": ({"k": 8e5, "b": 30.0, "exponent": 1.6}, 3e-4, {"club_force": 900.0}),
    "a pull": ({"k": 8e5, "exponent": 2.5, "club_force": -3e3}, 1e-4, {"b": 0.0}),
}


@pytest.mark.parametrize("name", CHANGED)
def test_changes_in_contact_against_an_integration(way_of, name):
    """By Runge–Kutta of order 8, of the equations of motion as they stand; by any steps."""
    given, instant, later = CHANGED[name]
    values = {"law": 2, **given}
    expected = integrated(values, [(instant, later)])
    end = expected["contact_time"] * (1.0 + 1e-9)
    scales = {"club_velocity": 35.0, "ball_velocity": 35.0}
    patterns = [(end - instant, later)], [(0.1 * (end - instant), later)] * 10
    for steps in patterns:
        found = way_of("in process").path(values, [(instant, {}), *steps])[-1]
        # Measured: 1e-12 without, 2e-10 with kinks at which the integration's error counts.
        assert_close(found, expected, scales, 1e-9, case=name)


@pytest.mark.parametrize("exponent", [1.0 + 1e-9, 1.5, 10.0])
@pytest.mark.parametrize(
    ("zeta", "club_force"), [(0.0, 0.0), (0.1, 0.0), (1.0, 0.0), (30.0, 0.0), (0.1, 500.0)]
)
def test_mean_forces_are_exact_relative_to_their_steps(way_of, exponent, zeta, club_force):
    """Against Gauss's quadrature of the force, which is smooth there: worst 6e-16, and under a
    force, where it is integrated, 2e-14. The difference of two impulses would have no digits left.
    """
    way, nodes, weights = way_of("in process"), *leggauss(8)
    values = {"law": 2, "k": 8e5, "exponent": exponent, "b": damping(8e5, exponent, zeta)}
    values["club_force"] = club_force
    impact = golf_impact.run_impact(**values)
    time = impact["contact_time"]
    for width in (1e-12 * time, 1e-6 * time, 1e-3 * time):
        for begin in (0.05 * time, 0.5 * time, 0.9 * time):
            width = (begin + width) - begin
            instants = begin + 0.5 * width * (1.0 + nodes)
            forces = golf_impact.run_trajectory(outputs=["force"], times=instants, **values)
            way.begin(values)
            way.step(begin)
            way.step(width)
            off = way["mean_force"] - 0.5 * sum(map(mul, weights, forces["force"]))
            assert_within(abs(off) / impact["max_force"], name="mean force", values=values)


def test_just_after_touch_and_before_separation():
    """d = v t, also where (d/L)^m, m = 6.5, has no double; elastic, it vanishes as it came."""

    def compression(time, **values):
        values = {"law": 2, "k": 8e5, **values}
        return golf_impact.run_trajectory(outputs=["compression"], times=time, **values)

    early = compression(1e-55, exponent=12.0)["compression"]
    assert early == pytest.approx(35e-55, rel=1e-12, abs=0.0)
    elastic = {"law": 2, "k": 8e5, "b": 0.0, "exponent": 10.0}
    end = golf_impact.run_impact(["contact_time"], **elastic)["contact_time"]
    left = 1e-9 * end
    late = compression(end - left, **elastic)["compression"]
    assert late == pytest.approx(35.0 * left, rel=1e-6)


# Under a force: integrated


def test_a_contact_that_a_push_keeps_together_comes_to_rest(way_of):
    """From then on force and compression are constant, and both bodies accelerate alike."""
    values = {"law": 2, "exponent": 1.5, "b": 60.0, "club_speed": 1.0, "club_force": 300.0}
    at_rest = 0.04593 * 300.0 / 0.25593
    expected = {"force": at_rest, "compression": 0.005 * (at_rest / 5e3) ** (1.0 / 1.5)}
    path = way_of("in process").path(values, [(1.0, {}), (999_999.0, {})])
    for time, found in zip((1.0, 1e6), path, strict=True):
        speed = (0.21 + 300.0 * time) / 0.25593
        expected |= {"club_velocity": speed, "ball_velocity": speed, "impulse": 0.04593 * speed}
        assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-11)
        assert found["in_contact"]


@pytest.mark.parametrize(
    ("exponent", "speed", "club_force"),
    [(1.5, 35.0, 1e4), (1.5, 35.0, 1e8), (1.5, 0.01, 300.0), (12.0, 35.0, 1e6), (1.01, 35.0, 1e3)],
)
def test_without_damping_the_bodies_part_as_fast_as_they_met(exponent, speed, club_force):
    """Also where the dip of the compression below 0 is far shorter than a panel."""
    values = {"law": 2, "exponent": exponent, "club_speed": speed, "club_force": club_force}
    found = golf_impact.run_impact(["coefficient_of_restitution"], b=0.0, **values)
    assert found["coefficient_of_restitution"] == pytest.approx(1.0, rel=1e-9)


def test_the_largest_pull_ends_the_contact():
    values = {"law": 2, "exponent": 1.5, "b": 0.0, "club_force": -4.6e8}
    found = golf_impact.run_impact(["contact_time", "max_compression"], **values)
    expected = [2.0 * 35.0 * 0.21 / 4.6e8, 35.0**2 * 0.21 / 9.2e8]
    assert list(found.values()) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("of", "most"), [("in process", 60), ("native, FMI 2.0", 600)])
def test_a_contact_with_neither_end_nor_rest_has_no_force(way_of, monkeypatch, of, most):
    """In C the limit is as it is."""
    monkeypatch.setattr(integrated_law, "_MOST_PANELS", 60)
    values = {"law": 2, "exponent": 1.5, "b": 1.0, "club_speed": 1e-3, "club_force": 300.0}
    way = way_of(of).begin(values)
    assert way.step(1e-4)
    assert way["force"] > 0.0
    assert way.step(1e3)
    assert math.isnan(way["force"])
    assert f"neither ended nor come to rest after {most} panels" in way.messages[-1]


# Damping chosen at touch


@pytest.mark.parametrize(
    "coefficient",
    [
        *(1.0, 1.0 - 2.0**-53, 1.0 - 1e-9, 0.93, 0.7585, 0.3),
        # The iteration begins at critical damping: exp(-π).
        math.exp(-math.pi),
        *(math.exp(-2.0), 0.1353, 1e-3, 1e-12, 1e-29),
    ],
)
def test_damping_ratio(coefficient):
    assert abs(restitution(damping_ratio(coefficient)) - coefficient) < 4e-16 * coefficient**0.5


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_restitution_gives_the_damping(way_of, exponent):
    """The damping ratio stays where the stiffness changes; b isn't used."""
    zeta, way = damping_ratio(0.86 - 0.0029 * 40.0), way_of("in process")
    values = {"law": 2, "exponent": exponent, "ball_speed": -5.0}
    line = {"restitution_at_rest": 0.86, "restitution_slope": 0.0029}
    b, b_later = (damping(k, exponent, zeta) for k in (1e6, 2e6))
    found, again, expected = (
        way.path(values | start, [(2e-4, {}), (1.0, {"k": 2e6, **later})])[-1]
        for start, later in (
            (line, {}), (line | {"b": 1e9}, {"b": 500.0}), ({"b": b}, {"b": b_later}),
        )
    )  # fmt: skip
    assert found == again
    assert found == pytest.approx(expected, rel=1e-13, abs=0.0)
