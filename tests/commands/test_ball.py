"""Preset balls, balls of files, and values with units."""

import math
from dataclasses import replace

import pytest

import golf_impact
from golf_impact.data.balls import (
    BALLS,
    Ball,
    ball,
    ball_toml,
    range_remarks,
    rating_stiffness,
    read_ball,
)
from golf_impact.data.units import remarks, si_value

MPH = 0.44704


@pytest.mark.parametrize("name", BALLS)
def test_a_preset(name, tmp_path):
    """It has a source, a COR of golf, and comes back from a file."""
    assert BALLS[name].source
    file = tmp_path / "copy.toml"
    file.write_text(ball_toml(BALLS[name]), "utf-8")
    assert replace(read_ball(file), name=name) == BALLS[name] == ball(name)
    outputs = golf_impact.run_impact(**golf_impact.balls()[name].values)
    assert 0.5 < outputs["coefficient_of_restitution"] < 1.0


def test_the_balls_of_a_rating():
    """Stiffness to the published digits; presets have the middle of a band of ratings."""
    published = {30: 5.4e5, 60: 7.0e5, 80: 8.8e5, 90: 1.0e6, 100: 1.17e6, 110: 1.40e6}
    for rating, k in published.items():
        assert rating_stiffness(rating) == pytest.approx(k, rel=0.006)
    for band, rating in {"low": 45, "mid": 73, "high": 98}.items():
        assert BALLS[f"rating-{band}"].values["k"] == float(f"{rating_stiffness(rating):.3g}")


def test_the_tour_ball():
    outputs = golf_impact.run_impact(club_speed=113 * MPH, **BALLS["tour"].values)
    assert outputs["smash_factor"] == pytest.approx(167 / 113, rel=1e-4)
    assert outputs["contact_time"] == pytest.approx(475e-6, rel=1e-3)


def test_at_rest_the_finite_element_ball_is_far_too_soft():
    """The text of its limits: 4 mm between two plates under 200 lbf, and a putt of 1.3 ms."""
    values = BALLS["roh-lee"].values
    d = 0.005 * (200 * 4.4482216152605 / (values["k"] * 0.005)) ** (1.0 / values["exponent"])
    assert 2.0 * d == pytest.approx(4.0e-3, abs=5e-5)
    assert 160.0 - 2.0 * d / 25.4e-6 == pytest.approx(1.0, abs=0.2)
    time = golf_impact.run_impact(club_speed=1.3, **values)["contact_time"]
    assert time == pytest.approx(1.3e-3, abs=5e-6)


# Balls of files


def test_a_file_with_values_alone(tmp_path):
    """As somebody writes it by hand, perhaps in an editor of Windows; defaults for the others."""
    file = tmp_path / "mine.toml"
    file.write_text("law = 2\nk = 8e5\nb = 30\n", "utf-8-sig")
    mine = golf_impact.read_ball(file)
    assert mine == ball(str(file))
    assert (mine.name, dict(mine.values)) == (str(file), {"law": 2, "k": 8e5, "b": 30})
    assert (mine.uncertain, mine.conditions, mine.speeds) == ((), {}, ())


def test_a_file_with_everything(tmp_path):
    """All conditions, with a unit; a parameter that is known exactly; one that is rounded to 0."""
    file = tmp_path / "mine.toml"
    file.write_text(
        "k = 8e5\nb = 30\n[conditions]\nclub_speed = '144 km/h'\nm_club = 0.2\nclub_force = 100\n"
        '[uncertainty]\nparameters = ["k", "b"]\ncovariance = [[1.6e8, 0], [0, 0]]\n'
    )
    mine = read_ball(file)
    assert mine.conditions == {"club_speed": 40.0, "m_club": 0.2, "club_force": 100}
    assert mine.covariance[1] == (0, 0)
    rounded = Ball("x", "x", {"law": 2, "k": 8e5, "b": 0.0}, "x", ("b",), ((0.25,),))
    file.write_text(ball_toml(rounded))
    assert read_ball(file).covariance == ((0.25,),)


# Units


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("95mph", "m/s", 95 * MPH),
        ("171 km/h", "m/s", 47.5),
        ("770N/mm", "N/m", 7.7e5),
        ("0.77e3 kN/m", "N/m", 7.7e5),
        ("42.67 mm", "m", 0.04267),
        ("30 N·s/m", "N.s/m", 30.0),
        ("600 µs", "s", 6e-4),
        ("600us", "s", 6e-4),
        ("74%", "1", 0.74),
        ("1e-3", "m", 1e-3),
        ("inf", "m", math.inf),
    ],
)
def test_a_value_with_a_unit(text, unit, value):
    assert si_value(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["95 knots", "5 kg", "5e", "mph"])
def test_what_is_no_value(text):
    with pytest.raises(ValueError, match=r"m/s, mph, km/h|not a number"):
        si_value(text, "m/s")


@pytest.mark.parametrize(
    ("name", "usual", "suspicious", "hint"),
    [
        ("club_speed", 70.0, 70.05, "m/s: write --set club_speed=31.3152 for 70.05 mph or "),
        ("m_club", 10.0, 10.005, "kg: write --set m_club=0.010005 for 10.005 g."),
        ("k", 1e4, 9.99e3, "N/m: write --set k=9.99e+06 for 9990 N/mm."),
        ("ball_diameter", 1.0, 1.005, "m: write --set ball_diameter=0.001005 for 1.005 mm."),
        ("b", 0.1, 0.099, "N·s/m: golf balls have 1 to 100 there."),
        # Nothing is remarked about 0, nor about what is refused.
        ("b", 0.0, 0.03, ""),
        ("k", -5.0, 770.0, ""),
    ],
)
def test_numbers_that_look_like_another_units(name, usual, suspicious, hint):
    assert remarks({name: usual}) == []
    (remark,) = remarks({name: suspicious})
    assert remark.startswith(f"--set {name}={suspicious:g} is taken in {hint}")


def test_speeds_for_which_a_ball_does_not_hold():
    """Those of a range, and of a ball that was measured at a single one."""
    once = replace(BALLS["roh-lee"], name="once", speeds=(40.0, 40.0))
    balls, lose = [BALLS["roh-lee"], once], "measured balls lose 0.0029 of COR per m/s."
    others = f"once was measured at 40 m/s, not at {{}}: {lose}"
    for speed in (30.0, 50.0):
        assert range_remarks(balls, speed) == [others.format(f"{speed:g}")]
    for speed in (29.9, 50.1):
        of_range = f"roh-lee holds for 30 to 50 m/s, not for {speed}."
        assert range_remarks(balls, speed) == [of_range, others.format(speed)]
    assert range_remarks(balls, 40.0) == []
