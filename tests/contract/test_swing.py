"""Swing.fmu: an independent integration, a published swing, and touch whatever the steps."""

import math

import integrations
import numpy as np
import pytest
from conftest import some
from fmpy.fmi1 import FMICallException
from fmus import get, put

BACKSWING = 0.75

#: Of the head with the start values.
AT_THE_BALL, AT = 52.763071110699870, 0.9624838642630617

MOTION = ("arm_angle", "club_angle", "head_speed")


def swung(swing, until, step=1e-3, begin=0.0):
    """Steps as far as `until`; returns where the last one ended."""
    count = round((until - begin) / step)
    for n in range(count):
        swing.doStep(begin + n * step, step)
    return begin + count * step


@pytest.mark.parametrize("seed", some(8, range(100)))
def test_against_an_integration(companion, seed):
    """From before the top to the end, by any steps, with a force on the head; measured: 4e-9.

    While the golfer holds the club an impulse has no effect.
    """
    values, random = integrations.drawn("Swing", seed), np.random.default_rng([seed, 1])
    swing, top = companion("Swing", **values), values["backswing_time"]
    begin, force = random.uniform(-0.05, 0.3), random.choice([0.0, 100.0, -100.0])
    end, sizes = random.uniform(0.4, 1.2), random.choice([5e-3, 7e-3, 2e-2], 500).tolist()
    fresh = swing.getFMUstate()
    held, touch, longest = until_touch(swing, sizes)
    swing.setFMUstate(fresh)
    swing.freeFMUstate(fresh)
    time, instants, found, since = 0.0, [], [], math.inf
    for size in sizes:
        if time - top >= begin:
            since = since if time < top else min(since, time - top)
            put(swing, impulse=get(swing, "reaction_impulse")[0] + force * size)
        swing.doStep(time, size)
        time += size
        instants.append(time - top)
        found.append(get(swing, *MOTION))
        if instants[-1] > end:
            break
    _, (at, speed, path, mass) = integrations.swing(swing, instants)
    normal = path + values["spin_loft"]
    expected, _ = integrations.swing(swing, instants, since, force, normal)
    assert np.array(found) == pytest.approx(expected, rel=1e-7, abs=1e-7)
    along = math.cos(values["spin_loft"])
    expected = [mass, expected[-1, 2] * along]
    assert get(swing, "effective_mass", "club_speed") == pytest.approx(expected, rel=1e-7, abs=1e-7)
    assert held[-1] == pytest.approx(speed * along, rel=1e-8)
    assert -0.5 <= (touch - top - at) / longest <= 2.1


def test_the_head_meets_the_ball_as_in_the_source(companion):
    """C.-C. Chiang, The Simple Golf Simulator (2016), case 1 by its solution 4: its digits."""
    swung(swing := companion("Swing"), AT, step=1e-4)
    found = AT_THE_BALL, AT - BACKSWING, *get(swing, "effective_mass")
    printed = (52.76, 0.005), (0.2125, 5e-5), (0.2030, 5e-5)
    assert found == tuple(pytest.approx(value, abs=half) for value, half in printed)


# Touch by a host that holds the speed over each step, of any length


def until_touch(swing, steps):
    """By an importer's head that starts at the ball, as ClubBallImpact's with a gap of 0.

    Returns the speeds that have been held, the last one at touch; when it touches, s; the longest
    step, s.
    """
    held, position, time, longest = get(swing, "club_speed"), 0.0, 0.0, 0.0
    for size in steps:
        if held[-1] > 0.0 and position + held[-1] * size >= 0.0:
            break
        position += held[-1] * size
        swing.doStep(time, size)
        time, longest = time + size, max(longest, size)
        held += get(swing, "club_speed")
    assert position < 0.0 < held[-1]
    return held, time - position / held[-1], longest


def sequence(seed):
    """Communication step sizes: mixed, in runs, spread over decades, uniform, and all the same."""
    random = np.random.default_rng(seed)
    sizes = [1e-3, 3e-4, 1e-4]
    return (
        random.choice(sizes, 6000),
        np.repeat(random.choice(sizes, 500), random.integers(1, 60, 500)),
        10.0 ** random.uniform(-5.0, -0.5, 4000),
        random.uniform(1e-5, 2e-3, 6000),
        np.full(10_000, random.choice([1e-4, 7e-4, 9.99e-3, 0.1, 0.3, 0.48])),
    )[seed % 5]


@pytest.mark.parametrize("part", some(1, range(20)))
def test_no_sequence_of_steps_touches_the_ball_with_another_speed(companion, part):
    swing, errors = companion("Swing"), []
    fresh = swing.getFMUstate()
    for seed in range(20 * part, 20 * (part + 1)):
        swing.setFMUstate(fresh)
        held, touch, longest = until_touch(swing, sequence(seed).tolist())
        assert held[-1] == pytest.approx(AT_THE_BALL, rel=1e-9)
        assert all(speed <= 0.0 or speed == held[-1] for speed in held)
        errors.append((touch - AT) / longest)
        assert seed % 5 < 4 or touch == pytest.approx(AT, abs=1e-10)
    swing.freeFMUstate(fresh)
    # The bounds aren't wide: such errors do occur.
    assert -0.5 <= min(errors) < 0.5 < max(errors) <= 2.1


@pytest.mark.parametrize(("size", "last"), [(1e-3, 0.08), (5e-4, 0.08), (2e-4, 0.1)])
def test_a_head_that_comes_to_the_ball_at_the_end_of_a_step(companion, size, last):
    """Its host may have it some 1e-13 m before or behind: it holds the same speed once more."""
    count = round(0.84 / size)
    # A tenth of the speed backwards, but not in the first step, and the same way back.
    back = [size] * count + [last]
    forth = ((count - 1) * size + last) / 100.0
    swing, time, held = companion("Swing"), 0.0, [0.0]
    for step in [*back, *[forth] * 10]:
        swing.doStep(time, step)
        time += step
        held += get(swing, "club_speed")
    speed = pytest.approx(AT_THE_BALL, rel=1e-9)
    assert held[1 : count + 1] == [pytest.approx(-0.1 * AT_THE_BALL, rel=1e-9)] * count
    assert held[count + 1 :] == [speed] * 11
    swing.doStep(time, 1e-9)
    assert get(swing, "club_speed")[0] < 0.99 * AT_THE_BALL


def test_the_sum_of_steps_is_exact(companion):
    """A plain sum of the small steps would be off by 1e-13 s, at 4,000 m/s²."""
    motions = []
    for size in (1e-4, 0.45):
        swung(swing := companion("Swing"), 0.9, size)
        motions.append(get(swing, *MOTION))
    assert motions[0] == pytest.approx(motions[1], rel=1e-14)


def test_a_step_of_more_than_half_the_swing_is_refused(companion):
    swing = companion("Swing")
    with pytest.raises(FMICallException):
        swing.doStep(0.0, 0.49)
    swing.doStep(0.0, 0.48)
