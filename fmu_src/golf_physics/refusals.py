"""Which values are rejected, each one and together, and why."""

from math import inf, sqrt
from typing import Any

from .laws import LAWS, Law
from .values import Inputs, Parameters, Refusal
from .variables import Variable

#: Rates (1/s), masses (kg), speeds and lengths outside these bounds would overflow on the way.
_SMALLEST, _LARGEST = 1e-75, 1e75

#: A larger damping ratio, or ratio of the masses, leaves nothing of one term beside the other.
_RATIO = 1e15

#: Laws that may reject ordinary inputs without a variant.
_STRICT = {
    n for n, law in LAWS.items() if type(law).refusal is not Law.refusal and not law.variants
}

#: By law: parameters that select variants of others, with the values where they select none.
_VARIANTS = {name: value for law in LAWS.values() for name, value in law.variants.items()}
_OF_OTHERS = {
    n: [(name, value) for name, value in _VARIANTS.items() if name not in law.variants]
    for n, law in LAWS.items()
}


def refusal(variable: Variable, value: Any) -> Refusal:
    """Why this value of this variable isn't accepted."""
    unit = f" {variable.unit}" if variable.unit not in ("", "1") else ""
    allowed = variable.allowed
    if variable.type != "Enumeration":
        if ".." in allowed:
            allowed = f"between {variable.low:g} and {variable.high:g}"
        else:
            allowed = f"a finite number {allowed}".removesuffix(" finite")
    reason = f"it must be {allowed}"
    sentence = f"{variable.name} = {value!r}{unit} is refused: {reason}"
    return Refusal(sentence, variable.name, value, reason)


def conflict(p: Parameters, inputs: Inputs) -> Refusal | None:
    """Why these values, each of them allowed, are rejected together; or None."""
    for name, unused in _OF_OTHERS[p.law]:
        value = getattr(p, name)
        if value != unused:
            others = (f"law = {n} ({o.name})" for n, o in LAWS.items() if name in o.variants)
            reason = f"set {name} = {unused:g}, or {' or '.join(others)}"
            law = f"law = {p.law} ({LAWS[p.law].name})"
            sentence = f"{name} = {value!r} is refused with {law}: {reason}"
            return Refusal(sentence, name, value, reason)
    return conflict_of_inputs(p, inputs)


def conflict_of_inputs(p: Parameters, inputs: Inputs) -> Refusal | None:
    """The same, with parameters that some inputs have been accepted with."""
    k, b, club_speed, club_force = inputs
    # The fast path: a host may set inputs at every step.
    if (
        p.ordinary
        and 1e-6 < k < 1e30
        and b < 1e6
        and -1e30 < club_speed < 1e30
        and -1e30 < club_force < 1e30
    ):
        return LAWS[p.law].refusal(p, inputs) if p.law in _STRICT else None
    speed = abs(club_speed) + abs(p.ball_speed)
    total = p.m_club + p.m_ball
    mu = p.m_club * (p.m_ball / total)
    omega = sqrt(k / mu) if mu else inf
    # If b isn't used: a COR allows no more damping than can be computed.
    if not (
        mu >= _SMALLEST
        and total <= _LARGEST
        and _SMALLEST <= omega <= _LARGEST
        and (p.restitution_at_rest or b <= 2.0 * _RATIO * mu * omega)
        and p.m_club <= _RATIO * p.m_ball
        and p.m_ball <= _RATIO * p.m_club
        and speed <= _LARGEST
        and p.gap <= _LARGEST
    ):
        reason = (
            "masses, speeds, gap and the frequency sqrt(k/mu) must stay below "
            f"{_LARGEST:g}, masses and frequency above {_SMALLEST:g} (SI), and the damping ratio "
            f"and the ratio of the masses below {_RATIO:g}"
        )
        given = (
            f"k = {k!r}, b = {b!r}, m_club = {p.m_club!r}, m_ball = {p.m_ball!r}, club_speed = "
            f"{club_speed!r}, ball_speed = {p.ball_speed!r}, gap = {p.gap!r} together leave the "
            "range of a double"
        )
        return Refusal(f"{given}: {reason}", reason=reason)
    if abs(club_force) > _LARGEST * p.m_club:
        reason = f"its acceleration of the club head must stay below {_LARGEST:g} m/s2"
        sentence = f"club_force = {club_force!r} N is refused: {reason}"
        return Refusal(sentence, "club_force", club_force, reason)
    return LAWS[p.law].refusal(p, inputs)
