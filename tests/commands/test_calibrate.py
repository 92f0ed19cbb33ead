"""From measurements to parameters: scalars, limits, priors, and the command."""

import json
import math
import random
import shlex
import sys

import lmfit
import numpy as np
import pytest
from command import golf, golf_here, refused
from compare import assert_close
from conftest import numbers
from lab import AT, FREE, LINEAR, record

import golf_impact
from golf_build.extras import install_command
from golf_impact.ball import BALLS
from golf_impact.calibration.curves import reduced_mass
from golf_impact.calibration.fit import Fit
from golf_impact.calibration.intervals import result_intervals
from golf_impact.calibration.measurements import (
    IMPACT,
    TARGETS,
    Measured,
    Measurements,
)
from golf_impact.calibration.measurements import measurements as targets
from golf_impact.calibration.model import ContactLaw
from golf_impact.measured import MPH

ROH_LEE = {"ball_speed": 50.0, "club_speed_after": 24.0, "contact_time": 6e-4, "max_force": 6600.0}


@pytest.mark.parametrize("restitution", [0.999, 0.743, 0.2, 0.13, 0.05])
def test_inverse_of_kelvin_voigt(restitution):
    fitted = Fit(targets({"cor": restitution, "contact_time": 6e-4}), LINEAR)
    met = golf_impact.run_impact(**fitted.values)
    # Parameters are rounded to a thousandth of their standard errors, which follow from σ of 1 %.
    assert met["coefficient_of_restitution"] == pytest.approx(restitution, rel=3e-5)
    assert met["contact_time"] == pytest.approx(6e-4, rel=3e-5)
    assert fitted.chi_squared < 1e-5


def random_case(fmu, seed):
    """Impact, law and parameters far beyond golf, targets of them, and the generator."""
    draw = random.Random(seed)
    ranges = {"club_speed": (5, 70), "m_club": (0.1, 0.4), "m_ball": (0.03, 0.06)}
    impact = {name: draw.uniform(*ends) for name, ends in ranges.items()}
    speed, mu = impact["club_speed"], reduced_mass(impact)
    law = draw.choice((1, 2, 2, 2))
    free = law == 2 and draw.random() < 0.5
    n = 1.0 if law == 1 or (not free and draw.random() < 0.5) else draw.uniform(1.05, 3.5)
    zeta = draw.choice((draw.uniform(0.002, 0.3), 10.0 ** draw.uniform(-3.0, -0.1)))
    length = speed * 10.0 ** draw.uniform(-4.3, -3.3)
    chosen = ContactLaw(law, None if free else n, 10.0 ** draw.uniform(-3.5, -1.5))
    speeds = draw.sample(("ball_speed", "club_speed_after", "cor"), draw.randint(1, 3))
    sizes = ["contact_time", "max_force", "time_of_max_force"]
    names = speeds + draw.sample(sizes, draw.randint(2 if free else 1, 3))
    # k and b of an undamped compression of this length and of this damping ratio.
    d, m = chosen.reference_compression, 0.5 * (n + 1.0)
    k = mu * m * (speed / length) ** 2 * (d / length) ** (n - 1.0)
    b = zeta * math.sqrt(4.0 * m * k * mu)
    true = {"law": law, "k": k, "b": b, "exponent": n, "reference_compression": d}
    outputs = {name: TARGETS[name] for name in names}
    predicted = fmu.impact(list(outputs.values()), **true, **impact)
    if any(map(math.isnan, predicted.values())):
        pytest.skip("these bodies never separate")
    return impact, chosen, true, {n: predicted[output] for n, output in outputs.items()}, draw


@pytest.mark.parametrize("seed", numbers(2, 10, 40))
def test_round_trip(fmu, seed):
    """The measurements are met; with a given exponent by the true parameters."""
    impact, law, true, measured, _ = random_case(fmu, seed)
    fitted = Fit(targets({**impact, **measured}), law)
    assert fitted.chi_squared < 1e-4
    # COR determines the damping, a time or a force k; times and forces may leave two exponents.
    if law.exponent is not None:
        right = {name: true[name] for name in fitted.parameters}
        assert_close(fitted.values, right, tolerance=2e-3, seed=seed)


@pytest.mark.parametrize("seed", numbers(1, 4, 15))
def test_noisy_targets(fmu, seed):
    """No parameters fit better than those found, not even the true ones."""
    impact, law, _, measured, draw = random_case(fmu, 1000 + seed)
    noisy = {}
    for name, value in measured.items():
        sigma = 10.0 ** draw.uniform(-5.0, -1.3) * abs(value)
        noisy[name] = Measured(value + sigma * draw.gauss(0.0, 1.0), sigma)
    fitted = Fit(Measurements(noisy, impact={**IMPACT, **impact}), law)
    truth = sum(((measured[name] - t.value) / t.sigma) ** 2 for name, t in noisy.items())
    # Rounding the parameters changes χ² by 1e-6 of their number.
    assert fitted.chi_squared <= truth * (1.0 + 1e-9) + 1e-4


def test_standard_error_of_an_exact_inverse():
    """b = 2 μ L/T, so its relative variance is the sum of those of L = -ln COR and T."""
    found = golf_impact.calibrate(cor=0.743, contact_time=6e-4)
    expected = found.fit.values["b"] * math.hypot(0.01 / -math.log(0.743), 0.01)
    assert found.parameters["b"].standard_error == pytest.approx(expected, rel=1e-5)
    assert (found.degrees_of_freedom, found.fit.probability) == (0, None)
    assert "χ² = 0.000" in repr(found)
    assert {row[-1] for row in found.tables()[1][2]} == {"0.00"}


@pytest.mark.ci
@pytest.mark.parametrize(
    ("name", "law"), [("roh-lee", FREE), ("roh-lee-linear", LINEAR), ("tour", ContactLaw(2, 1.5))]
)
def test_presets_are_what_calibrate_finds(name, law):
    tour = {"club_speed": 113 * MPH, "ball_speed": 167 * MPH, "contact_time": 475e-6}
    fitted = Fit(targets(tour if name == "tour" else ROH_LEE), law)
    for variable, value in BALLS[name].values.items():
        digits = 4 if variable == "exponent" else 3
        assert float(f"{fitted.values[variable]:.{digits}g}") == value


def test_a_parameter_at_its_limit(tmp_path):
    """A ball a little faster than an elastic one, but within its σ."""
    found = golf_impact.calibrate(contact_time=6e-4, ball_speed="57.6±0.5")
    b = found.parameters["b"]
    assert (b.value, b.standard_error, b.limit) == (0.0, None, 0.0)
    assert found.as_json()["parameters"]["b"]["limit"] == 0.0
    assert "b is at its limit 0: check club speed and mass" in found.words[0]
    # At the end of its interval χ² of the best other parameters is larger by 1.645².
    low, high = b.interval
    assert low == 0.0
    end = golf_impact.calibrate(contact_time=6e-4, ball_speed="57.6±0.5", fix={"b": high})
    assert end.chi_squared - found.chi_squared == pytest.approx(1.645**2, rel=0.05)
    cor = found.predict(35.0)["coefficient_of_restitution"]
    assert cor.low < 1.0 - 1e-3 < cor.value == cor.high == 1.0
    ball = golf_impact.read_ball(found.save(tmp_path / "mine.toml"))
    assert ball.uncertain == ("k",)
    assert "b is at its limit" in ball.limits
    with pytest.raises(golf_impact.UserError, match=r"must end in .toml"):
        found.save(tmp_path / "mine.txt")


def test_of_two_answers_the_less_damped_one():
    """Time and force of a linear ball fit a little damping, or very much."""
    wanted = golf_impact.run_impact(("contact_time", "max_force"), law=2, k=9e5, b=40.0)
    assert Fit(targets(wanted), LINEAR).values["b"] == pytest.approx(40.0, rel=1e-4)


def test_a_prior_counts_as_a_measurement():
    """Of the club: its σ is one of the parameters'; of b: as if b were measured."""
    given = {"cor": 0.743, "contact_time": 6e-4}
    alone = golf_impact.calibrate(**given).parameters["b"].standard_error
    found = golf_impact.calibrate(**given, prior={"m_club": (0.21, 0.02)})
    low, high = (golf_impact.calibrate(**given, m_club=m).fit.values["b"] for m in (0.209, 0.211))
    # The scalars don't determine the mass.
    assert found.parameters["m_club"].standard_error == pytest.approx(0.02, rel=1e-4)
    expected = math.hypot(alone, 0.02 * (high - low) / 0.002)
    assert found.parameters["b"].standard_error == pytest.approx(expected, rel=1e-2)
    known = golf_impact.calibrate(contact_time=6e-4, prior={"b": "37±2"})
    b = known.parameters["b"]
    assert (b.value, b.standard_error) == pytest.approx((37.0, 2.0), rel=1e-5)


def test_what_is_fixed_and_profiles():
    found = golf_impact.calibrate(curve=record(200), exponent="free", profile=True, **AT)
    assert isinstance(found.result, lmfit.minimizer.MinimizerResult)
    assert "C(k, exponent)" in found.fit_report()
    (row,) = (words for words in found.words if words.startswith("Correlations: "))
    assert f"C(k, n) = −{-found.fit.correlations[0, 2]:.2f}" in row
    # Touch lies between two rows, where χ² has cusps: the intervals are narrower than linear ones.
    # Those of a wrong law are enlarged for correlated residuals.
    wrong = golf_impact.calibrate(curve=record(200), profile=True, **AT)
    for one in (*found.parameters.values(), wrong.parameters["k"]):
        low, high = one.interval
        assert 0.5 < (high - low) / (2.0 * found.fit.coverage * one.standard_error) < 1.05
    scalars = golf_impact.calibrate(cor=0.743, contact_time=6e-4, profile=True).parameters["k"]
    half = np.abs(np.subtract(scalars.interval, scalars.value))
    assert half == pytest.approx(1.96 * scalars.standard_error, rel=0.05)
    fixed = golf_impact.calibrate(curve=record(200), fix={"n": 1.6, "b": 37}, **AT)
    assert [*fixed.parameters] == ["k"]
    assert (fixed.fit.values["exponent"], fixed.fit.values["b"]) == (1.6, 37.0)
    assert fixed.parameters["k"].standard_error < 0.5 * found.parameters["k"].standard_error


def test_errors_of_results_follow_from_a_ball():
    """By linear propagation: of a mean of repeated fits the spread."""
    found = golf_impact.calibrate(curve=record(200), exponent="free", **AT)
    values, outputs = {**found.fit.values}, ("coefficient_of_restitution", "max_force")
    errors = result_intervals(found.ball, values, outputs)
    draws = np.random.default_rng(1).multivariate_normal(
        [found.ball.values[name] for name in found.ball.uncertain], found.ball.covariance, 4000
    )
    spread = golf_impact.run_impacts(outputs, **values | dict(zip(found.ball.uncertain, draws.T)))
    for name in outputs:
        assert errors[name] == pytest.approx(spread[name].std(), rel=0.05)
    assert (
        result_intervals(
            found.ball, {**values, **dict.fromkeys("kb", 1e3), "exponent": 1.0}, outputs
        )
        == {}
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--cor 1", "cor = 1 is refused"),
        ("--cor 0.7 --contact-time 600", "600e-6 for 600 µs"),
        ("--cor 0.7 --max-force 6.6", "6600 for 6.6 kN"),
        ("--cor 0.7±0 --contact-time 6e-4", "sigma_cor = 0"),
        ("--cor 0.7 --measured cor=0.7", "cor is given twice"),
        ("--measured spin=3", "no target 'spin'"),
        ("--measured cor", "write NAME=VALUE"),
        ("--cor 0.7", "too few targets"),
        ("--ball-speed 50 --club-speed-after 24 --cor 0.74", "count once"),
        ("--cor 0.7 --contact-time 6e-4 --exponent free", "3 are needed"),
        ("", "--cor 0.743 --contact-time 600e-6"),
        ("--cor 0.7 --contact-time 6e-4 --m-club 210", "0.21 for 210 g"),
        ("--law 1 --exponent 1.5", "exponent = 1.5 is refused: law = 1"),
        ("--law 1 --exponent free", "exponent = free is refused: law = 1"),
        ("--reference-compression 0", "reference_compression = 0"),
        ("--law 3", "1 (absolute)"),
        ("--csv none.csv", "none.csv"),
        ("--fix m_club=1", "fix m_club is refused"),
        ("--prior k=8e5", "without its σ"),
        ("--baseline sloped", "zero, constant, linear"),
    ],
)
def test_options_that_are_refused(tmp_path, options, words):
    refused(golf_here("calibrate", *options.split(), "--out", tmp_path / "out"), words)
    assert not (tmp_path / "out").exists()


def test_the_command(tmp_path):
    """Its line, copied from a narrow terminal, gives the same result to the last digit."""
    done = golf(
        *("calibrate", "--measured", "ball_velocity=50±0.4", "--club-speed-after", 24),
        *("--contact-time", "600us", "--max-force", 6600, "--exponent", "free", "--out", tmp_path),
        env={"COLUMNS": "60"},
        code=0,
    )
    written = json.loads((tmp_path / "calibrate.json").read_text())
    assert (tmp_path / "calibrate.png").stat().st_size > 0
    line = done.stdout.splitlines()[-1]
    assert line == written["command"]
    assert set(written["parameters"]) == {"k", "b", "exponent"}
    assert np.diag(written["correlations"]) == pytest.approx(1.0)
    assert [row["name"] for row in written["targets"]] == list(ROH_LEE)
    assert [row["sigma_given"] for row in written["targets"]] == [True, False, False, False]
    assert (written["degrees_of_freedom"], len(written["comparison"])) == (1, 4)
    options = (pair.split("=") for pair in shlex.split(line) if "=" in pair)
    found = golf_impact.run_impact(**{name: float(value) for name, value in options})
    predicted = written["predicted"]
    for name in ROH_LEE:
        assert found[TARGETS[name]] == predicted[name]


def test_without_lmfit(tmp_path):
    """Calibrate names what to install."""
    start = (
        "import sys; sys.modules['lmfit'] = None\nfrom golf_impact.commands.app import main; main()"
    )
    calibrate = ("calibrate", "--cor", "0.7", "--contact-time", "6e-4")
    done = golf(*calibrate, program=(sys.executable, "-c", start))
    refused(done, "needs lmfit", install_command("calibrate"))


def test_progress():
    seen = []
    golf_impact.calibrate(
        cor=0.8, contact_time=5e-4, max_force=8e3, progress=lambda *one: seen.append(one)
    )
    assert [percent for percent, _ in seen] == [0.0, 25.0, 50.0, 75.0]
    assert seen[0][1] == "Kelvin–Voigt"
