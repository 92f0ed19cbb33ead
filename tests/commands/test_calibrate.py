"""From measurements to a ball: parameters are found again, and their intervals hold the truth."""

import json
import math
import random
import re
import shlex
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from command import golf, golf_here, refused
from compare import assert_close, assert_within
from conftest import numbers, some
from scipy import stats
from shown import axes_lines, check_snapshot

import golf_impact
from golf_build import VERSION
from golf_build.extras import install_command
from golf_impact import calibrate
from golf_impact.data.balls import BALLS, ball_toml
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
LINEAR = {"exponent": 1.0, "k": 1e6}
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


def curve(club_speed, **how):
    """A record with its conditions."""
    columns = dict(zip(("time", "force"), record(club_speed=club_speed, **how)))
    return {**columns, **AT, "club_speed": club_speed}


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


#: What is calibrated: each kind of measurement, of results, and of sentences about them.
PROBLEMS = {
    "scalars": lambda: {
        **ROH_LEE, "ball_speed": "50±0.4", "time_of_max_force": 2.8e-4, "exponent": "free"
    },
    "contradiction": lambda: {**TWO, "ball_speed": "57±0.1", "max_force": 6600, "fix": {"n": 1}},
    "limit": lambda: {"contact_time": 6e-4, "ball_speed": "57.6±0.5", "prior": {"k": (1e6, 1e5)}},
    "priors": lambda: {
        **TWO, "exponent": 1.5, "club_speed": 40.4, "prior": {"m_club": "210±4g", "k": "900±20N/mm"}
    },
    "line": lambda: {"cor_speeds": line(1)},
    "line and time": lambda: {
        "cor_speeds": (*line(3), np.full(16, 0.004)), "contact_time": "600±6us", "exponent": 2,
        "m_ball": 0.045, "max_force": 7000,
    },
    "rising line": lambda: {"cor_speeds": (np.arange(31.0, 49.0), np.linspace(0.7, 0.8, 18))},
    "curve": lambda: {"curve": record(200), **FREE},
    "wrong law": lambda: {"curve": (*record(140), np.full(140, 40.0)), **AT},
    "flaws and a prior": lambda: {
        "curve": record(200, baseline=(100.0, 500.0), step=100.0, limit=7e3, sign=-1.0), **FREE,
        "prior": {"n": (1.5, 0.01)},
    },
    "few rows": lambda: {"curve": record(30, **LINEAR), **AT, "fix": {"b": 37.0}},
    "together": lambda: {
        "curve": record(140, baseline=(100.0, 500.0), **LINEAR, **PENNER), "cor_speeds": line(1),
        "max_force": "6.9±0.06kN", "baseline": "linear", **AT,
    },
    "two curves": lambda: {
        "baseline": "zero", "curve": [
            curve(30.0, rows=120, noise=20.0, **LINEAR),
            curve(50.0, rows=120, noise=400.0, seed=2, **LINEAR),
        ],
    },
    "two balls": lambda: {
        "fix": {"b": 37.0}, "curve": [
            curve(30.0, rows=120, **LINEAR),
            curve(50.0, rows=160, exponent=1.0, k=1.05e6, part=slice(42, None)),
        ],
    },
}  # fmt: skip


@cache
def found(name):
    """The calibration of a problem."""
    return calibrate(**PROBLEMS[name]())


def drawn(figure):
    """Its title, and what axes show."""
    yield f"\n{figure.get_suptitle()}"
    for axes in figure.axes:
        yield from ("", *axes_lines(axes))


def fit_lines(name, fit):
    """All that is printed, drawn and written, as lines of Markdown."""
    yield f"\n## {name}\n"
    for title, columns, rows in fit.tables():
        yield from (f"**{title}**", *(f"| {' | '.join(row)} |" for row in [columns, *rows]), "")
    yield from (f"- {sentence}" for sentence in fit.words)
    written = fit.as_json()
    assert (written.pop("version"), written.pop("notes")) == (VERSION, fit.words)
    lines = [f"{name}: {json.dumps(value)}" for name, value in written.items()]
    lines += [*drawn(fit.draw()), "", ball_toml(fit.ball)]
    # Four digits are the same with each version of SciPy.
    yield "\n```"
    yield re.sub(
        r"-?\d+\.\d*(?:e[-+]?\d+)?|-?\d+e-\d+",
        lambda number: f"{round(float(number[0]), 12) + 0.0:.4g}",
        "\n".join([*lines, "```"]),
    )


def test_what_is_found(tmp_path, pytestconfig):
    """`pytest --update tests/commands/test_calibrate.py` writes it: read the diff."""
    lines = (line for name in PROBLEMS for line in fit_lines(name, found(name)))
    check_snapshot(pytestconfig, "calibrate.md", ["# Calibrations", *lines])


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_ball_comes_back_from_its_file(tmp_path, name):
    ball = found(name).ball
    file = found(name).save(tmp_path / "mine.toml")
    assert golf_impact.read_ball(file) == replace(ball, name=str(file))


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
    assert np.abs(np.subtract(k.interval, k.value)) == pytest.approx(1.96 * k.standard_error, 1e-4)
    assert (found.degrees_of_freedom, found.probability) == (0, None)
    assert found.predicted["cor"] == pytest.approx(0.743, rel=3e-5)
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


@pytest.mark.ci
@pytest.mark.parametrize(("name", "n"), [("roh-lee", "free"), ("roh-lee-linear", 1), ("tour", 1.5)])
def test_presets_are_what_calibrate_finds(name, n):
    tour = {"club_speed": 113 * MPH, "ball_speed": 167 * MPH, "contact_time": 475e-6}
    found = calibrate(**(tour if name == "tour" else ROH_LEE), exponent=n)
    for variable, value in BALLS[name].values.items():
        digits = 4 if variable == "exponent" else 3
        assert float(f"{found.values[variable]:.{digits}g}") == value


def test_a_parameter_at_its_limit():
    """A ball a little faster than an elastic one, but within its σ."""
    given = PROBLEMS["limit"]()
    limited = found("limit")
    b = limited.parameters["b"]
    assert (b.value, b.standard_error, b.limit, b.interval[0]) == (0.0, None, 0.0, 0.0)
    # At the end of its interval χ² of the best other parameters is larger by 1.645².
    rise = calibrate(**given, fix={"b": b.interval[1]}).chi_squared - limited.chi_squared
    assert rise == pytest.approx(1.645**2, rel=0.05)
    k, alone = (one.parameters["k"] for one in (limited, calibrate(**given, fix={"b": 0.0})))
    assert k.standard_error == pytest.approx(alone.standard_error, rel=1e-6)
    cor = limited.predict(35.0)["coefficient_of_restitution"]
    assert cor.low < 1.0 - 1e-3 < cor.value == cor.high == 1.0


#: What is given to calibrate, and the record.
FLAWS = {"baseline": (100.0, 500.0), "step": 100.0, "limit": 7e3, "sign": -1.0}
CURVES = {
    "flaws": (FREE, FLAWS),
    "long": (FREE, {"rows": 5000, "lead": 4.0, "trail": 5.0}),
    "coarse": (FREE, {"noise": 0.0, "step": 200.0}),
    "damped": (
        {**AT, "baseline": "linear"}, {"exponent": 1.0, "b": 400.0, "rows": 200, "trail": 2.0}
    ),
    "offset": (FREE, {"baseline": (300.0, 0.0), "seed": 2}),
    "far below": (FREE, {"baseline": (-3e4, 0.0), "sign": -1.0}),
    "quantized": (FREE, {"noise": 60.0, "step": 200.0}),
    "late": (FREE, {"part": slice(200, None)}),
    "short": (FREE, {"part": slice(350)}),
    "n = 1": (AT, {**LINEAR, "b": 30.0}),
    "n = 1.5": ({**AT, "exponent": 1.5}, {"exponent": 1.5, "shift": -1000.0}),
    "no lead": (FREE, {"lead": 0.0}),
    "faster": ({**FREE, "club_speed": 55.0}, {"club_speed": 55.0, "noise": 100.0}),
}  # fmt: skip


@pytest.mark.parametrize("case", some(2, CURVES))
def test_flaws_of_a_record(case):
    """Ball, touch and baseline are found all the same, of many rows by a spline of forces."""
    given, how = case
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


def test_curves_of_different_noise():
    """Each has the weight of its own residuals: the fit is that with their σ given."""
    both, given = found("two curves"), PROBLEMS["two curves"]()
    for one, sigma in zip(given["curve"], both.sigma.values()):
        one["sigma"] = sigma
    again = fitted(**given)
    for name, one in both.parameters.items():
        assert abs(again.values[name] - one.value) < 1e-3 * one.standard_error
    # Akaike's criterion, less N ln 2π, which is the same for every law.
    residuals, sigma = (np.concatenate([*of.values()]) for of in (both.residuals, both.sigma))
    likelihood = stats.norm.logpdf(residuals * sigma, scale=sigma).sum()
    aic = 2.0 * both.result.nvarys - 2.0 * likelihood - len(sigma) * math.log(2.0 * math.pi)
    assert both.aic == pytest.approx(aic)


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


def test_all_together():
    """Curve, COR line and a scalar in one fit; the curve's COR counts for the line."""
    together, alone = found("together"), found("line")
    assert_found(together, {**LINEAR, **PENNER})
    for name in PENNER:
        errors = (one.parameters[name].standard_error for one in (together, alone))
        assert next(errors) < 1.05 * next(errors)
    # The figure: measured without its baseline, over the time since touch.
    time, force = PROBLEMS["together"]()["curve"]
    touch, offset, drift = (one.value for one in together.curves["curve"].values())
    baseline = offset + drift * (time - together.data.curves["curve"].origin)
    dots, fit = together.draw().axes[0].lines
    assert np.array(dots.get_data()) == pytest.approx(
        np.array([1e6 * (time - touch), force - baseline])
    )
    assert np.std(fit.get_ydata() - dots.get_ydata()) == pytest.approx(40.0, rel=0.2)


def test_the_wrong_law_is_noticed():
    """Its correlated residuals enlarge an estimated σ, but no stated one."""
    for wrong, is_stated in ((found("curve").linear, False), (found("wrong law"), True)):
        r, noise = wrong.row_correlations["curve"], wrong.residuals["curve"]
        enlarged = 1.0 if is_stated else math.sqrt((1.0 + r) / (1.0 - r))
        assert noise == pytest.approx(enlarged * wrong.result.residual, abs=0.02)
        words = " ".join(wrong.words)
        assert ("doesn't fit" in words) == is_stated
        assert "are correlated" in words
    assert re.search(r"C\(k, exponent\) += -", found("curve").fit_report())


def test_predictions_and_errors_of_results():
    usual = found("curve")
    at = usual.predict(np.array([[30.0, 45.0]]))
    value, low, high = at["coefficient_of_restitution"]
    assert value.shape == low.shape == high.shape == (1, 2)
    direct = golf_impact.run_impact(**{**usual.values, "club_speed": 45.0})
    assert at["smash_factor"].value[0, 1] == pytest.approx(direct["smash_factor"], rel=1e-13)
    true = golf_impact.run_impact(**BALL, **AT)["coefficient_of_restitution"]
    assert low[0, 0] < true < high[0, 0]
    # Errors of results by linear propagation: the spread of those of random balls.
    ball, outputs = usual.ball, ("coefficient_of_restitution", "max_force")
    errors = result_intervals(ball, usual.values, outputs)
    mean = [ball.values[name] for name in ball.uncertain]
    draws = np.random.default_rng(1).multivariate_normal(mean, ball.covariance, 4000)
    spread = golf_impact.run_impacts(outputs, **usual.values | dict(zip(ball.uncertain, draws.T)))
    for name in outputs:
        assert errors[name] == pytest.approx(spread[name].std(), rel=0.05)
    other = {**usual.values, "k": 1e3, "b": 1e3, "exponent": 1.0}
    assert result_intervals(ball, other, outputs) == {}


def test_the_command(tmp_path):
    """Conditions with units; its last line, copied, gives the same result to the last digit."""
    for n, speed in enumerate((40.0, 50.0)):
        rows = np.transpose(record(100, seed=n, club_speed=speed, exponent=1.0))
        file = tmp_path / f"{n}.csv"
        np.savetxt(file, rows, "%.17g", ",", header="time,force", comments="")
    given = "--curve 0.csv@144km/h --curve 1.csv@50 --m-club 200g --measured contact-time=600us"
    line = [*shlex.split(given), "--club-speed", "40", "--out", "out"]
    done = golf_here("calibrate", *line, cwd=tmp_path, code=0)
    written = json.loads((tmp_path / "out" / "calibrate.json").read_text())
    assert (tmp_path / "out" / "calibrate.png").stat().st_size > 10_000
    last = done.stdout.splitlines()[-1]
    assert last == written["command"]
    pairs = (pair.split("=") for pair in shlex.split(last) if "=" in pair)
    direct = golf_impact.run_impact(**{name: float(value) for name, value in pairs})
    assert direct["contact_time"] == written["predicted"]["contact_time"]
    assert direct["ball_velocity"] == written["predicted"]["ball_speed"]


def test_without_lmfit():
    """Calibrate names what to install."""
    start = "import sys; sys.modules['lmfit'] = None; from golf_impact.commands.app import main"
    calibrate = ("calibrate", "--measured", "cor=0.7", "--measured", "contact_time=6e-4")
    done = golf(*calibrate, program=(sys.executable, "-c", f"{start}; main()"))
    refused(done, "needs lmfit", install_command("calibrate"))
