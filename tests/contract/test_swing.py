"""Swing.fmu: an independent integration, a published swing, and touch whatever the steps."""

import math
from itertools import cycle, repeat

import numpy as np
import pytest
from conftest import some
from fmpy.fmi1 import FMICallException
from fmus import get, put
from scipy.integrate import solve_ivp

from golf_build.system import DRIVE

BACKSWING = 0.75

#: Of the head with the start values.
AT_THE_BALL, AT = 52.763071110699870, 0.9624838642630617


def swung(swing, until, step=1e-3, begin=0.0):
    """Steps as far as `until`; returns where the last one ended."""
    count = round((until - begin) / step)
    for n in range(count):
        swing.doStep(begin + n * step, step)
    return begin + count * step


# Against an integration


def newton(swing, force, released):
    """The slope of (arm and club angle, their rates, work) by Newton's law in the plane.

    With a force on the head against its travel, N, and the wrist released at an instant, s; None:
    held. Vectors are complex: towards the target, and up.
    """
    r, s_a, j = get(swing, "arm_length", "arm_first_moment", "arm_inertia")
    length, m, s_c, i = get(swing, "club_length", "club_mass", "club_first_moment", "club_inertia")
    q_a, q_b, tau = get(swing, "max_shoulder_torque", "max_wrist_torque", "torque_rise_time")
    gravity, plane, loft = get(swing, "gravity", "plane_angle", "spin_loft")
    g, centre = gravity * math.sin(plane), s_c / m
    # The normal of the face at the ball.
    against = force * np.exp(1j * (DRIVE["Launch"]["attack_angle"] + loft))

    def slope(t, y):
        rates = np.array(y[2:4])
        of_centre, of_head = (np.exp(1j * y[:2]) * (r, outer) for outer in (centre, length))
        mass = np.diag([j, i - s_c * centre]) + m * np.outer(of_centre.conj(), of_centre).real
        pull = -1j * m * (g + of_centre @ rates**2)
        shoulder = q_a * (1.0 - math.exp(-t / tau))
        wrist = 0.0 if released is None else q_b * (1.0 - math.exp((released - t) / tau))
        push = np.array([shoulder - wrist - s_a * g * math.sin(y[0]), wrist])
        push += (of_centre.conj() * pull - of_head.conj() * against).real
        held = released is None
        bends = [push.sum() / mass.sum()] * 2 if held else np.linalg.solve(mass, push)
        return [*rates, *bends, shoulder * rates[0] + wrist * (rates[1] - rates[0])]

    return slope


def integrated(swing, instants, since, force):
    """Angles of arms and club, head speed and work at instants, in s from the top.

    A force (N) on the head begins at `since`, s.
    """
    arm, wrist, release, r, length = get(
        swing, "arm_start", "wrist_start", "release_angle", "arm_length", "club_length"
    )
    begin, released, y, found = 0.0, 0.0, [-arm, -arm - wrist, 0.0, 0.0, 0.0], []

    def at_release(t, y):
        return y[0] + release

    at_release.terminal = True
    stages = [(at_release, since, 0.0)] if release < arm else []
    for event, end, acting in (*stages, (None, since, 0.0), (None, instants[-1], force)):
        slope = newton(swing, acting, None if event else released)
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "dense_output": True}
        solved = solve_ivp(slope, (begin, end), y, events=event, **options)
        for p, q, u, w, work in map(solved.sol, (t for t in instants if begin < t <= solved.t[-1])):
            velocity = r * u * np.exp(1j * p) + length * w * np.exp(1j * q)
            found.append([p, q, abs(velocity), work])
        begin, y = solved.t[-1], solved.y[:, -1]
        released = begin if event else released
    return np.array(found)


#: Parameters, communication step sizes, and the force on the head from 0.15 s after the top on.
SWINGS = {
    "as published": ({}, [1e-3], 0.0),
    "any steps": ({}, [7e-4, 3e-3, 1e-4], 0.0),
    # The head's speed begins with the square of the time.
    "no gravity": ({"gravity": 0.0}, [1e-3], 0.0),
    "wrist held": ({"release_angle": 1.7, "torque_rise_time": 0.03}, [1e-3], 0.0),
    "a force": ({"spin_loft": 0.3}, [1e-3], 300.0),
}


@pytest.mark.parametrize(("values", "steps", "force"), SWINGS.values(), ids=SWINGS)
def test_against_an_integration(companion, values, steps, force):
    """Of angles (rad), speeds (m/s) and energies (J); measured: 2e-9."""
    swing, time, n = companion("Swing", **values), 0.0, 0
    (top,) = get(swing, "energy")
    instants, found = [], []
    for size in cycle(steps):
        if time > 0.96:
            break
        if time >= BACKSWING + 0.15 - 1e-9:
            put(swing, impulse=get(swing, "reaction_impulse")[0] + force * size)
        swing.doStep(time, size)
        time, n = time + size, n + 1
        # Before the ball, behind which the torques decay.
        if time > BACKSWING + 0.01 and n % 20 == 0 and get(swing, "arm_angle")[0] < 0.0:
            instants.append(time - BACKSWING)
            found.append(get(swing, "arm_angle", "club_angle", "head_speed", "work"))
            energy, work, lost = get(swing, "energy", "work", "reaction_work")
            # Only torques and the force work on it.
            assert energy - work + lost == pytest.approx(top, abs=1e-7)
    assert len(instants) >= 5
    expected = integrated(swing, instants, 0.15, force)
    assert np.array(found) == pytest.approx(expected, rel=1e-7, abs=1e-7)


def test_the_head_meets_the_ball_as_in_the_source(companion):
    """C.-C. Chiang, The Simple Golf Simulator (2016), case 1 by its solution 4: its digits."""
    swung(swing := companion("Swing"), AT, step=1e-4)
    found = AT_THE_BALL, AT - BACKSWING, *get(swing, "effective_mass")
    printed = (52.76, 0.005), (0.2125, 5e-5), (0.2030, 5e-5)
    assert found == tuple(pytest.approx(value, abs=half) for value, half in printed)


def test_it_rests_at_the_top_and_at_its_end(companion):
    swing = companion("Swing", spin_loft=0.3)
    top = get(swing, "arm_angle", "club_angle", "energy", "head_speed")
    time = swung(swing, BACKSWING)
    assert get(swing, "arm_angle", "club_angle", "energy", "head_speed") == top
    assert top[3] == get(swing, "work")[0] == 0.0
    time = swung(swing, AT - 5e-4, begin=time)
    # Along the normal of the face.
    assert get(swing, "club_speed")[0] == pytest.approx(AT_THE_BALL * math.cos(0.3), rel=1e-9)
    put(swing, impulse=1.0)
    swung(swing, 2.0, step=0.02, begin=time)
    assert get(swing, "arm_angle") == pytest.approx(get(swing, "arm_start"), abs=1e-12)
    assert get(swing, "head_speed", "club_speed") == [0.0, 0.0]
    assert get(swing, "reaction_work")[0] > 10.0


# Touch by a host that holds the speed over each step, of any length


def until_touch(swing, steps, late=0):
    """By an importer's head that starts at the ball, as ClubBallImpact's with a gap of 0.

    The host passes on each output `late` steps later. Returns the speeds that have been held, the
    last one at touch; when it touches, s; the longest step, s.
    """
    held = [0.0] * late + get(swing, "club_speed")
    position = time = longest = 0.0
    for n, size in enumerate(steps):
        if held[n] > 0.0 and position + held[n] * size >= 0.0:
            break
        position += held[n] * size
        swing.doStep(time, size)
        time, longest = time + size, max(longest, size)
        held += get(swing, "club_speed")
    assert position < 0.0 < held[n]
    return held[: n + 1], time - position / held[n], longest


@pytest.mark.parametrize("step", some(5, [1e-3, 7e-4, 9.99e-3, 0.1, 0.48, 1e-4, 3e-3, 0.02, 0.3]))
@pytest.mark.parametrize("late", [0, 1])
def test_touch_has_the_speed_at_the_ball(companion, step, late):
    held, touch, _ = until_touch(companion("Swing"), repeat(step), late)
    assert held[-1] == pytest.approx(AT_THE_BALL, rel=1e-9)
    # Late by as much as the host.
    assert touch - late * step == pytest.approx(AT, abs=1e-10)


def sequence(seed):
    """Communication step sizes: mixed, in runs, spread over decades, and uniform."""
    random = np.random.default_rng(seed)
    kind = seed % 4
    if kind == 0:
        return random.choice([1e-3, 3e-4, 1e-4], 6000)
    if kind == 1:
        return np.repeat(random.choice([1e-3, 3e-4, 1e-4], 500), random.integers(1, 60, 500))
    if kind == 2:
        return 10.0 ** random.uniform(-5.0, -0.5, 4000)
    return random.uniform(1e-5, 2e-3, 6000)


@pytest.mark.parametrize("part", some(1, range(10)))
def test_no_sequence_of_steps_touches_the_ball_with_another_speed(companion, part):
    swing, errors = companion("Swing"), []
    fresh = swing.getFMUstate()
    for seed in range(40 * part, 40 * (part + 1)):
        swing.setFMUstate(fresh)
        held, touch, longest = until_touch(swing, sequence(seed).tolist())
        assert held[-1] == pytest.approx(AT_THE_BALL, rel=1e-9)
        assert all(speed <= 0.0 or speed == held[-1] for speed in held)
        errors.append((touch - AT) / longest)
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


# Refused; the rest: refusals.toml


def test_a_step_of_more_than_half_the_swing_is_refused(companion):
    swing = companion("Swing")
    with pytest.raises(FMICallException):
        swing.doStep(0.0, 0.49)
    swing.doStep(0.0, 0.48)
