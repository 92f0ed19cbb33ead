"""Records of a lab: their files, their conditions, many rows, several curves."""

import json
import math
import os
import re
import threading
import time

import numpy as np
import pytest
from command import golf_case, golf_here, refused
from conftest import some
from lab import AT, BALL, FREE, assert_found, record, write

import golf_impact
from golf_impact.arrays.trajectory import closed_contact, forces
from golf_impact.calibration.calibration import calibrate
from golf_impact.calibration.fit import ContactLaw, Fit
from golf_impact.calibration.fit import _Problem as Problem
from golf_impact.calibration.measurements import measurements
from golf_impact.calibration.records import read_table
from golf_impact.errors import UserError

SERIES = (("time", "force", "sigma"), ("s", "N", "N"))


def test_the_force_of_arrays_is_that_of_the_fmu(fmu):
    """In closed form (two laws) and not, which the scalar physics computes."""
    time = np.linspace(1e-6, 5e-4, 40)
    for values in (BALL, {"law": 1}, {"law": 2, "b": 30.0}):
        fmu.start(**values)
        sampled = fmu.sample(np.append(0.0, time), ("force",))["force"][1:]
        found = forces(time, closed_contact(values))
        assert found == pytest.approx(sampled, rel=1e-12, abs=1e-12 * sampled.max())


@pytest.mark.parametrize(
    ("text", "chosen", "expected"),
    [
        ("time,force\n0,1\n1,2\n", "", [[0, 1], [1, 2]]),
        ("time [ms],force (kN)\n0,1\n1,2\n", "", [[0, 1e-3], [1e3, 2e3]]),
        ("t_us\tF/kN\n0\t1\n1\t2\n", "", [[0, 1e-6], [1e3, 2e3]]),
        ("Zeit [µs];Kraft [kN]\n0,5;1,25\n\n1,5;2\n", "", [[5e-7, 1.5e-6], [1250, 2e3]]),
        ("# x\nTime,A,B\n(us),(V),(kN)\n\n0,9,1\n1,9,2\n", "Time,B", [[0, 1e-6], [1e3, 2e3]]),
        ("0,9,1\n1,9,2\n", "1 [ms],3", [[0, 1e-3], [1, 2]]),
        ("0 1\n1 2\n", "", [[0, 1], [1, 2]]),
        ('"time","force"\n"0","1" # first\n"1","2"\n', "", [[0, 1], [1, 2]]),
        ("scope\nforce,time\n1,0\n2,1\n", "", [[0, 1], [1, 2]]),
        ("time,force\n", "", [[], []]),
        ("time,force,sigma\n0,1,5\n1,2,5\n", "", [[0, 1], [1, 2], [5, 5]]),
    ],
)
def test_files_as_labs_have_them(tmp_path, text, chosen, expected):
    file = tmp_path / "record.csv"
    for encoding in ("utf-8", "utf-8-sig", "cp1252"):
        file.write_bytes(text.encode(encoding))
        found = read_table(file, *SERIES, chosen)
        assert np.array(found.columns) == pytest.approx(np.array(expected))


def test_the_place_of_a_row(tmp_path):
    file = tmp_path / "record.csv"
    file.write_text("# a scope\n\ntime,force\n0,1\n# a pause\n\n1,2\n")
    assert read_table(file, *SERIES).where(1) == f"{file}, row 2 (line 7)"


def test_a_pipe_is_read_once(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_text, args=("time,force\n0,1\n1,2\n",))
    writer.start()
    found = read_table(pipe, *SERIES)
    writer.join()
    assert np.array(found.columns) == pytest.approx(np.array([[0.0, 1.0], [1.0, 2.0]]))
    assert found.where(1) == f"{pipe}, row 2 (line 3)"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Time,CH1,CH2\n0,1,2\n", ("its header is 'Time,CH1,CH2'", "--columns")),
        ("time,force [lbf]\n0,1\n", ("unit 'lbf' of force", "N, kN")),
        ("time,force\n0,1\n\n1,oops\n", ("line 4, column 2 (force): 'oops'", "a number")),
        ("time,force\n0,1\n1\n", ("line 3, column 2 (force): ''",)),
        ("time;force\n0,5;1\n1.000,5;1\n", ("line 3, column 1 (time): '1.000,5'",)),
        ("time,force,time\n0,1,2\n", ("2 columns", "time")),
        ("hello\nworld\n", ("its header is 'world'", "expected time,force")),
        ("", ("no header",)),
        (f"time,force\n{'0' * 131_073},1\n", ("field larger than field limit",)),
    ],
)
def test_what_is_no_table(tmp_path, text, words):
    file = tmp_path / "record.csv"
    file.write_text(text)
    with pytest.raises(UserError) as refusal:
        read_table(file, *SERIES)
    assert all(word in str(refusal.value) for word in (str(file), *words))


CHANGES = {
    "sign and offset": (lambda t, f: (t, 3e4 - f), "an offset of"),
    "clipped": (lambda t, f: (t, np.minimum(f, 7000.0)), "left out"),
    "late": (lambda t, f: (t[400:], f[400:]), "the record begins in contact"),
    "short": (lambda t, f: (t[:800], f[:800]), "the record ends in contact"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_flaws_that_are_found(name):
    """They are reported, and the ball is found all the same."""
    change, words = CHANGES[name]
    curve = record(1100, lead=0.5)
    plain, flawed = (measurements(AT, curve=one) for one in (curve, change(*curve)))
    assert not plain.curves["curve"].notes
    assert any(words in note for note in flawed.curves["curve"].notes)
    found = Fit(flawed, FREE)
    assert_found(found)
    if "offset" in words:
        # Its error counts.
        b, least = (one.parameters["b"].standard_error for one in (found, Fit(plain, FREE)))
        assert b > 1.1 * least


def test_no_curve_without_its_conditions(tmp_path):
    file = write(tmp_path / "curve.csv", *record())
    calibrate = ("calibrate", "--curve", file, "--out", tmp_path / "out")
    refused(golf_here(*calibrate), "needs club_speed and m_club")
    refused(golf_here(*calibrate, "--club-speed", 40), "needs m_club")
    refused(golf_here(*calibrate[:2], f"{file}@40", *calibrate[3:]), "needs m_club")
    mph = ("--club-speed", 90, "--m-club", 0.2)
    refused(golf_here(*calibrate, *mph), "90mph")
    assert not (tmp_path / "out").exists()


def test_conditions_with_units_reproduce_the_fit(tmp_path):
    """--save keeps them, and run and sweep take them, unless an option overrides."""
    file, ball = write(tmp_path / "curve.csv", *record()), tmp_path / "mine.toml"
    given = ("--club-speed", "144 km/h", "--m-club", "200g", "--exponent", "free", "--save", ball)
    common = ("--no-figures", "--out", tmp_path)
    done = golf_here(
        "calibrate", "--curve", file, *given, "--predict", 50, "--out", tmp_path, code=0
    )
    assert done.stdout.splitlines()[-1] == f"golf-impact run --ball {ball}"
    assert (tmp_path / "calibrate.png").stat().st_size > 10_000
    written = json.loads((tmp_path / "calibrate.json").read_text())
    assert written["conditions"] == {**AT, "m_ball": 0.04593, "club_force": 0.0}
    for n, (name, one) in enumerate(written["parameters"].items()):
        assert abs(one["value"] - BALL[name]) < 4.0 * one["standard_error"]
        assert one["standard_error"] == pytest.approx(math.sqrt(written["covariance"][n][n]))
    assert written["touch_time"]["value"] == pytest.approx(0.0123, abs=4e-6)
    (prediction,) = written["predictions"]
    assert prediction["club_speed"] == 50.0
    low, value, high = (prediction["smash_factor"][key] for key in ("low", "value", "high"))
    assert 0.0 < high - value == pytest.approx(value - low)
    (printed,) = re.findall(r"│ 50 +│ +(\S+) ± (\S+) │", done.stdout)
    assert list(map(float, printed)) == pytest.approx([value, high - value], rel=0.06)
    assert not written["series"]["curve"]["sigma_given"]
    assert golf_impact.read_ball(ball).conditions == AT
    done, case = golf_case(tmp_path, "--ball", ball)
    assert "--set club_speed=40 --set m_club=0.2" in done.stdout
    assert case["ball_velocity"] == written["predicted"]["ball_speed"]
    other = tmp_path / "other.toml"
    other.write_text(ball.read_text().replace("club_speed = 40.0", "club_speed = 42.0"))
    both = ("--ball", ball, "--ball", other)
    refused(golf_here("run", *both, *common), "club_speed = 40 and 42", "--set club_speed=")
    golf_here("run", *both, "--set", "club_speed=95mph", *common, code=0)
    table = tmp_path / "sweep.csv"
    sweep = ("sweep", "--set", f"ball={ball}", "--set", "k=800,900N/mm", "--no-figures")
    golf_here(*sweep, "--out", table, code=0)
    values = {**golf_impact.read_ball(ball).values, **AT, "k": 9e5}
    found = float(table.read_text().splitlines()[-1].split(",")[-2])
    assert found == pytest.approx(golf_impact.run_impact(**values)["ball_velocity"], rel=1e-13)


@pytest.mark.parametrize("text", ["", "curve = 3", "[[curve]]", '[[curve]]\nfile = "x"\nspeed = 3'])
def test_lists_that_are_none(tmp_path, text):
    file = tmp_path / "list.toml"
    file.write_text(text)
    with pytest.raises(UserError, match=r"list.toml lists no curves: write a table \[\[curve\]\]"):
        calibrate(file)


@pytest.mark.parametrize("k", some(1, [8.6e5, BALL["k"]]))
def test_several_curves(tmp_path, k):
    """A stiffness for each shows whether one holds; options and mappings are as a TOML file."""
    stiffnesses = {30: BALL["k"], 50: k}
    for speed, one in stiffnesses.items():
        write(tmp_path / f"{speed}.csv", *record(club_speed=speed, seed=speed, k=one))
    listed = tmp_path / "list.toml"
    row = '[[curve]]\nfile = "{}.csv"\nclub_speed = {}\nm_club = "200g"\n'
    listed.write_text(row.format(30, 30) + row.format(50, '"50 m/s"'))
    found = calibrate(listed, exponent="free")
    alone = found.as_json()["stiffness_by_curve"].values()
    for one, expected in zip(alone, stiffnesses.values(), strict=True):
        assert abs(one["value"] - expected) < 4.0 * one["standard_error"]
    slow, fast = (one["value"] for one in alone)
    assert fast / slow == pytest.approx(k / BALL["k"], rel=0.02)
    if k == BALL["k"]:
        assert_found(found)
    holds = "the law holds" if k == BALL["k"] else "the law doesn't hold"
    assert holds in " ".join(found.words)
    assert list(found.residuals) == ["curve", "curve 2"]
    rows = "551 rows of {}/{}.csv ({} m/s, club 0.2 kg, ball 0.04593 kg)"
    measured = ", ".join(rows.format(tmp_path, speed, speed) for speed in (30, 50))
    assert found.ball.source == f"golf-impact calibrate: {measured}"
    assert found.ball.conditions == {"club_speed": 30.0, "m_club": 0.2}  # of the first
    files = [f"{tmp_path}/{speed}.csv@{speed}" for speed in (30, 50)]
    tables = [read_table(tmp_path / f"{v}.csv", *SERIES).columns for v in (30, 50)]
    rows = [dict(zip(("time", "force"), t)) | {"club_speed": v} for t, v in zip(tables, (30, 50))]
    for curves in (files, rows):
        data = measurements({"m_club": 0.2}, curve=curves)
        for one, expected in zip(data.curves.values(), found.data.curves.values(), strict=True):
            assert (one.impact, one.x.tolist()) == (expected.impact, expected.x.tolist())
            assert one.y.tolist() == expected.y.tolist()
    titles = [axes.get_title("left") for axes in found.draw().axes]
    assert titles == ["30.csv, 30 m/s", "50.csv, 50 m/s", "", ""]


@pytest.mark.parametrize("rows", [3000, pytest.param(100_000, marks=pytest.mark.ci)])
def test_long_records(rows):
    """At most 600 evaluations of all rows, beside what 500 rows take; measured: 70 and 210."""
    curve, contact = record(rows, lead=1.5), closed_contact({**BALL, **AT})
    calibrate(record(500), exponent="free", **AT)
    times = [time.process_time()]
    for one in (record(500), curve):
        found = calibrate(one, exponent="free", **AT)
        times.append(time.process_time())
    for _ in range(20):
        forces(curve[0] - 0.0123, contact)
    short, whole, once = np.diff([*times, time.process_time()]) / (1, 1, 20)
    assert whole < short + 600.0 * once
    assert_found(found)
    errors = [one.standard_error / one.value for one in found.parameters.values()]
    since = curve[0] - 0.0123
    inside = np.count_nonzero((since > 0.0) & (since < contact.contact_time))
    assert max(errors) < 0.0845 / math.sqrt(inside)


@pytest.mark.parametrize("seed", some(3, range(6)))
@pytest.mark.parametrize("exponent", [1.0, 1.6])
def test_no_touch_some_rows_away_is_better(exponent, seed):
    """χ² has a minimum between any two rows; found is one as low as where the truth leads."""
    data = measurements(AT, curve=record(1500, seed=seed, exponent=exponent))
    problem = Problem(data, ContactLaw(2, exponent), False, lambda: None)
    k, b, curve = BALL["k"], BALL["b"], data.curves["curve"]
    zeta = b / math.sqrt(2.0 * (exponent + 1.0) * k * data.reduced_mass)
    start = np.array([math.log(k), zeta, (0.0123 - curve.x[0]) / 1e-4])
    # Half of χ², with a σ twice the true one; worst measured case 0.006.
    assert problem.minimum().cost < problem.solve(start).cost + 0.05


def test_the_best_of_several_starts():
    """Of a linear law on a curve that isn't: the other leads to five times this χ²."""
    data = measurements(AT, curve=record(200, b=500.0))
    problem = Problem(data, ContactLaw(2, 1.0), False, lambda: None)
    with np.errstate(all="ignore"):
        costs = [problem.solve(start).cost for start in problem.starts()]
        assert problem.minimum().cost < min(costs)


def test_an_exact_fit_ranks_nothing():
    """Residuals of rounding aren't compared; with noise they are, in N."""
    exact = calibrate(record(noise=0.0), exponent="free", **AT)
    (_, *rows) = exact.tables()[3].rows
    assert [row[-1] for row in rows] == ["–", "–", "exact"]
    noisy = calibrate(record(), exponent="free", **AT).tables()[3]
    assert noisy.columns[-2:] == ["rms residual (N)", "ΔAIC"]
    assert float(noisy.rows[-1][-2]) == pytest.approx(40.0, rel=0.1)
    assert noisy.rows[-1][-1] == "0"


def test_a_prediction_at_a_speed_that_nobody_gave():
    line = ([25.0, 30.0, 35.0], [0.356, 0.23, 0.105])
    with pytest.raises(UserError, match=r"no prediction at .* nearer to those measured"):
        calibrate(cor_speeds=line)
    assert calibrate(cor_speeds=line, predict=[30.0]).speeds.tolist() == [30.0]
