"""Force curves and COR over speed: the ball is found again, with standard errors that hold."""

import math
from dataclasses import replace

import numpy as np
import pytest
from command import golf_here, refused
from compare import assert_close
from conftest import numbers, some
from lab import AT, BALL, FREE, LINEAR, assert_found, deviations, line, record
from scipy.stats import norm

import golf_impact
from golf_impact.calibration.calibration import Calibration
from golf_impact.calibration.fit import ContactLaw, Fit
from golf_impact.calibration.measurements import Measurements, measurements
from golf_impact.calibration.model import Model
from golf_impact.errors import UserError

ABSOLUTE = ContactLaw(1, 1.0)
PENNER = {"restitution_at_rest": 0.86, "restitution_slope": 0.0029}


def fitted(law=FREE, conditions=AT, **given):
    return Fit(measurements(dict(conditions), **given), law)


@pytest.mark.parametrize("seed", numbers(2, 10, 40))
def test_a_power_law_ball_from_its_noisy_curve(seed):
    """Within 5 %, and four standard errors."""
    shift = (-1.0) ** seed * 10.0 ** (seed % 5 - 3)
    found = fitted(curve=record(200, seed=seed, shift=shift))
    assert list(found.parameters) == ["k", "b", "exponent"]
    right = {name: BALL[name] for name in found.parameters}
    assert_close(found.values, right, tolerance=0.05, seed=seed)
    assert_found(found)
    assert found.sigma[0] == pytest.approx(40.0, rel=0.2)


def test_curves_of_different_noise():
    """Each has the weight of its own residuals: the fit is that with their σ given."""
    rows = []
    for speed, noise in ((30.0, 20.0), (50.0, 400.0)):
        time, force = record(100, noise, club_speed=speed, seed=int(speed))
        rows.append({"time": time, "force": force, "club_speed": speed})
    found = fitted(conditions={"m_club": 0.2}, curve=rows)
    for row, sigma in zip(rows, np.split(found.sigma, 2)):
        row["sigma"] = sigma
    again = fitted(conditions={"m_club": 0.2}, curve=rows)
    for name, (value, error) in found.parameters.items():
        assert abs(again.values[name] - value) < 1e-3 * error


def test_aic_is_that_of_a_normal_likelihood():
    """Less N ln 2π, which is the same for every law."""
    found = fitted(LINEAR, curve=record(100))
    parameters = len(found.parameters) + len(found.touches)
    likelihood = norm.logpdf(found.residuals * found.sigma, scale=found.sigma).sum()
    constant = len(found.residuals) * math.log(2.0 * math.pi)
    assert found.aic == pytest.approx(2.0 * parameters - 2.0 * likelihood - constant)


def test_the_error_of_an_offset_is_one_of_the_parameters():
    """Added to their variance: the square of the change that it makes."""
    data, law = measurements(AT, curve=record()), ContactLaw(2, 1.6)
    (curve,) = data.curves.values()

    def fit(**changes):
        one = replace(curve, sigma=np.full(len(curve.y), 40.0), **changes)
        return Fit(Measurements({}, [one], None, data.impact), law)

    error, small = 20.0, 0.2
    below, above = fit(y=curve.y - small), fit(y=curve.y + small)
    without, with_ = fit().parameters, fit(offset_error=error).parameters
    for name, (_, deviation) in without.items():
        change = error * (above.values[name] - below.values[name]) / (2.0 * small)
        found = math.sqrt(with_[name].standard_error ** 2 - deviation**2)
        assert found == pytest.approx(abs(change), rel=0.05)


def test_the_impulse_of_a_pushed_head():
    """That of the push, which lasts as long as the contact, isn't the impact's."""
    values = {"exponent": 1.0, "k": 1e6, "b": 0.0, "club_force": 4000.0}
    curve = record(300, noise=0.0, **values)
    impulse = golf_impact.run_impact(["impulse"], **BALL | AT | values)["impulse"]
    with pytest.raises(UserError, match="its impulse, ") as caught:
        fitted(LINEAR, AT | {"club_speed": 100.0, "club_force": 4000.0}, curve=curve)
    found = float(str(caught.value).partition("its impulse, ")[2].split()[0])
    reduced = 0.2 * 0.04593 / 0.24593
    # 1 + COR is 2; the push counts from a quarter of the largest force on.
    assert found == pytest.approx(2.0 * reduced * 40.0, rel=0.03)
    assert impulse > 1.07 * found


@pytest.mark.ci
@pytest.mark.parametrize("given", [True, False])
def test_standard_errors_are_the_spread(given):
    """Of 30 fits; the root mean square of that many normal deviates is known to 13 %."""
    sigma = [np.full(120, 60.0)] if given else []
    all_ = []
    for seed in range(30):
        found = fitted(curve=(*record(120, 60.0, seed=seed), *sigma))
        all_ += [deviations(found)]
    rms = np.sqrt(np.mean(np.square(all_), axis=0))
    assert (rms > 0.6).all()
    assert (rms < 1.4).all()


@pytest.mark.ci
def test_a_row_in_the_steep_rise_after_touch():
    """The least χ² puts touch just before a row, where its derivative is that of one row only."""
    values, at = {"k": 6.995e5, "b": 15.33, "exponent": 1.55}, {"club_speed": 35.0, "m_club": 0.21}
    curves = [record(200, seed=n, **values, **at) for n in range(40)]
    found = [fitted(conditions=at, curve=curve) for curve in curves]
    true = {**BALL, **values}
    for one in found:
        assert_found(one, true)
    errors = [one.curves["curve"]["touch"].standard_error for one in found]
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
def test_other_laws_and_records(case):
    law, values, how = case
    given = {name: values[name] for name in ("club_speed", "club_force") if name in values}
    found = fitted(law, AT | given, curve=record(**{"rows": 200, "seed": 3} | values | how))
    assert_found(found, {**BALL, **values})


def test_many_rows_of_a_contact_that_is_not_in_closed_form(fmu):
    """Their forces are interpolated: 4.4e-10 of the largest off, 5.6e-9 at b = 1e5 N·s/m."""
    times = np.linspace(0.0, 6e-4, 1500)
    fmu.start(**BALL, **AT, club_force=2000.0)
    force = fmu.sample(times, ("force",))["force"]
    data = measurements({**AT, "club_force": 2000.0}, curve=(times - 0.01, force))
    found = Model(data)({**BALL, "touch": -0.01})
    assert found == pytest.approx(force, rel=0.0, abs=2e-9 * force.max())


@pytest.mark.parametrize("given", [{"curve": record(200)}, {"scalars": {"contact_time": 5e-4}}])
def test_a_contact_that_does_not_end(given):
    """Has neither a curve nor targets."""
    data = measurements(**{"scalars": AT} | given)
    with pytest.raises(UserError, match="don't separate"):
        Model(data)({"law": 1, "k": 1e6, "b": 1e4, "touch": 0.0})


def test_a_line_of_cor_is_above_0():
    model, slope = Model(measurements({}, cor_speeds=line())), 2.0**-7
    assert model({"restitution_at_rest": 56.0 * slope, "restitution_slope": slope}).min() == slope
    with pytest.raises(UserError, match="COR isn't above 0"):
        model({"restitution_at_rest": 55.0 * slope, "restitution_slope": slope})


def test_without_noise():
    found = fitted(curve=record(200, noise=0.0, shift=2.0))
    right = {name: BALL[name] for name in found.parameters}
    assert_close(found.values, right, tolerance=1e-6)
    assert found.curves["curve"]["touch"].value == pytest.approx(2.0, abs=1e-10)


@pytest.mark.parametrize("seed", range(20))
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
    assert found.values["restitution_slope"] == 0.0
    assert found.parameters["restitution_slope"].standard_error is None
    assert found.values["restitution_at_rest"] == pytest.approx(0.75, abs=1e-3)


def test_all_together(fmu):
    """Curve, COR line and a scalar in one fit; the curve's COR counts for the line."""
    force = fmu.impact(("max_force",), **BALL, **AT, **PENNER)["max_force"]
    scalars = {**AT, "max_force": force, "sigma_max_force": 60.0}
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
    rows = {row[0]: row[-1] for row in calibration.tables()[1].rows}
    assert rows["curve"].endswith(" N), 40 m/s")
    assert "N" not in rows["cor_speeds"]
    _, above, targets, _, below = calibration.draw().axes
    (measured, fit), (residuals, _) = above.lines, below.lines
    assert [*map(list, measured.get_data())] == [[*data.cor_speeds.x], [*data.cor_speeds.y]]
    assert fit.get_ydata() - measured.get_ydata() == pytest.approx(residuals.get_ydata())
    (point, _) = targets.lines
    assert [*map(list, point.get_data())] == [[*calibration.residuals["targets"]], [0]]
    assert [text.get_text() for text in targets.get_yticklabels()] == ["max force (N)"]


def test_the_wrong_law_is_noticed():
    data = measurements(AT, curve=record(200))
    calibration = Calibration(data, LINEAR)
    assert any("correlated" in words for words in calibration.words)
    assert calibration.words[-1].startswith("power law, n free describes")
    assert not any("correlated" in words for words in Calibration(data, FREE).words)
    stated = measurements(AT, curve=(*record(200), np.full(200, 40.0)))
    assert any("doesn't fit" in words for words in Calibration(stated, LINEAR).words)


def test_predictions_are_the_fmus(fmu):
    """Their intervals: COR has one of its own under a law whose COR is fixed by ζ."""
    found = golf_impact.calibrate(curve=record(200), exponent="free", **AT)
    at = found.predict(np.array([[30.0, 45.0]]))
    value, low, high = at["coefficient_of_restitution"]
    assert value.shape == low.shape == high.shape == (1, 2)
    direct = fmu.impact(("smash_factor",), **{**found.fit.values, "club_speed": 45.0})
    assert at["smash_factor"].value[0, 1] == pytest.approx(direct["smash_factor"], rel=1e-13)
    true = fmu.impact(**{**BALL, **AT, "club_speed": 30.0})["coefficient_of_restitution"]
    assert low[0, 0] < true < high[0, 0]
    assert high[0, 0] - low[0, 0] == pytest.approx(high[0, 1] - low[0, 1], rel=1e-3)
    assert found.predict(45.0)["ball_velocity"].value.shape == ()


def test_from_python():
    """The text has the digits that are significant."""
    time, force = record(200)
    found = golf_impact.calibrate(curve=(time, force), exponent="free", **AT)
    assert isinstance(found, golf_impact.Calibration)
    assert found.covariance.shape == (3, 3)
    for n, one in enumerate(found.parameters.values()):
        assert one.standard_error == pytest.approx(math.sqrt(found.covariance[n, n]))
    assert found.speeds.tolist() == [24.0, 32.0, 40.0, 48.0, 56.0]
    lines = repr(found).splitlines()
    assert lines[0] == "Calibration: power law, n free (law 2)"
    assert lines[1].startswith("  k = 8")
    assert lines[1].endswith(" N/m")
    assert len(lines[1]) < 30
    # Measured and fitted, residuals and zero; over the time since touch, a tenth of a second ago.
    above, below = found.draw().axes
    (measured, model), (residuals, zero) = above.lines, below.lines
    since = 1e6 * (time - found.fit.curves["curve"]["touch"].value)
    for drawn in (measured, model, residuals):
        assert drawn.get_xdata() == pytest.approx(since)
    assert measured.get_ydata() == pytest.approx(force)
    assert model.get_ydata() - force == pytest.approx(residuals.get_ydata(), abs=1e-9)
    assert residuals.get_ydata().std() == pytest.approx(40.0, rel=0.2)
    assert zero.get_ydata() == [0.0, 0.0]
    (begin, *_, end), (band,) = since[force > 0.25 * force.max()], below.collections
    margin, half = 0.3 * (end - begin), found.fit.coverage * found.fit.sigma[0]
    assert below.get_xlim() == pytest.approx((begin - margin, end + margin))
    assert band.get_datalim(below.transData).intervaly == pytest.approx([-half, half])
    with pytest.raises(UserError, match="no target 'speed'"):
        golf_impact.calibrate(speed=3.0)
    with pytest.raises(UserError, match="one length"):
        golf_impact.calibrate(curve=(time, force[:-1]), **AT)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("approach_speed,cor\n30,0.8\n\n40,0\n", ("bad.csv, row 2 (line 4)", "above 0")),
        ("approach_speed,cor\n30,0.8\n-4,0.7\n", ("row 2 (line 3)", "approach_speed = -4")),
        ("approach_speed,cor\n30,0.8\n30,0.7\n", ("bad.csv", "two speeds")),
        ("approach_speed,cor\n30,0.8\n40,0.7\n", ("bad.csv", "sigma")),
        ("approach_speed,cor,sigma\n30,0.8,0.1\n40,0.7,0\n", ("row 2 (line 3)", "sigma = 0")),
    ],
)
def test_lines_that_are_refused(tmp_path, text, words):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    refused(golf_here("calibrate", "--cor-speeds", file, "--out", tmp_path / "out"), *words)
