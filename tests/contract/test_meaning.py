"""What numbers mean: units by dimension, the level of intervals, digits of a source."""

import math
from importlib.resources import files as files_of

import fmpy
import numpy as np
import pytest
from cases import DEFAULTS
from compare import assert_close
from components import stepped
from fmus import get, put
from golf_physics.companions.double_pendulum import HELD, RELEASED, Golfer, Motion, State
from golf_physics.variables import MORE_UNITS, VARIABLES

from golf_build import BY_NAME, UNITS
from golf_impact.ball import BALLS
from golf_impact.calibration.fit import Fit
from golf_impact.calibration.measurements import measurements
from golf_impact.calibration.model import ContactLaw
from golf_impact.files import read_toml

OUTPUTS = [v.name for v in VARIABLES if (v.causality, v.type) == ("output", "Real")]


def dimension(*factors):
    """Of a product of variables, by exponents: (name, 1) or (name, -1)."""
    base, units = {}, UNITS | MORE_UNITS
    for name, power in factors:
        for unit, exponent in units[BY_NAME[name].unit].base.items():
            base[unit] = base.get(unit, 0) + power * exponent
    return {unit: exponent for unit, exponent in base.items() if exponent}


@pytest.mark.parametrize(
    ("name", "factors"),
    [
        ("impulse", [("force", 1), ("contact_time", 1)]),
        ("momentum", [("m_club", 1), ("club_velocity", 1)]),
        ("kinetic_energy", [("force", 1), ("compression", 1)]),
        ("k", [("force", 1), ("compression", -1)]),
        ("b", [("force", 1), ("club_velocity", -1)]),
        ("club_speed", [("gap", 1), ("contact_time", -1)]),
        ("club_force", [("k", 1), ("gap", 1)]),
        ("club_acceleration", [("force", 1), ("m_club", -1)]),
        ("mean_force", [("impulse", 1), ("contact_time", -1)]),
        ("smash_factor", [("ball_velocity", 1), ("club_speed", -1)]),
        ("restitution_slope", [("club_speed", -1)]),
        ("reference_compression", [("compression", 1)]),
    ],
)
def test_units_by_dimension(name, factors):
    assert dimension((name, 1)) == dimension(*factors)


#: Of each kind; the last two are in extended precision.
ANY = (
    {"law": 1}, {"law": 2, "club_force": 300.0}, {"law": 2, "exponent": 1.6, "gap": 0.001},
    {"law": 2, "restitution_at_rest": 0.86, "restitution_slope": 0.0029},
    *({"law": n, "k": 8e3, "b": 1540.0, "club_speed": 276.0, "club_force": -1.1e5} for n in (1, 2)),
)  # fmt: skip


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("values", ANY)
def test_results_do_not_depend_on_the_base_units(values, sign):
    def run(steps, **units):
        def size(name):
            return math.prod(units[unit] ** n for unit, n in dimension((name, 1)).items())

        given = {name: value for name, value in (DEFAULTS | values).items() if name != "law"}
        given = {name: size(name) * value for name, value in given.items()} | {"law": values["law"]}
        instance = stepped(given, [(2e-4 * size("contact_time"), {})] * steps)
        return {name: value / size(name) for name, value in instance.read(OUTPUTS).items()}

    for steps in (1, 2, 10):
        found = run(steps, kg=10.0 ** (9 * sign), m=10.0 ** (-5 * sign), s=10.0 ** (4 * sign))
        exact, scales = run(steps, kg=1.0, m=1.0, s=1.0), {"coefficient_of_restitution": 1.0}
        assert_close(found, exact, scales, values=values, steps=steps)


def test_95_percent_of_intervals_contain_the_truth():
    """Lines of COR through four points: Student's t with two degrees of freedom.

    Of 600 intervals 95 % hold with a standard deviation of 0.9 %; with the 90 % quantile 90 %.
    """
    speeds, true, held = np.array([20.0, 30.0, 40.0, 50.0]), (0.86, 0.0029), []
    for seed in range(300):
        noise = np.random.default_rng(seed).normal(0.0, 2e-3, 4)
        cors = true[0] - true[1] * speeds + noise
        found = Fit(measurements({}, cor_speeds=(speeds, cors)), ContactLaw(2, 1.0))
        for estimate, value in zip(found.parameters.values(), true, strict=True):
            held.append(abs(estimate.value - value) <= found.coverage * estimate.standard_error)
    assert 0.925 < np.mean(held) < 0.975, f"{np.mean(held):.3f} of {len(held)} intervals"


# Numbers that a calculation by hand gives, of round ones: masses of 0.2 and 0.05 kg (μ = 0.04 kg),
# k = 1 MN/m (ω = √(k/μ) = 5000/s), 30 m/s.


BY_HAND = {
    # Half an oscillation.
    "undamped": (
        {"law": 2, "b": 0.0, "gap": 0.003},
        {
            "smash_factor": 1.6, "coefficient_of_restitution": 1.0, "energy_efficiency": 1.0,
            "club_velocity": 18.0, "ball_velocity": 48.0, "impulse": 2.4, "momentum": 6.0,
            "kinetic_energy": 90.0, "max_force": 6000.0, "max_compression": 6e-3,
            "touch_time": 1e-4, "contact_time": math.pi / 5e3, "time_of_max_force": math.pi / 1e4,
            "contact_displacement": 24.0 * math.pi / 5e3,
        },
    ),
    # Damping ratio 1/2: COR = exp(-2π/(3√3)); Schwager & Pöschel, Granular Matter 9 (2007) 465.
    "damped": (
        {"law": 2, "b": 200.0},
        {
            "smash_factor": 1.0387488473538199, "coefficient_of_restitution": 0.29843605919227489,
            "energy_efficiency": 0.817812816285243, "impulse": 1.5581232710307299,
            "contact_time": 4.8367983046245809e-4, "contact_displacement": 0.010175822846976075,
            "max_force": 6000.0, "time_of_max_force": 0.0,
        },
    ),
    # Hertz: d = (5 μ u²/(4 K))^(2/5), T = 2.94327518432470464 d/u, K = k/√(5 mm); Landau and
    # Lifshitz, Theory of Elasticity, § 9.
    "Hertz": (
        {"law": 2, "exponent": 1.5, "b": 0.0},
        {
            "smash_factor": 1.6, "max_compression": 6.3252690951412494e-3,
            "contact_time": 6.2056691873017396e-4, "max_force": 7114.3218293379352,
        },
    ),
}  # fmt: skip


@pytest.mark.parametrize(("values", "expected"), BY_HAND.values(), ids=BY_HAND)
def test_readouts_by_hand(fmu, values, expected):
    found = fmu.impact(tuple(expected), m_club=0.2, m_ball=0.05, club_speed=30.0, **values)
    assert found == pytest.approx(expected, rel=1e-13, abs=1e-18)


#: The same impact with a loft of tan 1/4 or 1: the face slides by 7.5 or 30 m/s.
STRUCK = {
    "ball_velocity": 48.0, "club_velocity": 18.0, "smash_factor": 1.6,
    "coefficient_of_restitution": 1.0,
}  # fmt: skip
LAUNCHES = {
    # ρ = 3 and κ = 1/3: half a tangential oscillation, which reverses the sliding: 2 · 7.5/75 N·s.
    "sticks": ({"friction": 1e9, "tangential_stiffness_ratio": 1.0 / 3.0}, 0.25, (0.2, 500.0, 4.0)),
    # Coulomb: 0.05 · 2.4 N·s.
    "slips": ({"friction": 0.05}, 1.0, (0.12, 300.0, 2.4)),
}


@pytest.mark.parametrize(("values", "loft", "expected"), LAUNCHES.values(), ids=LAUNCHES)
def test_a_launch_by_hand(companion, values, loft, expected):
    """Spin: impulse / (0.4 m r), a solid ball's."""
    ball = {"m_club": 0.2, "m_ball": 0.05, "ball_diameter": 0.04, "dynamic_loft": math.atan(loft)}
    launch = companion("Launch", **ball, **values)
    put(launch, **STRUCK, separated=True)
    launch.doStep(0.0, 1e-3)
    names = "tangential_impulse", "backspin", "ball_speed", "launch_angle"
    impulse, spin, across = expected
    angle = math.atan(loft) - math.atan(across / 48.0)
    expected = [impulse, spin, math.hypot(48.0, across), angle]
    assert get(launch, *names) == pytest.approx(expected, rel=1e-12)


def test_a_flight_by_hand(companion):
    """In a vacuum: v² sin 2θ / g, v² sin² θ / (2 g), 2 v sin θ / g."""
    launch = {"ball_velocity": 50.0, "launch_angle": math.radians(30.0), "backspin": 300.0}
    flight = companion("BallFlight", air_density=0.0, gravity=10.0)
    put(flight, **launch, separated=True)
    flight.doStep(0.0, 1.25)
    names = "carry", "apex", "flight_time", "land_angle", "distance", "height"
    root = 0.75**0.5
    expected = [250.0 * root, 31.25, 5.0, math.radians(30.0), 62.5 * root, 23.4375]
    assert get(flight, *names) == pytest.approx(expected, rel=1e-14)


def test_a_swing_by_hand(companion):
    """A rigid pendulum that falls by 90°: ω² = 2 · 0.95 kg·m · g / 0.875 kg·m² = 16/s².

    The club is a point of 0.3 kg, at 1.5 m from the shoulder.
    """
    swing = companion(
        "Swing", arm_length=0.5, arm_first_moment=0.5, arm_inertia=0.2, club_length=1.0,
        club_mass=0.3, club_first_moment=0.3, club_inertia=0.3, max_shoulder_torque=0.0,
        max_wrist_torque=0.0, arm_start=math.pi / 2, wrist_start=0.0, release_angle=0.0,
        gravity=14.0 / 1.9, plane_angle=math.pi / 2,
    )  # fmt: skip
    n = 0
    while get(swing, "club_speed")[0] <= 0.0:
        swing.doStep(n * 1e-3, 1e-3)
        n += 1
    names = "club_speed", "effective_mass", "energy"
    assert get(swing, *names) == pytest.approx([6.0, 0.3, 7.0], rel=1e-12)


@pytest.mark.parametrize("stage", [HELD, RELEASED])
def test_force_and_torque_of_the_hands_by_newton(stage):
    """Momentum of the club, and its angular momentum about its centre of mass, by differences."""
    rows = read_toml(files_of("golf_physics.companions") / "swing.toml")["parameter"]
    golfer = Golfer(**{name: rows[name][2] for name in Golfer._fields})
    golfer = golfer._replace(release_angle=1.0, max_wrist_torque=5.0)
    start, force, direction = State(-2.0, -3.0, 5.0, 5.0, 60.0, 3.0, 0.0), 800.0, 0.5
    motion = Motion(golfer, 0.0, start, stage, force, direction)
    mass, first, length = golfer.club_mass, golfer.club_first_moment, golfer.club_length

    def momentum(t):
        p, q, u, w, *_ = motion.at(t)[0]
        r = mass * golfer.arm_length
        velocity = (u * r * math.cos(p), u * r * math.sin(p))
        return np.array([first * w * math.cos(q), first * w * math.sin(q)]) + velocity, w

    t, step = 0.03, 1e-6
    state, stage_then = motion.at(t)
    assert stage_then == stage
    (after, w_after), (before, w_before) = momentum(t + step), momentum(t - step)
    push = force * np.array([math.cos(direction), math.sin(direction)])
    hands = (after - before) / (2.0 * step) + push + (0.0, mass * golfer.gravity)
    found, torque = motion.hands(t, state)
    assert found == pytest.approx(math.hypot(*hands), rel=1e-8)
    club, centre = np.array([math.sin(state.club), -math.cos(state.club)]), first / mass
    spin = (golfer.club_inertia - first * centre) * (w_after - w_before) / (2.0 * step)

    def moment(lever, force):
        return lever * (club[0] * force[1] - club[1] * force[0])

    expected = spin - moment(-centre, hands) - moment(length - centre, -push)
    assert torque == pytest.approx(expected, rel=1e-6)


# Conversions and digits


def test_display_units_of_the_fmus(fmu_path, files):
    """All of them; how many of the unit are an SI unit (one mile: 1609.344 m)."""
    expected = {
        "mm": 1e3, "g": 1e3, "ms": 1e3, "us": 1e6, "mph": 3600 / 1609.344, "km/h": 3.6, "kN": 1e-3,
        "kN/m": 1e-3, "N/mm": 1e-3, "%": 100.0, "deg": 180.0 / math.pi, "rpm": 30.0 / math.pi,
    }  # fmt: skip
    for file in (fmu_path, *files[:-1]):
        for unit in fmpy.read_model_description(str(file)).unitDefinitions:
            for one in unit.displayUnits or ():
                assert one.factor == pytest.approx(expected[one.name], rel=1e-15), one.name


def test_balls_have_the_digits_of_their_source():
    """The document; Penner's COR 0.86 - 0.0029 v; the rules' 1.620 oz and 1.680 in at most."""
    assert (BALLS["document"].values["k"], BALLS["document"].values["b"]) == (1e6, 9.0)
    assert (BALLS["document-old"].values["k"], BALLS["document-old"].values["b"]) == (0.5e6, 12.0)
    for name in ("penner", "rating-low", "rating-mid", "rating-high"):
        line = [BALLS[name].values[n] for n in ("restitution_at_rest", "restitution_slope")]
        assert line == [0.86, 0.0029]
    assert BY_NAME["m_ball"].start == round(1.620 * 0.028349523125, 5)
    assert BY_NAME["ball_diameter"].start == round(1.680 * 0.0254, 5)


def test_coefficients_of_flight_have_the_digits_of_their_source():
    """Ferguson, McNally & McPhee, ISEA 2022, doi:10.5703/1288284317493."""
    printed = {
        "drag_constant": 0.1304, "drag_spin": 0.9287, "drag_spin_squared": -0.8259,
        "drag_reynolds": 0.0, "lift_constant": 0.0504, "lift_spin": 1.2031,
        "lift_spin_squared": -1.1490, "lift_reynolds": 0.0, "spin_ratio_limit": 0.75,
    }  # fmt: skip
    rows = read_toml(files_of("golf_physics.companions") / "ball_flight.toml")["parameter"]
    assert {name: rows[name][2] for name in printed} == printed
