"""An impact is immutable: deriving another from it changes nothing and leaves no trace."""

import itertools

import pytest
from golf_physics.component.component import Component
from golf_physics.component.state import plain, revived
from golf_physics.impact import Approach, Contact, Flight, Impact
from golf_physics.parameters import Parameters
from golf_physics.variables import VARIABLES

REFERENCES = {variable.name: n for n, variable in enumerate(VARIABLES)}
STATE = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity", "compression")
ALL_REALS = [n for n, variable in enumerate(VARIABLES) if variable.type == "Real"]

POWER_LAW = {"law": 2, "exponent": 1.6, "k": 8e5, "b": 30.0}
KINDS = {
    "law 1": {},
    "law 2": {"law": 2},
    "overdamped": {"law": 2, "b": 800.0},
    "power law": POWER_LAW,
    "COR line": {"law": 2, "restitution_at_rest": 0.86, "restitution_slope": 0.0029},
}
APART = {"gap": 0.01, "club_speed": 50.0, "ball_speed": -5.0}


def impact_of(values):
    values = {v.name: v.start for v in VARIABLES if v.causality in ("input", "parameter")} | values
    inputs = tuple(values.pop(name) for name in ("k", "b", "club_speed"))
    return Impact.start(Parameters(*values.values()), inputs), inputs


def put(component, values):
    for name, value in values.items():
        type_ = VARIABLES[REFERENCES[name]].type
        component.set_values([REFERENCES[name]], [value], type_)


@pytest.mark.parametrize("values", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("read", [STATE, ("force",), ("max_force", "impulse")], ids=len)
def test_reads_in_initialization_mode_leave_no_trace(values, read):
    """Also not of a contact that begins at once, when the bodies are moved apart afterwards."""
    references = [REFERENCES[name] for name in read]
    components = [Component(pytest.fail) for _ in range(2)]
    for number, component in enumerate(components):
        component.set_up(0.0)
        component.enter_initialization()
        put(component, values)
        if number:
            component.reals(references)
        put(component, APART)
    first, second = ([c.reals(references), c.reals(ALL_REALS)] for c in components)
    assert first == second
    position, speed, ball = (
        REFERENCES[n] for n in ("club_position", "club_velocity", "ball_speed")
    )
    assert components[1].reals([position, speed, ball]) == [-0.01, 50.0, -5.0]


@pytest.mark.parametrize("values", KINDS.values(), ids=KINDS)
def test_an_impact_never_changes(values):
    impact, (k, b, speed) = impact_of({**values, "gap": 0.001})
    before = plain(impact)
    touch = 0.001 / speed
    kinds = []
    for time in (0.0, 0.5 * touch, touch + 1e-5, touch + 2e-4, touch + 0.01):
        now = impact.at(time, 0.0)
        kinds.append(type(now))
        packed = plain(now)
        for inputs in itertools.product((k, 2.0 * k), (b, 0.5 * b), (speed, 40.0)):
            now.with_inputs(inputs, time, 0.0).at(touch + 0.02, 0.0).state(touch + 0.02, 0.0)
        assert plain(now) == packed
        assert plain(revived(packed)) == packed
        # The same phase is the same object: it is computed once.
        assert impact.at(time, 0.0) is now
    assert plain(impact) == before
    assert set(kinds) == {Approach, Contact, Flight}


def test_inputs_that_make_no_difference_keep_the_contact():
    impact, (k, b, _) = impact_of({})
    contact = impact.at(1e-4, 0.0)
    assert contact.with_inputs((k, b, 50.0), 1e-4, 0.0) is contact
