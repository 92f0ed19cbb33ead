"""The laws as differential equations: what a host's own solver integrates in Model Exchange.

The contact phases are their exact solutions; see there for what each law means.
"""

from math import inf

from .parameters import Parameters


def contact_force(
    parameters: Parameters, k: float, b: float, compression: float, closing: float
) -> float:
    """Contact force, N; beyond either end of a contact it goes on smoothly, below 0.

    Args:
        parameters: law, exponent and reference_compression count.
        k: contact stiffness, N/m.
        b: damping, N.s/m.
        compression: m.
        closing: v_club - v_ball, m/s.
    """
    if parameters.law == 1:
        return k * compression
    exponent = parameters.exponent
    if exponent == 1.0:
        return k * compression + b * closing
    try:
        power = (abs(compression) / parameters.reference_compression) ** (0.5 * (exponent - 1.0))
    except OverflowError:
        power = inf
    return power * (k * power * compression + b * closing)


def accelerations(
    parameters: Parameters, b: float, force: float, v_club: float, v_ball: float
) -> tuple[float, float]:
    """Accelerations of club and ball in contact, m/s²; law 1 drags each by its own velocity."""
    drag = b if parameters.law == 1 else 0.0
    return (
        -(force + drag * v_club) / parameters.m_club,
        (force - drag * v_ball) / parameters.m_ball,
    )
