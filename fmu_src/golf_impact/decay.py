"""Sums and quotients of decaying exponentials, written so that nothing cancels."""

from math import cos, exp, expm1, sin, sqrt


def mean_fall(x: float) -> float:
    """(1 - e^(-x)) / x - 1: the mean of e^(-y) - 1 over y from 0 to x."""
    if x > 0.5:
        return -expm1(-x) / x - 1.0
    term = total = -0.5 * x
    n = 2
    while abs(term) > 1e-18 * abs(total):
        n += 1
        term *= -x / n
        total += term
    return total


def difference(slow: float, split: float, tau: float) -> float:
    """(e^(-slow·τ) - e^(-(slow + split)·τ)) / split, also where split is 0."""
    return exp(-slow * tau) * (-expm1(-split * tau) / split if split > 0.0 else tau)


def divided_differences(r: float, half: float, square: float, tau: float) -> tuple[float, float]:
    """exp(-·τ) over the pair (half ± √-square), and over the pair and r.

    The second is ∫ e^(-r(τ-σ)) S(σ) dσ with S the first; its closed form cancels where the three
    meet, a Taylor series doesn't.
    """
    eta = half - r
    c, s = decayed(half, square, tau)
    reach = max(abs(eta), sqrt(abs(square))) * tau
    if reach > 1.0:
        return s, (exp(-r * tau) - (c + eta * s)) / (eta * eta + square)
    # u = e^(-ησ) S(σ) e^(half σ) obeys u'' + 2ηu' + (η² + Ω²)u = 0, u(0) = 0, u'(0) = 1.
    stiffness = (eta * eta + square) * tau * tau
    damping = 2.0 * eta * tau
    previous, term, integral = 0.0, tau, 0.5 * tau
    n = 1
    while abs(term) > 1e-18 * tau or abs(previous) > 1e-18 * tau:
        following = -(damping * n * term + stiffness * previous) / (n * (n + 1.0))
        previous, term = term, following
        n += 1
        integral += term / (n + 1.0)
    return s, exp(-r * tau) * integral * tau


def decayed(half: float, square: float, tau: float) -> tuple[float, float]:
    """e^(-half·τ)·(cos Ωτ, sin Ωτ/Ω) with Ω² = square, which may be negative."""
    if square > 0.0:
        angle = sqrt(square) * tau
        decay = exp(-half * tau)
        return decay * cos(angle), decay * (tau * sin(angle) / angle if angle else tau)
    angle = sqrt(-square) * tau
    slow = exp(angle - half * tau)
    fallen = -expm1(-2.0 * angle)
    return slow * (1.0 - 0.5 * fallen), slow * (0.5 * tau * fallen / angle if angle else tau)
