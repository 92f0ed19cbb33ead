"""An impact is immutable: deriving another from it changes nothing and leaves no trace."""

import gc
import itertools

import pytest
from cases import DEFAULTS, KINDS
from golf_physics import codec
from golf_physics.component.component import Component
from golf_physics.component.state import CLASSES
from golf_physics.impact import Approach, Contact, Flight, Impact, advance
from golf_physics.values import Inputs, Parameters
from golf_physics.variables import BY_NAME, VARIABLES

ALL_REALS = [row.reference for row in VARIABLES if row.type == "Real"]


def state(impact, instant):
    if impact.in_contact:
        dense, scale = impact.phase.dense_output()
        return dense(scale * impact.elapsed(instant))
    return impact.state(instant)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "never separates"])
def test_an_impact_never_changes(kind):
    values = DEFAULTS | KINDS[kind] | {"gap": 0.001}
    inputs = Inputs(*(values.pop(name) for name in Inputs._fields))
    impact = Impact.start(Parameters(**values), inputs.club_speed)
    k, b, speed, _ = inputs
    touch = 0.001 / speed
    kinds = []
    for time in (0.0, 0.5 * touch, touch + 1e-5, touch + 2e-4, touch + 0.01):
        instant = time, 0.0
        now = advance(impact, inputs, instant)
        kinds.append(type(now))
        packed = codec.packed("", now)
        for others in itertools.product((k, 2.0 * k), (0.5 * b,), (speed, 40.0), (0.0, 300.0)):
            given = Inputs(*others)
            if now.touch is None:
                changed = now.with_speed(given.club_speed, instant)
            else:
                changed = now.changed(given, instant)
            later = time + 0.02, 0.0
            advance(changed, given, later).state(later)
        assert codec.packed("", now) == packed
        again = codec.unpacked("", packed, CLASSES)
        assert codec.packed("", again) == packed
        assert state(again, instant) == state(now, instant)
    assert set(kinds) == {Approach, Contact, Flight}


def changing(steps):
    """A component whose k has been changed at every one of so many steps, in contact."""
    component = Component(pytest.fail)
    component.enter_initialization()
    component.exit_initialization()
    for n in range(steps):
        component.set_values([BY_NAME["k"].reference], [1e6 + 1e3 * (n % 7)])
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
