"""Force curves and COR over speed: the ball is found again, with standard errors that hold."""

import json
import math

import numpy as np
import pytest
from command import golf_here, refused
from conftest import numbers, some

import golf_impact
from golf_impact.calibration.calibration import Calibration
from golf_impact.calibration.fit import ContactLaw, Fit
from golf_impact.calibration.measurements import Measurements, measurements
from golf_impact.calibration.model import Model
from golf_impact.errors import UserError

FREE, LINEAR, ABSOLUTE = ContactLaw(2, None), ContactLaw(2, 1.0), ContactLaw(1, 1.0)
BALL = {"law": 2, "k": 8.2e5, "b": 37.0, "exponent": 1.55}


def curve(fmu, seed=0, rows=200, noise=40.0, shift=0.0123, lead=0.15, trail=0.25, **values):
    """Time by a shifted clock, force with noise: the FMU's, in one step to each instant."""
    random = np.random.default_rng(seed)
    values = {**BALL, **values}
    contact = fmu.impact(("contact_time",), **values)["contact_time"]
    instants = np.linspace(-lead * contact, (1.0 + trail) * contact, rows)
    force = np.zeros(rows)
    for n in np.flatnonzero(instants > 0.0):
        fmu.start(**values)
        fmu.step(0.0, instants[n])
        force[n] = fmu.read(("force",))["force"]
    return instants + shift, force + random.normal(0.0, noise, rows)


def line(seed=0, rest=0.86, slope=0.0029, sigma=0.004):
    speeds = np.repeat(np.arange(20.0, 56.0, 5.0), 2)
    random = np.random.default_rng(seed)
    return speeds, rest - slope * speeds + random.normal(0.0, sigma, len(speeds))


#: The conditions of all curves here.
AT = {"club_speed": 35.0, "m_club": 0.21}
CONDITIONS = ("--club-speed", 35, "--m-club", 0.21)


def fitted(fmu, law=FREE, conditions=AT, **given):
    return Fit(measurements(dict(conditions), **given), law)


def deviations(found, true):
    """(found − true) in standard errors."""
    return [(one.value - true[n]) / one.standard_error for n, one in found.parameters.items()]


@pytest.mark.parametrize("seed", numbers(2, 10, 40))
def test_a_power_law_ball_from_its_noisy_curve(fmu, seed):
    """Within 5 %, and four standard errors."""
    found = fitted(fmu, curve=curve(fmu, seed, shift=(-1.0) ** seed * 10.0 ** (seed % 5 - 3)))
    assert list(found.parameters) == ["k", "b", "exponent"]
    for name in found.parameters:
        assert found.values[name] == pytest.approx(BALL[name], rel=0.05)
    assert max(map(abs, deviations(found, BALL))) < 4.0
    assert found.sigma[0] == pytest.approx(40.0, rel=0.2)


@pytest.mark.ci
@pytest.mark.parametrize("given", [True, False])
def test_standard_errors_are_the_spread(fmu, given):
    """Of 30 fits; the root mean square of that many normal deviates is known to 13 %."""
    sigma = [np.full(120, 60.0)] if given else []
    all_ = []
    for seed in range(30):
        found = fitted(fmu, curve=(*curve(fmu, seed, 120, 60.0), *sigma))
        all_ += [deviations(found, BALL)]
    rms = np.sqrt(np.mean(np.square(all_), axis=0))
    assert (rms > 0.6).all()
    assert (rms < 1.4).all()


@pytest.mark.ci
def test_a_row_in_the_steep_rise_after_touch(fmu):
    """The least χ² puts touch just before a row, where its derivative is that of one row only."""
    values = {"k": 6.995e5, "b": 15.33}
    found = [fitted(fmu, curve=curve(fmu, n, **values)) for n in range(40)]
    true = {**BALL, **values}
    assert max(abs(z) for one in found for z in deviations(one, true)) < 4.0
    errors = [one.touches["curve"].standard_error for one in found]
    assert min(errors) > 0.2 * max(errors)


CASES = {
    "n = 1": (LINEAR, {"exponent": 1.0, "k": 1e6, "b": 30.0}, {}),
    "law 1": (ABSOLUTE, {"law": 1, "exponent": 1.0, "k": 1e6, "b": 9.0}, {}),
    "n = 1.5": (ContactLaw(2, 1.5), {"exponent": 1.5}, {}),
    "n = 2.5": (FREE, {"exponent": 2.5, "b": 60.0}, {}),
    "few rows": (FREE, {}, {"rows": 18, "noise": 15.0}),
    "no lead": (FREE, {}, {"lead": 0.0}),
    "long lead": (FREE, {}, {"rows": 500, "lead": 4.0, "trail": 5.0}),
    "faster": (FREE, {"club_speed": 55.0}, {"noise": 100.0}),
    "pushed": (LINEAR, {"exponent": 1.0, "k": 1e6, "b": 30.0, "club_force": 2000.0}, {}),
}


@pytest.mark.parametrize("case", some(6, CASES))
def test_other_laws_and_records(fmu, case):
    law, values, how = CASES[case] if isinstance(case, str) else case
    given = {name: values[name] for name in ("club_speed", "club_force") if name in values}
    found = fitted(fmu, law, AT | given, curve=curve(fmu, 3, **values, **how))
    assert max(map(abs, deviations(found, {**BALL, **values}))) < 4.0


def test_many_rows_of_a_contact_that_is_not_in_closed_form(fmu):
    """Their forces are interpolated: 4.4e-10 of the largest off, 5.6e-9 at b = 1e5 N·s/m."""
    times = np.linspace(0.0, 6e-4, 1500)
    fmu.start(**BALL, **AT, club_force=2000.0)
    force = fmu.sample(times, ("force",))["force"]
    data = measurements({**AT, "club_force": 2000.0}, curve=(times - 0.01, force))
    found = Model(data)({**BALL, "touch": -0.01})
    assert found == pytest.approx(force, rel=0.0, abs=2e-9 * force.max())


def test_without_noise(fmu):
    found = fitted(fmu, curve=curve(fmu, noise=0.0, shift=2.0))
    for name in found.parameters:
        assert found.values[name] == pytest.approx(BALL[name], rel=1e-6)
    assert found.touches["curve"].value == pytest.approx(2.0, abs=1e-10)


@pytest.mark.parametrize("seed", range(20))
def test_a_line_of_cor(fmu, seed):
    """Against the normal equations: least squares of a line has a closed form."""
    speeds, cors = line(seed)
    found = fitted(fmu, LINEAR, cor_speeds=(speeds, cors))
    assert tuple(found.parameters) == ("restitution_at_rest", "restitution_slope")
    (slope, rest), covariance = np.polyfit(speeds, cors, 1, cov=True)
    for n, (name, expected) in enumerate(zip(found.parameters, (rest, -slope))):
        error = found.parameters[name].standard_error
        assert error == pytest.approx(math.sqrt(covariance[1 - n, 1 - n]), rel=1e-3)
        assert found.values[name] == pytest.approx(expected, abs=2e-3 * error)
    true = {"restitution_at_rest": 0.86, "restitution_slope": 0.0029}
    assert max(map(abs, deviations(found, true))) < 4.0


def test_a_line_that_rises_is_held_at_slope_0(fmu):
    found = fitted(fmu, LINEAR, cor_speeds=(np.arange(20.0, 50.0), np.linspace(0.7, 0.8, 30)))
    assert found.values["restitution_slope"] == 0.0
    assert found.parameters["restitution_slope"].standard_error is None
    assert found.values["restitution_at_rest"] == pytest.approx(0.75, abs=1e-3)


def test_all_together(fmu):
    """Curve, COR line and a scalar in one fit; the curve's COR counts for the line."""
    penner = {"restitution_at_rest": 0.86, "restitution_slope": 0.0029}
    data = measurements(
        {
            **AT,
            "max_force": fmu.impact(("max_force",), **BALL, **penner)["max_force"],
            "sigma_max_force": 60.0,
        },
        curve=curve(fmu, 1, **penner),
        cor_speeds=line(1),
    )
    calibration = Calibration(data, FREE)
    assert list(calibration.parameters) == ["k", "exponent", *penner]
    assert max(map(abs, deviations(calibration.fit, {**BALL, **penner}))) < 4.0
    alone = Fit(Measurements({}, cor_speeds=data.cor_speeds), LINEAR)
    for name in penner:
        assert (
            calibration.parameters[name].standard_error
            < alone.parameters[name].standard_error * 1.05
        )
    assert {one.law.exponent for one in calibration.fits} == {1.0, 1.5, None}
    assert calibration.residuals.keys() == {"targets", "curve", "cor_speeds"}


def test_the_wrong_law_is_noticed(fmu):
    data = measurements(AT, curve=curve(fmu))
    calibration = Calibration(data, LINEAR)
    assert any("correlated" in words for words in calibration.words)
    assert calibration.words[-1].startswith("power law, n free describes")
    assert not any("correlated" in words for words in Calibration(data, FREE).words)
    stated = measurements(AT, curve=(*curve(fmu), np.full(200, 40.0)))
    assert any("doesn't fit" in words for words in Calibration(stated, LINEAR).words)


def test_predictions_are_the_fmus(fmu):
    """Their intervals: COR has one of its own under a law whose COR is fixed by ζ."""
    found = golf_impact.calibrate(curve=curve(fmu), exponent="free", **AT)
    at = found.predict(np.array([[30.0, 45.0]]))
    value, low, high = at["coefficient_of_restitution"]
    assert value.shape == low.shape == high.shape == (1, 2)
    direct = fmu.impact(("smash_factor",), **{**found.fit.values, "club_speed": 45.0})
    assert at["smash_factor"].value[0, 1] == pytest.approx(direct["smash_factor"], rel=1e-13)
    assert low[0, 0] < 0.757 < high[0, 0] or abs(value[0, 0] - 0.757) < 0.01
    assert high[0, 0] - low[0, 0] == pytest.approx(high[0, 1] - low[0, 1], rel=1e-3)
    assert found.predict(45.0)["ball_velocity"].value.shape == ()


def test_from_python(fmu):
    """A mapping, arrays and a table give the same; the text has the digits that are significant."""
    time, force = curve(fmu)
    found = golf_impact.calibrate(curve={"time": time, "force": force}, exponent="free", **AT)
    assert isinstance(found, golf_impact.Calibration)
    again = golf_impact.calibrate(curve=(time, force), exponent="free", **AT)
    assert found.parameters == again.parameters
    again = golf_impact.calibrate(curve=np.column_stack([time, force]), exponent="free", **AT)
    assert found.parameters == again.parameters
    assert found.covariance.shape == (3, 3)
    for n, one in enumerate(found.parameters.values()):
        assert one.standard_error == pytest.approx(math.sqrt(found.covariance[n, n]))
    lines = repr(found).splitlines()
    assert lines[0] == "Calibration: power law, n free (law 2)"
    assert lines[1].startswith("  k = 8")
    assert lines[1].endswith(" N/m")
    assert len(lines[1]) < 30
    with pytest.raises(UserError, match="no target 'speed'"):
        golf_impact.calibrate(speed=3.0)
    with pytest.raises(UserError, match="one length"):
        golf_impact.calibrate(curve=(time, force[:-1]), **AT)


def write(path, header, *columns):
    rows = "\n".join(",".join(f"{cell:.9g}" for cell in row) for row in zip(*columns))
    path.write_text(f"{header}\n{rows}\n")
    return path


def test_the_command(fmu, tmp_path):
    """What it writes, what it saves, and that its line gives the printed impact."""
    file = write(tmp_path / "curve.csv", "time,force", *curve(fmu))
    speeds = write(tmp_path / "cor.csv", "approach_speed,cor", *line())
    ball = tmp_path / "mine.toml"
    done = golf_here(
        *("calibrate", "--curve", file, "--exponent", "free", "--save", ball, "--predict", 50),
        *CONDITIONS,
        *("--out", tmp_path / "out"),
    )
    assert done.returncode == 0, done.stderr
    written = json.loads((tmp_path / "out" / "calibrate.json").read_text())
    assert list(written["parameters"]) == ["k", "b", "exponent"]
    for n, (name, one) in enumerate(written["parameters"].items()):
        assert abs(one["value"] - BALL[name]) < 4.0 * one["standard_error"]
        assert one["standard_error"] == pytest.approx(math.sqrt(written["covariance"][n][n]))
    assert written["touch_time"]["value"] == pytest.approx(0.0123, abs=4e-6)
    (prediction,) = written["predictions"]
    assert prediction["club_speed"] == 50.0
    assert prediction["smash_factor"]["low"] < prediction["smash_factor"]["high"]
    assert (tmp_path / "out" / "calibrate.png").stat().st_size > 10_000
    assert done.stdout.splitlines()[-1] == f"golf-impact run --ball {ball}"
    # The ball beside another one, with intervals.
    done = golf_here("run", "--ball", ball, "--ball", "tour", "--out", tmp_path, "--no-figures")
    assert done.returncode == 0, done.stderr
    assert "±" in done.stdout
    (results,) = tmp_path.glob("*_results.json")
    cases = json.loads(results.read_text())["custom"]
    assert cases[str(ball)]["max_force"] == written["predicted"]["max_force"]
    done = golf_here("calibrate", "--cor-speeds", speeds, "--no-figures", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "calibrate.json").read_text())["parameters"]
    assert list(found) == ["restitution_at_rest", "restitution_slope"]


GOOD = np.column_stack([1e-6 * np.arange(-50.0, 800.0, 10.0), np.zeros(85)])
GOOD[5:65, 1] = 6600.0 * np.sin(np.pi * np.arange(60) / 60.0)


def changed(row=None, column=1, value=None, scale=(1.0, 1.0), rows=slice(None)):
    table = GOOD.copy()
    if row is not None:
        table[row - 1, column] = value
    return (table * scale)[rows]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (changed(rows=slice(0, 0)), ("no rows",)),
        (changed(9, 0, 0.0), ("row 9 (line 10)", "isn't after")),
        (changed(9, 0, GOOD[7, 0]), ("row 9 (line 10)", "isn't after")),
        (changed(20, 1, math.nan), ("row 20 (line 21)", "force = nan")),
        (changed(20, 0, math.inf), ("row 20 (line 21)", "time = inf")),
        (changed(scale=(1e3, 1.0)), ("row 36 (line 37)", "time [")),
        (changed(scale=(1e6, 1.0)), ("row 36 (line 37)", "time [")),
        (changed(scale=(1e3, 1e-3)), ("row 36 (line 37)", "time [")),
        (changed(scale=(1.0, 1e-3)), ("force [kN]",)),
        (changed(scale=(1.0, 0.0)), ("row 1 (line 2)", "no touch")),
        (changed(rows=slice(0, None, 20)), ("rows in contact",)),
    ],
)
def test_curves_that_are_refused(tmp_path, table, words):
    file = write(tmp_path / "bad.csv", "time,force", *table.T)
    done = golf_here("calibrate", "--curve", file, *CONDITIONS, "--out", tmp_path / "out")
    refused(done, "bad.csv", *words)
    assert not (tmp_path / "out").exists()


def test_a_curve_of_another_club_speed_is_refused(tmp_path):
    file = write(tmp_path / "curve.csv", "time,force", *GOOD.T)
    done = golf_here(
        "calibrate", "--curve", file, *CONDITIONS[2:], "--club-speed", 78, "--out", tmp_path
    )
    refused(
        done,
        "curve.csv",
        "78 looks like mph: write --club-speed 78mph",
        "speeds of 33.4 to 66.9 m/s",
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("speed,cor\n30,0.8\n", ("bad.csv", "approach_speed,cor")),
        ("approach_speed,cor\n", ("bad.csv", "no rows")),
        ("approach_speed,cor\n30,0.8\n40,1.02\n", ("bad.csv, row 2 (line 3)", "gains energy")),
        ("approach_speed,cor\n30,80\n40,78\n", ("row 1 (line 2)", "0.8 for 80 %")),
        ("approach_speed,cor\n30,0.8\n\n40,0\n", ("row 2 (line 4)", "above 0")),
        ("approach_speed,cor\n30,0.8\n-4,0.7\n", ("row 2 (line 3)", "approach_speed = -4")),
        ("approach_speed,cor\n30,0.8\n40,nan\n", ("row 2 (line 3)", "cor = nan")),
        ("approach_speed,cor\n30,0.8\n40\n", ("line 3, column", "'' is refused")),
        ("approach_speed,cor\n30,0.8\n40,x\n", ("line 3, column 2 (cor)", "'x' is refused")),
        ("approach_speed,cor\n30,0.8\n30,0.7\n", ("bad.csv", "two speeds")),
        ("approach_speed,cor\n30,0.8\n40,0.7\n", ("bad.csv", "sigma")),
        ("approach_speed,cor,sigma\n30,0.8,0.1\n40,0.7,0\n", ("row 2 (line 3)", "sigma = 0")),
        ("approach_speed,cor,sigma\n30,0.8,0.1\n40,0.7\n", ("line 3, column", "'' is refused")),
    ],
)
def test_lines_that_are_refused(tmp_path, text, words):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    refused(golf_here("calibrate", "--cor-speeds", file, "--out", tmp_path / "out"), *words)
