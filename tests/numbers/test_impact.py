"""An impact is immutable: deriving another from it changes nothing and leaves no trace."""

import gc
import itertools
import math

import pytest
from cases import KINDS as ALL_KINDS
from components import initialized, put
from golf_physics import codec
from golf_physics.component.component import Component
from golf_physics.component.state import CLASSES
from golf_physics.impact import Approach, Contact, Flight, Impact, advance
from golf_physics.laws.contact import ContactPhase
from golf_physics.values import Inputs, Parameters
from golf_physics.variables import SETTABLE, VARIABLES

ALL_REALS = [row.reference for row in VARIABLES if row.type == "Real"]

KINDS = {name: values for name, values in ALL_KINDS.items() if name != "never separates"}


def impact_of(values):
    values = {v.name: v.start for v in SETTABLE.values()} | values
    inputs = Inputs(*(values.pop(name) for name in Inputs._fields))
    return Impact.start(Parameters(*values.values()), inputs.club_speed), inputs


def state(impact, instant):
    if impact.in_contact:
        dense, scale = impact.phase.dense_output()
        return dense(scale * impact.elapsed(instant))
    return impact.state(instant)


@pytest.mark.parametrize("values", KINDS.values(), ids=KINDS)
def test_an_impact_never_changes(values):
    impact, inputs = impact_of({**values, "gap": 0.001})
    k, b, speed, _ = inputs
    touch = 0.001 / speed
    kinds = []
    for time in (0.0, 0.5 * touch, touch + 1e-5, touch + 2e-4, touch + 0.01):
        instant = time, 0.0
        now = advance(impact, inputs, instant)
        kinds.append(type(now))
        packed = codec.packed("", now)
        forces = 0.0, 300.0
        for others in itertools.product((k, 2.0 * k), (b, 0.5 * b), (speed, 40.0), forces):
            given = Inputs(*others)
            if now.touch is None:
                changed = now.with_speed(given.club_speed, instant)
            else:
                changed = now.changed(given, instant)
            later = time + 0.02, 0.0
            advance(changed, given, later).state(later)
        assert codec.packed("", now) == packed
        again = codec.unpacked("", packed, CLASSES, lambda class_, arguments: None)
        assert codec.packed("", again) == packed
        assert state(again, instant) == state(now, instant)
    assert set(kinds) == {Approach, Contact, Flight}


def changing(steps):
    """A component whose k has been changed at every one of so many steps, in contact."""
    component = initialized(report=pytest.fail)
    for n in range(steps):
        put(component, k=1e6 + 1e3 * (n % 7))
        assert component.step(n * 1e-6, 1e-6)
    return component


def test_changes_in_contact_do_not_pile_up():
    # A phase and the totals of those before it, whatever their number.
    sizes = [len(Component.packed(changing(steps).snapshot())) for steps in (20, 400)]
    assert abs(sizes[1] - sizes[0]) < 60


def test_no_cyclic_garbage():
    component = changing(300)
    component.step(300e-6, 1e-3)
    component.reals(ALL_REALS)
    gc.collect()
    gc.disable()
    try:
        start = component.snapshot()
        for _ in range(3):
            component.restore(start)
            component.step(1.3e-3, 1e-3)
            component.reals(ALL_REALS)
        del component, start
        assert gc.collect() == 0
    finally:
        gc.enable()


@pytest.mark.parametrize("b", [0.0, 9.0, 200.0])
@pytest.mark.parametrize("law", [1, 2])
def test_totals_after_a_short_time_are_those_of_any_time(law, b):
    """In closed form, also beside the maxima: there the slope is too small to decide."""
    impact, inputs = impact_of({"law": law, "b": b})
    contact = impact.following(inputs)
    peaks = [contact.phase.largest(name, 1.0)[1] for name in ("force", "d")]
    for peak in peaks:
        start = contact.changed(inputs._replace(k=1.1e6), (0.9 * peak, 0.0))
        phase = start.phase
        (_, when), deepest = phase.largest("force", 1.0), phase.largest("d", 1.0)[1]
        for center in (1e-5, when, deepest):
            for offset in (0.0, *(sign * 10.0**n for n in range(-16, -1) for sign in (1, -1))):
                t = center * (1.0 + offset)
                assert phase.totals(t) == ContactPhase.totals(phase, t)


@pytest.mark.parametrize("values", [{"law": 1}, {"law": 2, "b": 0.0}], ids=["law 1", "law 2"])
def test_a_change_while_the_compression_underflows(fmu, values):
    """Right after touch neither compression nor force is above 0, but the bodies close."""
    names = ("smash_factor", "coefficient_of_restitution", "contact_time")
    fmu.start(club_speed=1e-200, **values)
    fmu.step(0.0, 1e-130)
    assert fmu.read(["compression"]) == {"compression": 0.0}
    fmu.slave.setReal(fmu.references(["k"]), [2e6])
    fmu.step(1e-130, 1.0)
    # A linear law's don't depend on the speed.
    assert fmu.read(names) == pytest.approx(fmu.impact(names, k=2e6, **values), rel=1e-13)


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
