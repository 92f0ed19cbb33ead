"""Force curves and COR over speed: the ball is found again, with intervals that hold."""

import json
import math
import re

import numpy as np
import pytest
from command import golf_here, refused
from compare import assert_close
from conftest import numbers, some
from lab import AT, BALL, FREE, LINEAR, assert_found, line, record, write
from scipy.stats import norm

import golf_impact
from golf_impact.calibration.calibration import Calibration, calibrate
from golf_impact.calibration.fit import Fit
from golf_impact.calibration.measurements import Measurements, measurements
from golf_impact.calibration.model import ContactLaw, Problem
from golf_impact.errors import UserError

ABSOLUTE = ContactLaw(1, 1.0)
PENNER = {"restitution_at_rest": 0.86, "restitution_slope": 0.0029}


def fitted(law=FREE, conditions=AT, baseline="", **given):
    return Fit(measurements(dict(conditions), baseline=baseline, **given), law)


CASES = {
    "n = 1": (LINEAR, {"exponent": 1.0, "k": 1e6, "b": 30.0}, {}),
    "law 1": (ABSOLUTE, {"law": 1, "exponent": 1.0, "k": 1e6, "b": 9.0}, {}),
    "n = 1.5": (ContactLaw(2, 1.5), {"exponent": 1.5}, {"shift": -1000.0}),
    "n = 2.5": (FREE, {"exponent": 2.5, "b": 60.0}, {}),
    "few rows": (FREE, {}, {"rows": 18, "noise": 15.0}),
    "pushed": (LINEAR, {"exponent": 1.0, "k": 1e6, "b": 30.0, "club_force": 2000.0}, {}),
    "no lead": (FREE, {}, {"lead": 0.0}),
    "long": (FREE, {}, {"rows": 5000, "lead": 4.0, "trail": 5.0}),
    "faster": (FREE, {"club_speed": 55.0}, {"noise": 100.0}),
}


@pytest.mark.parametrize("case", some(6, CASES))
def test_laws_and_records(case):
    law, values, how = case
    given = {name: values[name] for name in ("club_speed", "club_force") if name in values}
    curve = record(**{"rows": 200, "seed": 3, "noise": 40.0} | values | how)
    assert_found(fitted(law, AT | given, curve=curve), {**BALL, **values})


FLAWS = {
    "offset": ({"baseline": (300.0, 0.0)}, lambda t, f: (t, f), "baseline constant, an offset of"),
    "drift": (
        {"baseline": (0.0, 600.0)},
        lambda t, f: (t, f),
        "drift of (59|60)\\S* ± .* N over",
    ),
    "sign": ({"baseline": (-3e4, 0.0)}, lambda t, f: (t, -f), "its sign was changed"),
    "quantized": ({"noise": 60.0}, lambda t, f: (t, 200.0 * np.round(f / 200.0)), "zero"),
    "clipped": ({"baseline": (0.0, 400.0)}, lambda t, f: (t, np.minimum(f, 7000.0)), "left out"),
    "late": ({}, lambda t, f: (t[400:], f[400:]), "the record begins in contact"),
    "short": ({}, lambda t, f: (t[:800], f[:800]), "the record ends in contact"),
}


@pytest.mark.parametrize("name", FLAWS)
def test_flaws_of_a_record(name):
    """They are reported, and the ball is found all the same."""
    how, change, words = FLAWS[name]
    found = calibrate(curve=change(*record(1100, lead=0.5, **how)), exponent="free", **AT)
    assert any(re.search(words, sentence) for sentence in found.words)
    assert_found(found.fit)


@pytest.mark.parametrize(
    ("how", "step"), [({}, 0.1), ({"baseline": (50.0, 200.0)}, 0.1), ({}, 200.0)]
)
@pytest.mark.parametrize("records", some(1, [6, 40]))
def test_95_percent_of_intervals_contain_the_truth(how, step, records):
    """Of 18 or 120 intervals; measured: 95 to 100 %, also of records in coarse steps."""
    held = []
    for seed in range(records):
        time, force = record(551, lead=0.5, trail=0.5, seed=seed, **how)
        found = fitted(curve=(time, step * np.round(force / step)))
        ends = {name: one.interval for name, one in found.parameters.items()}
        held += [low <= BALL[name] <= high for name, (low, high) in ends.items()]
    assert np.mean(held) > 0.9


def test_the_error_of_a_baseline_is_one_of_the_parameters():
    curve = record(551, lead=0.5, trail=0.5)
    errors = [
        fitted(baseline=kind, curve=curve).parameters["b"].standard_error
        for kind in ("zero", "constant", "linear")
    ]
    # By the offset's error from 400 rows, 2 N of 8 kN, in COR and from there in b.
    assert 1.2 * errors[0] < errors[1] < errors[2]


def test_curves_of_different_noise():
    """Each has the weight of its own residuals: the fit is that with their σ given."""
    rows = []
    for speed, noise in ((30.0, 20.0), (50.0, 400.0)):
        time, force = record(100, noise, club_speed=speed, seed=int(speed))
        rows.append({"time": time, "force": force, "club_speed": speed})
    found = fitted(conditions={"m_club": 0.2}, curve=rows, baseline="zero")
    for row, sigma in zip(rows, np.split(found.sigma, 2)):
        row["sigma"] = sigma
    again = fitted(conditions={"m_club": 0.2}, curve=rows, baseline="zero")
    for name, one in found.parameters.items():
        assert abs(again.values[name] - one.value) < 1e-3 * one.standard_error


def test_aic_is_that_of_a_normal_likelihood():
    """Less N ln 2π, which is the same for every law."""
    found = fitted(LINEAR, curve=record(100))
    likelihood = norm.logpdf(found.residuals * found.sigma, scale=found.sigma).sum()
    constant = len(found.residuals) * math.log(2.0 * math.pi)
    assert found.aic == pytest.approx(2.0 * found.result.nvarys - 2.0 * likelihood - constant)


def test_without_noise():
    found = fitted(curve=record(200, noise=0.0, shift=2.0))
    assert_close(found.values, {name: BALL[name] for name in found.parameters}, tolerance=1e-6)
    assert found.curves["curve"]["touch"].value == pytest.approx(2.0, abs=1e-10)
    exact = calibrate(record(200, noise=0.0), exponent="free", **AT)
    assert [row[-1] for row in exact.tables()[3][2]][1:] == ["–", "–", "exact"]


@pytest.mark.parametrize("values", [BALL, {"law": 1}, BALL | {"club_force": 2000.0}])
def test_forces_of_many_rows_are_interpolated(fmu, values):
    """To 2e-9 of the largest, in closed form or not, where it is 1e-6."""
    times = np.linspace(0.0, 6e-4, 1500)
    fmu.start(**values, **AT)
    force = fmu.sample(times, ("force",))["force"]
    conditions = {**AT, "club_force": values.get("club_force", 0.0)}
    data = measurements(conditions, curve=(times - 0.01, force))
    touch = 1e6 * (-0.01 - data.curves["curve"].origin)
    defaults = {"k": 1e6, "b": 9.0, "exponent": 1.0}
    found = Problem(data, LINEAR, False, {}).model({**defaults, **values, "touch": touch})
    tolerance = 1e-6 if "club_force" in values else 1e-8
    assert found[5:] == pytest.approx(force[5:], rel=0.0, abs=tolerance * force.max())


@pytest.mark.parametrize("seed", numbers(3, 10, 20))
def test_a_line_of_cor(seed):
    """Against the normal equations: least squares of a line has a closed form."""
    speeds, cors = line(seed)
    found = fitted(LINEAR, cor_speeds=(speeds, cors))
    assert list(found.parameters) == [*PENNER]
    (slope, rest), covariance = np.polyfit(speeds, cors, 1, cov=True)
    for n, (name, expected) in enumerate(zip(found.parameters, (rest, -slope))):
        error = found.parameters[name].standard_error
        assert error == pytest.approx(math.sqrt(covariance[1 - n, 1 - n]), rel=1e-3)
        assert found.values[name] == pytest.approx(expected, abs=2e-3 * error)
    assert_found(found, PENNER)


def test_a_line_that_rises_is_held_at_slope_0():
    found = fitted(LINEAR, cor_speeds=(np.arange(20.0, 50.0), np.linspace(0.7, 0.8, 30)))
    slope = found.parameters["restitution_slope"]
    assert (slope.value, slope.standard_error, slope.limit) == (0.0, None, 0.0)
    assert found.values["restitution_at_rest"] == pytest.approx(0.75, abs=1e-3)


def test_all_together():
    """Curve, COR line and a scalar in one fit; the curve's COR counts for the line."""
    force = golf_impact.run_impact(("max_force",), **{**BALL, **AT, **PENNER})["max_force"]
    scalars = {**AT, "max_force": (force, 60.0)}
    data = measurements(scalars, curve=record(200, **PENNER), cor_speeds=line(1))
    calibration = Calibration(data, FREE)
    assert list(calibration.parameters) == ["k", "exponent", *PENNER]
    assert_found(calibration.fit, {**BALL, **PENNER})
    alone = Fit(Measurements({}, cor_speeds=data.cor_speeds), LINEAR)
    for name in PENNER:
        together, of_line = (one.parameters[name].standard_error for one in (calibration, alone))
        assert together < 1.05 * of_line
    assert {one.law.exponent for one in calibration.fits} == {1.0, 1.5, None}
    assert calibration.residuals.keys() == {"targets", "curve", "cor_speeds"}
    _, above, targets, _, below = calibration.draw().axes
    (measured, fit), (residuals, _) = above.lines, below.lines
    assert [*map(list, measured.get_data())] == [[*data.cor_speeds.x], [*data.cor_speeds.y]]
    assert fit.get_ydata() - measured.get_ydata() == pytest.approx(residuals.get_ydata())
    assert [text.get_text() for text in targets.get_yticklabels()] == ["max force (N)"]


def test_the_wrong_law_is_noticed():
    data = measurements(AT, curve=record(200))
    words = " ".join(Calibration(data, LINEAR).words)
    assert "correlated" in words
    assert "power law, n free describes" in words
    assert "are correlated" not in " ".join(Calibration(data, FREE).words)
    stated = measurements(AT, curve=(*record(200), np.full(200, 40.0)))
    assert any("doesn't fit" in words for words in Calibration(stated, LINEAR).words)


def test_predictions_and_the_figure():
    """COR has an interval of its own under a law whose COR is fixed by ζ."""
    time, force = record(200, baseline=(100.0, 0.0))
    found = calibrate(curve=(time, force), exponent="free", **AT)
    at = found.predict(np.array([[30.0, 45.0]]))
    value, low, high = at["coefficient_of_restitution"]
    assert value.shape == low.shape == high.shape == (1, 2)
    direct = golf_impact.run_impact(**{**found.fit.values, "club_speed": 45.0})
    assert at["smash_factor"].value[0, 1] == pytest.approx(direct["smash_factor"], rel=1e-13)
    true = golf_impact.run_impact(**BALL, **AT)["coefficient_of_restitution"]
    assert low[0, 0] < true < high[0, 0]
    assert found.predict(45.0)["ball_velocity"].value.shape == ()
    # Measured without its offset and fitted, over the time since touch; residuals.
    above, below = found.draw().axes
    (measured, model), (residuals, _) = above.lines, below.lines
    since = 1e6 * (time - found.fit.curves["curve"]["touch"].value)
    assert measured.get_xdata() == pytest.approx(since)
    assert measured.get_ydata() == pytest.approx(force - found.fit.curves["curve"]["offset"].value)
    assert model.get_ydata() - measured.get_ydata() == pytest.approx(residuals.get_ydata())
    assert residuals.get_ydata().std() == pytest.approx(40.0, rel=0.2)
    steep = ([25.0, 30.0, 35.0], [0.356, 0.23, 0.105])
    with pytest.raises(UserError, match=r"no prediction at .* nearer to those measured"):
        calibrate(cor_speeds=steep)
    assert calibrate(cor_speeds=steep, predict=[30.0]).speeds.tolist() == [30.0]


@pytest.mark.parametrize("k", [8.6e5, BALL["k"]])
def test_several_curves(tmp_path, k):
    """A stiffness for each shows whether one holds; options and mappings are as a TOML file."""
    for speed, one in {30: BALL["k"], 50: k}.items():
        write(tmp_path / f"{speed}.csv", *record(club_speed=speed, seed=speed, k=one))
    listed = tmp_path / "list.toml"
    row = '[[curve]]\nfile = "{}.csv"\nclub_speed = {}\nm_club = "200g"\n'
    listed.write_text(row.format(30, 30) + row.format(50, '"50 m/s"'))
    found = calibrate(listed, exponent="free")
    slow, fast = (one["value"] for one in found.as_json()["stiffness_by_curve"].values())
    assert fast / slow == pytest.approx(k / BALL["k"], rel=0.02)
    (words,) = (words for words in found.words if words.startswith("Stiffnesses of the curves"))
    more = "by 5.* %, more than chance in 1 of 1000"
    assert re.search(more if k > BALL["k"] else "no more than by chance", words)
    assert [*found.residuals] == ["curve", "curve_2"]
    assert found.ball.conditions == {"club_speed": 30.0, "m_club": 0.2}  # of the first
    files = [f"{tmp_path}/{speed}.csv@{speed}" for speed in (30, 50)]
    again = measurements({"m_club": 0.2}, curve=files).curves
    for name, one in found.data.curves.items():
        assert (one.impact, one.x.tolist()) == (again[name].impact, again[name].x.tolist())
    titles = [axes.get_title("left") or axes.get_title() for axes in found.draw().axes]
    assert titles == ["30.csv, 30 m/s", "50.csv, 50 m/s", "", ""]


@pytest.mark.parametrize("text", ["", "curve = 3", "[[curve]]", '[[curve]]\nfile = "x"\nspeed = 3'])
def test_lists_that_are_none(tmp_path, text):
    file = tmp_path / "list.toml"
    file.write_text(text)
    with pytest.raises(UserError, match=r"list.toml lists no curves: write a table \[\[curve\]\]"):
        calibrate(file)


def test_no_curve_without_its_conditions(tmp_path):
    file = write(tmp_path / "curve.csv", *record())
    command = ("calibrate", "--curve", file, "--out", tmp_path / "out")
    refused(golf_here(*command), "needs club_speed and m_club")
    refused(golf_here(*command[:2], f"{file}@40", *command[3:]), "needs m_club")
    refused(golf_here(*command, "--club-speed", 90, "--m-club", 0.2), "90mph")
    assert not (tmp_path / "out").exists()


def test_a_saved_ball(tmp_path):
    """Conditions with units; parameters, covariance and intervals as in Python."""
    file, ball = write(tmp_path / "curve.csv", *record()), tmp_path / "mine.toml"
    given = ("--club-speed", "144 km/h", "--m-club", "200g", "--exponent", "free", "--save", ball)
    done = golf_here(
        "calibrate", "--curve", file, *given, "--predict", 50, "--out", tmp_path, code=0
    )
    assert done.stdout.splitlines()[-1] == f"golf-impact run --ball {ball}"
    assert (tmp_path / "calibrate.png").stat().st_size > 10_000
    written = json.loads((tmp_path / "calibrate.json").read_text())
    assert written["conditions"] == {**AT, "m_ball": 0.04593, "club_force": 0.0}
    for n, one in enumerate(written["parameters"].values()):
        assert one["standard_error"] == pytest.approx(math.sqrt(written["covariance"][n][n]))
    assert written["touch_time"]["value"] == pytest.approx(0.0123, abs=4e-6)
    (prediction,) = written["predictions"]
    low, value, high = (prediction["smash_factor"][key] for key in ("low", "value", "high"))
    assert 0.0 < high - value == pytest.approx(value - low)
    saved = golf_impact.read_ball(ball)
    assert saved.conditions == AT
    assert np.array(saved.covariance) == pytest.approx(np.array(written["covariance"]))
    direct = golf_impact.run_impact(**saved.values, **saved.conditions)
    assert direct["ball_velocity"] == written["predicted"]["ball_speed"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("approach_speed,cor\n30,0.8\n\n40,0\n", ("bad.csv, row 2 (line 4)", "above 0")),
        ("approach_speed,cor\n30,0.8\n30,0.7\n", ("bad.csv", "two speeds")),
        ("approach_speed,cor\n30,0.8\n40,0.7\n", ("bad.csv", "sigma")),
        ("approach_speed,cor,sigma\n30,0.8,0.1\n40,0.7,0\n", ("row 2 (line 3)", "sigma = 0")),
    ],
)
def test_lines_that_are_refused(tmp_path, text, words):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    refused(golf_here("calibrate", "--cor-speeds", file, "--out", tmp_path / "out"), *words)
