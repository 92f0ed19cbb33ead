"""The clock: many steps of any sizes end at the same instant as few, to the last bit of a double.

The sum of the step sizes is exact (`fractions.Fraction`); few steps have the same sum.
"""

import itertools
import random
from fractions import Fraction

import pytest
from compare import assert_close
from components import get, initialized, is_set, stepped
from golf_physics.component.hybrid import HybridComponent
from golf_physics.variables import VARIABLES

import golf_impact

MOVING = ("force", "compression", "club_velocity", "ball_velocity", "impulse")
REALS = [v for v in VARIABLES if (v.causality, v.type) == ("output", "Real")]
LAWS = {"law 1": {"law": 1}, "law 2": {"law": 2}, "n = 1.6": {"law": 2, "exponent": 1.6, "b": 30.0}}


def few(total):
    """At most three steps whose exact sum is that of many."""
    steps = []
    while total:
        step = float(total)
        # Never beyond: what is left is another step.
        steps.append(step if Fraction(step) <= total else step * (1.0 - 2.0**-52))
        total -= Fraction(steps[-1])
    return steps


def outputs(values, steps):
    instance = stepped(values, ((size, {}) for size in steps))
    assert instance.read_flag("in_contact")
    return instance.read([v.name for v in REALS])


def check(values, steps):
    ends = few(sum(map(Fraction, steps)))
    assert len(ends) <= 4
    assert sum(map(Fraction, ends)) == sum(map(Fraction, steps))
    many, once = outputs(values, steps), outputs(values, ends)
    # That of the last step alone.
    del many["mean_force"]
    # Positions: those of a ball that lies at 0 until touch.
    units = {"m/s": 35.0, "N": once["max_force"], "m": once["max_compression"]}
    scales = {v.name: units.get(v.unit) for v in REALS}
    right = {name: once[name] for name in many if name != "touch_time"}
    assert_close(many, right, scales, values=values, steps=len(steps))


@pytest.mark.parametrize("values", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("seed", range(3))
def test_after_an_approach_of_333_s_in_unequal_steps(values, seed):
    rng = random.Random(seed)
    approach = 333.0
    steps = [rng.uniform(0.2, 1.8) * approach / 500.0 for _ in range(480)]
    # Into contact, 70 µs after touch, by ten more steps, and by eight equal ones to 150 µs.
    left = float(Fraction(approach) - sum(map(Fraction, steps)))
    cuts = sorted(rng.uniform(0.0, left) for _ in range(9))
    edges = [0.0, *cuts, left + 70e-6]
    steps += [after - before for before, after in itertools.pairwise(edges)] + [1e-5] * 8
    check({**values, "gap": 35.0 * approach}, steps)


def test_after_an_approach_of_333_s_in_equal_steps():
    """The instant is the product of their number and size, of which none is a double."""
    approach, number = 333.0, 20_011
    check({"law": 2, "gap": 35.0 * approach}, [(approach + 150e-6) / number] * number)


def test_after_a_club_speed_that_changes_at_every_step():
    """The gap that is left is a sum of as many products; their order has no effect."""
    number, size, last = 10_000, 1e-6 / 3.0, 150e-6
    gap = 35.0 * 2 * number * size + 1e-3

    def run(steps):
        steps = [*steps, (40.0, 1e-3 / 40.0 + last)]
        changes = ((size, {"club_speed": speed}) for speed, size in steps)
        return stepped({"law": 2, "gap": gap}, changes).read(MOVING)

    many = run([(30.0, size), (40.0, size)] * number)
    half = few(number * Fraction(size))
    assert_close(many, run([(speed, step) for speed in (30.0, 40.0) for step in half]))


@pytest.mark.parametrize("values", LAWS.values(), ids=LAWS)
def test_a_change_in_contact_after_an_approach_of_333_s(values):
    steps = [(150e-6, {}), (100e-6, {"k": 2e6})]
    late = stepped({**values, "gap": 35.0 * 333.0}, [(333.0, {}), *steps])
    assert_close(late.read(MOVING), stepped(values, steps).read(MOVING))


@pytest.mark.parametrize("values", LAWS.values(), ids=LAWS)
def test_after_alternating_steps_in_contact(values):
    check(values, [1e-9, 1.7e-9, 0.3e-9, 1e-9] * 50_000)


@pytest.mark.parametrize("values", LAWS.values(), ids=LAWS)
def test_equal_steps_that_end_with_the_contact(values):
    """By rounding just before or after it: bodies never pull, nor leave each other too early."""
    contact = golf_impact.run_impact(("contact_time",), **values)["contact_time"]
    for number in range(2, 60):
        component, size, point = initialized(report=pytest.fail, **values), contact / number, 0.0
        for _ in range(number):
            assert component.step(point, size)
            point += size
            assert min(get(component, "force", "compression")) >= 0.0


@pytest.mark.parametrize("seed", range(200))
def test_a_step_to_the_announced_event_reaches_it(seed):
    """Touch and separation, wherever the host's clock stands: never an instant too early."""
    rng = random.Random(seed)
    ranges = {"gap": (0.0, 10.0 ** (seed % 5)), "club_speed": (5.0, 70.0), "k": (1e5, 3e6)}
    given = {name: rng.uniform(*ends) for name, ends in ranges.items()}
    component = initialized(HybridComponent, pytest.fail, **given)
    point, step = rng.choice([0.0, rng.uniform(-1e3, 1e3)]), rng.uniform(1e-5, 1e-3)
    assert component.step(point, step)
    point += step
    for flag in ("touched", "separated"):
        if not is_set(component, flag):
            _, _, when = component.update()
            assert component.step(point, when - point)
            point += when - point
        assert is_set(component, flag), (flag, point, given)
