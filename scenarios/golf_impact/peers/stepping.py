"""The impact by methods of a fixed step dt (s), in plain Python.

Methods of order 2 and 4 find the end of contact and the largest force by cubic Hermite
interpolation over a step, whose error is O(dt^4). A step is described by a function's values f0, f1
and derivatives g0, g1 at its two ends.
Sources: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, sections II.1 (Runge–
Kutta) and II.6 (interpolation); Hairer, Lubich, Wanner, Geometric Numerical Integration, sections
I.1.2 (symplectic Euler), I.1.4 and II.3 (Störmer–Verlet).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import wraps

from golf_impact.peers.problem import Case, Outcome

#: Force, v_club and v_ball, each with its derivative.
_State = tuple[float, float, float, float, float, float]


def explicit_euler(case: Case, dt: float) -> Outcome:
    """The source document's scheme, order 1.

    Everything moves on with the rates it has at the start of the step. Contact ends with the first
    step after which the force is negative, and is as long as all the steps until then; the largest
    force is the largest one seen. Nothing is interpolated, as in the document.
    """
    m_club, m_ball, k, drag, damper = case.coefficients
    x_club = x_ball = 0.0
    v_club, v_ball = case.club_speed, case.ball_speed
    max_force = 0.0
    for n in range(math.ceil(case.time_limit / dt) + 1):
        force = k * (x_club - x_ball) + damper * (v_club - v_ball)
        if force < 0.0:
            return Outcome(v_club, v_ball, n * dt, max_force)
        if force > max_force:
            max_force = force
        x_club += dt * v_club
        x_ball += dt * v_ball
        v_club -= dt * (force + drag * v_club) / m_club
        v_ball += dt * (force - drag * v_ball) / m_ball
    return Outcome(v_club, v_ball, math.inf, max_force)


def semi_implicit_euler(case: Case, dt: float) -> Outcome:
    """Semi-implicit (symplectic) Euler, order 1: new velocities first, then positions with them.

    What game engines do. Damping acts with the velocities at the start of the step. The last step
    is interpolated linearly in the force, which is enough for order 1.
    """
    m_club, m_ball, k, drag, damper = case.coefficients
    compression = 0.0
    v_club, v_ball = case.club_speed, case.ball_speed
    force = max_force = damper * (v_club - v_ball)
    for n in range(math.ceil(case.time_limit / dt)):
        before, club, ball = force, v_club, v_ball
        v_club -= dt * (force + drag * v_club) / m_club
        v_ball += dt * (force - drag * v_ball) / m_ball
        compression += dt * (v_club - v_ball)
        force = k * compression + damper * (v_club - v_ball)
        if force > max_force:
            max_force = force
        elif force < 0.0:
            part = before / (before - force)
            v_club, v_ball = club + part * (v_club - club), ball + part * (v_ball - ball)
            return Outcome(v_club, v_ball, (n + part) * dt, max_force)
    return Outcome(v_club, v_ball, math.inf, max_force)


def _interpolated(
    states: Callable[[Case, float], Iterator[_State]],
) -> Callable[[Case, float], Outcome]:
    """From states that follow each other by dt to an outcome, its end and peak interpolated."""

    @wraps(states)
    def solve(case: Case, dt: float) -> Outcome:
        following = states(case, dt)
        before = next(following)
        max_force = before[0]
        for n, after in zip(range(math.ceil(case.time_limit / dt)), following):
            if after[1] <= 0.0 < before[1]:
                max_force = max(max_force, _peak(dt, *before[:2], *after[:2]))
            if after[0] < 0.0:
                part = _fall_through_zero(dt, *before[:2], *after[:2])
                v_club = _value(part, dt, *before[2:4], *after[2:4])
                v_ball = _value(part, dt, *before[4:], *after[4:])
                return Outcome(v_club, v_ball, (n + part) * dt, max_force)
            before = after
        return Outcome(before[2], before[4], math.inf, max_force)

    return solve


@_interpolated
def stormer_verlet(case: Case, dt: float) -> Iterator[_State]:
    """Störmer–Verlet in its velocity form, order 2, with the damping half implicit.

    Kick, drift, kick. The damping depends on the velocities, so the first half kick takes them at
    its start and the second one at its end: the step is then symmetric and stays of order 2. The
    implicit half is linear and solved by hand: a division by 1 + dt b/(2 m).
    """
    m_club, m_ball, k, drag, damper = case.coefficients
    half = 0.5 * dt
    club_divisor, ball_divisor = 1.0 + half * drag / m_club, 1.0 + half * drag / m_ball
    force_divisor = 1.0 + half * damper / case.reduced_mass
    compression = 0.0
    v_club, v_ball = case.club_speed, case.ball_speed
    force = damper * (v_club - v_ball)
    while True:
        a_club, a_ball = -(force + drag * v_club) / m_club, (force - drag * v_ball) / m_ball
        rise = k * (v_club - v_ball) + damper * (a_club - a_ball)
        yield force, rise, v_club, a_club, v_ball, a_ball
        v_club += half * a_club
        v_ball += half * a_ball
        compression += dt * (v_club - v_ball)
        force = (k * compression + damper * (v_club - v_ball)) / force_divisor
        v_club = (v_club - half * force / m_club) / club_divisor
        v_ball = (v_ball + half * force / m_ball) / ball_divisor


@_interpolated
def runge_kutta4(case: Case, dt: float) -> Iterator[_State]:
    """The classical Runge–Kutta method, order 4."""
    m_club, m_ball, k, drag, damper = case.coefficients

    def rates(d: float, v_club: float, v_ball: float) -> tuple[float, float, float, float]:
        """d', v_club', v_ball' and the force."""
        closing = v_club - v_ball
        force = k * d + damper * closing
        return closing, -(force + drag * v_club) / m_club, (force - drag * v_ball) / m_ball, force

    half, sixth = 0.5 * dt, dt / 6.0
    d, v_club, v_ball = 0.0, case.club_speed, case.ball_speed
    while True:
        w1, p1, q1, force = rates(d, v_club, v_ball)
        yield force, k * w1 + damper * (p1 - q1), v_club, p1, v_ball, q1
        w2, p2, q2, _ = rates(d + half * w1, v_club + half * p1, v_ball + half * q1)
        w3, p3, q3, _ = rates(d + half * w2, v_club + half * p2, v_ball + half * q2)
        w4, p4, q4, _ = rates(d + dt * w3, v_club + dt * p3, v_ball + dt * q3)
        d += sixth * (w1 + 2.0 * (w2 + w3) + w4)
        v_club += sixth * (p1 + 2.0 * (p2 + p3) + p4)
        v_ball += sixth * (q1 + 2.0 * (q2 + q3) + q4)


def _value(theta: float, h: float, f0: float, g0: float, f1: float, g1: float) -> float:
    """The interpolant at the fraction `theta` of the step."""
    rest = 1.0 - theta
    bend = (1.0 - 2.0 * theta) * (f1 - f0) - h * (rest * g0 - theta * g1)
    return rest * f0 + theta * f1 - theta * rest * bend


def _fall_through_zero(h: float, f0: float, g0: float, f1: float, g1: float) -> float:
    """The fraction of the step at which the interpolant falls through 0, for f0 >= 0 >= f1.

    f0 = 0 is not taken for the fall: a contact starts with d = 0. Newton's method, kept in a
    bracket.
    """
    c1 = h * g0
    c2 = 3.0 * (f1 - f0) - h * (2.0 * g0 + g1)
    c3 = h * (g0 + g1) - 2.0 * (f1 - f0)
    low, high = 0.0, 1.0
    theta = f0 / (f0 - f1) if f0 > 0.0 else 1.0
    for _ in range(60):
        f = f0 + theta * (c1 + theta * (c2 + theta * c3))
        slope = c1 + theta * (2.0 * c2 + theta * 3.0 * c3)
        if f > 0.0:
            low = theta
        else:
            high = theta
        newton = theta - f / slope if slope < 0.0 else -1.0
        if abs(newton - theta) < 1e-15 or high - low < 1e-15:
            break
        theta = newton if low < newton < high else 0.5 * (low + high)
    return theta


def _peak(h: float, f0: float, g0: float, f1: float, g1: float) -> float:
    """The largest value of the interpolant, for g0 > 0 >= g1."""
    # h f'(theta) = c0 + 2 c1 theta + c2 theta^2, which falls through 0 once.
    c0 = h * g0
    c1 = 3.0 * (f1 - f0) - h * (2.0 * g0 + g1)
    c2 = 3.0 * (h * (g0 + g1) - 2.0 * (f1 - f0))
    return _value(c0 / (math.sqrt(max(0.0, c1 * c1 - c0 * c2)) - c1), h, f0, g0, f1, g1)
