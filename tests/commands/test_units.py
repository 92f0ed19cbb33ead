"""Values with units wherever text is taken, and remarks about those that lack one."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from command import golf_case, golf_here, refused

import golf_impact
from golf_impact.errors import UserError
from golf_impact.measured import MPH
from golf_impact.sweeps import parse_axis
from golf_impact.units import remarks, si_value


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
def test_values(text, unit, value):
    assert si_value(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["95 knots", "5 kg", "fast", "5e", "mph"])
def test_what_is_no_value(text):
    with pytest.raises(ValueError, match=r"m/s, mph, km/h|no number"):
        si_value(text, "m/s")


@pytest.mark.parametrize(("text", "said"), [("1,5", "write 1.5,"), ("-,5 mph", "write -.5 mph,")])
def test_decimals_after_a_comma(text, said):
    with pytest.raises(ValueError, match=said):
        si_value(text, "m/s")


@pytest.mark.parametrize(
    ("name", "usual", "slip", "words"),
    [
        ("club_speed", 70.0, 70.05, "mph or"),
        ("m_club", 10.0, 10.005, "for 10.005 g"),
        ("k", 1e4, 770.0, "k=770000 for 770 N/mm"),
        ("ball_diameter", 1.0, 42.67, "ball_diameter=0.04267 for 42.67 mm"),
        ("b", 0.1, 0.03, "N·s/m"),
    ],
)
def test_remarks(name, usual, slip, words):
    """On both sides of a border; not about 0, and not about what isn't allowed."""
    assert remarks({name: usual}) == remarks({name: 0.0}) == remarks({name: -5.0}) == []
    (remark,) = remarks({name: slip})
    assert remark.startswith(f"--set {name}={slip:g} is taken in ")
    assert words in remark


def test_where_text_is_taken(tmp_path):
    """run, a ball's file, sweep; calibrate is in test_calibrate."""
    ball = tmp_path / "ball.toml"
    ball.write_text('law = 2\nk = "770 N/mm"\nb = 30\nball_diameter = "42.67mm"\n')
    assert golf_impact.read_ball(ball).values["k"] == 7.7e5
    done, case = golf_case(tmp_path, "--ball", ball, "--set", "club_speed=95mph")
    assert done.stderr == ""
    direct = golf_impact.run_impact(law=2, k=7.7e5, b=30.0, club_speed=95 * MPH)
    assert case["max_force"] == direct["max_force"]
    sets = {"k": "500:2000N/mm:4", "club_speed": "90,95 mph"}
    table = golf_impact.sweep(sets, ["impulse"])
    assert table["k"][::2].tolist() == [5e5, 1e6, 1.5e6, 2e6]
    assert table["club_speed"][:2] == pytest.approx([90 * MPH, 95 * MPH])
    assert parse_axis("club_speed", "normal:95mph:2mph").std() == pytest.approx(2 * MPH)
    with pytest.raises(UserError, match="'lb' isn't a unit it may have: N/m, kN/m, N/mm"):
        golf_impact.sweep({"k": "500:2000lb:4"})
    refused(golf_here("run", "--set", "k=770lb", "--out", tmp_path), "--set k=770lb", "N/mm")


def test_a_remark_once_a_command(tmp_path):
    """Of a number, of a distribution, of a ball's file."""
    ball = tmp_path / "ball.toml"
    ball.write_text("k = 770\n")
    for options, words in (
        (("--set", "club_speed=95"), "write --set club_speed=42.4688 for 95 mph"),
        (("--set", "club_speed=normal:95:2", "--samples", 3), "--set club_speed=42.4688"),
        (("--set", f"ball={ball}"), f"{ball}: k = 770 is taken in N/m: write k = 770000 for"),
    ):
        done = golf_here("sweep", *options, "--no-figures", "--out", tmp_path / "sweep.csv")
        assert (done.returncode, done.stderr.count("is taken in")) == (0, 1)
        assert words in " ".join(done.stderr.split())


@pytest.mark.parametrize("value", ["2", None, [2], [[1], [1, 2]], math.nan])
def test_python_takes_numbers_only(value):
    for function in (golf_impact.run_impact, golf_impact.run_trajectory):
        with pytest.raises(UserError, match="law = "):
            function(law=value)


@pytest.mark.parametrize("k", [10**20, Decimal("8e5"), Fraction(5e6) / 3, np.float32(8e5)])
def test_python_takes_any_real_number(k):
    expected = golf_impact.run_impact(["contact_time"], k=float(k))
    assert golf_impact.run_impact(["contact_time"], k=k) == expected
    found = golf_impact.run_impacts(["contact_time"], k=[k, k])["contact_time"]
    assert found == pytest.approx(expected["contact_time"], rel=1e-13)
