"""Preset balls, and balls of files; see transcripts/ball.md, too."""

from dataclasses import replace

import pytest

import golf_impact
from golf_impact.data.balls import BALLS, Ball, ball, ball_toml, read_ball

MPH = 0.44704
VALUES = {"law": 2, "k": 8e5, "b": 30}


@pytest.mark.parametrize("name", BALLS)
def test_a_preset(name, tmp_path):
    """It has a source, a COR of golf, and comes back from a file."""
    assert BALLS[name].source
    file = tmp_path / "copy.toml"
    file.write_text(ball_toml(BALLS[name]), "utf-8")
    assert replace(read_ball(file), name=name) == BALLS[name] == ball(name)
    outputs = golf_impact.run_impact(**golf_impact.balls()[name].values)
    assert 0.5 < outputs["coefficient_of_restitution"] < 1.0


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


def test_files(tmp_path):
    """By hand, perhaps in an editor of Windows; of earlier versions; one that is rounded to 0."""
    file = tmp_path / "mine.toml"
    file.write_text("law = 2\nk = 8e5\nb = 30\n", "utf-8-sig")
    assert read_ball(file) == ball(str(file)) == Ball(str(file), "of mine", VALUES, "mine")
    conditions = {"club_speed": 40.0, "m_club": 0.2, "club_force": 100}
    file.write_text(
        "k = 8e5\nb = 30\n[conditions]\nclub_speed = '144 km/h'\nm_club = 0.2\nclub_force = 100\n"
        '[uncertainty]\nparameters = ["k", "b"]\ncovariance = [[1.6e8, 0], [0, 0]]\n'
    )
    mine = read_ball(file)
    assert (mine.conditions, mine.covariance[1]) == (conditions, (0, 0))
    file.write_text("law = 2\nrestitution_at_rest = 0.86\n[conditions]\nclub_speed = 35.0\n")
    assert read_ball(file).undetermined == ("k",)
    file.write_text("law = 1\nreference_compression = 0.005\nk = 1e6\nb = 8.4\n")
    assert read_ball(file).undetermined == ()
    rounded = Ball(str(file), "x", VALUES | {"b": 0.0}, "x", ("b",), ((0.25,),))
    file.write_text(ball_toml(rounded))
    assert read_ball(file) == rounded
