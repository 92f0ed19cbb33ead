"""The preset balls, and `run --ball`."""

import json

import pytest
from command import golf_here, refused

from golf_impact.facts.balls import BALLS, ball, rating_stiffness
from golf_impact.facts.measured import MPH


@pytest.mark.parametrize("name", BALLS)
def test_each_ball(fmu, name):
    assert BALLS[name].name == name
    assert BALLS[name].source
    outputs = fmu.impact(("coefficient_of_restitution",), **ball(name).values)
    assert 0.5 < outputs["coefficient_of_restitution"] < 1.0


@pytest.mark.parametrize(
    ("rating", "k"),
    [(30, 5.4e5), (60, 7.0e5), (80, 8.8e5), (90, 1.0e6), (100, 1.17e6), (110, 1.40e6)],
)
def test_rating_stiffness(rating, k):
    """To the published digits."""
    assert rating_stiffness(rating) == pytest.approx(k, rel=0.006)


def test_the_tour_ball(fmu):
    outputs = fmu.impact(
        ("smash_factor", "contact_time"), club_speed=113 * MPH, **BALLS["tour"].values
    )
    assert outputs["smash_factor"] == pytest.approx(167 / 113, rel=1e-12)
    assert outputs["contact_time"] == pytest.approx(475e-6, rel=1e-9)


def test_run_with_a_ball(tmp_path):
    """--set overrides the values of the preset."""
    done = golf_here(
        *("run", "--ball", "document-old", "--set", "club_speed=50", "--set", "b=9"),
        *("--no-figures", "--out", tmp_path),
    )
    assert done.returncode == 0, done.stderr
    (file,) = tmp_path.glob("*_results.json")
    old = json.loads(file.read_text())["custom"]["custom"]
    same = ("--set", "k=0.5e6", "--set", "law=1", "--set", "club_speed=50")
    assert golf_here("run", *same, "--no-figures", "--out", tmp_path / "same").returncode == 0
    (file,) = (tmp_path / "same").glob("*_results.json")
    assert json.loads(file.read_text())["custom"]["custom"] == old


def test_list_balls():
    done = golf_here("list", "--balls")
    assert done.returncode == 0
    for name in BALLS:
        assert name in done.stdout
    # Lines are wrapped between words.
    words = {word for ball in BALLS.values() for word in f"{ball.title} {ball.source}".split()}
    assert words <= set(done.stdout.split())


def test_an_unknown_ball_on_the_command_line(tmp_path):
    refused(golf_here("run", "--ball", "cannon", "--out", tmp_path), "cannon", "roh-lee, ")
    assert list(tmp_path.iterdir()) == []
