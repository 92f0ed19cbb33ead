"""Cubic Hermite interpolation over one step, for methods of order 2 and 4.

A step of length h is described by a function's values f0, f1 and derivatives g0, g1 at its two
ends. The interpolant's error is O(h^4), so it keeps the order of these methods.
Source: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, section II.6.
"""

from __future__ import annotations

import math

from golf_scenarios.peers.problem import Outcome


def value(theta: float, h: float, f0: float, g0: float, f1: float, g1: float) -> float:
    """The interpolant at the fraction `theta` of the step."""
    rest = 1.0 - theta
    return (
        rest * f0
        + theta * f1
        - theta * rest * ((1.0 - 2.0 * theta) * (f1 - f0) - h * (rest * g0 - theta * g1))
    )


def fall_through_zero(h: float, f0: float, g0: float, f1: float, g1: float) -> float:
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


def peak(h: float, f0: float, g0: float, f1: float, g1: float) -> float:
    """The largest value of the interpolant, for g0 > 0 >= g1."""
    # h f'(theta) = c0 + 2 c1 theta + c2 theta^2, which falls through 0 once.
    c0 = h * g0
    c1 = 3.0 * (f1 - f0) - h * (2.0 * g0 + g1)
    c2 = 3.0 * (h * (g0 + g1) - 2.0 * (f1 - f0))
    theta = c0 / (math.sqrt(max(0.0, c1 * c1 - c0 * c2)) - c1)
    return value(theta, h, f0, g0, f1, g1)


def separation(
    number: int,
    h: float,
    before: tuple[float, ...],
    after: tuple[float, ...],
    max_force: float,
) -> Outcome:
    """The outcome of an impact that ends within a step of `h` s, after a number of such steps.

    `before` and `after` are force, v_club and v_ball, each with its derivative, at its two ends.
    """
    part = fall_through_zero(h, *before[:2], *after[:2])
    v_club, v_ball = (value(part, h, *before[n : n + 2], *after[n : n + 2]) for n in (2, 4))
    return Outcome(v_club, v_ball, (number + part) * h, max_force)
