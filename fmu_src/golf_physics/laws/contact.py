"""The interface of contact laws and of contact phases: arguments and return values."""

from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol

#: Until this time (in units of 1/rate) after touch, compression and force are evaluated separately:
#: the closed form suffers from cancellation there.
EARLY = 1e-3

#: Of a value, relative.
_ROUNDING = 4e-15

#: k (N/m), b (N.s/m) and club_speed (m/s): what a host may change at every communication point.
Inputs = tuple[float, float, float]


class Parameters(Protocol):
    """The values that stay fixed from the end of initialization on; see the table of variables."""

    __slots__ = ()

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


#: Force (N), positions of club and ball (m), their velocities (m/s), compression (m).
State = list[float]


class InitialState(NamedTuple):
    """The bodies at the start of a contact phase.

    Attributes:
        x_club: position of the club face, m.
        compression: how far it is past the ball's rest shape, m, >= 0.
        v_club, v_ball: velocities, m/s.
        closing: v_club - v_ball, m/s; given separately because the difference may lose digits.
    """

    x_club: float
    compression: float
    v_club: float
    v_ball: float
    closing: float


#: Position of the ball (m), velocities of club and ball (m/s), compression (m), and its rate of
#: change (m/s).
EndState = tuple[float, float, float, float, float]


class ContactPhase(Protocol):
    """Contact under constant k and b, from its initial state until the contact force is zero.

    Times are s since the start of the phase, at most `duration`. A phase is a value: methods return
    the same results in any order of calls.
    """

    #: s until contact ends; inf if it never does.
    duration: float
    #: The fastest rate of change in the phase, 1/s.
    rate: float

    def dense_output(self) -> tuple[Callable[[float], State], float]:
        """A function from scaled time to the state, and the time scale in 1/s."""

    def end(self) -> EndState:
        """The bodies when contact ends."""

    def compression(self, t: float) -> float:
        """Compression, m, to full relative accuracy just after touch."""

    def closing(self, t: float) -> float:
        """Closing speed v_club - v_ball, m/s, to full relative accuracy."""

    def impulse(self, begin: float, width: float) -> float:
        """Impulse of the contact force over [begin, begin + width], N.s."""

    def peak_force(self, t: float) -> tuple[float, float]:
        """The largest contact force on [0, t], N, and its time."""

    def peak_compression(self, t: float) -> float:
        """The largest compression on [0, t], m."""


def largest_until(
    t: float, value: Callable[[float], float], maxima: Iterable[tuple[float, float]]
) -> tuple[float, float]:
    """The largest value on [0, t] and its time, from the maxima (time, value) inside the phase."""
    passed = [(0.0, value(0.0)), *(point for point in maxima if point[0] <= t)]
    when, largest = max(passed, key=lambda point: point[1])
    now = value(t)
    # Just after a maximum, rounding must not move its time.
    return (now, t) if now > largest + _ROUNDING * abs(largest) else (largest, when)
