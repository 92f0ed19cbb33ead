"""The values that the component accepts, each one and together, and why it rejects others."""

from math import inf, sqrt
from typing import Any

from .laws import LAWS
from .laws.contact import Inputs
from .variables import VARIABLES, Variable

#: Rates (1/s), masses (kg), speeds and lengths outside these bounds would overflow on the way.
_SMALLEST, _LARGEST = 1e-75, 1e75

#: A larger damping ratio, or ratio of the masses, leaves nothing of one term beside the other.
_RATIO = 1e15

_NAMES = tuple(row.name for row in VARIABLES if row.causality == "parameter")


class Parameters:
    """The values, in the table's order, that stay fixed from the end of initialization on."""

    __slots__ = (*_NAMES, "arguments", "contact_law", "ordinary")

    def __init__(self, *values: Any) -> None:
        self.arguments = values
        # At once: a loop over the names would take four times as long.
        (
            self.m_club, self.m_ball, self.ball_diameter, self.ball_speed, self.gap, self.law,
            self.exponent, self.reference_compression, self.restitution_at_rest,
            self.restitution_slope,
        ) = values  # fmt: skip
        self.contact_law = LAWS[self.law]
        #: Far inside all bounds: no ordinary inputs lead out of them.
        self.ordinary = (
            1e-6 < self.m_club < 1e6 and 1e-6 < self.m_ball < 1e6 and self.gap < 1e30
            and abs(self.ball_speed) < 1e30
        )  # fmt: skip


INPUTS = 3
SETTABLE = INPUTS + len(_NAMES)


def refusal(variable: Variable, value: object) -> str:
    """Why this value of this variable isn't accepted."""
    unit = f" {variable.unit}" if variable.unit not in ("", "1") else ""
    allowed = "a finite number"
    if variable.type == "Enumeration":
        allowed = variable.allowed
    elif ".." in variable.allowed:
        allowed = f"between {variable.low:g} and {variable.high:g}"
    elif variable.allowed != "finite":
        allowed += f" {variable.allowed}"
    return f"{variable.name} = {value!r}{unit} is refused: it must be {allowed}"


def conflict(parameters: Parameters, inputs: Inputs) -> str | None:
    """Why these values, each of them allowed, are rejected together; or None."""
    p = parameters
    k, b, club_speed = inputs
    # The fast path: a host may set inputs at every step.
    if p.ordinary and 1e-6 < k < 1e30 and b < 1e6 and -1e30 < club_speed < 1e30:
        return p.contact_law.refusal(p, inputs)
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
        return (
            f"k = {k!r}, b = {b!r}, m_club = {p.m_club!r}, m_ball = {p.m_ball!r}, club_speed = "
            f"{club_speed!r}, ball_speed = {p.ball_speed!r}, gap = {p.gap!r} together leave the "
            "range of a double: masses, speeds, gap and the frequency sqrt(k/mu) must stay below "
            f"{_LARGEST:g}, masses and frequency above {_SMALLEST:g} (SI), and the damping ratio "
            f"and the ratio of the masses below {_RATIO:g}"
        )
    return p.contact_law.refusal(p, inputs)
