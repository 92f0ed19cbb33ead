"""Launch.fmu: reference cases, an independent integration, borders; refusals: refusals.toml."""

import json
import math

import integrations
import pytest
from compare import assert_close
from conftest import HERE, some
from fmus import get, is_set, put
from golf_physics.companions import launch
from golf_physics.companions.launch import Contact

CASES = json.loads((HERE / "data" / "launch.json").read_text())["cases"]
OUTPUTS = ("ball_speed", "launch_angle", "backspin", "tangential_impulse")
HEAD = ("friction", "tangential_stiffness_ratio", "m_club", "m_ball", "ball_diameter")


def contact(e):
    """Inputs after the contact of this COR with a ball at rest; it takes any smash factor."""
    inputs = {"ball_velocity": 56.0, "club_velocity": 56.0 - 40.0 * e, "smash_factor": 1.4}
    return inputs | {"coefficient_of_restitution": e}


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
    inputs = fmu.read(contact(1.0))
    slave = companion("Launch", dynamic_loft=case["spin_loft"], **{n: case[n] for n in HEAD})
    found = launched(slave, **inputs)
    found["below_normal"] = case["spin_loft"] - found["launch_angle"]
    expected = {name: case[name] for name in found if name != "launch_angle"}
    assert_close(found, expected, {"below_normal": 1.0}, 1e-10, case=case)


DRIVER = contact(CASES[0]["coefficient_of_restitution"]) | {n: CASES[0][n] for n in HEAD}
NAMED = {
    "gear effect alone": {"strike_height": 0.01, "centre_depth": 0.038, "head_inertia": 2.7e-4},
    # In the second slip what was left of the stick's deformation decays.
    "slip after stick": contact(0.8)
    | {"friction": 0.35, "tangential_stiffness_ratio": 2.5, "dynamic_loft": 0.7},
    "critical damping": contact(math.exp(-2.0)) | {"dynamic_loft": 0.32},
}
# Borders, from both sides.
for part in (-1e-9, 0.0, 1e-9):
    # Stick at touch if ratio * tan(spin loft) is at most the friction.
    at = {"friction": 0.25, "tangential_stiffness_ratio": 1.5}
    at["dynamic_loft"] = math.atan(0.25 / 1.5) * (1.0 + part)
    NAMED[f"between stick and slip at touch {part:+}"] = at
    # With less loft it sticks once more.
    at = {"friction": 0.15, "dynamic_loft": 0.62645457 * (1.0 + 1e4 * part)}
    NAMED[f"between slip throughout and stick {part:+}"] = at


@pytest.mark.parametrize("case", [*NAMED, *some(30, range(300))])
def test_against_an_integration(companion, case):
    if case in NAMED:
        values = DRIVER | {"dynamic_loft": 0.0} | NAMED[case]
    else:
        values = integrations.drawn("Launch", case)
    slave = companion("Launch", **values)
    found, impulse = launched(slave), integrations.tangential_impulse(slave)
    ball, m, diameter = (values[name] for name in ("ball_velocity", "m_ball", "ball_diameter"))
    speed, across = ball / values["smash_factor"], impulse / m
    angle = values["dynamic_loft"] - math.atan2(across, ball)
    exact = math.hypot(ball, across), angle, 5.0 * across / diameter, impulse
    scales = speed, speed / ball, 5.0 * speed / diameter, m * speed
    exact, scales = (dict(zip(OUTPUTS, values, strict=True)) for values in (exact, scales))
    # Measured: 2e-9.
    assert_close(found, exact, scales, 1e-8, case=case)


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
    "no friction": ({"friction": 0.0}, 1.0, (0.0, 0.0, 0.0)),
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
