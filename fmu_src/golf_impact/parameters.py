"""What values the component accepts, one by one and together, and how it says no."""

from math import inf, sqrt
from operator import attrgetter
from typing import Any

from .laws import LAWS
from .variables import VARIABLES, Variable

#: Rates (1/s), masses (kg), speeds and lengths outside these bounds would overflow on the way.
_SMALLEST, _LARGEST = 1e-75, 1e75

#: A larger damping ratio, or ratio of the masses, leaves nothing of one term beside the other.
_RATIO = 1e15


_NAMES = tuple(row.name for row in VARIABLES if row.causality == "parameter")
_values = attrgetter(*_NAMES)


class Parameters:
    """The values that stay fixed from the end of initialization on; never changed in place.

    Args:
        values: in the table's order.
    """

    # Not a named tuple: an attribute of one costs a look-up.
    __slots__ = (*_NAMES, "contact_law", "ordinary")

    m_club: float
    m_ball: float
    ball_diameter: float
    ball_speed: float
    gap: float
    law: int
    exponent: float
    reference_compression: float
    restitution_at_rest: float
    restitution_slope: float

    def __init__(self, *values: Any) -> None:
        # At once: a loop over the names would take four times as long.
        (
            self.m_club,
            self.m_ball,
            self.ball_diameter,
            self.ball_speed,
            self.gap,
            self.law,
            self.exponent,
            self.reference_compression,
            self.restitution_at_rest,
            self.restitution_slope,
        ) = values
        #: What `law` stands for.
        self.contact_law = LAWS[self.law]
        #: Far inside all bounds: no ordinary inputs lead out of them.
        self.ordinary = (
            1e-6 < self.m_club < 1e6 and 1e-6 < self.m_ball < 1e6 and self.gap < 1e30
            and abs(self.ball_speed) < 1e30
        )  # fmt: skip

    def values(self) -> tuple:
        """What it is made from."""
        return _values(self)


#: k (N/m), b (N.s/m) and club_speed (m/s): what a host may change at every communication point.
Inputs = tuple[float, float, float]

INPUTS = 3
SETTABLE = INPUTS + len(_NAMES)


def refusal(variable: Variable, value: object) -> str:
    """Why this value of this variable isn't accepted."""
    unit = f" {variable.unit}" if variable.unit not in ("", "1") else ""
    return f"{variable.name} = {value!r}{unit} is refused: it must be {_in_words(variable)}"


def _in_words(variable: Variable) -> str:
    if variable.type == "Enumeration" or variable.allowed == "finite":
        return variable.allowed if variable.type == "Enumeration" else "a finite number"
    if ".." in variable.allowed:
        return f"between {variable.low:g} and {variable.high:g}"
    return f"a finite number {variable.allowed}"


def conflict(parameters: Parameters, inputs: Inputs) -> str | None:
    """Why these values can't stand together, or None if they can.

    Each is allowed by itself; but values at the ends of a double's range may leave it when they are
    combined, and the law has its say.
    """
    p = parameters
    k, b, club_speed = inputs
    if p.ordinary and 1e-6 < k < 1e30 and b < 1e6 and -1e30 < club_speed < 1e30:
        # A quick yes, since a host may set inputs at every step.
        return p.contact_law.refusal(p, inputs)
    speed = abs(club_speed) + abs(p.ball_speed)
    total = p.m_club + p.m_ball
    mu = p.m_club * (p.m_ball / total)
    omega = sqrt(k / mu) if mu and k / mu < inf else inf
    zeta = b / (2.0 * mu * omega) if 0.0 < mu * omega < inf else inf
    if p.restitution_at_rest:
        # b isn't used, and a COR allows no more damping than can be computed.
        zeta = 0.0
    if not (
        mu >= _SMALLEST
        and total <= _LARGEST
        and _SMALLEST <= omega <= _LARGEST
        and zeta <= _RATIO
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
