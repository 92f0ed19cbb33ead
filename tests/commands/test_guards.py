"""Guards that ordinary inputs don't reach: rounding at an event, ranges, foreign content."""

import json
import math
import random

import components
import pytest
from components import initialized, stepped
from fmpy.fmi1 import FMICallException
from golf_physics.companions.ball_flight import BallFlight
from golf_physics.companions.launch import Launch
from golf_physics.companions.swing import Swing
from golf_physics.component.component import Component
from golf_physics.component.hybrid import HybridComponent
from golf_physics.component.state import Snapshot
from golf_physics.instance import Instance, RefusedError
from golf_physics.laws import LAWS, Law
from golf_physics.laws.closed_form import ClosedFormContact
from golf_physics.laws.extended import ExtendedContact
from golf_physics.laws.law import LinearLaw
from golf_physics.numerics import zeros
from golf_physics.values import Inputs, Motion, Parameters
from golf_physics.variables import BY_NAME, MOTION
from instances import get, put, with_checksum
from scipy.integrate import solve_ivp

from golf_build.system import COMPANIONS
from golf_impact.arrays.contacts import Contacts


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
            assert force >= 0.0
            assert compression >= 0.0
            assert club >= ball


class Vanishing(Law):
    """A spring whose force is no number above 1 MN/m."""

    name = "vanishing"
    description = "A law that leaves the range of a double"

    def __init__(self, beyond=math.inf):
        self.beyond = beyond

    def force(self, p, k, b, compression, closing):
        return k * compression if k <= 1e6 else self.beyond


@pytest.mark.parametrize("beyond", [math.inf, math.nan])
@pytest.mark.parametrize("kind", [Component, HybridComponent])
def test_a_law_without_a_number(monkeypatch, kind, beyond):
    """A change that leads there is refused and has no effect; an output is NaN."""
    monkeypatch.setitem(LAWS, 2, Vanishing(beyond))
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
    beyond = kind(messages.append)
    beyond.enter_initialization()
    components.put(beyond, law=2, k=2e6)
    for names in (["force"], MOTION):
        assert all(map(math.isnan, components.get(beyond, *names)))
    assert "must be a finite number" in messages[-1].sentence


class Both(LinearLaw):
    """A damper between the bodies and a drag on each: closed in extended precision alone."""

    name = description = "both"

    def damper(self, b):
        return b

    def drag(self, b):
        return 0.5 * b


P = Parameters(0.21, 0.04593, 0.04267, 2.0, 0.0, 2, 1.0, 0.005, 0.0, 0.0)
TOUCH = Motion(0.0, 0.0, 35.0, 2.0, 0.0, 33.0)

#: The drag keeps the bodies together for 7 half periods of an oscillation that decays slower.
LATE = Motion(0.0, -1e-3, 3.495, 6.4455, 1e-3, -2.9505)

#: So fast that not even drag beyond critical damping keeps them together.
APART = Motion(0.0, -1e-3, -60.0, 40.0, 1e-3, -100.0)


@pytest.mark.parametrize(
    ("law", "b", "start"),
    [(law, b, TOUCH) for law in (Both(), LAWS[1], LAWS[2]) for b in (0.0, 9.0, 100.0, 500.0)]
    + [(LAWS[1], 1500.0, APART)],
)
def test_a_linear_law_by_its_coefficients_alone(law, b, start):
    """Against the integration of its force and drag; measured: 5e-15."""
    linear = LinearLaw.contact(law, P, Inputs(1e6, b, 35.0, 0.0), start)
    phase = Law.contact(law, P, Inputs(1e6, b, 35.0, 0.0), start)
    while phase.extend():
        pass
    assert linear.duration == pytest.approx(phase.duration, rel=1e-12)
    assert linear.end_velocities() == pytest.approx(phase.end_velocities(), rel=1e-12)
    half = 0.5 * linear.duration
    for width in (half, 1e-12):
        expected = phase.impulse(half, width)
        assert linear.impulse(half, width) == pytest.approx(expected, rel=1e-12)


def test_a_late_end_under_drag():
    """Beside SciPy's integration; the default phase gives up there, with a true sentence."""
    linear = LinearLaw.contact(LAWS[1], P, Inputs(1e6, 300.0, 35.0, 0.0), LATE)

    def slopes(t, y):
        d, club, ball = y
        force = 1e6 * d
        return [
            club - ball, (-force - 300.0 * club) / P.m_club, (force - 300.0 * ball) / P.m_ball
        ]  # fmt: skip

    def parted(t, y):
        return y[0] if t > 0.0 else 1.0

    parted.terminal, parted.direction = True, -1.0
    start = [LATE.compression, LATE.v_club, LATE.v_ball]
    options = {"events": parted, "rtol": 1e-12, "atol": 1e-16}
    path = solve_ivp(slopes, (0.0, 1.0), start, "DOP853", **options)
    assert linear.duration == pytest.approx(path.t[-1], rel=1e-6)
    assert linear.end_velocities() == pytest.approx(tuple(path.y[1:, -1]), rel=1e-8)
    phase = Law.contact(LAWS[1], P, Inputs(1e6, 300.0, 35.0, 0.0), LATE)
    with pytest.raises(ArithmeticError, match="neither ended nor come to rest after 600 panels"):
        phase.end()


class Exponential(Vanishing):
    """Stiff: the first iterations leave the range of a double."""

    def force(self, p, k, b, compression, closing):
        return math.expm1(1e6 * compression) if compression < 7e-4 else self.beyond


def test_an_integration_that_diverges_is_refined():
    phase = Law.contact(Exponential(), P, Inputs(1e6, 0.0, 35.0, 0.0), TOUCH)
    while phase.extend():
        pass
    # Elastic: velocities by momentum and energy.
    mean = (35.0 * 0.21 + 2.0 * 0.04593) / 0.25593
    expected = [2.0 * mean - 35.0, 2.0 * mean - 2.0]
    assert phase.end_velocities() == pytest.approx(expected, rel=1e-13)
    with pytest.raises(ArithmeticError, match="must be a finite number"):
        Law.contact(Wall(), P, Inputs(1e6, 0.0, 35.0, 0.0), TOUCH)


class Wall(Vanishing):
    def force(self, p, k, b, compression, closing):
        return 1e3 if compression <= 0.0 else self.beyond


def test_newtons_method_is_given_up(monkeypatch):
    """Where it doesn't converge, extended precision takes over."""
    inputs = Inputs(1e6, 60.0, 35.0, 0.0)
    expected = LAWS[1].contact(P, inputs, TOUCH)
    monkeypatch.setattr(zeros, "_NEWTON_STEPS", range(1))
    found = LAWS[1].contact(P, inputs, TOUCH)
    assert (type(expected), type(found)) == (ClosedFormContact, ExtendedContact)
    assert found.duration == pytest.approx(expected.duration, rel=1e-14)


@pytest.mark.parametrize("size", [1e3, 1e25])
def test_bodies_that_stay_together(size):
    """Beyond the range of a decimal's exponent nothing is left of the compression."""
    names = ["compression", "force", "club_position", "impulse"]
    found = stepped({"b": 5000.0}, [(size, {})]).read(names)
    # What the club loses to its own drag is what the ball loses: the same path.
    place = 0.21 * 35.0 / 1e4
    assert list(found.values()) == pytest.approx([0.0, 0.0, place, 5e3 * place], rel=1e-14)


def test_an_integrated_contact_without_an_end():
    """A force on the head pushes both through the drag for ever: they come to rest together."""
    given = P, Inputs(1e6, 600.0, 35.0, 500.0), Motion(0.0, 0.0, 35.0, 0.0, 0.0, 35.0)
    phase, exact = Law.contact(LAWS[1], *given), LinearLaw.contact(LAWS[1], *given)
    while phase.extend():
        pass
    assert (phase.duration, exact.duration) == (math.inf, math.inf)
    dense, scale = exact.dense_output()
    for t in (1e-4, 1e-3, 7e-3, 1.0):
        assert phase.state(t) == pytest.approx(dense(scale * t), rel=1e-10)


def test_the_start_time_is_finite():
    messages = []
    component = Component(messages.append)
    component.set_up(math.nan)
    component.enter_initialization()
    component.exit_initialization()
    assert not component.step(0.0, 1e-4)
    assert messages[0].sentence == "start time = nan s is refused: it must be a finite number"


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
        (("impact", 0), lambda name: "Instance"),
    ],
)
def test_states_that_no_instance_has_are_refused(places, value):
    component = initialized(report=pytest.fail)
    component.step(0.0, 1e-4)
    components.put(component, k=2e6)
    component.step(1e-4, 1e-4)
    assert changed_state(component, *places, value=lambda old: old) is not None
    assert changed_state(component, *places, value=value) is None


def test_names_that_are_no_outputs():
    with pytest.raises(RefusedError, match="there is no output 'k': choose from force, club_pos"):
        Instance().read(["k"])


def test_hardly_any_drag():
    """Its damping ratio would underflow in a divisor."""
    found = []
    for b in (0.0, 1e-300, 5e-324):
        names = ["contact_time", "smash_factor", "max_force"]
        found.append(stepped({"b": b}, [(1.0, {})]).read(names))
    assert found[1:] == [pytest.approx(found[0], rel=1e-14)] * 2


def test_a_solver_may_try_any_state():
    """Of a power law the force leaves the range of a double: the accelerations are infinite."""
    component = initialized(HybridComponent, pytest.fail, law=2, exponent=12.0)
    component.set_time(0.0)
    component.set_states([1e60, 0.0, 35.0, 0.0])
    assert component.derivatives()[2:] == [-math.inf, math.inf]


def test_a_step_to_a_touch_that_is_refused():
    """At 35 m/s the COR would be 0.1 - 0.1015: refused if touch falls at the end of the step."""
    for size, accepted in ((0.01, False), (0.01 * (1.0 - 1e-9), True)):
        line = {"restitution_at_rest": 0.1, "restitution_slope": 0.0029}
        component = initialized(law=2, gap=0.35, **line)
        assert component.step(0.0, size) == accepted


def test_steps_that_end_with_an_event():
    """Touch is 1e-4 s after the start; a step that goes on beyond it reports none."""
    for early, size, event in ((True, 1e-3, True), (False, 1e-3, False), (True, 5e-5, False)):
        component = initialized(HybridComponent, pytest.fail, gap=0.0035)
        assert component.step(0.0, 1e-5)
        accepted, happened, end = component.step_to_event(1e-5, size, early)
        assert (accepted, happened) == (True, event)
        assert end == pytest.approx(1e-4 if event else 1e-5 + size, rel=1e-12)
    component = initialized(HybridComponent, pytest.fail, gap=0.0035)
    assert component.step(0.0, 1e-5)
    _, _, when = component.update()
    assert component.step_to_event(1e-5, when - 1e-5, False) == (True, True, when)
    # From 0 the next double after touch is enough.
    component = initialized(HybridComponent, pytest.fail, gap=0.0035)
    after = math.nextafter(0.0035 / 35.0, math.inf)
    assert component.step_to_event(0.0, 1e-3, True) == (True, True, after)


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


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("k", -1.0, "k = -1.0 N/m is refused: it must be a finite number > 0"),
        ("law", 99, f"law = 99 is refused: it must be {BY_NAME['law'].allowed}"),
    ],
)
def test_sentences_of_refusals(name, value, sentence):
    messages = []
    component = initialized(HybridComponent, messages.append, **{name: value})
    assert messages[0].sentence == sentence
    assert component.update() == (True, False, None)
    assert f"the simulation must stop: {sentence}" in messages[-1].sentence


@pytest.mark.parametrize("kind", [Component, HybridComponent])
def test_a_step_after_the_end(kind):
    """Refused, also where it is one more of equal steps."""
    messages = []
    component = initialized(kind, messages.append)
    for n in range(3):
        assert component.step(n * 0.25, 0.25)
    component.terminate()
    assert not component.step(0.75, 0.25)
    assert len(messages) == 1


def test_the_fields_of_several_refusals_are_those_of_the_first():
    messages = []
    assert not initialized(report=messages.append, k=-1.0, b=-2.0).step(0.0, 1e-4)
    refusal = messages[-1]
    assert (refusal.variable, refusal.value) == ("k", -1.0)
    assert "k = -1.0" in refusal.sentence
    assert "b = -2.0" in refusal.sentence


def test_an_event_before_initialization():
    """It is refused alone: the refused start value may still be corrected."""
    messages = []
    component = HybridComponent(messages.append)
    components.put(component, k=-1.0)
    assert component.update() == (False, False, None)
    assert messages[-1].sentence == "an event before initialization or after the end is refused"


@pytest.mark.parametrize("speed", [0.1, 35.0])
def test_a_solver_finds_no_separation_at_touch(speed):
    """There is no force either; but the bodies close, at more than half of the approach speed."""
    component = initialized(HybridComponent, pytest.fail, club_speed=speed)
    component.set_time(0.0)
    found = []
    for closing in (1.0, 0.5, 0.4, -0.9):
        component.set_states([0.0, 0.0, closing * speed, 0.0])
        found.append(component.indicators()[1] > 0.0)
    assert found == [True, True, False, False]


def test_indicators_before_touch():
    """Neither has passed zero."""
    component = initialized(HybridComponent, pytest.fail, gap=0.01)
    component.set_time(0.0)
    assert min(component.indicators()) > 0.0


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


# Companions


def test_a_club_has_at_least_the_inertia_of_its_mass_and_moment():
    made, messages = struck(Swing, club_mass=0.4, club_first_moment=0.3, club_inertia=0.2)
    made.exit_initialization()
    assert "club_inertia = 0.2 is refused" in messages[-1].sentence
    assert messages[-1].reason.endswith("it must be at least 0.225")


def test_a_step_of_a_companion_has_a_size_and_an_end():
    made, messages = struck(Launch)
    made.exit_initialization()
    for point, size in ((0.0, 0.0), (0.0, -1.0), (0.0, math.nan), (0.0, math.inf), (1e308, 1e308)):
        assert not made.step(point, size)
        assert "step size = " in messages[-1].sentence
    assert made.step(0.0, 1.0)


def test_a_ball_that_is_launched_later_lies_on_the_ground(companion):
    """Its touch time may be ahead of an importer that passes it on early."""
    flight = companion("BallFlight")
    put(flight, ball_velocity=50.0, touch_time=0.5, separated=True)
    flight.doStep(0.0, 0.1)
    assert get(flight, "distance", "height") == [0.0, 0.0]
    assert get(flight, "carry")[0] > 100.0
    flight.doStep(0.1, 0.5)
    assert get(flight, "distance")[0] > 4.0


def struck(kind, **others):
    """A companion of golf_physics in initialization, with the values of an impact; its messages."""
    rows, messages, values = COMPANIONS[kind.__name__].tables["rows"], [], STRUCK | others
    made = kind(rows, messages.append)
    made.enter_initialization()
    for row in rows:
        if row.name in values:
            made.set_values([row.reference], [values[row.name]], row.type)
    return made, messages


STRUCK = {
    "ball_velocity": 55.0, "club_velocity": 23.0, "smash_factor": 1.57,
    "coefficient_of_restitution": 0.93, "separated": True,
}  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "place", "value", "sentence"),
    [
        (Launch, "launch._PHASES", 1, "this step can't be computed: stick and slip alternate"),
        (
            BallFlight,
            "ball_flight._MOST_PANELS",
            0,
            "this step can't be computed: this ball",
        ),
        (Swing, "swing.Motion.ball", lambda *_: 1 / 0, "these parameters leave the range of a"),
        (Swing, "swing._backswing", lambda *_: 1 / 0, "this swing leaves the range of a double"),
    ],
)
def test_a_companion_without_a_solution(monkeypatch, kind, place, value, sentence):
    """No values that are allowed are known to lead there."""
    monkeypatch.setattr(f"golf_physics.companions.{place}", value)
    made, messages = struck(kind)
    made.exit_initialization()
    if made.step(0.0, 0.4):
        assert all(map(math.isnan, made.reals(list(range(21, 33)))))
    assert messages[0].sentence.startswith(sentence)


def test_an_attribute_that_no_formula_gives():
    assert not hasattr(Contacts({}, {}), "motion")


def test_a_refused_value_stays_refused_in_a_serialized_state(companion, capfd):
    first, second = companion("BallFlight"), companion("BallFlight")
    put(first, backspin=1e9)
    with pytest.raises(FMICallException):
        first.doStep(0.0, 1e-3)
    state = first.serializeFMUState(first.getFMUstate())
    second.setFMUstate(second.deserializeFMUState(state))
    with pytest.raises(FMICallException):
        second.doStep(0.0, 1e-3)
    put(second, backspin=100.0)
    second.doStep(0.0, 1e-3)
    assert capfd.readouterr().err.count("backspin = 1000000000.0") == 2


def test_an_output_of_a_companion_is_not_set(companion, capfd):
    flight = companion("BallFlight")
    put(flight, carry=5.0)
    assert get(flight, "carry") == [0.0]
    assert "carry is no Real input or parameter: it can't be set" in capfd.readouterr().err


@pytest.mark.parametrize("step", [1e-3, 3e-3, 0.02, 0.1, 0.3])
def test_after_touch_the_speed_is_that_of_the_swings_head(companion, step):
    """Also where an importer's head, which is held over each step, touches before the swing's."""
    swing, position, n, held = companion("Swing"), 0.0, 0, 0.0
    while position < 0.0 or held <= 0.0:
        held = get(swing, "club_speed")[0]
        swing.doStep(n * step, step)
        position, n = position + held * step, n + 1
    club, head = get(swing, "club_speed", "head_speed")
    assert club == pytest.approx(head, rel=1e-14)
    assert n * step == pytest.approx(0.9625, abs=step)


@pytest.mark.parametrize(("before", "touch_time"), [(0.02, 0.01), (0.005, 5.005)])
def test_the_time_of_touch_after_a_restore_to_another_time(before, touch_time):
    """A touch that has been stays when it was; one to come moves with the host's time."""
    component = initialized(gap=0.35)
    assert component.step(0.0, before)
    component.restore(component.snapshot())
    assert component.step(5.0, 0.01)
    assert components.get(component, "touch_time") == pytest.approx([touch_time], rel=1e-15)
