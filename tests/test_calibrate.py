"""From measurements to parameters: scalars, force curves, COR over speed, and the command."""

import json
import math
import random
import shlex
import sys

import pytest
from command import golf, golf_here, refused
from compare import assert_close
from conftest import numbers
from lab import FREE, LINEAR

from golf_build.extras import install_command
from golf_impact.ball import BALLS
from golf_impact.calibration.calibration import Calibration
from golf_impact.calibration.fit import ContactLaw, Fit
from golf_impact.calibration.measurements import IMPACT, TARGETS, Measurements, Measured, measurements
from golf_impact.closed_forms import solution
from golf_impact.errors import UserError
from golf_impact.measured import MPH

ROH_LEE = {"ball_speed": 50.0, "club_speed_after": 24.0, "contact_time": 6e-4, "max_force": 6600.0}


def targets(impact=IMPACT, **values):
    return measurements({**impact, **values})


def of_impact(fmu, names, **values):
    """Targets that the FMU itself gives, with σ of 1 %."""
    outputs = [TARGETS[name] for name in names]
    predicted = fmu.impact(outputs, **values)
    return targets(**{name: predicted[output] for name, output in zip(names, outputs, strict=True)})


@pytest.mark.parametrize("restitution", [0.999, 0.743, 0.2, 0.13, 0.05])
def test_inverse_of_kelvin_voigt(restitution):
    fitted = Fit(targets(cor=restitution, contact_time=6e-4), LINEAR)
    met = solution({**IMPACT, "ball_speed": 0.0, "restitution_at_rest": 0.0, **fitted.values})
    # Parameters are rounded to a thousandth of their standard errors, which follow from σ of 1 %.
    assert met["coefficient_of_restitution"] == pytest.approx(restitution, rel=3e-5)
    assert met["contact_time"] == pytest.approx(6e-4, rel=3e-5)
    assert fitted.chi_squared < 1e-5


def random_case(fmu, seed):
    """Impact, law and parameters far beyond golf, targets of them, and the generator."""
    draw = random.Random(seed)
    ranges = {"club_speed": (5, 70), "m_club": (0.1, 0.4), "m_ball": (0.03, 0.06)}
    impact = {name: draw.uniform(*ends) for name, ends in ranges.items()}
    speed, mu = impact["club_speed"], Measurements({}, impact=impact).reduced_mass
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
    measured = {name: predicted[output] for name, output in outputs.items()}
    return impact, chosen, true, measured, draw


@pytest.mark.parametrize("seed", numbers(2, 10, 40))
def test_round_trip(fmu, seed):
    """The measurements are met; with a given exponent by the true parameters."""
    impact, law, true, measured, _ = random_case(fmu, seed)
    fitted = Fit(targets(impact, **measured), law)
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
    fitted = Fit(Measurements(noisy, impact=impact), law)
    truth = sum(((measured[name] - t.value) / t.sigma) ** 2 for name, t in noisy.items())
    # Rounding the parameters changes χ² by 1e-6 of their number.
    assert fitted.chi_squared <= truth * (1.0 + 1e-9) + 1e-4


def test_standard_error_of_an_exact_inverse():
    """b = 2 μ L/T, so its relative variance is the sum of those of L = -ln COR and T."""
    fitted = Fit(targets(cor=0.743, contact_time=6e-4), LINEAR)
    expected = fitted.values["b"] * math.hypot(0.01 / -math.log(0.743), 0.01)
    assert fitted.parameters["b"].standard_error == pytest.approx(expected, rel=1e-5)
    assert fitted.degrees_of_freedom == 0
    assert fitted.probability is None


@pytest.mark.ci
@pytest.mark.parametrize(
    ("name", "law"), [("roh-lee", FREE), ("roh-lee-linear", LINEAR), ("tour", ContactLaw(2, 1.5))]
)
def test_presets_are_what_calibrate_finds(name, law):
    tour = {"club_speed": 113 * MPH, "ball_speed": 167 * MPH, "contact_time": 475e-6}
    fitted = Fit(measurements(tour if name == "tour" else ROH_LEE), law)
    for variable, value in BALLS[name].values.items():
        digits = 4 if variable == "exponent" else 3
        assert float(f"{fitted.values[variable]:.{digits}g}") == value


def test_no_damping_is_within_reach(fmu):
    elastic = of_impact(fmu, ("contact_time", "max_force"), law=2, b=0.0, k=7e5)
    fitted = Fit(elastic, LINEAR)
    assert fitted.values["b"] == pytest.approx(0.0, abs=1e-6)
    assert fitted.values["k"] == pytest.approx(7e5, rel=3e-5)
    # A ball a little faster than an elastic one, but within its σ: b is held at 0.
    faster = targets(contact_time=6e-4, ball_speed=57.6)
    fitted = Fit(faster, LINEAR)
    assert fitted.values["b"] == pytest.approx(0.0, abs=1e-6)
    assert fitted.residuals[0] == pytest.approx(-0.27, abs=0.02)
    assert fitted.parameters["b"].standard_error is None
    assert "b = 0 is at its limit" in Calibration(faster, LINEAR).words[0]


def test_of_two_answers_the_less_damped_one(fmu):
    """Time and force of a linear ball fit a little damping, or very much."""
    wanted = of_impact(fmu, ("contact_time", "max_force"), law=2, k=9e5, b=40.0)
    assert Fit(wanted, LINEAR).values["b"] == pytest.approx(40.0, rel=1e-4)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--cor 1", "cor = 1 is refused"),
        ("--cor 0.7 --contact-time 600", "600e-6 for 600 µs"),
        ("--cor 0.7 --max-force 6.6", "6600 for 6.6 kN"),
        ("--cor 0.7 --contact-time 6e-4 --sigma-cor 0", "sigma_cor = 0"),
        ("--cor 0.7 --sigma-max-force 1", "without max_force"),
        ("--cor 0.7", "too few targets"),
        ("--ball-speed 50 --club-speed-after 24 --cor 0.74", "count once"),
        ("--cor 0.7 --contact-time 6e-4 --exponent free", "3 are needed"),
        ("", "--cor 0.743 --contact-time 600e-6"),
        ("--cor 0.7 --contact-time 6e-4 --m-club 210", "0.21 for 210 g"),
        ("--law 1 --exponent 1.5", "exponent = 1.5 is refused: law = 1"),
        ("--law 1 --exponent free", "exponent = free is refused: law = 1"),
        ("--exponent stiff", "'stiff'"),
        ("--reference-compression 0", "reference_compression = 0"),
        ("--law 3", "1 (absolute)"),
        ("--csv none.csv", "none.csv"),
    ],
)
def test_options_that_are_refused(tmp_path, options, words):
    refused(golf_here("calibrate", *options.split(), "--out", tmp_path / "out"), words)
    assert not (tmp_path / "out").exists()


def test_targets_from_a_file(tmp_path):
    file = tmp_path / "shot.csv"
    file.write_text(
        "target,value,sigma\nball-speed,50,0.5\ncor,0.74,\n\nclub_speed,36,\nm_club,0.2,\n"
    )
    data = measurements({"cor": 0.75, "sigma_cor": 0.02, "m_club": 0.21}, file)
    assert data.impact == {**IMPACT, "club_speed": 36.0, "m_club": 0.21}
    assert data.targets == {"ball_speed": Measured(50.0, 0.5), "cor": Measured(0.75, 0.02)}
    file.write_text("target,value\ncor,74 %\n")
    assert measurements({}, file).targets == {"cor": Measured(0.74, 0.0074, False)}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "first line"),
        ("name,value\ncor,0.7\n", "first line"),
        ("target,value,sigma\nspin,3000,1\n", "row 1 (line 2): there is no target 'spin'"),
        ("target,value,sigma\ncor,high,\n", "row 1 (line 2): cor = 'high'"),
        ("target,value,sigma\ncor,,\n", "row 1 (line 2): cor = ''"),
        ("target,value,sigma\ncor,0.7,\ncor,0.8,\n", "row 2 (line 3): cor is given twice"),
        ("target,value,sigma\ncor,0.7,0.1,4\n", "more cells"),
        ("target,value,sigma\nm_ball,0.046,0.1\n", "no target 'sigma_m_ball'"),
        ("target,value,value\ncor,0.7,0.8\n", "first line"),
        (f"target,value\ncor,{'0' * 131_073}\n", "field larger than field limit"),
    ],
)
def test_files_that_are_refused(tmp_path, text, words):
    file = tmp_path / "shot.csv"
    file.write_text(text)
    with pytest.raises(UserError) as refusal:
        measurements({}, file)
    assert words in str(refusal.value)


def test_the_command(tmp_path):
    """Its line, copied from a narrow terminal, gives the same result to the last digit."""
    done = golf(
        *("calibrate", "--ball-speed", 50, "--club-speed-after", 24, "--sigma-ball-speed", 0.4),
        *("--contact-time", 600e-6, "--max-force", 6600, "--exponent", "free", "--out", tmp_path),
        env={"COLUMNS": "60"},
        code=0,
    )
    written = json.loads((tmp_path / "calibrate.json").read_text())
    assert (tmp_path / "calibrate.png").stat().st_size > 0
    line = done.stdout.splitlines()[-1]
    assert line == written["command"]
    assert set(written["parameters"]) == {"k", "b", "exponent"}
    assert [row["name"] for row in written["targets"]] == list(ROH_LEE)
    assert [row["sigma_given"] for row in written["targets"]] == [True, False, False, False]
    assert written["degrees_of_freedom"] == 1
    assert len(written["comparison"]) == 4
    command, *arguments = shlex.split(line)
    assert command == "golf-impact"
    golf(*arguments, "--out", tmp_path, "--no-figures", code=0)
    (file,) = tmp_path.glob("*_results.json")
    case = json.loads(file.read_text())["custom"]["custom"]
    for name, output in TARGETS.items():
        assert case[output] == written["predicted"][name]


def test_without_scipy(tmp_path):
    """Calibrate names what to install; run doesn't need it."""
    start = (
        "import sys; sys.modules['scipy'] = None\nfrom golf_impact.commands.app import main; main()"
    )
    program = (sys.executable, "-c", start)
    calibrate = ("calibrate", "--cor", "0.7", "--contact-time", "6e-4")
    refused(golf(*calibrate, program=program), "needs SciPy", install_command("calibrate"))
    run = ("run", "validation", "--ball", "tour", "--no-figures", "--out", tmp_path)
    golf(*run, program=program, code=0)
