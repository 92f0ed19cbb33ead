"""Which values are rejected together."""

from math import sqrt

from .laws import LAWS
from .refusals import MOST_RATIO, refusal
from .restitution import MOST_DAMPING
from .values import Inputs, Parameters, Refusal
from .variables import LAWS as NAMES

#: By law: parameters that others alone use, with their values where they have no effect.
_OWN = {name: value for law in LAWS.values() for name, value in law.own_parameters.items()}
_OF_OTHER_LAWS = {
    n: [(name, value) for name, value in _OWN.items() if name not in law.own_parameters]
    for n, law in LAWS.items()
}


def conflict(p: Parameters, inputs: Inputs) -> Refusal | None:
    """Why these values, each of them allowed, are rejected together; or None."""
    for name, unused in _OF_OTHER_LAWS[p.law]:
        value = getattr(p, name)
        if value != unused:
            return refusal("OF_OTHER_LAWS", name, value, **of_other_laws(p.law, name))
    m_club, m_ball = p.m_club, p.m_ball
    if m_club > MOST_RATIO * m_ball or m_ball > MOST_RATIO * m_club:
        return refusal("MASS_RATIO", m_club=m_club, m_ball=m_ball)
    if p.restitution_at_rest:
        return None
    # Of a power law in its own time, see `RelativeLaw.damping`.
    mu = m_club * (m_ball / (m_club + m_ball))
    critical = 2.0 * sqrt(0.5 * (p.exponent + 1.0) * inputs.k * mu)
    if inputs.b <= MOST_DAMPING * critical:
        return None
    return refusal("DAMPING_RATIO", "b", inputs.b, zeta=inputs.b / critical, most=MOST_DAMPING)


def of_other_laws(law: int, name: str) -> dict[str, str]:
    """The words on a law that doesn't use this parameter."""
    words = {n: f"law = {n} ({NAMES[n][0]})" for n in LAWS}
    others = " or ".join(words[n] for n, other in LAWS.items() if name in other.own_parameters)
    return {"law": words[law], "unused": f"{_OWN[name]:g}", "others": others}
