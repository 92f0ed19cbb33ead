"""The component: its clock, changes, laws of one's own.

Calls, restores and refusals: contract/test_lockstep.py.

Many steps of any sizes end at the same instant as few, to the last bit of a double: the sum of the
step sizes is exact (`fractions.Fraction`), and few steps have the same sum.
"""

import itertools
import math
import random
from fractions import Fraction

import pytest
from compare import assert_close
from golf_physics.laws import LAWS, Law, integrated
from golf_physics.laws.law import LinearLaw
from golf_physics.values import Inputs, Motion, Parameters
from golf_physics.variables import MOTION, VARIABLES
from ways import InProcess, marked

import golf_impact

MOVING = ("force", "compression", "club_velocity", "ball_velocity", "impulse")
LAW = {"law 1": {"law": 1}, "law 2": {"law": 2}, "n = 1.6": {"law": 2, "exponent": 1.6, "b": 30.0}}
each_law = pytest.mark.parametrize("values", LAW.values(), ids=LAW)

#: An approach, s, after which a contact begins.
LONG = 333.0


@pytest.fixture(params=marked(["in process", "native, FMI 2.0"]))
def way(request, way_of):
    """The component, in Python and in C."""
    return way_of(request.param)


# The clock


def few(total):
    """At most four steps whose exact sum is that of many."""
    steps = []
    while total:
        step = float(total)
        # Never beyond: what is left is another step.
        steps.append(step if Fraction(step) <= total else step * (1.0 - 2.0**-52))
        total -= Fraction(steps[-1])
    assert len(steps) <= 4
    return steps


def run(way, values, steps):
    """Outputs after steps (s), each with inputs set before it, or none."""
    way.begin(values)
    for step in steps:
        size, inputs = step if isinstance(step, tuple) else (step, {})
        way.set(**inputs)
        assert way.step(size)
    return way.read()


def unequal():
    """Into contact, 70 µs after touch, by ten steps, and by eight equal ones to 150 µs."""
    rng = random.Random(1)
    steps = [rng.uniform(0.2, 1.8) * LONG / 500.0 for _ in range(480)]
    left = float(Fraction(LONG) - sum(map(Fraction, steps)))
    edges = [0.0, *sorted(rng.uniform(0.0, left) for _ in range(9)), left + 70e-6]
    return [*steps, *(after - before for before, after in itertools.pairwise(edges)), *[1e-5] * 8]


#: Of the equal ones the instant is the product of their number and size, of which none is a double.
STEPS = {
    "unequal": (LONG, unequal()),
    "equal": (LONG, [(LONG + 150e-6) / 10_007] * 10_007),
    "alternating in contact": (0.0, [1e-9, 1.7e-9, 0.3e-9, 1e-9] * 5_000),
}


@each_law
@pytest.mark.parametrize("name", STEPS)
def test_many_steps_end_where_few_do(way, values, name):
    approach, steps = STEPS[name]
    values = {**values, "gap": 35.0 * approach}
    many, once = (run(way, values, s) for s in (steps, few(sum(map(Fraction, steps)))))
    assert many["in_contact"]
    # Positions: those of a ball that lies at 0 until touch.
    units = {"m/s": 35.0, "N": once["max_force"], "m": once["max_compression"]}
    # The mean force is that of the last step alone.
    right = {name: once[name] for name in once.keys() - {"touch_time", "mean_force"}}
    assert_close(many, right, {v.name: units.get(v.unit) for v in VARIABLES}, values=values)


def test_after_a_club_speed_that_changes_at_every_step(way):
    """The gap that is left is a sum of as many products; their order has no effect."""
    number, size, speeds = 5_000, 1e-6 / 3.0, ({"club_speed": 30.0}, {"club_speed": 40.0})
    values = {"law": 2, "gap": 35.0 * 2 * number * size + 1e-3}
    half, end = few(number * Fraction(size)), (1e-3 / 40.0 + 150e-6, speeds[1])
    many = run(way, values, [*[(size, speed) for speed in speeds] * number, end])
    once = run(way, values, [*((step, speed) for speed in speeds for step in half), end])
    assert_close(many, {name: once[name] for name in MOVING})


@each_law
@pytest.mark.parametrize("ball_speed", [0.0, 1000.0])
def test_a_change_in_contact_after_a_long_approach(way, values, ball_speed):
    """The difference of two positions of 1e5 m would have an error of 1e-9."""
    values = {**values, "ball_speed": ball_speed, "club_speed": ball_speed + 35.0}
    steps = [(150e-6, {}), (100e-6, {"k": 2e6})]
    late = run(way, {**values, "gap": 35.0 * LONG}, [LONG, *steps])
    early = run(way, values, steps)
    assert_close(late, {name: early[name] for name in (*MOVING, "contact_displacement")})


# Events


@each_law
def test_bodies_push_up_to_the_last_double_before_separation(way, values):
    """There the closed forms are all rounding error; also by steps that end beside it."""
    rng = random.Random(1)
    for number in range(2, 60):
        given = values | {"k": 10.0 ** rng.uniform(4, 7), "club_speed": rng.uniform(5.0, 70.0)}
        end = golf_impact.run_impact(["contact_time", "ball_velocity"], **given)
        time = end["contact_time"]
        for steps in ([time / number] * number, [time * (1.0 - 2.0**-53)], [time * (1 - 2.0**-51)]):
            way.begin(given)
            for size in steps:
                assert way.step(size)
                force, *_, v_ball, compression = way.read(MOTION).values()
                assert min(force, compression) >= 0.0
            assert v_ball == pytest.approx(end["ball_velocity"], rel=1e-12)


@pytest.mark.parametrize(("bits", "faster"), [(0, True), (1, True), (2, False)])
def test_touch_is_undecided_up_to_the_last_bit_of_the_clock(way, bits, faster):
    """Touch is at 1 s; a club speed set there still counts, as a host may have rounded."""
    steps = [1.0 + bits * 2.0**-52, (1.0, {"club_speed": 70.0})]
    now = run(way, {"gap": 35.0, "law": 2}, steps)
    once = now["smash_factor"] * 35.0
    assert now["ball_velocity"] == pytest.approx(once * (2.0 if faster else 1.0), rel=1e-13)


def test_separation_wins_over_a_change_at_the_same_instant(way):
    values = {"law": 2, "b": 0.0}
    contact = golf_impact.run_impact(("contact_time",), **values)["contact_time"]
    after = run(way, values, [contact, (1e-3, {"club_force": 5e4})])
    assert after["contact_time"] == pytest.approx(contact, rel=1e-15)
    assert after["club_velocity"] > 200.0


@pytest.mark.parametrize("seed", range(6))
def test_after_separation_results_are_constant_and_the_compression_only_falls(way, seed):
    """To 0, where it stays, whatever the inputs."""
    rng = random.Random(seed)
    values = {"law": 1 + seed % 2, "b": rng.uniform(5.0, 60.0), "club_force": 100.0}
    values |= {"law": 2, "exponent": 1.5, "club_force": 0.0} if seed % 3 == 0 else {}
    end = run(way, values, [1e-3])["contact_time"] * (1.0 + 1e-12)
    at_end = run(way, values, [end])
    results = [v.name for v in VARIABLES if v.causality == "output" and not v.momentary]
    for name in ("club_velocity", "momentum", "kinetic_energy"):  # the force goes on
        results.remove(name)
    left, crossed = math.inf, False
    for size in (*[1e-7] * 20, *[1e-5] * 20, *[2e-2] * 20):
        way.set(club_force=rng.uniform(-1e4, 2e4), k=rng.uniform(1e5, 1e7), b=rng.uniform(0, 99))
        assert way.step(size)
        now = way.read()
        assert [now[name] for name in results] == [at_end[name] for name in results]
        assert now["force"] == 0.0
        assert 0.0 <= now["compression"] <= left
        crossed |= now["club_position"] > now["ball_position"] + 1e-3
        left = now["compression"]
    assert left == 0.0
    assert crossed


def test_the_time_of_the_largest_force_never_goes_back(way):
    """Near its maximum the force is flat: a later value may be larger by rounding."""
    values = {"m_club": 1.6511082076446364, "m_ball": 0.6056538241224874, "b": 1.2e7}
    path = way.path(values | {"club_speed": 1.0}, [(6e-8, {})] * 64)
    times = [now["time_of_max_force"] for now in path]
    assert times == sorted(times)


@pytest.mark.parametrize("before", [f * 10.0**-n for n in range(4, 17) for f in (1, 3)])
def test_the_largest_force_comes_after_a_change_just_before_it(way, before):
    """Under law 1 the force doesn't jump with b: it goes on to rise, by less than rounding."""
    names = ("time_of_max_force", "max_force")
    once = run(way, {}, [1e-3])
    change = once["time_of_max_force"] * (1.0 - before)
    found = run(way, {}, [change, (1e-3, {"b": 9.0 * (1.0 + 1e-9)})])
    assert [found[n] for n in names] == pytest.approx([once[n] for n in names], rel=1e-14)


@pytest.mark.parametrize("values", [{"law": 1}, {"law": 2, "b": 0.0}], ids=["law 1", "law 2"])
def test_a_change_while_the_compression_underflows(way, values):
    """Right after touch neither compression nor force is above 0, but the bodies close."""
    found = run(way, {**values, "club_speed": 1e-29}, [1e-300, (1.0, {"k": 2e6})])
    names = ("smash_factor", "coefficient_of_restitution", "contact_time")
    # A linear law's don't depend on the speed.
    expected = golf_impact.run_impact(names, k=2e6, **values)
    assert {name: found[name] for name in names} == pytest.approx(expected, rel=1e-13)


def test_only_pieces_that_are_read_are_integrated(monkeypatch):
    pieces, panel = [], integrated.next_panel
    monkeypatch.setattr(integrated, "next_panel", lambda *a: pieces.append(1) or panel(*a))
    values = {"law": 2, "exponent": 1.6, "club_force": 100.0}
    run(InProcess(), values, [(1e-5, {"club_force": 100.0 + n}) for n in range(50)])
    # Half as many with whole contacts would be 50 times 20.
    assert len(pieces) < 400


# Laws of one's own

P = Parameters(0.21, 0.04593, 0.04267, 2.0, 0.0, 2, 1.0, 0.005, 0.0, 0.0)
TOUCH = Motion(0.0, 0.0, 35.0, 2.0, 0.0, 33.0)


class Own(Law):
    """A force as a function of k and the compression."""

    def __init__(self, force):
        self._force = force

    def force(self, p, k, b, compression, closing):
        return self._force(k, compression)


class Both(LinearLaw):
    """A damper between the bodies and a drag on each: integrated."""

    def damper(self, b):
        return b

    def drag(self, b):
        return 0.5 * b


@pytest.mark.parametrize("beyond", [math.inf, math.nan])
def test_a_law_without_a_number(monkeypatch, beyond):
    """A change that leads there is refused and has no effect; an output is NaN."""
    monkeypatch.setitem(LAWS, 2, Own(lambda k, d: k * d if k <= 1e6 else beyond))
    way, other = InProcess().begin({"law": 2}), InProcess()
    assert way.step(1e-4)
    before = way["force"]
    way.set(k=2e6)
    assert not way.step(1e-4)
    assert "k = 2000000, b = 9 are refused" in way.messages[-1]
    assert way["force"] == before
    way.set(k=1e6)
    assert way.step(1e-4)
    other.component.enter_initialization()
    other.set(law=2, k=2e6)
    for names in (["force"], MOTION):
        other.messages.clear()
        assert all(map(math.isnan, other.read(names).values()))
        (sentence,) = other.messages
        assert sentence.startswith("this impact can't be computed: the force at a compression of")


def by_integration(law, *given):
    phase = Law.contact(law, P, *given)
    while phase.extend():
        pass
    return phase


@pytest.mark.parametrize("law", [Both(), LAWS[1], LAWS[2]])
@pytest.mark.parametrize("b", [0.0, 9.0, 500.0])
def test_a_linear_law_by_its_coefficients_alone(law, b):
    """Against the integration of its force and drag; measured: 5e-15."""
    given = Inputs(1e6, b, 35.0, 0.0), TOUCH
    linear, phase = LinearLaw.contact(law, P, *given), by_integration(law, *given)
    while linear.extend():
        pass
    assert linear.duration == pytest.approx(phase.duration, rel=1e-12)
    assert linear.end_velocities() == pytest.approx(phase.end_velocities(), rel=1e-12)
    half = 0.5 * linear.duration
    for width in (half, 1e-12):
        expected = phase.impulse(half, width)
        assert linear.impulse(half, width) == pytest.approx(expected, rel=1e-12)


def test_an_integration_that_diverges_is_refined():
    # Stiff: the first iterations leave the range of a double.
    law = Own(lambda k, d: math.expm1(1e6 * d) if d < 7e-4 else math.inf)
    phase = by_integration(law, Inputs(1e6, 0.0, 35.0, 0.0), TOUCH)
    # Elastic: velocities by momentum and energy.
    mean = (35.0 * 0.21 + 2.0 * 0.04593) / 0.25593
    assert phase.end_velocities() == pytest.approx([2 * mean - 35.0, 2 * mean - 2.0], rel=1e-13)
