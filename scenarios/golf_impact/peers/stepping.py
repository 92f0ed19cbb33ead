"""The impact by methods of a fixed step dt (s), in plain Python.

The methods of order 2 and 4 shorten the step in which contact ends, and the one in which the force
is largest, so that it ends there (SciPy's brentq): the error stays of their order.
Sources: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, section II.1 (Runge–
Kutta); Hairer, Lubich, Wanner, Geometric Numerical Integration, sections I.1.4 and II.3
(Störmer–Verlet).
"""

import math
from collections.abc import Callable

from scipy.optimize import brentq

from golf_impact.peers.problem import Case, Outcome

#: d (m), v_club and v_ball (m/s).
_State = tuple[float, float, float]


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


def stormer_verlet(case: Case, dt: float) -> Outcome:
    """Störmer–Verlet in its velocity form (symplectic without damping), order 2.

    Kick, drift, kick. The damping depends on the velocities, so the first half kick takes them at
    its start and the second one at its end: the step is then symmetric and stays of order 2. The
    implicit half is linear and solved by hand: a division by 1 + dt b/(2 m).
    """
    m_club, m_ball, k, drag, damper = case.coefficients

    def step(state: _State, h: float) -> _State:
        d, v_club, v_ball = state
        half = 0.5 * h
        force = k * d + damper * (v_club - v_ball)
        v_club -= half * (force + drag * v_club) / m_club
        v_ball += half * (force - drag * v_ball) / m_ball
        d += h * (v_club - v_ball)
        force = (k * d + damper * (v_club - v_ball)) / (1.0 + half * damper / case.reduced_mass)
        v_club = (v_club - half * force / m_club) / (1.0 + half * drag / m_club)
        v_ball = (v_ball + half * force / m_ball) / (1.0 + half * drag / m_ball)
        return d, v_club, v_ball

    return _outcome(case, dt, step)


def runge_kutta4(case: Case, dt: float) -> Outcome:
    """The classical Runge–Kutta method, order 4."""
    m_club, m_ball, k, drag, damper = case.coefficients

    def rates(d: float, v_club: float, v_ball: float) -> _State:
        closing = v_club - v_ball
        force = k * d + damper * closing
        return closing, -(force + drag * v_club) / m_club, (force - drag * v_ball) / m_ball

    def step(state: _State, h: float) -> _State:
        half, sixth = 0.5 * h, h / 6.0
        d, v_club, v_ball = state
        w1, p1, q1 = rates(d, v_club, v_ball)
        w2, p2, q2 = rates(d + half * w1, v_club + half * p1, v_ball + half * q1)
        w3, p3, q3 = rates(d + half * w2, v_club + half * p2, v_ball + half * q2)
        w4, p4, q4 = rates(d + h * w3, v_club + h * p3, v_ball + h * q3)
        return (
            d + sixth * (w1 + 2.0 * (w2 + w3) + w4),
            v_club + sixth * (p1 + 2.0 * (p2 + p3) + p4),
            v_ball + sixth * (q1 + 2.0 * (q2 + q3) + q4),
        )

    return _outcome(case, dt, step)


def _outcome(case: Case, dt: float, step: Callable[[_State, float], _State]) -> Outcome:
    """Steps of a one-step method until the force falls below zero."""
    m_club, m_ball, k, drag, damper = case.coefficients

    def force_of(h: float, start: _State) -> float:
        d, v_club, v_ball = step(start, h)
        return k * d + damper * (v_club - v_ball)

    def rise_of(h: float, start: _State) -> float:
        d, v_club, v_ball = step(start, h)
        force = k * d + damper * (v_club - v_ball)
        closing = -(force + drag * v_club) / m_club - (force - drag * v_ball) / m_ball
        return k * (v_club - v_ball) + damper * closing

    state = before = 0.0, case.club_speed, case.ball_speed
    max_force = force_of(0.0, state)
    risen = rise_of(0.0, state) <= 0.0
    for n in range(math.ceil(case.time_limit / dt)):
        after = step(state, dt)
        force = k * after[0] + damper * (after[1] - after[2])
        if force > max_force:
            max_force = force
        elif not risen:
            # The largest force lies in this step or the one before.
            risen, start = True, state if rise_of(0.0, state) > 0.0 else before
            # No maximum is found where the step is far too long for the method.
            if rise_of(dt, start) < 0.0 < rise_of(0.0, start):
                max_force = max(max_force, force_of(brentq(rise_of, 0.0, dt, (start,)), start))
        if force < 0.0:
            # The force of a contact that has just begun may be 0, which isn't the end.
            low = 0.0 if force_of(0.0, state) > 0.0 else 1e-9 * dt
            h = brentq(force_of, low, dt, (state,), xtol=1e-15 * dt)
            _, v_club, v_ball = step(state, h)
            return Outcome(v_club, v_ball, n * dt + h, max_force)
        before, state = state, after
    return Outcome(state[1], state[2], math.inf, max_force)


METHODS: dict[str, Callable[[Case, float], Outcome]] = {
    "explicit Euler": explicit_euler,
    "Störmer–Verlet": stormer_verlet,
    "Runge–Kutta 4": runge_kutta4,
}
