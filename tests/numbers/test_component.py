"""The component in this process: rounding at an event, laws of one's own, refusals, solvers."""

import json
import math
import random

import components
import pytest
from components import initialized, stepped
from fmus import with_checksum
from golf_physics.component.component import Component
from golf_physics.component.hybrid import HybridComponent
from golf_physics.component.state import Snapshot
from golf_physics.laws import LAWS, Law
from golf_physics.laws.law import LinearLaw
from golf_physics.values import Inputs, Motion, Parameters
from golf_physics.variables import MOTION


def test_bodies_push_up_to_the_last_double_before_separation():
    """There the closed forms are all rounding error: some 1 of 500 below 0."""
    rng = random.Random(1)
    for _ in range(1500):
        law = rng.choice([1, 2])
        values = {"law": law, "k": 10.0 ** rng.uniform(4, 7), "club_speed": rng.uniform(5, 70)}
        time = stepped(values, [(1.0, {})]).read(["contact_time"])["contact_time"]
        for last in (2.0**-53, 2.0**-51):
            early = stepped(values, [(time * (1.0 - last), {})])
            force, club, ball, *_, compression = early.read(MOTION).values()
            assert min(force, compression, club - ball) >= 0.0


# Laws of one's own

P = Parameters(0.21, 0.04593, 0.04267, 2.0, 0.0, 2, 1.0, 0.005, 0.0, 0.0)
TOUCH = Motion(0.0, 0.0, 35.0, 2.0, 0.0, 33.0)


class Spring(Law):
    """A spring whose force is another function beyond some border."""

    name = description = "spring"

    def __init__(self, beyond):
        self.beyond = beyond

    def force(self, p, k, b, compression, closing):
        return k * compression if k <= 1e6 else self.beyond


class Exponential(Spring):
    """Stiff: the first iterations leave the range of a double."""

    def force(self, p, k, b, compression, closing):
        return math.expm1(1e6 * compression) if compression < 7e-4 else self.beyond


class Both(LinearLaw):
    """A damper between the bodies and a drag on each: closed in extended precision alone."""

    name = description = "both"

    def damper(self, b):
        return b

    def drag(self, b):
        return 0.5 * b


@pytest.mark.parametrize("beyond", [math.inf, math.nan])
@pytest.mark.parametrize("kind", [Component, HybridComponent])
def test_a_law_without_a_number(monkeypatch, kind, beyond):
    """A change that leads there is refused and has no effect; an output is NaN."""
    monkeypatch.setitem(LAWS, 2, Spring(beyond))
    messages = []
    component = initialized(kind, messages.append, law=2)
    assert component.step(0.0, 1e-4)
    before = components.get(component, "force")
    components.put(component, k=2e6)
    if kind is HybridComponent:
        assert component.update() == (False, False, None)
    assert not component.step(1e-4, 1e-4)
    assert "k = 2000000.0, b = 9.0 are refused" in messages[-1].sentence
    assert components.get(component, "force") == before
    components.put(component, k=1e6)
    assert component.step(1e-4, 1e-4)
    other = kind(messages.append)
    other.enter_initialization()
    components.put(other, law=2, k=2e6)
    for names in (["force"], MOTION):
        assert all(map(math.isnan, components.get(other, *names)))
    assert "must be a finite number" in messages[-1].sentence


def integrated(law, *given):
    phase = Law.contact(law, P, *given)
    while phase.extend():
        pass
    return phase


@pytest.mark.parametrize("law", [Both(), LAWS[1], LAWS[2]])
@pytest.mark.parametrize("b", [0.0, 9.0, 100.0, 500.0])
def test_a_linear_law_by_its_coefficients_alone(law, b):
    """Against the integration of its force and drag; measured: 5e-15."""
    given = Inputs(1e6, b, 35.0, 0.0), TOUCH
    linear, phase = LinearLaw.contact(law, P, *given), integrated(law, *given)
    assert linear.duration == pytest.approx(phase.duration, rel=1e-12)
    assert linear.end_velocities() == pytest.approx(phase.end_velocities(), rel=1e-12)
    half = 0.5 * linear.duration
    for width in (half, 1e-12):
        expected = phase.impulse(half, width)
        assert linear.impulse(half, width) == pytest.approx(expected, rel=1e-12)


def test_an_integration_that_diverges_is_refined():
    phase = integrated(Exponential(math.inf), Inputs(1e6, 0.0, 35.0, 0.0), TOUCH)
    # Elastic: velocities by momentum and energy.
    mean = (35.0 * 0.21 + 2.0 * 0.04593) / 0.25593
    assert phase.end_velocities() == pytest.approx([2 * mean - 35.0, 2 * mean - 2.0], rel=1e-13)


# Values at the ends of their ranges, and steps that end at an event


@pytest.mark.parametrize("size", [1e3, 1e25])
def test_bodies_that_stay_together(size):
    """Beyond the range of a decimal's exponent nothing is left of the compression."""
    names = ["compression", "force", "club_position", "impulse"]
    found = stepped({"b": 5000.0}, [(size, {})]).read(names)
    # What the club loses to its own drag is what the ball loses: the same path.
    place = 0.21 * 35.0 / 1e4
    assert list(found.values()) == pytest.approx([0.0, 0.0, place, 5e3 * place], rel=1e-14)


def test_hardly_any_drag():
    """Its damping ratio would underflow in a divisor."""
    names = ["contact_time", "smash_factor", "max_force"]
    none, *hardly = (stepped({"b": b}, [(1.0, {})]).read(names) for b in (0.0, 1e-300, 5e-324))
    assert hardly == [pytest.approx(none, rel=1e-14)] * 2


def test_the_mean_force_of_a_short_step_of_an_integrated_contact():
    """The difference of two impulses would have no digits left."""
    instance = stepped({"law": 2, "exponent": 1.5, "club_force": 500.0}, [(2e-4, {})])
    before = instance.read(["force"])["force"]
    instance.step(2e-4, 1e-10)
    now = instance.read(["force", "mean_force"])
    assert now["mean_force"] == pytest.approx(0.5 * (before + now["force"]), rel=1e-12)
    assert before < now["force"]


@pytest.mark.parametrize(("bits", "faster"), [(0, True), (1, True), (2, False)])
def test_touch_is_undecided_up_to_the_last_bit_of_the_clock(bits, faster):
    """Touch is at 1 s; a club speed set there still counts, as a host may have rounded."""
    steps = [(1.0 + bits * 2.0**-52, {}), (1.0, {"club_speed": 70.0})]
    now = stepped({"gap": 35.0, "law": 2}, steps).read(["ball_velocity", "smash_factor"])
    once = now["smash_factor"] * 35.0
    assert now["ball_velocity"] == pytest.approx(once * (2.0 if faster else 1.0), rel=1e-13)


def test_a_step_to_a_touch_that_is_refused():
    """At 35 m/s the COR would be 0.1 - 0.1015: refused if touch falls at the end of the step."""
    for size, accepted in ((0.01, False), (0.01 * (1.0 - 1e-9), True)):
        line = {"restitution_at_rest": 0.1, "restitution_slope": 0.0029}
        component = initialized(law=2, gap=0.35, **line)
        assert component.step(0.0, size) == accepted


@pytest.mark.parametrize(("before", "touch_time"), [(0.02, 0.01), (0.005, 5.005)])
def test_the_time_of_touch_after_a_restore_to_another_time(before, touch_time):
    """A touch that has been stays when it was; one to come moves with the host's time."""
    component = initialized(gap=0.35)
    assert component.step(0.0, before)
    component.restore(component.snapshot())
    assert component.step(5.0, 0.01)
    assert components.get(component, "touch_time") == pytest.approx([touch_time], rel=1e-15)


def test_the_start_time_is_finite():
    messages = []
    component = Component(messages.append)
    component.set_up(math.nan)
    component.enter_initialization()
    component.exit_initialization()
    assert not component.step(0.0, 1e-4)
    assert messages[0].sentence == "start time = nan s is refused: it must be a finite number"


@pytest.mark.parametrize("kind", [Component, HybridComponent])
def test_it_is_set_before_initialization(kind):
    messages = []
    component = kind(messages.append)
    component.enter_initialization()
    component.set_up(1.0)
    component.exit_initialization()
    assert messages[0].sentence == "set-up after initialization has begun is refused"
    assert components.get(component, "touch_time") == [0.0]
    # An illegal call costs one step.
    assert not component.step(0.0, 1e-4)
    assert component.step(0.0, 1e-4)


# States


def changed_state(component, name, *places, value):
    """A serialized state with another value at a place, and the right checksum."""
    content = json.loads(Component.packed(component.snapshot()))[:-1]
    places = (1 + Snapshot._fields.index(name), *places)
    inner = content[1]
    for place in places[:-1]:
        inner = inner[place]
    inner[places[-1]] = value(inner[places[-1]])
    return Component.unpacked(with_checksum(json.dumps(content).encode()[:-1]))


@pytest.mark.parametrize(
    ("places", "value"),
    [
        (("values", 0), lambda k: -1.0),
        (("values",), lambda values: values[1:]),
        (("mode",), lambda mode: 7),
        (("steps",), lambda steps: -1.0),
        (("size",), lambda size: -1e-4),
        (("begin", 0), lambda high: 1e200),
        (("inputs", 1), lambda k: -1.0),
        (("inputs",), lambda inputs: None),
        (("impact",), lambda impact: None),
        (("impact", 1, 2), lambda m_ball: 1e300),
        (("impact", 2, 1), lambda k: 0.0),
        (("impact", 5, 5), lambda compression: -compression),
        (("impact", 0), lambda name: "Approach"),
    ],
)
def test_states_that_no_instance_has_are_refused(places, value):
    component = initialized(report=pytest.fail)
    component.step(0.0, 1e-4)
    components.put(component, k=2e6)
    component.step(1e-4, 1e-4)
    assert changed_state(component, *places, value=lambda old: old) is not None
    assert changed_state(component, *places, value=value) is None


# Events


def test_a_solver_finds_no_separation_at_touch():
    """There is no force either; but the bodies close, at more than half of the approach speed."""
    component = initialized(HybridComponent, pytest.fail)
    component.set_time(0.0)
    found = []
    for closing in (1.0, 0.5, 0.4, -0.9):
        component.set_states([0.0, 0.0, closing * 35.0, 0.0])
        found.append(component.indicators()[1] > 0.0)
    assert found == [True, True, False, False]


@pytest.mark.parametrize(("compression", "in_contact"), [(1e-4, True), (0.0, False)])
def test_an_event_near_separation(compression, in_contact):
    """An event of another kind doesn't end a contact that still has a force, however small."""
    component = initialized(HybridComponent, pytest.fail, law=2, b=0.0)
    component.set_time(0.0)
    component.update()
    component.set_time(5e-4)
    component.set_states([0.01 + compression, 0.01, 20.0, 50.0])
    component.update()
    assert components.is_set(component, "in_contact") == in_contact


def test_a_solver_may_try_any_state():
    """Of a power law the force leaves the range of a double: the accelerations are infinite."""
    component = initialized(HybridComponent, pytest.fail, law=2, exponent=12.0)
    component.set_time(0.0)
    component.set_states([1e60, 0.0, 35.0, 0.0])
    assert component.derivatives()[2:] == [-math.inf, math.inf]
