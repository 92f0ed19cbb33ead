"""Swing.fmu: an independent integration, a published swing, and touch whatever the steps."""

import math
from itertools import cycle, pairwise, repeat

import numpy as np
import pytest
from conftest import some
from fmpy.fmi1 import FMICallException
from fmus import get, put
from golf_physics.companions.double_pendulum import HELD, RELEASED, Golfer, Motion, State
from scipy.integrate import solve_ivp

from golf_build.system import COMPANIONS, DRIVE

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

EXACTLY = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}


def source_equations(swing, force, released):
    """The source's own: angle of the arms and of the wrist, Q_alpha and Q_beta.

    With a force on the head, N, and the wrist released at an instant, s; None: held. Returns the
    slope of (alpha, alpha', beta, beta', path, work) for solve_ivp.
    """
    held = released is None
    arm = ("arm_length", "arm_first_moment", "arm_inertia", "arm_start")
    club = ("club_length", "club_mass", "club_first_moment", "club_inertia")
    torque = ("max_shoulder_torque", "max_wrist_torque", "torque_rise_time")
    r, s_a, j, theta0, length, m, s_c, i = get(swing, *arm, *club)
    q_a, q_b, tau, gravity, plane = get(swing, *torque, "gravity", "plane_angle")
    g = gravity * math.sin(plane)
    # The force acts against the head's direction of travel at the ball.
    direction = DRIVE["Launch"]["attack_angle"]

    def slope(t, y):
        alpha, da, beta, db = y[:4]
        theta = theta0 - alpha
        cos, sin = math.cos(beta), math.sin(beta)
        torque = q_a * (1.0 - math.exp(-t / tau))
        wrist = 0.0 if held else -q_b * (1.0 - math.exp((released - t) / tau))
        # The head, and what a force on it does to alpha and to beta.
        x_alpha = r * math.cos(theta) + length * math.cos(theta + beta)
        y_alpha = -r * math.sin(theta) - length * math.sin(theta + beta)
        x_beta, y_beta = -length * math.cos(theta + beta), length * math.sin(theta + beta)
        along, up = math.cos(direction), math.sin(direction)
        weight = s_c * g * math.sin(theta + beta)
        a = j + i + m * r * r + 2.0 * r * s_c * cos
        b = i + r * s_c * cos
        right_a = torque - (db * db - 2.0 * da * db) * r * s_c * sin + weight
        right_a += (s_a + m * r) * g * math.sin(theta)
        right_a -= force * (along * x_alpha + up * y_alpha)
        right_b = wrist - da * da * r * s_c * sin - weight
        right_b -= force * (along * x_beta + up * y_beta)
        if held:
            dda, ddb = right_a / a, 0.0
        else:
            dda, ddb = np.linalg.solve([[a, -b], [-b, i]], [right_a, right_b])
        speed = math.hypot(x_alpha * da + x_beta * db, y_alpha * da + y_beta * db)
        return [da, dda, db, ddb, speed, torque * da + wrist * db]

    return slope


def integrated(swing, instants, since, force):
    """Angles of arms and club, head speed and work at instants, in s from the top.

    A force (N) on the head begins at `since`, s.
    """
    theta0, beta0, release = get(swing, "arm_start", "wrist_start", "release_angle")
    begin, released, y, found = 0.0, 0.0, [0.0, 0.0, beta0, 0.0, 0.0, 0.0], {}

    def at_release(t, y):
        return y[0] - (theta0 - release)

    at_release.terminal = True
    stages = [(True, since, 0.0)] if release < theta0 else []
    for held, end, acting in (*stages, (False, since, 0.0), (False, instants[-1], force)):
        slope = source_equations(swing, acting, None if held else released)
        options = EXACTLY | {"events": at_release if held else None}
        inside = [t for t in instants if begin < t < end]
        solved = solve_ivp(slope, (begin, end), y, t_eval=[*inside, end], **options)
        for t, y in zip(solved.t, solved.y.T):
            arm = y[0] - theta0
            found[t] = [arm, arm - y[2], slope(t, y)[4], y[5]]
        begin = end
        if held:
            begin = released = solved.t_events[0][0]
            y = solved.y_events[0][0]
    return np.array([found[t] for t in instants])


#: Parameters, communication step sizes, and the force on the head from 0.15 s after the top on.
SWINGS = {
    "as published": ({}, [1e-3], 0.0),
    "any steps": ({}, [7e-4, 3e-3, 1e-4], 0.0),
    # The head's speed begins with the square of the time.
    "no gravity": ({"gravity": 0.0}, [1e-3], 0.0),
    "wrist held": ({"release_angle": 1.7}, [1e-3], 0.0),
    "a force": ({}, [1e-3], 300.0),
}


@pytest.mark.parametrize(("values", "steps", "force"), SWINGS.values(), ids=SWINGS)
def test_against_an_integration(companion, values, steps, force):
    """Stated: 1e-6 of the angles (rad), speeds (m/s) and energies (J); measured: 1e-9."""
    swing, time, n = companion("Swing", **values), 0.0, 0
    names = ("arm_angle", "club_angle", "head_speed", "work")
    instants, found, balances = [], [], []
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
            found.append(get(swing, *names))
            energy, work, lost = get(swing, "energy", "work", "reaction_work")
            balances.append(energy - work + lost)
    expected = integrated(swing, instants, 0.15, force)
    assert len(instants) >= 5
    assert np.array(found) == pytest.approx(expected, rel=1e-8, abs=1e-8)
    # Only torques and the force work on it: else its energy is that at the top.
    top = companion("Swing", **values)
    swung(top, BACKSWING)
    assert balances == pytest.approx(get(top, "energy") * len(balances), abs=1e-7)


def test_the_head_meets_the_ball_as_in_the_source(companion):
    """C.-C. Chiang, The Simple Golf Simulator (2016), case 1 by its solution 4: its digits."""
    swung(swing := companion("Swing"), AT, step=1e-4)
    found = AT_THE_BALL, AT - BACKSWING, *get(swing, "effective_mass")
    printed = (52.76, 0.005), (0.2125, 5e-5), (0.2030, 5e-5)
    assert found == tuple(pytest.approx(value, abs=half) for value, half in printed)


def test_the_backswing_begins_at_rest_and_its_speed_is_the_slope_of_its_path(companion):
    swing, step, places = companion("Swing"), 1e-4, []
    begin = swung(swing, 0.3)
    arm, club = get(swing, "arm_length", "club_length")
    for n in range(3):
        angles = get(swing, "arm_angle", "club_angle")
        places.append(arm * np.exp(1j * angles[0]) + club * np.exp(1j * angles[1]))
        if n == 1:
            (speed,) = get(swing, "head_speed")
        swing.doStep(begin + n * step, step)
    assert speed == pytest.approx(-abs(places[2] - places[0]) / (2.0 * step), rel=1e-6)


def test_the_swing_goes_on_to_its_end_and_rests_there(companion):
    swing = companion("Swing")
    swung(swing, 2.0, step=0.02)
    assert get(swing, "arm_angle") == pytest.approx(get(swing, "arm_start"), abs=1e-12)
    assert get(swing, "head_speed", "shoulder_torque", "hand_force", "club_speed") == [0.0] * 4


def test_the_speed_is_that_along_the_normal(companion):
    flat, lofted = companion("Swing"), companion("Swing", spin_loft=0.3)
    for swing in (flat, lofted):
        swung(swing, 0.96)
    assert get(lofted, "club_speed")[0] == pytest.approx(AT_THE_BALL * math.cos(0.3), rel=1e-9)
    names = ("head_speed", "energy", "work")
    assert get(lofted, *names) == get(flat, *names)


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


STEPS = [1e-3, 7e-4, 9.99e-3, 0.1, 0.48, 1e-4, 3e-3, 0.02, 0.3]


@pytest.mark.parametrize("step", some(5, STEPS))
@pytest.mark.parametrize("late", [0, 1])
def test_touch_has_the_speed_at_the_ball(companion, step, late):
    held, touch, _ = until_touch(companion("Swing"), repeat(step), late)
    assert held[-1] == pytest.approx(AT_THE_BALL, rel=1e-9)
    # Late by as much as the host.
    assert touch - late * step == pytest.approx(AT, abs=1e-10)
    assert min(held) < 0.0


@pytest.mark.parametrize("step", some(4, [1e-4, 7e-4, 0.01, 0.3, 1e-5, 3e-3, 9.99e-3, 0.0101]))
@pytest.mark.parametrize("late", [0, 1])
def test_with_a_prescribed_speed_touch_falls_after_the_peak(companion, step, late):
    held, *_ = until_touch(companion("Swing", prescribed_speed=35.0), repeat(step), late)
    assert held[-1] == 35.0
    assert min(held) < 0.0
    assert all(later >= earlier for earlier, later in pairwise(held[late:]))


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
    swing = companion("Swing")
    fresh = swing.getFMUstate()
    errors = []
    for seed in range(40 * part, 40 * (part + 1)):
        swing.setFMUstate(fresh)
        held, touch, longest = until_touch(swing, sequence(seed).tolist())
        assert held[-1] == pytest.approx(AT_THE_BALL, rel=1e-9)
        assert all(speed <= 0.0 or speed == held[-1] for speed in held)
        errors.append((touch - AT) / longest)
    swing.freeFMUstate(fresh)
    assert min(errors) >= -0.5
    # The bounds aren't wide: such errors do occur.
    assert 0.5 < max(errors) <= 2.0


# Refusals and states of its own; those of all FMUs: test_refusals.py, test_lockstep.py


@pytest.mark.parametrize(
    ("name", "value", "correction"),
    [
        ("max_shoulder_torque", -500.0, 100.0),
        pytest.param("club_inertia", 0.1, 0.3, marks=pytest.mark.ci),
    ],
)
def test_an_impossible_swing_is_refused_until_corrected(companion, name, value, correction):
    swing = companion("Swing", **{name: value})
    with pytest.raises(FMICallException):
        swing.doStep(0.0, 1e-3)
    assert get(swing, "club_speed", "arm_angle", "energy", "hand_force") == [0.0] * 4
    put(swing, **{name: correction})
    swung(swing, 0.8)
    assert get(swing, "head_speed")[0] > 0.0


def test_a_step_of_more_than_half_the_swing_is_refused(companion):
    swing = companion("Swing")
    with pytest.raises(FMICallException):
        swing.doStep(0.0, 0.49)
    swing.doStep(0.0, 0.48)
    assert get(swing, "arm_angle")[0] < 0.0


@pytest.mark.parametrize("stage", [HELD, RELEASED])
def test_force_and_torque_of_the_hands_by_newton(stage):
    """Momentum of the club, and its angular momentum about its centre of mass, by differences."""
    start = {row.name: row.start for row in COMPANIONS["Swing"].tables["rows"]}
    golfer = Golfer(*map(start.get, Golfer._fields))
    golfer = golfer._replace(release_angle=1.0, max_wrist_torque=5.0)
    start, force, direction = State(-2.0, -3.0, 5.0, 5.0, 60.0, 3.0, 0.0), 800.0, 0.5
    motion = Motion(golfer, 0.0, start, stage, force, direction)
    mass, first, length = golfer.club_mass, golfer.club_first_moment, golfer.club_length

    def momentum(t):
        p, q, u, w, *_ = motion.at(t)[0]
        r = mass * golfer.arm_length
        velocity = (u * r * math.cos(p), u * r * math.sin(p))
        return np.array([first * w * math.cos(q), first * w * math.sin(q)]) + velocity, w

    t, step = 0.03, 1e-6
    state, stage_then = motion.at(t)
    assert stage_then == stage
    (after, w_after), (before, w_before) = momentum(t + step), momentum(t - step)
    push = force * np.array([math.cos(direction), math.sin(direction)])
    hands = (after - before) / (2.0 * step) + push + (0.0, mass * golfer.gravity)
    found, torque = motion.hands(t, state)
    assert found == pytest.approx(math.hypot(*hands), rel=1e-8)
    club, centre = np.array([math.sin(state.club), -math.cos(state.club)]), first / mass
    spin = (golfer.club_inertia - first * centre) * (w_after - w_before) / (2.0 * step)

    def moment(lever, force):
        return lever * (club[0] * force[1] - club[1] * force[0])

    expected = spin - moment(-centre, hands) - moment(length - centre, -push)
    assert torque == pytest.approx(expected, rel=1e-6)
