"""Records of labs and oscilloscopes, measured numbers, and what isn't one of an impact."""

import json
import math
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from command import golf_here
from test_calibrate import AT, PENNER, record

import golf_impact
from golf_impact.data.errors import UserError
from golf_impact.data.files import read_toml
from golf_impact.data.measured import MPH
from golf_impact.studies.calibrate import records
from golf_impact.studies.calibrate.measurements import measured, measurements, number

KINDS = {
    "curve": (records.TIME, records.FORCE, records.SIGMA),
    "cor": (records.SPEED, records.COR, records.COR_SIGMA),
    "shots": (records.CLUB, records.BALL),
}
FILES = read_toml(Path(__file__).with_name("records.toml"))


def read(folder, case):
    """The table of a file that is described in records.toml; half of the shots may be missing."""
    kind, file = case.get("kind", "curve"), folder / "record.csv"
    file.write_bytes(case["file"].encode(case.get("encoding", "utf-8")))
    missing = {"missing": 0.5} if kind == "shots" else {}
    return records.read_table(file, KINDS[kind], case.get("columns", ""), **missing)


@pytest.mark.parametrize("case", FILES["tables"], ids=lambda case: case["of"])
def test_what_is_read(tmp_path, case):
    table = read(tmp_path, case)
    names = [column.name for column in KINDS[case.get("kind", "curve")]]
    assert [*table.columns] == names[: len(case["read"])]
    for found, expected in zip(table.columns.values(), case["read"]):
        assert found == pytest.approx(np.array(expected), rel=1e-9, abs=1e-15)
    rows = [int(place.removeprefix("line ")) for place in table.places]
    assert [rows[0], rows[-1]] == case.get("rows", [rows[0], rows[0] + len(rows) - 1])
    assert table.notes == case.get("notes", [])
    assert table.clipped == ("clipped" in "".join(table.notes))


@pytest.mark.parametrize("case", FILES["refused"], ids=lambda case: case["of"])
def test_what_is_refused(tmp_path, case):
    (tmp_path / "record.csv").write_text(case.get("file", ""), "utf-8")
    options = case.get("options", "--curve record.csv@40 --m-club 0.2").split()
    options += ["--columns", case["columns"]] if "columns" in case else []
    done = golf_here("calibrate", *options, "--out", "out", cwd=tmp_path, code=2)
    assert done.stderr == f"Error: {case['why']}\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("last", ["NaN,100\n", "100"])
def test_one_percent_of_rows_may_be_unreadable(tmp_path, last):
    """Also the last one, and if it is cut."""
    rows = "".join(f"{n},{n}\n" for n in range(1, 100))
    table = read(tmp_path, {"file": f"time,force\n{rows}{last}"})
    assert table.notes == ["1 unreadable rows left out, the first in line 101"]
    assert [*map(len, table.columns.values())] == [99, 99]
    with pytest.raises(UserError, match="line 100"):
        read(tmp_path, {"file": f"time,force\n{rows[4:]}{last}"})
    with pytest.raises(UserError, match="a line has more than 131072 characters"):
        read(tmp_path, {"file": f"time,force\n{'0' * 131_073},1\n"})


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("cor", 0.01, 1.0), ("exponent", 0.999999, 12.000001), ("max_force", 20.0, math.inf),
     ("contact_time", 0.0, 0.1), ("restitution_at_rest", 0.0, 1.000001),
     ("m_ball", 0.0, 10.0), ("club_speed", 0.0, math.inf)],
)  # fmt: skip
def test_ranges_of_measured_numbers(name, low, high):
    inside = [low * (1.0 + 1e-9) or 1e-9, high * (1.0 - 1e-9) if high < math.inf else 1e9]
    assert [number(value, name) for value in inside] == inside
    for value in (low, high, math.nan):
        with pytest.raises(UserError, match="is refused"):
            number(value, name)


@pytest.mark.parametrize("text", ["600us±6us", "600±6us", "600us +- 6", "0.6ms+/-6us", "6e-4±6e-6"])
def test_a_number_with_its_sigma(text):
    assert measured(text, "contact_time") == pytest.approx((6e-4, 6e-6, True))


def curve(rows=260, lead=100):
    """The half sine of an undamped contact: 6 kN, 628 µs, 2.4 N·s; one row in 5 µs."""
    time = 5e-6 * np.arange(rows)
    since = time - lead * 5e-6
    inside = (since > 0.0) & (since < math.pi / 5e3)
    return time, np.where(inside, 6e3 * np.sin(5e3 * since), 0.0)


def conditioned(*columns, window=None, baseline="", **options):
    """The curve as it is fitted."""
    given = {"club_speed": 30.0, "m_club": 0.2, "m_ball": 0.05} | options
    data = measurements(given, curve=columns, window=window, baseline=baseline)
    return data.curves["curve"]


TIME, FORCE = curve()
#: Its largest force, its impulse over reduced mass times speed; 105 rows are above a quarter.
PEAK, RATIO = FORCE.max(), np.trapezoid(FORCE, TIME) / (0.04 * 30.0)


def said(time, force):
    """Notes, or why a record is refused, without numbers."""
    try:
        words = conditioned(time, force).notes
    except UserError as error:
        words = [str(error)]
    return re.sub(r"\b\d+(\.\d+)?(e[-+]\d+)?", "#", "; ".join(words))


def peak(time, force):
    """The row of the largest force, of a record that is refused."""
    with pytest.raises(UserError, match="the largest force") as error:
        conditioned(time, force)
    return int(re.search(r"row (\d+)", str(error.value))[1])


def changed(*changes):
    """The half sine with other forces in some rows."""
    force = FORCE.copy()
    for rows, value in changes:
        force[rows] = value
    return TIME, force


def blocks(*forces, stretch=1.0):
    """Numbers of rows at (almost) a force; those at 1 together have 1.8 times μ v."""
    force = np.concatenate([np.full(round(n), f) for n, f in forces])
    unit = 1.8 * 0.04 * 30.0 / (np.count_nonzero(force == 1.0) * 2.0**-18)
    rows = np.arange(len(force))
    return stretch * 2.0**-18 * rows, unit * force * (1.0 + 1e-6 * rows)


def scattered(ratio):
    """The offset of a baseline beside scatter that is so many times larger after contact."""
    time, force = curve(327)
    noise = (-1.0) ** np.arange(327)
    force[:100] += noise[:100]
    force[225:] += 50.0 + ratio * noise[225:]
    return round(conditioned(time, force, baseline="constant").baseline[0])


def steps(n):
    """Forces in steps of 500 N, 20 rows at the largest one and n rows a step below."""
    force = np.minimum(500.0 * np.round(FORCE / 500.0), 5000.0)
    force[140:160], force[160 : 160 + round(n)] = 6e3, 5500.0
    return said(TIME, force)


def shots(folder, speeds, cors, unit=" [m/s]"):
    """What is said of shots with a club of 0.2 kg and a ball of 0.05 kg."""
    rows = [f"{u!r},{u * (1.0 + e) / 1.25!r}" for u, e in zip(speeds, cors)]
    file = folder / "shots.csv"
    file.write_text("\n".join([f"Club Speed{unit},Ball Speed{unit}", *rows]))
    try:
        words = measurements({"m_club": 0.2, "m_ball": 0.05}, shots=file).cor_speeds.notes
    except UserError as error:
        words = [str(error)]
    return re.sub(r"\b\d+(\.\d+)?\b(?! shots)", "#", "; ".join(words))


SPEEDS = [30.0, 35.0, 38.0, 40.0, 42.0, 45.0, 50.0]
MIDDLE = [40.0] * 8
#: What is said of a record, or another result, by a number; its range, where the result changes.
BORDERS = {
    "amplitude": (lambda x: said(TIME, x * FORCE), 4e-4, 3.0, [
        *(x / RATIO for x in (1e-3, 2e-3, 1 / 3.6, MPH, 2 / 3.6, 2 * MPH, 0.95, 2.05)),
        0.05 / 0.04 / (0.5 * RATIO)]),
    "amplitude of an incomplete record": (lambda x: said(TIME[150:], x * FORCE[150:]), 0.36, 0.6,
        [0.5 * 1.2 / np.trapezoid(FORCE[150:], TIME[150:])]),
    "a time before": (lambda x: said(np.array([5.0, 6.0, 5.0 + x, 7.0]), np.ones(4)), 1e-3, 0.5,
        [0.01]),
    "stretched time": (lambda x: said(x * TIME, FORCE), 5.0, 1e5,
        [0.02 / (104 * 5e-6), 20.0 / (104 * 5e-6)]),
    "a negative row": (lambda x: peak(
        *changed((slice(40), 100.0), (slice(230, 260), 300.0), (60, -x))), 4e3, 9e3,
        [PEAK - 400.0]),
    "undershoot": (lambda x: said(*changed((60, -x))), 100.0, 5e3, [PEAK / 3.0]),
    "a tail": (lambda x: said(37.0 * TIME, changed(
        (slice(216, 240), x * PEAK), (slice(240, 260), 200.0))[1]), 0.15, 0.5,
        [0.25]),
    "begin": (lambda x: said(*changed(([0, 1, 2], [0.0, x * PEAK, 0.9 * PEAK]))), 0.01, 0.24,
        [0.1]),
    "end": (lambda x: said(*changed(([-3, -2, -1], [0.9 * PEAK, x * PEAK, 0.0]))), 0.01, 0.24,
        [0.1]),
    "first rows": (lambda n: peak(*changed((slice(round(n)), -7e3))) > 100, 3, 10, [6.5]),
    "rows at the top": (lambda n: said(*changed((slice(150, 150 + round(n)), 6100.0))), 2, 30,
        [10.5]),
    "few rows at the top": (lambda n: said(TIME[::5], changed(
        (slice(150, 150 + 5 * round(n)), 6100.0))[1][::5]), 2, 6, [3.5]),
    "rows below the top": (steps, 1, 9, [4.5]),
    "rows in contact": (lambda n: said(*blocks((20, 0), (n, 1), (20, 0))), 2, 40, [4.5, 30.5]),
    "rows below a limit": (lambda n: said(*changed((slice(108 + round(n), 219), 4500.0))), 1, 20,
        [4.5]),
    "a second pulse": (lambda x: said(*blocks((20, 0), (100, 1), (50, 0), (40, x), (20, 0))),
        0.11, 0.9, [0.25]),
    "rows of a second pulse": (lambda n: said(*blocks((20, 0), (100, 1), (50, 0), (n, 2), (20, 0))),
        9, 60, [19.5]),
    "rows of a second short pulse": (lambda n: said(
        *blocks((20, 0), (20, 1), (50, 0), (n, 2), (20, 0))), 4, 15, [4.5]),
    "a pause": (lambda x: said(*blocks((20, 0), (100, 1), (50, x), (40, 1), (20, 0.03))), 0.01,
        0.24, [0.1]),
    "rows of a pause": (lambda n: said(*blocks((20, 0), (100, 1), (n, 0), (40, 1), (20, 0))),
        2, 30, [9.5]),
    "rows of a pause of short pulses": (lambda n: said(
        *blocks((20, 0), (20, 1), (n, 0), (20, 1), (20, 0))), 1, 9, [2.5]),
    "two slow pulses": (lambda x: peak(
        *blocks((20, 0), (100, 1), (50, 0), (40, 1.5), (20, 0), stretch=x)), 1e4, 2.6e4,
        [20.0 / (229 * 2.0**-18)]),
    "scatter": (scattered, 1.2, 3.0, [2.0]),
}  # fmt: skip
SHOTS = {
    "speeds without a unit": (lambda f, x: shots(f, [x * u / 40.0 for u in SPEEDS], [0.8] * 7, ""),
        20.0, 90.0, [33.0, 58.0]),
    "a mishit": (lambda f, x: shots(f, SPEEDS, [0.8, 0.8, 0.8, 0.8 - x, 0.8, 0.8, 0.8]), 1e-3, 0.1,
        [0.009]),
    "a mishit beside scatter": (lambda f, x: shots(
        f, [*MIDDLE, 41.0, 41.0], [0.81, 0.79] * 4 + [0.8 + x, 0.8 - x]), 0.011, 0.1,
        [3.0 * 1.4826 * 0.01]),
    "energy from nowhere": (lambda f, x: shots(f, SPEEDS, [0.996] * 6 + [x]), 0.99, 1.004, [1.0]),
    "no energy": (lambda f, x: shots(f, SPEEDS, [0.012] * 6 + [x]), 0.005, 0.02, [0.01]),
    "a line": (lambda f, x: shots(f, [*MIDDLE, 40.0 - x, 40.0 + x], [0.8] * 8 + [0.82, 0.78]),
        1.0, 3.0, [2.0]),
    "shots": (lambda f, n: shots(f, SPEEDS[: round(n)], [0.8] * 7), 1, 6, [2.5]),
}  # fmt: skip


def assert_borders(said, low, high, borders):
    """Fail unless what is said changes at the borders, to a thousandth of them, and only there."""
    near = [x * factor for x in borders for factor in (1.0 - 4e-4, 1.0 + 4e-4)]
    words = [said(x) for x in (low, *near, high)]
    changes = [a != b for a, b in pairwise(words)]
    assert changes == [n % 2 == 1 for n in range(len(changes))], words


@pytest.mark.parametrize("name", BORDERS)
def test_borders_of_records(name):
    assert_borders(*BORDERS[name])


@pytest.mark.parametrize("name", SHOTS)
def test_borders_of_shots(tmp_path, name):
    said, *borders = SHOTS[name]
    assert_borders(lambda x: said(tmp_path, x), *borders)


#: Columns; records.toml has the notes on them, or why they are refused.
CURVES = {
    "no rows": (TIME[:0], FORCE[:0]),
    "one column": (TIME,),
    "a matrix": (TIME[:, None], FORCE),
    "four columns": (TIME, FORCE, FORCE, FORCE),
    "another segment": ([2e-5, 1e-5], [1.0, 2.0]),
    "the same time twice": ([0.0, 2e-5, 2e-5], [1.0, 2.0, 2.0]),
    "no number": ([1.0, 2.0, 3.0], [1.0, math.nan, math.inf]),
    "σ of 0": ([1.0, 2.0], [1.0, 2.0], [1.0, 0.0]),
    "no force": (TIME, 0.0 * FORCE),
    "a spike": changed((slice(260), 0.0), (150, 6e3)),
    "a spike of two rows": changed((slice(260), 0.0), ([150, 151], 6e3)),
    "late": (TIME[170:], FORCE[170:]),
    "time in ms": (1e3 * TIME, FORCE),
    "time in µs": (1e6 * TIME, FORCE),
    "force in kN": (TIME, 1e-3 * FORCE),
    "speed in mph": (TIME, 0.35 * FORCE),
    "speed in km/h": (TIME, 0.2 * FORCE),
    "too much": (TIME, 1.1 * FORCE),
    "far too much": (TIME, 3.0 * FORCE),
    "all at a limit": changed((slice(108, 219), 4500.0)),
    "clipped": changed((slice(150, 170), 6050.0)),
    "late by a little": (TIME[120:], FORCE[120:]),
    "cut at the end": (TIME[:205], FORCE[:205]),
    "negative, few rows": (TIME[::5], -FORCE[::5]),
    "a second pulse": (5e-6 * np.arange(600), np.tile(curve(300)[1], 2)),
    "a second pulse at once": (5e-6 * np.arange(381), np.append(FORCE[:224], FORCE[103:])),
}


@pytest.mark.parametrize("name", CURVES)
def test_what_is_said_of_a_curve(name):
    try:
        words = "; ".join(conditioned(*CURVES[name]).notes)
    except UserError as error:
        words = f"Error: {error}"
    assert words == FILES["said"][name]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_record_as_it_is_fitted(sign):
    """Offset and drift by the rows outside contact, at the first row in it; less many rows."""
    offset, drift = 50.0, 1e4
    force = FORCE + offset + drift * (TIME - TIME[111])
    sigma = np.linspace(10.0, 20.0, 260)
    found = conditioned(TIME, sign * force, sigma)
    assert found.origin == TIME[111]
    assert found.baseline == pytest.approx((offset, drift))
    assert found.signal == pytest.approx(FORCE, abs=1e-8)
    assert found.contact.tolist() == [*range(111, 216)]
    assert found.spacing == pytest.approx(5e-6)
    assert found.guess is found.sigma
    assert conditioned(TIME, FORCE).guess == pytest.approx(np.full(260, 0.01 * PEAK))
    for kind, expected in {"zero": (), "constant": (offset,), "linear": (offset, 0.0)}.items():
        baseline = conditioned(TIME, FORCE + offset, baseline=kind).baseline
        assert baseline == pytest.approx(expected, abs=1e-6)
    for window in ("0.25:1ms", (2.5e-4, 1e-3)):
        part = conditioned(TIME, FORCE, sigma, window=window)
        assert part.x.tolist() == TIME[50:201].tolist()
        assert part.sigma.tolist() == sigma[50:201].tolist()
    # 105 rows of contact with half as many on each side, of which every third one stays; an eighth.
    assert found.thinned(260) is found
    assert found.thinned(80).x.tolist() == TIME[58:269:3].tolist()
    assert found.thinned(10).x.tolist() == TIME[58:269:8].tolist()


def test_what_is_measured_together(tmp_path):
    """Curves with conditions of their own, scalars, prior knowledge and a COR line."""
    at = {"club_speed": 30.0, "m_club": 0.2, "m_ball": 0.05}
    one = {"time": TIME, "force": FORCE, **at}
    two = {**one, "force": 1.1 * FORCE, "club_speed": 33.0, "sigma": 0.0 * TIME + 5.0}
    prior = {"b": (9.0, 1.0)}
    data = measurements(
        {}, [one, two], priors=prior, cor_speeds=([20.0, 30.0], [0.8, 0.7], [0.1] * 2)
    )
    assert [*data.parts] == ["targets", "curve", "curve_2", "cor_speeds"]
    assert [part.suffix for part in data.curves.values()] == ["", "_2"]
    assert data.curves["curve_2"].impact == {**at, "club_speed": 33.0}
    assert (data.impact, data.given) == (at, {"club_speed", "m_club"})
    assert (data.estimated, data.sized) == (["curve"], True)
    assert (data.scalars.y, data.scalars.guess, data.scalars.targets) == ([9.0], [1.0], [])
    assert data.scalars.model({"k": 1e6, "b": 8.0}) == [8.0]
    with pytest.raises(UserError, match="scalars beside curves of several speeds need"):
        measurements({"cor": 0.7}, [one, one, two])
    assert measurements({"cor": 0.7, "club_speed": 40.0}, [one, two]).impact["club_speed"] == 40.0
    assert measurements({"cor": 0.7}, (one, one)).impact == at
    assert not measurements({"coefficient-of-restitution": "70%"}).sized
    timed = measurements({"contact_time": 6e-4, "cor": 0.7}, priors={"m_club": (0.21, 0.01)})
    assert (timed.sized, timed.given, timed.impact["m_club"]) == (True, {"m_club"}, 0.21)
    assert timed.scalars.measured["cor"] == pytest.approx((0.7, 0.007, False))
    file = tmp_path / "line.csv"
    file.write_text("approach_speed,cor\n80,0.8\n100,0.7\n90,0.6\n")
    line = measurements({}, cor_speeds=file).cor_speeds
    assert line.notes == (
        "approach_speed has no unit: taken in m/s",
        "approach speed 100 is taken in m/s: write approach speed 44.704 for 100 mph or approach "
        "speed 27.7778 for 100 km/h",
    )
    assert (line.step, line.clipped, line.sigma) == (0.0, False, None)
    fall = {"restitution_at_rest": 1.0, "restitution_slope": 0.002}
    assert line.model(fall) == pytest.approx([0.84, 0.8, 0.82])
    with pytest.raises(UserError, match="COR isn't above 0 at these speeds"):
        line.model({**fall, "restitution_slope": 0.01})


@pytest.mark.parametrize(("rows", "kind"), [(9, 0), (10, 1)])
def test_a_baseline_needs_ten_rows(rows, kind):
    """Of rows at least a quarter of the contact before it, or after it."""
    for part in (slice(85 - rows, 230), slice(90, 241 + rows)):
        assert len(conditioned(TIME[part], FORCE[part] + 50.0).baseline) == kind


@pytest.mark.parametrize("step", [50.0, 200.0, 500.0])
@pytest.mark.parametrize("limit", [math.inf, 7000.0])
def test_quantization_is_not_clipping(step, limit):
    """Rows at the largest value are a parabola's, or as many as are left out at a limit."""
    time, force = record(lead=0.15, trail=0.25, step=step, limit=limit)
    sigma, clipped = np.linspace(10.0, 20.0, 551), (force == force.max()) & (limit < math.inf)
    series = conditioned(time, force, sigma, **AT, m_ball=0.04593)
    assert series.step == step
    assert series.clipped == bool(clipped.any())
    assert series.sigma.tolist() == sigma[~clipped].tolist()


def test_what_cor_alone_leaves_open(tmp_path):
    """Shots of a launch monitor: mishits are left out, k stays undetermined for all readers."""
    draw, speeds = np.random.default_rng(1), np.linspace(38.0, 52.0, 40)
    cors = PENNER["restitution_at_rest"] - PENNER["restitution_slope"] * speeds
    smash = (1.0 + cors + draw.normal(0.0, 0.004, 40)) / (1.0 + 0.04593 / 0.2)
    smash[[3, 9]] -= 0.12
    rows = [
        f"{n},{u / MPH:.1f},{u * s / MPH:.1f}" for n, (u, s) in enumerate(zip(speeds, smash), 1)
    ]
    text = "\n".join(["Shot,Club Speed,Ball Speed", ",[mph],[mph]", *rows, "Average,,101,147"])
    (tmp_path / "shots.csv").write_text(text)
    given = "--shots", "shots.csv", "--m-club", "200g", "--save", "m.toml", "--no-figures"
    done = golf_here("calibrate", *given, "--out", ".", cwd=tmp_path, code=0)
    words = " ".join(done.stdout.split())
    assert "of 40 shots are left out" in words
    assert "k is undetermined" in words
    ball = golf_impact.read_ball(tmp_path / "m.toml")
    assert (ball.undetermined, ball.conditions) == (("k",), {"m_club": 0.2})
    assert ball.speeds == pytest.approx((38.0, 52.0), abs=0.1)
    written = json.loads((tmp_path / "calibrate.json").read_text())["parameters"]
    for name, one in written.items():
        assert abs(one["value"] - PENNER[name]) < 4.0 * one["standard_error"]
    done = golf_here("run", "--ball", "m.toml", "--no-figures", cwd=tmp_path, code=0)
    rows = [row for row in done.stdout.splitlines() if "k undetermined" in row]
    assert {row.split("(")[0].strip("│ ") for row in rows[1:]} >= {"contact time", "max force"}
    table = golf_impact.sweep({"ball": f"{tmp_path}/m.toml,penner"}, ["smash_factor", "max_force"])
    assert np.isnan(table["max_force"]).tolist() == [True, False]
    assert not np.isnan(table["smash_factor"]).any()


@pytest.mark.parametrize("unit", [" [m/s]", ""])
def test_a_mishit_is_beside_the_line_of_the_others(tmp_path, unit):
    """COR falls by 0.058 from 30 to 50 m/s; a shot 0.04 below is left out and no other."""
    speeds = np.linspace(30.0, 50.0, 21)
    cors = 0.93 - 0.0029 * speeds
    cors[12] -= 0.04
    rows = [f"7i,{u},{u * (1.0 + cor) / 1.25}" for u, cor in zip(speeds, cors)]
    rows += ["7i,0,60", "Average,40,60"]
    file = tmp_path / "shots.csv"
    file.write_text("\n".join([f"Club,Club Speed [m/s],Ball Speed{unit}", *rows]))
    line = measurements({"m_club": 0.2, "m_ball": 0.05}, shots=file).cor_speeds
    assert line.x == pytest.approx(np.delete(speeds, 12))
    assert line.y == pytest.approx(np.delete(cors, 12))
    assert line.notes[0] == "1 unreadable rows left out, the first in line 23"
    assert "1 of 21 shots are left out" in line.notes[1]
    assert "(line 14)" in line.notes[1]
