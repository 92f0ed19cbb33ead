"""From measurements to a ball: parameters are found again, and their intervals hold the truth."""

import json
import math
import random
import re
import shlex
import sys
from functools import cache

import numpy as np
import pytest
from command import golf, golf_here, refused
from compare import assert_close, assert_within
from conftest import numbers, some
from scipy import stats

import golf_impact
from golf_build.extras import install_command
from golf_impact import calibrate
from golf_impact.data.balls import BALLS
from golf_impact.data.measured import MPH
from golf_impact.studies.calibrate.calibration import Calibration
from golf_impact.studies.calibrate.fit import Problem
from golf_impact.studies.calibrate.measurements import measurements
from golf_impact.studies.intervals import result_intervals

#: A ball, and the conditions of its curves.
BALL = {"law": 2, "k": 8.2e5, "b": 37.0, "exponent": 1.6}
AT = {"club_speed": 40.0, "m_club": 0.2}

ROH_LEE = {"ball_speed": 50.0, "club_speed_after": 24.0, "contact_time": 6e-4, "max_force": 6600.0}
TWO = {"cor": 0.743, "contact_time": 6e-4}
LINEAR = {"exponent": 1.0, "k": 1e6, "b": 30.0}
DAMPED = {"exponent": 1.0, "b": 400.0, "rows": 200, "trail": 2.0}
PENNER = {"restitution_at_rest": 0.86, "restitution_slope": 0.0029}
FREE = {**AT, "exponent": "free"}

#: Outputs of the FMU by the names of scalars: first three that depend on the damping alone.
OUTPUTS = {
    "ball_speed": "ball_velocity", "club_speed_after": "club_velocity",
    "cor": "coefficient_of_restitution", "contact_time": "contact_time",
    "max_force": "max_force", "time_of_max_force": "time_of_max_force",
}  # fmt: skip


def record(
    rows=551, noise=40.0, lead=0.5, trail=0.5, seed=1, shift=0.0123, baseline=(0.0, 0.0),
    step=0.0, limit=1e9, sign=1.0, part=slice(None), **values,
):  # fmt: skip
    """Instants by a shifted clock, s, and force, N, with noise; of 100 rows few are in contact.

    Of its sensor's flaws baseline is offset and drift over the record, N; step its resolution;
    limit the largest value; sign, and part, the rows that are there.
    """
    values = {**BALL, **AT, **values}
    contact = golf_impact.run_impact(("contact_time",), **values)["contact_time"]
    instants, force = np.linspace(-lead * contact, (1.0 + trail) * contact, rows), np.zeros(rows)
    inside = instants > 0.0
    path = golf_impact.run_trajectory(outputs=("force",), times=instants[inside], **values)
    force[inside] = path["force"]
    force += np.linspace(baseline[0], sum(baseline), rows)
    force = np.minimum(force + np.random.default_rng(seed).normal(0.0, noise, rows), limit)
    force = step * np.round(force / step) if step else force
    return (instants + shift)[part], sign * force[part]


def line(seed=0, sigma=0.004):
    """Approach speeds, m/s, and COR with noise."""
    speeds = np.repeat(np.arange(20.0, 56.0, 5.0), 2)
    noise = np.random.default_rng(seed).normal(0.0, sigma, len(speeds))
    return speeds, PENNER["restitution_at_rest"] - PENNER["restitution_slope"] * speeds + noise


def fitted(curve=None, *, exponent=1.0, fix=None, baseline="", **given):
    """As `calibrate`, but not compared with n = 1."""
    fixed = {} if exponent == "free" else {"exponent": exponent}
    data = measurements(given, curve=curve, baseline=baseline)
    return Calibration(Problem(data, {**fixed, **(fix or {})}))


@cache
def usual():
    """The fit of 200 rows, and of n = 1 beside it."""
    return calibrate(record(200), **FREE)


def assert_found(found, true):
    """Fail unless all parameters are the true ones within four standard errors and rounding."""
    for name, one in found.parameters.items():
        off = abs(one.value - true[name]) / (4.0 * one.standard_error + 1e-6 * true[name])
        assert_within(off, 1.0, name, found=one.value, exact=true[name])


@pytest.mark.parametrize("seed", numbers(1, 14, 55))
def test_scalars_of_random_impacts(seed):
    """Far beyond golf: the truth is found, and with noise nothing fits better than what is."""
    draw = random.Random(seed + 1)
    ranges = {"club_speed": (5, 70), "m_club": (0.1, 0.4), "m_ball": (0.03, 0.06)}
    impact = {name: draw.uniform(*ends) for name, ends in ranges.items()}
    speed, mu = impact["club_speed"], 1.0 / (1.0 / impact["m_club"] + 1.0 / impact["m_ball"])
    free = draw.choice((False, True))
    n = draw.uniform(1.05, 3.5) if free else draw.choice((1.0, 1.0, 1.5))
    zeta = draw.choice((draw.uniform(0.002, 0.3), 10.0 ** draw.uniform(-3.0, -0.1)))
    length, d = speed * 10.0 ** draw.uniform(-4.3, -3.3), 0.005
    # k and b of an undamped contact of this length and of this damping ratio.
    k = mu * 0.5 * (n + 1.0) * (speed / length) ** 2 * (d / length) ** (n - 1.0)
    b = zeta * math.sqrt(2.0 * (n + 1.0) * k * mu)
    names = draw.sample([*OUTPUTS][:3], draw.randint(1, 3))
    names += draw.sample([*OUTPUTS][3:], draw.randint(2 if free else 1, 3))
    true = {"law": 2, "k": k, "b": b, "exponent": n}
    exact = golf_impact.run_impact([OUTPUTS[name] for name in names], **true, **impact)
    if any(map(math.isnan, exact.values())):
        pytest.skip("these bodies never separate")
    given = {"exponent": "free" if free else n, **impact}
    measured = dict(zip(names, exact.values()))
    found = fitted(**given, **measured)
    assert found.chi_squared < 1e-4
    # COR determines the damping, a time or a force k; times and forces may leave two exponents.
    if not free:
        assert_close(found.values, {"k": k, "b": b}, tolerance=2e-3, seed=seed)
    noise = {name: draw.gauss(0.0, 1.0) for name in names}
    noise["cor"] = -abs(noise.get("cor", 0.0))  # it must be below 1
    sigma = {name: 10.0 ** draw.uniform(-5.0, -1.3) * abs(measured[name]) for name in names}
    noisy = {name: (v + sigma[name] * noise[name], sigma[name]) for name, v in measured.items()}
    # Rounding the parameters changes χ² by 1e-6 of their number.
    assert fitted(**given, **noisy).chi_squared <= sum(noise[n] ** 2 for n in names) + 1e-4


def test_errors_of_scalars():
    """Of an exact inverse, and with a prior, which counts as a measurement."""
    found = calibrate(**TWO)
    k, b = found.parameters.values()
    # b = 2 μ L/T, so its relative variance is the sum of those of L = -ln COR and T.
    expected = b.value * math.hypot(0.01 / -math.log(0.743), 0.01)
    assert b.standard_error == pytest.approx(expected, rel=1e-5)
    assert found.coverage == pytest.approx(stats.norm.ppf(0.975))  # σ is given
    assert np.abs(np.subtract(k.interval, k.value)) == pytest.approx(1.96 * k.standard_error, 1e-4)
    assert (found.degrees_of_freedom, found.probability) == (0, None)
    assert found.predicted["cor"] == pytest.approx(0.743, rel=3e-5)
    assert "χ² = 0, degrees of freedom 0" in repr(found)
    assert {row[-1] for row in found.tables()[1][2]} == {"0.00"}
    # What is exact isn't ranked by rounding.
    (other,) = (words for words in calibrate(**TWO, exponent=1.5).words if "With n = 1" in words)
    assert "AIC" not in other
    with_prior = calibrate(**TWO, prior={"m_club": (0.21, 0.02)}).parameters
    low, high = (calibrate(**TWO, m_club=m).values["b"] for m in (0.209, 0.211))
    # The scalars don't determine the mass.
    assert with_prior["m_club"].standard_error == pytest.approx(0.02, rel=1e-4)
    expected = math.hypot(b.standard_error, 0.02 * (high - low) / 0.002)
    assert with_prior["b"].standard_error == pytest.approx(expected, rel=1e-2)
    b = calibrate(contact_time=6e-4, prior={"b": "37±2"}).parameters["b"]
    assert (b.value, b.standard_error) == pytest.approx((37.0, 2.0), rel=1e-5)
    # Beside a curve it has a weight by the noise of the rows, also while touch is searched.
    against = calibrate(record(200), **FREE, prior={"n": (1.5, 0.01)})
    assert against.rms["curve"] == pytest.approx(40.0, rel=0.1)


@pytest.mark.ci
@pytest.mark.parametrize(("name", "n"), [("roh-lee", "free"), ("roh-lee-linear", 1), ("tour", 1.5)])
def test_presets_are_what_calibrate_finds(name, n):
    tour = {"club_speed": 113 * MPH, "ball_speed": 167 * MPH, "contact_time": 475e-6}
    found = calibrate(**(tour if name == "tour" else ROH_LEE), exponent=n)
    for variable, value in BALLS[name].values.items():
        digits = 4 if variable == "exponent" else 3
        assert float(f"{found.values[variable]:.{digits}g}") == value


def test_a_parameter_at_its_limit(tmp_path):
    """A ball a little faster than an elastic one, but within its σ."""
    given = {"contact_time": 6e-4, "ball_speed": "57.6±0.5"}
    found = calibrate(**given)
    b = found.parameters["b"]
    assert (b.value, b.standard_error, b.limit, b.interval[0]) == (0.0, None, 0.0, 0.0)
    assert found.as_json()["parameters"]["b"]["limit"] == 0.0
    assert "b is at its limit 0: check club speed and mass" in found.words[0]
    # At the end of its interval χ² of the best other parameters is larger by 1.645².
    rise = calibrate(**given, fix={"b": b.interval[1]}).chi_squared - found.chi_squared
    assert rise == pytest.approx(1.645**2, rel=0.05)
    k, alone = (one.parameters["k"] for one in (found, calibrate(**given, fix={"b": 0.0})))
    assert k.standard_error == pytest.approx(alone.standard_error, rel=1e-6)
    cor = found.predict(35.0)["coefficient_of_restitution"]
    assert cor.low < 1.0 - 1e-3 < cor.value == cor.high == 1.0
    ball = golf_impact.read_ball(found.save(tmp_path / "mine.toml"))
    assert (ball.uncertain, ball.limits[:18]) == (("k",), "b is at its limit:")
    rising = calibrate(cor_speeds=(np.arange(20.0, 50.0), np.linspace(0.7, 0.8, 30)))
    assert rising.parameters["restitution_slope"].limit == 0.0
    assert rising.values["restitution_at_rest"] == pytest.approx(0.75, abs=1e-3)


def test_of_two_answers_the_less_damped_one():
    """Time and force of a linear ball fit a little damping, or very much."""
    wanted = golf_impact.run_impact(("contact_time", "max_force"), law=2, k=9e5, b=40.0)
    assert calibrate(**wanted).values["b"] == pytest.approx(40.0, rel=1e-4)


def test_what_is_fixed():
    """It isn't fitted, and what it determines is better known."""
    fixed = fitted(record(200), fix={"exponent": 1.6, "b": 37.0}, **AT)
    assert [*fixed.parameters] == ["k"]
    assert (fixed.values["exponent"], fixed.values["b"]) == (1.6, 37.0)
    assert fixed.parameters["k"].standard_error < 0.5 * usual().parameters["k"].standard_error
    # One measurement determines the other parameter.
    assert [*calibrate(contact_time=6e-4, fix={"b": 37}).parameters] == ["k"]
    k = calibrate(**TWO).values["k"]
    found = calibrate(cor=TWO["cor"], fix={"k": k})
    assert [*found.parameters] == ["b"]
    assert found.predicted["contact_time"] == pytest.approx(TWO["contact_time"], rel=1e-4)
    ball = calibrate(cor_speeds=line(), fix={"k": k}).ball
    assert (ball.values["k"], ball.undetermined) == (k, ())


#: What is given to calibrate, the record, and words about it.
CURVES = {
    "drift": (FREE, {"baseline": (0.0, 600.0)}, "baseline linear"),
    "sign": (FREE, {"baseline": (-3e4, 0.0), "sign": -1.0}, "its sign was changed"),
    "coarse": (FREE, {"noise": 0.0, "step": 200.0}, "resolved in steps of 200 N"),
    "clipped": (FREE, {"baseline": (0.0, 400.0), "limit": 7e3}, "rows .* are left out: clipped"),
    "damped": ({**AT, "baseline": "linear"}, DAMPED, ""),
    "offset": (FREE, {"baseline": (300.0, 0.0), "seed": 2}, "baseline constant"),
    "quantized": (FREE, {"noise": 60.0, "step": 200.0}, "resolved in steps of 200 N"),
    "late": (FREE, {"part": slice(200, None)}, "the record begins in contact"),
    "short": (FREE, {"part": slice(350)}, "the record ends in contact"),
    "n = 1": (AT, LINEAR, "baseline zero"),
    "n = 1.5": ({**AT, "exponent": 1.5}, {"exponent": 1.5, "shift": -1000.0}, "baseline zero"),
    "no lead": (FREE, {"lead": 0.0}, ""),
    "long": (FREE, {"rows": 5000, "lead": 4.0, "trail": 5.0}, ""),
    "faster": ({**FREE, "club_speed": 55.0}, {"club_speed": 55.0, "noise": 100.0}, ""),
}  # fmt: skip


@pytest.mark.parametrize("case", some(4, CURVES))
def test_laws_and_flaws_of_a_record(case):
    """They are reported, and the ball is found all the same, of many rows by a spline of forces."""
    given, how, words = case
    found = fitted(record(**how), **given)
    assert_found(found, {**BALL, **how})
    curve, step = found.data.curves["curve"], how.get("step", 0.0)
    (start, change), lasts = how.get("baseline", (0.0, 0.0)), np.ptp(curve.x)
    true = {
        "touch_time": how.get("shift", 0.0123),
        "offset": start + change * (curve.origin - curve.x[0]) / lasts,
        "drift": change / lasts,
    }
    for name, one in found.curves["curve"].items():
        assert abs(one.value - true[name]) < 4.0 * one.standard_error + 1e-9 + 1e-8 * step, name
    # The error of a coarse step is even; outside contact all values may round to one.
    sigma, few = math.hypot(how.get("noise", 40.0), step / math.sqrt(12.0)), how.get("rows", 551)
    assert found.sigma["curve"][0] == pytest.approx(sigma, rel=0.05 + 3.0 / few**0.5, abs=0.01)
    assert any(re.search(words, sentence) for sentence in found.words)


#: Records whose intervals hold the truth as often as they say: of 40 each, of 20 with few rows.
RECORDS = {
    "plain": {"rows": 200}, "drift": {"rows": 200, "baseline": (50.0, 200.0)},
    "steps": {"rows": 200, "step": 200.0}, "few": {"rows": 40, "lead": 0.15, "trail": 0.25},
}  # fmt: skip


@pytest.mark.ci
@pytest.mark.parametrize("how", RECORDS.values(), ids=RECORDS)
def test_95_percent_of_intervals_contain_the_truth(how):
    """Measured: 95 to 100 %, also in coarse steps; of few rows, where χ² rises, 65 of 69."""
    held = []
    for seed in range(20 if how["rows"] == 40 else 40):
        found = fitted(record(seed=seed, **how), **FREE)
        ends = {name: one.interval for name, one in found.parameters.items()}
        held += [low <= BALL[name] <= high for name, (low, high) in ends.items()]
    assert np.mean(held) >= 0.9


def test_the_error_of_a_baseline_is_one_of_the_parameters():
    fits = [usual(), *(fitted(record(200), baseline=b, **FREE) for b in ("constant", "linear"))]
    zero, constant, linear = (fit.parameters["b"].standard_error for fit in fits)
    # By the offset's error from 150 rows, 3 N of 8 kN, in COR and from there in b.
    assert 1.2 * zero < constant < linear


def test_curves_of_different_noise():
    """Each has the weight of its own residuals: the fit is that with their σ given."""
    given, rows = {"exponent": 1.6, "baseline": "zero"}, []
    for speed, noise in ((30.0, 20.0), (50.0, 400.0)):
        time, force = record(140, noise, club_speed=speed, seed=int(speed))
        rows.append({"time": time, "force": force, "club_speed": speed, "m_club": 0.2})
    found = fitted(rows, **given)
    again = fitted([{**row, "sigma": s} for row, s in zip(rows, found.sigma.values())], **given)
    for name, one in found.parameters.items():
        assert abs(again.values[name] - one.value) < 1e-3 * one.standard_error
    # Akaike's criterion, less N ln 2π, which is the same for every law.
    residuals, sigma = (np.concatenate([*of.values()]) for of in (found.residuals, found.sigma))
    likelihood = stats.norm.logpdf(residuals * sigma, scale=sigma).sum()
    aic = 2.0 * found.result.nvarys - 2.0 * likelihood - len(sigma) * math.log(2.0 * math.pi)
    assert found.aic == pytest.approx(aic)


@pytest.mark.parametrize("seed", numbers(3, 10, 20))
def test_a_line_of_cor(seed):
    """Against the normal equations: least squares of a line has a closed form."""
    speeds, cors = line(seed)
    found = calibrate(cor_speeds=(speeds, cors))
    assert list(found.parameters) == [*PENNER]
    (slope, rest), covariance = np.polyfit(speeds, cors, 1, cov=True)
    errors = np.sqrt(covariance.diagonal())[::-1]
    student = stats.t.ppf(0.975, len(speeds) - 2)
    for one, expected, error in zip(found.parameters.values(), (rest, -slope), errors):
        assert one.standard_error == pytest.approx(error, rel=1e-3)
        assert one.value == pytest.approx(expected, abs=2e-3 * error)
        assert np.ptp(one.interval) == pytest.approx(2.0 * student * one.standard_error)
    assert_found(found, PENNER)
    assert not {"k", "contact_time", "max_force"} & {*found.values, *found.predicted}
    # A steep line ends below the speeds of predictions.
    assert calibrate(cor_speeds=([25.0, 30.0, 35.0], [0.356, 0.23, 0.105])).predictions == {}


def test_all_together():
    """Curve, COR line and a scalar in one fit; the curve's COR counts for the line."""
    force = golf_impact.run_impact(("max_force",), **{**BALL, **AT, **PENNER})["max_force"]
    time, measured = record(140, baseline=(100.0, 500.0), **PENNER)
    given = {"cor_speeds": line(1), "max_force": (force, 60.0), "baseline": "linear"}
    found = calibrate((time, measured), exponent=1.6, **AT, **given)
    assert list(found.parameters) == ["k", *PENNER]
    assert_found(found, {**BALL, **PENNER})
    alone = calibrate(cor_speeds=line(1))
    for name in PENNER:
        together, of_line = (one.parameters[name].standard_error for one in (found, alone))
        assert together < 1.05 * of_line
    assert (found.exponent, found.linear.exponent) == (1.6, 1.0)
    assert found.residuals.keys() == {"targets", "curve", "cor_speeds"}
    _, given_force, _, model, residual = found.tables()[1][2][0]
    assert float(model) == pytest.approx(found.predicted["max_force"], abs=0.6)
    assert float(model) - float(given_force) == pytest.approx(60.0 * float(residual), abs=1.5)
    # The figure: measured without its baseline and fitted, over the time since touch; residuals.
    curve, cors, targets, *below = found.draw().axes
    touch, offset, drift = (one.value for one in found.curves["curve"].values())
    baseline = offset + drift * (time - found.data.curves["curve"].origin)
    exact = 1e6 * (time - touch), measured - baseline
    for above, residuals, points in zip((curve, cors), below, (exact, line(1))):
        (dots, fit), (off, _) = above.lines, residuals.lines
        assert np.array(dots.get_data()) == pytest.approx(np.array(points))
        assert fit.get_ydata() - dots.get_ydata() == pytest.approx(off.get_ydata())
    assert below[0].lines[0].get_ydata().std() == pytest.approx(40.0, rel=0.2)
    assert [text.get_text() for text in targets.get_yticklabels()] == ["max force (N)"]


@pytest.mark.parametrize("sigma", [(np.full(200, 40.0),), ()], ids=["stated", "estimated"])
def test_the_wrong_law_is_noticed(sigma):
    """Its correlated residuals enlarge an estimated σ, but no stated one."""
    found = calibrate((*record(200), *sigma), **FREE) if sigma else usual()
    wrong, right = (" ".join(one.words) for one in (found.linear, found))
    assert "are correlated" in wrong
    assert "Try --exponent free" in wrong
    assert ("doesn't fit" in wrong) == bool(sigma)
    r, noise = found.linear.row_correlations["curve"], found.linear.residuals["curve"]
    enlarged = 1.0 if sigma else math.sqrt((1.0 + r) / (1.0 - r))
    assert noise == pytest.approx(enlarged * found.linear.result.residual, abs=0.02)
    assert not re.search("are correlated|describes|doesn't fit", right)
    assert re.search(r"With n = 1 instead: k = .* rms residual 2\d\d.* N, AIC higher by ", right)
    words = f"Correlations: C(k, b) = {found.correlations[0, 1]:.2f}, C(k, exponent) = -"
    assert words in found.words[-1]
    assert re.search(r"C\(k, exponent\) += -", found.fit_report())


@pytest.mark.parametrize(
    ("measured", "marked", "words"),
    [
        ({"cor": 0.8, "contact_time": 6e-4, "club_speed": 40.4}, "30 50", "if COR didn't depend"),
        ({"cor_speeds": ([29.0, 35.0, 41.0], [0.79, 0.77, 0.76])}, "50", "from 29 to 41 m/s"),
        ({"cor_speeds": ([31.0, 40.0, 51.0], [0.79, 0.77, 0.73])}, "30", "from 31 to 51 m/s"),
        ({"cor_speeds": ([30.0, 40.0, 50.0], [0.79, 0.77, 0.73])}, "", "if the law holds"),
    ],
)
def test_speeds_that_were_not_measured(measured, marked, words):
    title, _, rows = calibrate(**measured).tables()[-1]
    assert [row[0] for row in rows if "*" in row[0]] == [f"{v} *" for v in marked.split()]
    assert words in title
    assert ("(*:" in title) == bool(marked)


def test_predictions_and_errors_of_results():
    found = usual()
    at = found.predict(np.array([[30.0, 45.0]]))
    value, low, high = at["coefficient_of_restitution"]
    assert value.shape == low.shape == high.shape == (1, 2)
    direct = golf_impact.run_impact(**{**found.values, "club_speed": 45.0})
    assert at["smash_factor"].value[0, 1] == pytest.approx(direct["smash_factor"], rel=1e-13)
    true = golf_impact.run_impact(**BALL, **AT)["coefficient_of_restitution"]
    assert low[0, 0] < true < high[0, 0]
    # Errors of results by linear propagation: the spread of those of random balls.
    ball, outputs = found.ball, ("coefficient_of_restitution", "max_force")
    errors = result_intervals(ball, found.values, outputs)
    mean = [ball.values[name] for name in ball.uncertain]
    draws = np.random.default_rng(1).multivariate_normal(mean, ball.covariance, 4000)
    spread = golf_impact.run_impacts(outputs, **found.values | dict(zip(ball.uncertain, draws.T)))
    for name in outputs:
        assert errors[name] == pytest.approx(spread[name].std(), rel=0.05)
    other = {**found.values, "k": 1e3, "b": 1e3, "exponent": 1.0}
    assert result_intervals(ball, other, outputs) == {}


@pytest.mark.parametrize("second", some(1, [(8.6e5, 50.0), (BALL["k"], 30.0)]))
def test_several_curves(tmp_path, second):
    """A stiffness for each shows whether one holds, also at one speed."""
    (k, speed), files = second, []
    for n, how in enumerate(({"club_speed": 30.0}, {"club_speed": speed, "k": k})):
        rows = np.transpose(record(140, seed=n, **how))
        np.savetxt(tmp_path / f"{n}.csv", rows, "%.17g", ",", header="time,force", comments="")
        files.append(f"{tmp_path}/{n}.csv@{how['club_speed']}m/s")
    found = fitted(files, exponent="free", m_club="200g")
    assert any("differ by more than noise in k" in one for one in found.words) == (k > BALL["k"])
    assert [*found.residuals] == ["curve", "curve_2"]
    assert found.ball.conditions == {"club_speed": 30.0, "m_club": 0.2}  # of the first
    titles = [axes.get_title() for axes in found.draw().axes]
    assert titles == ["0.csv, 30 m/s", f"1.csv, {speed:g} m/s", "", ""]


def test_the_command(tmp_path):
    """Its line, copied, gives the same result to the last digit."""
    scalars = "ball_velocity=50±0.4", "club_speed_after=24", "contact_time=600us", "max_force=6600"
    given = (*(f"--measured={one}" for one in scalars), "--exponent=free", "--no-figures")
    done = golf_here("calibrate", *given, "--out", tmp_path, code=0)
    written = json.loads((tmp_path / "calibrate.json").read_text())
    line = done.stdout.splitlines()[-1]
    assert line == written["command"]
    assert set(written["parameters"]) == {"k", "b", "exponent"}
    assert np.diag(written["correlations"]) == pytest.approx(1.0)
    assert [row["name"] for row in written["targets"]] == list(ROH_LEE)
    assert [row["sigma_given"] for row in written["targets"]] == [True, False, False, False]
    assert written["degrees_of_freedom"] == 1
    pairs = (pair.split("=") for pair in shlex.split(line) if "=" in pair)
    found = golf_impact.run_impact(**{name: float(value) for name, value in pairs})
    for name in ROH_LEE:
        assert found[OUTPUTS[name]] == written["predicted"][name]


def test_a_file_says_what_nothing_depends_on(tmp_path):
    cors = calibrate(cor_speeds=([29.0, 35.0, 41.0], [0.79, 0.77, 0.76]))
    files = [found.save(tmp_path / f"{n}.toml") for n, found in enumerate((cors, usual()))]
    assert ['undetermined = ["k"]' in file.read_text("utf-8") for file in files] == [True, False]
    assert [golf_impact.read_ball(file).undetermined for file in files] == [("k",), ()]
    assert "undetermined" not in files[1].read_text("utf-8")


def test_a_saved_ball(tmp_path):
    """Conditions with units; parameters, covariance and intervals as in Python."""
    np.savetxt(tmp_path / "a.csv", np.transpose(record(200)), "%.9g", ",", header="time,force")
    given = "--curve a.csv --club-speed 144km/h --m-club 200g --exponent 1"
    done = golf_here("calibrate", *given.split(), "--save", "m.toml", "--out", ".", cwd=tmp_path)
    assert done.stdout.splitlines()[-1] == "golf-impact run --ball m.toml"
    assert (tmp_path / "calibrate.png").stat().st_size > 10_000
    written = json.loads((tmp_path / "calibrate.json").read_text())
    assert written["conditions"] == {**AT, "m_ball": 0.04593}
    errors = [one["standard_error"] for one in written["parameters"].values()]
    assert errors == pytest.approx(np.sqrt(np.diag(written["covariance"])))
    touch = written["series"]["curve"]["touch_time"]
    assert abs(touch["value"] - 0.0123) < 4.0 * touch["standard_error"]
    # The digits of a value, of its error and of its interval end together.
    for name, size, unit in (("k", 1.0, "N/m"), ("touch_time", 1e6, "µs")):
        (row,) = (line for line in done.stdout.splitlines() if line.startswith(f"│ {name} "))
        found = list(map(float, re.findall(r"[-+\d.]{2,}", row)))
        assert (len(found), f" {unit} " in row) == (4, True)
        one = {"touch_time": touch, **written["parameters"]}[name]
        exact = [one["value"], one["standard_error"], *one["interval"]]
        places = 1 - math.floor(math.log10(size * exact[1]))
        assert found == [round(size * x, places) for x in exact]
    smash = written["predictions"][2]["smash_factor"]
    assert 0.0 < smash["high"] - smash["value"] == pytest.approx(smash["value"] - smash["low"])
    saved = golf_impact.read_ball(tmp_path / "m.toml")
    assert saved.conditions == AT
    assert np.array(saved.covariance) == pytest.approx(np.array(written["covariance"]))
    direct = golf_impact.run_impact(**saved.values, **saved.conditions)
    assert direct["ball_velocity"] == written["predicted"]["ball_speed"]


def test_without_lmfit():
    """Calibrate names what to install."""
    start = "import sys; sys.modules['lmfit'] = None; from golf_impact.commands.app import main"
    calibrate = ("calibrate", "--measured", "cor=0.7", "--measured", "contact_time=6e-4")
    done = golf(*calibrate, program=(sys.executable, "-c", f"{start}; main()"))
    refused(done, "needs lmfit", install_command("calibrate"))


def test_balls_of_earlier_versions(tmp_path):
    """A file without k has it undetermined; law 1 is read."""
    text = "law = 2\nrestitution_at_rest = 0.86\n[conditions]\nclub_speed = 35.0\nm_club = 0.21\n"
    (tmp_path / "cor.toml").write_text(text)
    assert golf_impact.read_ball(tmp_path / "cor.toml").undetermined == ("k",)
    (tmp_path / "one.toml").write_text("law = 1\nreference_compression = 0.005\nk = 1e6\nb = 8.4\n")
    assert golf_impact.read_ball(tmp_path / "one.toml").undetermined == ()
