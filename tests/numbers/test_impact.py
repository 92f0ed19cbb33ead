"""Changes of an impact leave no trace in memory; that they change no other: lockstep's states."""

import gc

import pytest
from golf_physics.component.component import Component
from golf_physics.variables import BY_NAME, VARIABLES

ALL_REALS = [row.reference for row in VARIABLES if row.type == "Real"]


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
