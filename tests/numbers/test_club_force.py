"""A force on the club head: against 80-digit arithmetic, DOP853 and Model Exchange; its borders."""

import math
import random

import fmpy
import pytest
from cases import DEFAULTS, integrated
from compare import assert_close
from components import get, initialized, put, stepped
from conftest import some
from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME, MOTION, VARIABLES

import golf_impact
from golf_impact.reference import Reference
from golf_impact.scales import Scales

M_BALL = 0.04593
OUTPUTS = [v.name for v in VARIABLES if (v.causality, v.type) == ("output", "Real")]
OUTPUTS.remove("mean_force")


def case_of(number):
    """A random impact of golf, near-critical ones among them: values, and steps with inputs."""
    rng = random.Random(number)
    k, m_club = 10.0 ** rng.uniform(5.0, 6.7), rng.uniform(0.1, 0.4)
    mu = m_club * M_BALL / (m_club + M_BALL)
    zeta = rng.choice([0.0, rng.uniform(0.0, 1.2), 1.0 + rng.uniform(-1e-6, 1e-6)])
    b, half = 2.0 * zeta * math.sqrt(k * mu), math.pi * math.sqrt(mu / k)
    forces = [100.0, -100.0, rng.uniform(-3e3, 3e3), rng.uniform(-3e4, 3e4)]
    values = {"law": 1 + number % 2, "k": k, "b": b, "m_club": m_club, "m_ball": M_BALL}
    values |= {"club_speed": rng.uniform(10.0, 60.0), "club_force": rng.choice(forces)}
    values |= {"ball_speed": rng.choice([0.0, rng.uniform(-5.0, 5.0)]), "gap": 0.0}
    changes = {"k": k, "b": b, "club_force": 2e3}
    steps = []
    for _ in range(rng.randint(0, 4)):
        chosen = [name for name in changes if rng.random() < 0.5]
        inputs = {name: changes[name] * rng.uniform(0.7, 1.4) for name in chosen}
        if "club_force" in inputs:
            inputs["club_force"] *= rng.choice([0.0, 1.0, -1.0])
        steps.append((half * rng.uniform(0.1, 0.5), inputs))
    return values, [*steps, (half * rng.choice([1.0, 2.0, 4.0]), {})]


#: Law 2 is in double precision up to a level of half the amplitude; law 1 without force.
BORDERS = {
    f"law {law}, {force:g} N": (
        {"law": law, "b": 30.0, "club_force": force},
        [(4e-4, {}), (8e-4, {})],
    )
    for law in (1, 2)
    for force in (1e-300, 1e-9, 1.0, 9e3, 1.3e4, 1.5e4, -1.2e4, -1.8e4)
}
NAMED = BORDERS | {
    # The share of a fast common motion decays before the oscillation, which leaves 1.5 N.
    "parts late": (
        {
            "law": 1,
            "m_club": 0.2,
            "m_ball": 0.1,
            "b": 10.0,
            "ball_speed": 34.999,
            "club_force": -40.0,
        },
        [(8e-4, {}), (0.1, {"club_force": 3.0})],
    ),
    "no force": ({"law": 2, "club_force": -0.0}, [(1e-4, {"k": 1.2e6}), (1e-3, {})]),
    # Touch comes after 286 µs.
    "ignored before touch": (
        {"law": 2, "gap": 0.01},
        [(1e-4, {"club_force": -5e4}), (1e-4, {"club_force": 800.0}), (1e-3, {})],
    ),
    # In flight, to its value in contact: not the same as one that has never changed.
    "returns": (
        {"law": 2, "club_force": 500.0},
        [(1e-3, {}), (1e-3, {"club_force": 0.0}), (2e-3, {"club_force": 500.0})],
    ),
    "ends in flight": ({"law": 2, "club_force": 500.0}, [(1e-3, {}), (1e-3, {"club_force": 0.0})]),
}


@pytest.mark.parametrize("case", [*NAMED, *some(24, range(400), 120)])
def test_against_80_digits(case):
    values, steps = NAMED[case] if case in NAMED else case_of(case)
    now, exact = stepped(values, steps).read(OUTPUTS), Reference(DEFAULTS | values)
    for size, inputs in steps:
        exact.step(size, **inputs)
    outputs, values = exact.outputs(), DEFAULTS | values
    approach, span = values["gap"] / values["club_speed"], sum(size for size, _ in steps)
    # Measured: 2.5e-15.
    scales = Scales(values, now, approach, span, after=now)
    assert_close(now, {name: float(outputs[name]) for name in OUTPUTS}, scales, case=case)


def test_separation_wins_over_a_change_at_the_same_instant():
    values = {"law": 2, "b": 0.0}
    contact = golf_impact.run_impact(("contact_time",), **values)["contact_time"]
    after = stepped(values, [(contact, {}), (1e-3, {"club_force": 5e4})]).read(OUTPUTS)
    assert after["contact_time"] == pytest.approx(contact, rel=1e-15)
    assert after["club_velocity"] > 200.0


@pytest.mark.parametrize("exponent", [1.2, 1.6, 2.5])
def test_power_laws_against_an_integration(exponent):
    values = {"law": 2, "exponent": exponent, "k": 8e5, "b": 30.0, "club_force": 900.0}
    expected = integrated(values)
    steps = [(1e-4, {}), (2e-4, {}), (expected["contact_time"], {})]
    now = stepped(values, steps).read(OUTPUTS)
    for name in ("ball_velocity", "contact_time", "impulse"):
        # Measured: 1e-12; the force's kink at touch limits the integration.
        assert now[name] == pytest.approx(expected[name], rel=1e-10), name


def test_only_pieces_that_are_read_are_integrated(monkeypatch):
    from golf_physics.laws import integrated

    pieces, panel = [], integrated.next_panel
    monkeypatch.setattr(integrated, "next_panel", lambda *a: pieces.append(1) or panel(*a))
    values = {"law": 2, "exponent": 1.6, "club_force": 100.0}
    stepped(values, [(1e-5, {"club_force": 100.0 + n}) for n in range(50)]).read(OUTPUTS)
    # Half as many with whole contacts would be 50 times 20.
    assert len(pieces) < 400


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_refusals(sign):
    messages = []
    component = Component(messages.append)
    assert BY_NAME["club_force"].reference == 40
    put(component, club_force=sign * math.inf)
    assert messages[-1].variable == "club_force"
    put(component, club_force=sign * 1.1e75 * 0.21)
    component.enter_initialization()
    assert not component.exit_initialization()
    assert "acceleration of the club head must stay below 1e+75" in str(messages[-1])
    put(component, club_force=sign * 0.9e75 * 0.21)
    assert component.step(0.0, 1e-3)


OUT_OF_PROPORTION = [
    {"law": 1, "b": 0.0, "club_force": 1e60},
    {"law": 2, "b": 1e-200, "club_force": 1e60},
    {"law": 2, "b": 0.0, "club_force": 300.0, "club_speed": 1e-50},
    {"law": 2, "exponent": 1.44, "b": 0.0, "club_force": 5e48},
    {"law": 2, "exponent": 1.5, "b": 0.0, "club_force": 1e10},
    {"law": 2, "exponent": 1.5, "club_force": 300.0, "club_speed": 1e-6},
    {"law": 2, "exponent": 1.5, "restitution_at_rest": 0.8, "club_force": 1e10},
]


@pytest.mark.parametrize("values", OUT_OF_PROPORTION, ids=str)
def test_a_force_out_of_proportion_is_refused_at_touch(values):
    """Before touch it is ignored; in time, and the run goes on once it is corrected."""
    messages = []
    component = initialized(Component, messages.append, gap=0.001, **values)
    approach = 0.001 / values.get("club_speed", 35.0)
    assert component.step(0.0, 0.5 * approach)
    assert not messages
    assert not component.step(0.5 * approach, approach)
    assert "club_force = " in str(messages[-1])
    part = "share m_ball/(m_club + m_ball)" if "exponent" in values else "neither keeps the bodies"
    assert part in str(messages[-1])
    put(component, club_force=0.0)
    assert component.step(0.5 * approach, approach)


def test_a_force_out_of_proportion_is_refused_in_contact():
    messages = []
    component = initialized(Component, messages.append, law=2, exponent=1.5)
    assert component.step(0.0, 1e-4)
    put(component, club_force=1e9)
    assert not component.step(1e-4, 1e-4)
    assert "club_force = 1000000000.0 N is refused: its share" in str(messages[-1])
    put(component, club_force=300.0)
    assert component.step(1e-4, 1e-4)


@pytest.mark.parametrize("seed", range(12))
def test_after_separation_the_compression_only_falls(seed):
    """To 0, where it stays, whatever the force; the largest compression is constant."""
    rng = random.Random(seed)
    values = {"law": 1 + seed % 2, "b": rng.uniform(5.0, 60.0), "club_force": 100.0}
    values |= {"law": 2, "exponent": 1.5, "club_force": 0.0} if seed % 3 == 0 else {}
    end = stepped(values, [(1e-3, {})]).read(["contact_time"])["contact_time"] * (1.0 + 1e-12)
    component = initialized(Component, pytest.fail, **values)
    component.step(0.0, end)
    time, left, most, crossed = end, math.inf, None, False
    for size in (*[1e-7] * 20, *[1e-5] * 20, *[2e-2] * 20):
        put(component, club_force=rng.uniform(-1e4, 2e4))
        assert component.step(time, size)
        time += size
        force, x_club, x_ball, *_, now = get(component, *MOTION)
        largest = get(component, "max_compression")
        assert force == 0.0
        assert 0.0 <= now <= left
        assert most in (None, largest)
        crossed |= x_club > x_ball + 1e-3
        left, most = now, largest
    assert left == 0.0
    assert crossed


def test_run_impact_ends_at_separation():
    pushed = golf_impact.run_impact(law=2, club_force=400.0)
    gained = pushed["momentum"] - 0.21 * 35.0
    assert gained == pytest.approx(400.0 * pushed["contact_time"], rel=1e-12)
    many = golf_impact.run_impacts(law=2, club_force=[0.0, 400.0])
    assert many["smash_factor"][1] == pushed["smash_factor"]


@pytest.mark.model_exchange
def test_through_the_fmus(fmu, fmi3_path):
    """FMI 2.0 and, by CVODE, Model Exchange."""
    names = ("ball_velocity", "coefficient_of_restitution", "energy_efficiency", "contact_time")
    for law in (1, 2):
        values = {"law": law, "club_force": -700.0, "gap": 0.001}
        stepwise = fmu.impact(names, **values)
        assert stepwise == golf_impact.run_impact(names, **values)
        rows = fmpy.simulate_fmu(
            str(fmi3_path), fmi_type="ModelExchange", start_values=values, output=names,
            stop_time=2e-3, output_interval=1e-4, relative_tolerance=1e-10,
        )  # fmt: skip
        last = {name: rows[name][-1] for name in names}
        assert_close(last, stepwise, tolerance=1e-6, **values)
