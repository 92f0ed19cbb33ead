"""Closed forms that the FMU's results are held against, written independently of it.

Elastic and law 2: Schwager & Pöschel, Granular Matter 9, 465–469 (2007). Law 1 has none for its
times, but its momentum balances are exact.
"""

import math
from collections.abc import Mapping


def reduced_mass(m_club: float, m_ball: float) -> float:
    """μ = m_C m_B / (m_C + m_B), kg."""
    return m_club * (m_ball / (m_club + m_ball))


def half_contact(zeta: float) -> float:
    """Law 2's contact time in units of 2/ω, ω = √(k/μ), with the damping ratio ζ = b/(2√(kμ))."""
    if zeta < 1.0:
        return math.acos(zeta) / math.sqrt((1.0 - zeta) * (1.0 + zeta))
    if zeta > 1.0:
        return math.acosh(zeta) / math.sqrt((zeta - 1.0) * (zeta + 1.0))
    return 1.0


def elastic_smash_factor(m_club: float, m_ball: float) -> float:
    """2 m_C / (m_C + m_B): ball at rest, no loss, whatever the stiffness."""
    return 2.0 * m_club / (m_club + m_ball)


def elastic_contact_time(k: float, m_club: float, m_ball: float) -> float:
    """Half a period of the spring, π √(μ/k), s."""
    return math.pi * math.sqrt(reduced_mass(m_club, m_ball) / k)


def expected(given: Mapping[str, float], metrics: Mapping[str, float]) -> dict[str, float]:
    """What metrics of a separated impact must be, by name (SI units).

    They follow from all inputs and parameters, some from others of the FMU's metrics.
    """
    k, b = given["k"], given["b"]
    m_club, m_ball = given["m_club"], given["m_ball"]
    u_club, u_ball = given["club_speed"], given["ball_speed"]
    mu, approach = reduced_mass(m_club, m_ball), u_club - u_ball
    start = m_club * u_club + m_ball * u_ball
    law = int(given["law"])
    if law not in (1, 2):
        return {}
    if given.get("exponent", 1.0) != 1.0 or given.get("restitution_at_rest", 0.0) > 0.0:
        return {"momentum_final": start}
    if law == 1 and b > 0.0:
        # Both bodies have moved as far when they part, and each has lost b·x to the drag.
        lost = b * metrics["contact_displacement"]
        gain = metrics["momentum_gain_ball"]
        return {"impulse": gain + lost, "momentum_final": start - 2.0 * lost}
    zeta = b / (2.0 * math.sqrt(k * mu))
    phase = half_contact(zeta)
    restitution = math.exp(-2.0 * zeta * phase)
    results = {
        "coefficient_of_restitution": restitution,
        "contact_time": 2.0 * phase / math.sqrt(k / mu),
        "ball_velocity": u_ball + (1.0 + restitution) * approach * m_club / (m_club + m_ball),
        "impulse": mu * approach * (1.0 + restitution),
        "momentum_final": start,
    }
    if b == 0.0:
        results["max_force"] = approach * math.sqrt(k * mu)
    return results
