"""What the FMU's results are held against, written independently of it: closed forms and balances.

Elastic and law 2: Schwager & Pöschel, Granular Matter 9, 465–469 (2007). Law 1 has none for its
times, but its momentum balances are exact. `given` has all inputs and parameters (SI units).
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


def definitions(given: Mapping[str, float], metrics: Mapping[str, float]) -> dict[str, float]:
    """S, COR and E by their definitions, from the velocities after an impact."""
    u_club, u_ball = given["club_speed"], given["ball_speed"]
    v_club, v_ball = metrics["club_velocity"], metrics["ball_velocity"]
    energy = 0.5 * (given["m_club"] * v_club**2 + given["m_ball"] * v_ball**2)
    return {
        "smash_factor": v_ball / u_club if u_club else 0.0,
        "coefficient_of_restitution": (v_ball - v_club) / (u_club - u_ball),
        "energy_efficiency": energy / metrics["kinetic_energy_initial"],
    }


def balances(given: Mapping[str, float], metrics: Mapping[str, float]) -> dict[str, float]:
    """Momentum after an impact, and under law 1 the impulse, from other metrics."""
    start = given["m_club"] * given["club_speed"] + given["m_ball"] * given["ball_speed"]
    # With a force on the club head the metrics are those at separation.
    pushed = given["club_force"] * metrics["contact_time"] if given["club_force"] else 0.0
    if given["law"] == 1 and given["b"] > 0.0:
        # Both bodies have moved as far when they part, and each has lost b·x to the drag.
        lost = given["b"] * metrics["contact_displacement"]
        impulse = metrics["momentum_gain_ball"] + lost
        return {"impulse": impulse, "momentum_final": start + pushed - 2 * lost}
    return {"momentum_final": start + pushed} if given["law"] in (1, 2) else {}


def solution(given: Mapping[str, float]) -> dict[str, float]:
    """Metrics by name (SI units) with a linear damper or none; without a closed form: empty."""
    k, b, law = given["k"], given["b"], given["law"]
    linear = given["exponent"] == 1.0 and given["restitution_at_rest"] == 0.0
    if not linear or given["club_force"] or (law != 2 and (law, b) != (1, 0.0)):
        return {}
    m_club, m_ball, u_ball = given["m_club"], given["m_ball"], given["ball_speed"]
    mu, approach = reduced_mass(m_club, m_ball), given["club_speed"] - u_ball
    zeta = b / (2.0 * math.sqrt(k * mu))
    phase = half_contact(zeta)
    restitution = math.exp(-2.0 * zeta * phase)
    results = {
        "coefficient_of_restitution": restitution,
        "contact_time": 2.0 * phase / math.sqrt(k / mu),
        "ball_velocity": u_ball + (1.0 + restitution) * approach * m_club / (m_club + m_ball),
        "impulse": mu * approach * (1.0 + restitution),
    }
    if b == 0.0:
        results["max_force"] = approach * math.sqrt(k * mu)
    return results
