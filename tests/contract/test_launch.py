"""Launch.fmu: reference cases, an independent integration, borders; refusals: refusals.toml."""

import json
import math

import integrations
import numpy as np
import pytest
from compare import assert_close
from conftest import HERE, some
from fmus import get, is_set, put
from golf_physics.companions import launch
from golf_physics.companions.launch import Contact

CASES = json.loads((HERE / "data" / "launch.json").read_text())["cases"]
OUTPUTS = ("ball_speed", "launch_angle", "backspin", "tangential_impulse")
TURNING = ("strike_height", "centre_depth", "head_inertia")
HEAD = ("friction", "tangential_stiffness_ratio", "m_club", "m_ball", "ball_diameter")


def contact(case):
    """Launch's inputs after the contact with a ball at rest; it takes any smash factor."""
    speed, e = case["club_speed"] * math.cos(case["spin_loft"]), case["coefficient_of_restitution"]
    return {
        "ball_velocity": 1.4 * speed,
        "club_velocity": (1.4 - e) * speed,
        "smash_factor": 1.4,
        "coefficient_of_restitution": e,
    }


def launched(slave, begin=0.0, **inputs):
    """The outputs after the step that launches the ball."""
    put(slave, **inputs, separated=True)
    slave.doStep(begin, 0.5)
    assert is_set(slave, "launched")
    return dict(zip(OUTPUTS, get(slave, *OUTPUTS), strict=True))


# Against references


@pytest.mark.parametrize("case", CASES, ids=[f"{n}{c['phases']}" for n, c in enumerate(CASES)])
def test_reference_cases_behind_the_impact(companion, fmu, case):
    """ClubBallImpact's outputs by name; the cases are good to 1e-10."""
    fmu.begin(
        {"law": 2, "exponent": case["exponent"], **{name: case[name] for name in HEAD[2:]}}
        | {"club_speed": case["club_speed"] * math.cos(case["spin_loft"])}
        | {"restitution_at_rest": case["coefficient_of_restitution"]}
    )
    fmu.step(1.0)
    inputs = fmu.read(contact(case))
    slave = companion("Launch", dynamic_loft=case["spin_loft"], **{n: case[n] for n in HEAD})
    found = launched(slave, **inputs)
    found["below_normal"] = case["spin_loft"] - found["launch_angle"]
    expected = {name: case[name] for name in found if name != "launch_angle"}
    assert_close(found, expected, {"below_normal": 1.0}, 1e-10, case=case)


def random_case(seed):
    random = np.random.default_rng(seed)
    case = {
        "m_club": random.uniform(0.15, 0.35),
        "m_ball": random.uniform(0.04, 0.05),
        "ball_diameter": 0.04267,
        "club_speed": random.uniform(10.0, 55.0),
        "spin_loft": random.uniform(-0.15, 1.1),
        "attack_angle": random.uniform(-0.15, 0.1),
        "coefficient_of_restitution": random.uniform(0.02, 0.98),
        "friction": 10.0 ** random.uniform(-2.0, 1.0),
        "tangential_stiffness_ratio": 10.0 ** random.uniform(-0.7, 0.5),
    }
    if seed % 2:
        turning = random.uniform(-0.025, 0.025), random.uniform(0.0, 0.05), 2.7e-4
        case |= dict(zip(TURNING, turning, strict=True))
    return case | ({} if seed % 5 else {"friction": 1e3})


DRIVER = CASES[0] | {"friction": 0.4}
TURNED = DRIVER | dict(zip(TURNING, (0.01, 0.038, 2.7e-4), strict=True))
NAMED = {
    "no friction": TURNED | {"friction": 0.0},
    "no loft": DRIVER | {"spin_loft": 0.0},
    "gear effect alone": TURNED | {"spin_loft": 0.0},
    "negative loft": TURNED | {"spin_loft": -0.2, "attack_angle": 0.1, "friction": 0.1},
    "slips throughout": DRIVER | {"friction": 0.01},
    # In the second slip what was left of the stick's deformation decays.
    "slip after stick": DRIVER
    | {"friction": 0.35, "tangential_stiffness_ratio": 2.5, "spin_loft": 0.7}
    | {"coefficient_of_restitution": 0.8},
    "critical damping": DRIVER | {"coefficient_of_restitution": math.exp(-2.0)},
}
# Borders, from both sides.
for part in (-1e-9, 0.0, 1e-9):
    # Stick at touch if ratio * tan(spin loft) is at most the friction.
    at = {"friction": 0.25, "tangential_stiffness_ratio": 1.5, "spin_loft": math.atan(0.25 / 1.5)}
    at["spin_loft"] *= 1.0 + part
    NAMED[f"between stick and slip at touch {part:+}"] = DRIVER | at
    # With less loft it sticks once more.
    at = {"friction": 0.15, "spin_loft": 0.62645457 * (1.0 + 1e4 * part)}
    NAMED[f"between slip throughout and stick {part:+}"] = DRIVER | at


@pytest.mark.parametrize("case", [*NAMED, *some(20, range(300))])
def test_against_an_integration(companion, case):
    given = NAMED[case] if case in NAMED else random_case(case)
    attack = given.get("attack_angle", 0.0)
    angles = {"dynamic_loft": given["spin_loft"] + attack, "attack_angle": attack}
    head = {name: given[name] for name in (*HEAD, *TURNING) if name in given}
    slave, inputs = companion("Launch", **angles, **head), contact(given)
    found, impulse = launched(slave, **inputs), integrations.tangential_impulse(slave)
    ball, speed, m = inputs["ball_velocity"], given["club_speed"], given["m_ball"]
    diameter, across = given["ball_diameter"], impulse / m
    angle = angles["dynamic_loft"] - math.atan2(across, ball)
    exact = math.hypot(ball, across), angle, 5.0 * across / diameter, impulse
    scales = speed, speed / ball, 5.0 * speed / diameter, m * speed
    exact, scales = (dict(zip(OUTPUTS, values, strict=True)) for values in (exact, scales))
    # Measured: 2e-11.
    assert_close(found, exact, scales, 1e-7, case=case)


@pytest.mark.parametrize("part", [-1e-7, -1e-9, 0.0, 1e-9, 1e-7])
def test_the_head_turns_at_the_frequency_of_the_tangential_spring(part):
    """kappa rho = 1: the closed form's difference of two oscillators is a limit there."""
    found, near = (Contact(0.2, 1e3, (1.0 + x) / 4.0, 4.0, 0.3).impulse(0.4) for x in (part, 1e-5))
    below = Contact(0.2, 1e3, (1.0 - 1e-5) / 4.0, 4.0, 0.3).impulse(0.4)
    assert found == pytest.approx(0.5 * (near + below), rel=1e-7)


#: Contacts that stick but for a thousandth or less: zeta, friction, ratio, rho and gamma; p.
GRAZING = [
    ((0.1, 0.0499057, 1.36, 5.0, -0.16), 0.03),
    ((0.1, 0.0499057, 1.36, 5.0, 0.16), -0.03),
    ((0.1, 0.061739, 1.09, 5.5, 0.271), 0.0415),
]


@pytest.mark.parametrize(("values", "sliding"), GRAZING)
def test_a_slip_between_two_instants_is_found(monkeypatch, values, sliding):
    """As by so many instants that its end is between two others; missed, it is 4e-8 of it."""
    found = Contact(*values).impulse(sliding)
    monkeypatch.setattr(launch, "_INSTANTS", 4000)
    assert found == pytest.approx(Contact(*values).impulse(sliding), rel=1e-12)


# By hand

#: Masses of 0.2 and 0.05 kg at 30 m/s without damping, where COR may exceed 1 by rounding errors;
#: with a loft of tan 1/4 or 1 the face slides by 7.5 or 30 m/s.
STRUCK = {
    "m_club": 0.2, "m_ball": 0.05, "ball_diameter": 0.04, "ball_velocity": 48.0,
    "club_velocity": 18.0, "smash_factor": 1.6, "coefficient_of_restitution": 1.0 + 4e-16,
}  # fmt: skip
LAUNCHES = {
    # ρ = 3 and κ = 1/3: half a tangential oscillation, which reverses the sliding: 2 · 7.5/75 N·s.
    "sticks": ({"friction": 1e3, "tangential_stiffness_ratio": 1.0 / 3.0}, 0.25, (0.2, 500.0, 4.0)),
    # Coulomb: 0.05 · 2.4 N·s.
    "slips": ({"friction": 0.05}, 1.0, (0.12, 300.0, 2.4)),
    # Without loft, or a club at rest, which the ball meets and which has no smash factor.
    "no loft": ({}, 0.0, (0.0, 0.0, 0.0)),
    "a club at rest": ({"smash_factor": 0.0}, 1.0, (0.0, 0.0, 0.0)),
}


@pytest.mark.parametrize(("values", "loft", "expected"), LAUNCHES.values(), ids=LAUNCHES)
def test_by_hand(companion, values, loft, expected):
    """Spin: impulse / (0.4 m r), a solid ball's. By the first contact alone."""
    impulse, spin, across = expected
    slave = companion("Launch", **STRUCK | values, dynamic_loft=math.atan(loft))
    slave.doStep(0.0, 0.5)
    assert get(slave, *OUTPUTS) == [0.0] * 4
    found = launched(slave, 0.5)
    expected = [math.hypot(48.0, across), math.atan(loft) - math.atan(across / 48.0), spin, impulse]
    assert [*found.values()] == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert launched(slave, 1.0, ball_velocity=20.0) == found
