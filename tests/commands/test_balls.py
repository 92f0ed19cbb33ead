"""The preset balls, and `run --ball`."""

from dataclasses import replace

import pytest
from command import golf_case, golf_here, refused

from golf_impact import run_impact
from golf_impact.ball import BALLS, Ball, ball, ball_toml, rating_stiffness, read_ball
from golf_impact.measured import MPH


@pytest.mark.parametrize("name", BALLS)
def test_each_ball(fmu, name, tmp_path):
    assert BALLS[name].source
    file = tmp_path / "copy.toml"
    file.write_text(ball_toml(BALLS[name]), "utf-8")
    assert replace(read_ball(file), name=name) == BALLS[name]
    outputs = fmu.impact(("coefficient_of_restitution",), **ball(name).values)
    assert 0.5 < outputs["coefficient_of_restitution"] < 1.0


@pytest.mark.parametrize(
    ("rating", "k"),
    [(30, 5.4e5), (60, 7.0e5), (80, 8.8e5), (90, 1.0e6), (100, 1.17e6), (110, 1.40e6)],
)
def test_rating_stiffness(rating, k):
    """To the published digits."""
    assert rating_stiffness(rating) == pytest.approx(k, rel=0.006)


@pytest.mark.parametrize(("band", "rating"), [("low", 45), ("mid", 73), ("high", 98)])
def test_the_balls_of_a_rating(band, rating):
    assert BALLS[f"rating-{band}"].values["k"] == float(f"{rating_stiffness(rating):.3g}")


def test_the_tour_ball(fmu):
    outputs = fmu.impact(
        ("smash_factor", "contact_time"), club_speed=113 * MPH, **BALLS["tour"].values
    )
    assert outputs["smash_factor"] == pytest.approx(167 / 113, rel=1e-4)
    assert outputs["contact_time"] == pytest.approx(475e-6, rel=1e-3)


@pytest.mark.parametrize("speed", [29.9, 30.0, 50.0, 50.1])
def test_a_run_outside_of_a_balls_range_gets_a_remark(tmp_path, speed):
    done, _ = golf_case(tmp_path, "--ball", "roh-lee", "--set", f"club_speed={speed}")
    assert ("roh-lee holds for 30 to 50 m/s" in done.stderr) is (speed in (29.9, 50.1))


def test_at_rest_the_finite_element_ball_is_far_too_soft():
    """The text of its limits: 4 mm between two plates under 200 lbf, and a putt of 1.3 ms."""
    values = BALLS["roh-lee"].values
    d = 0.005 * (200 * 4.4482216152605 / (values["k"] * 0.005)) ** (1.0 / values["exponent"])
    assert 2.0 * d == pytest.approx(4.0e-3, abs=5e-5)
    assert 160.0 - 2.0 * d / 25.4e-6 == pytest.approx(1.0, abs=0.2)
    assert run_impact(club_speed=1.3, **values)["contact_time"] == pytest.approx(1.3e-3, abs=5e-6)


def test_run_with_a_ball(tmp_path):
    """--set overrides the values of the preset."""
    old = ("--ball", "document-old", "--set", "club_speed=50", "--set", "b=9")
    same = ("--set", "k=0.5e6", "--set", "law=1", "--set", "club_speed=50")
    (_, first), (_, second) = golf_case(tmp_path / "old", *old), golf_case(tmp_path / "same", *same)
    assert first == second


def test_list_balls():
    done = golf_here("list", "--balls", code=0)
    for name in BALLS:
        assert name in done.stdout
    # Lines are wrapped between words.
    texts = [f"{ball.title} {ball.source} {ball.limits}" for ball in BALLS.values()]
    words = {word for text in texts for word in text.split()}
    assert words <= set(done.stdout.split())


# Balls of one's own


def test_a_parameter_that_was_rounded_to_0(tmp_path):
    """Its standard error is kept: 0 is a value of b like any other."""
    mine = Ball("x", "x", {"law": 2, "k": 8e5, "b": 0.0}, "x", ("b",), ((0.25,),))
    file = tmp_path / "mine.toml"
    file.write_text(ball_toml(mine))
    assert read_ball(file).covariance == ((0.25,),)
    assert "±" in golf_case(tmp_path, "--ball", file)[0].stdout


def test_a_ball_from_a_file(fmu, tmp_path):
    """A file that somebody writes by hand: values alone, defaults for the others."""
    file = tmp_path / "mine.toml"
    file.write_text("law = 2\nk = 8e5\nb = 30\n")
    mine = ball(str(file))
    assert mine == read_ball(file)
    assert (mine.name, dict(mine.values)) == (str(file), {"law": 2, "k": 8e5, "b": 30})
    assert mine.uncertain == ()
    _, case = golf_case(tmp_path / "out", "--ball", "mine.toml", cwd=tmp_path)
    assert case["max_force"] == fmu.impact(("max_force",), law=2, k=8e5, b=30.0)["max_force"]


def test_a_ball_file_with_everything(tmp_path):
    """All conditions, with a unit; and a parameter that is known exactly."""
    file = tmp_path / "mine.toml"
    file.write_text(
        "k = 8e5\nb = 30\n[conditions]\nclub_speed = '144 km/h'\nm_club = 0.2\nclub_force = 100\n"
        '[uncertainty]\nparameters = ["k", "b"]\ncovariance = [[1.6e8, 0], [0, 0]]\n'
    )
    mine = read_ball(file)
    assert mine.conditions == {"club_speed": 40.0, "m_club": 0.2, "club_force": 100}
    assert mine.covariance[1] == (0, 0)


UNCERTAIN = 'k = 8e5\nb = 30\n[uncertainty]\nparameters = ["k"]\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is no ball"),
        ("title = 'x'", "is no ball"),
        ("k = ", "no TOML"),
        ("k = 'stiff'", "k = 'stiff' is refused"),
        ("k = '8e5 N'", "'N' isn't a unit it may have: N/m, kN/m, N/mm"),
        ("k = true", "k = True is refused"),
        ("k = nan", "finite"),
        ("k = 1e6\nstiffness = 3", "a ball has no stiffness"),
        ("k = 1e6\nuncertainty = 3", "needs parameters"),
        ("k = 1e6\nconditions = 3", "conditions takes club_speed, m_club"),
        ("k = 1e6\n[conditions]\nball_speed = 3", "conditions takes club_speed, m_club"),
        ("k = 1e6\nspeeds = [30, 30]", "two, in m/s, rising"),
        ("k = 1e6\nspeeds = ['slow', 30]", "two, in m/s, rising"),
        (UNCERTAIN, "and covariance"),
        (UNCERTAIN + "covariance = [[1, 2]]", "p rows of p"),
        (UNCERTAIN + "covariance = [['x']]", "finite numbers"),
        (UNCERTAIN + "covariance = [[-1]]", "below 0"),
        ('k = 8e5\n[uncertainty]\nparameters = ["b"]\ncovariance = [[1]]', "names of values"),
        ('k = 8e5\n[uncertainty]\nparameters = [["k"]]\ncovariance = [[1]]', "names of values"),
    ],
)
def test_files_that_are_no_balls(tmp_path, text, words):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    done = golf_here("run", "--ball", file, "--out", tmp_path / "out")
    refused(done, "mine.toml", words)
    assert not (tmp_path / "out").exists()


def test_intervals_of_a_ball(fmu, tmp_path):
    """Without damping contact time is π √(μ/k): 0.2 % of k are 0.1 % of it."""
    file = tmp_path / "mine.toml"
    uncertainty = '[uncertainty]\nparameters = ["k"]\ncovariance = [[1.6e6]]\n'
    file.write_text(f"law = 2\nk = 8e5\nb = 0\n{uncertainty}")
    done = golf_here(
        "run", "--ball", file, "--ball", "document", "--out", tmp_path, "--no-figures", code=0
    )
    time = fmu.impact(("contact_time",), law=2, k=8e5, b=0.0)["contact_time"] * 1e6
    assert f"{time:.1f} ± {1.96 * 0.5 * 1.2649e3 / 8e5 * time:.1f}" in done.stdout
    assert "Intervals are 95 %" in done.stdout
    # COR doesn't depend on k, and what is set besides is exact.
    done, _ = golf_case(tmp_path / "k", "--ball", file, "--set", "k=9e5")
    assert "±" not in done.stdout
    assert "Intervals" not in done.stdout
