"""An impact is immutable: deriving another from it changes nothing and leaves no trace."""

import gc
import itertools

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
