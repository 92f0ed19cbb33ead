"""What a contact law is told, what it answers, and what a contact phase answers."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

#: Until this time (in units of 1/rate) after touch, what is small is asked for by itself.
EARLY = 1e-3

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


class Start(NamedTuple):
    """Where the bodies are when a contact phase begins.

    Attributes:
        x_club: position of the club face, m.
        compression: how far it is past the ball's rest shape, m, >= 0.
        v_club, v_ball: velocities, m/s.
        closing: v_club - v_ball, which may be known better than that difference tells, m/s.
    """

    x_club: float
    compression: float
    v_club: float
    v_ball: float
    closing: float


#: Position of the ball (m), velocities of club and ball (m/s), compression (m), and how fast that
#: grows (m/s).
End = tuple[float, float, float, float, float]


class ContactPhase(Protocol):
    """Contact under constant k and b, from its start until the contact force is gone.

    It is made from k (contact stiffness, N/m, > 0), b (damping, N.s/m, >= 0), m_club and m_ball
    (masses, kg) and where the bodies are. Times are s since the start, at most `duration`.
    """

    #: s until contact ends; inf if it never does.
    duration: float
    #: The fastest rate of change in the phase, 1/s.
    rate: float

    def course(self) -> tuple[Callable[[float], State], float]:
        """A function that gives the state, and how much of its own time passes in a second."""

    def end(self) -> End:
        """Where things are when contact ends."""

    def compression(self, t: float) -> float:
        """Compression, m, good relative to itself however small it is just after touch."""

    def closing(self, t: float) -> float:
        """Closing speed v_club - v_ball, m/s, good relative to itself."""

    def impulse(self, begin: float, width: float) -> float:
        """Impulse of the contact force over [begin, begin + width], N.s."""

    def peak_force(self, t: float) -> tuple[float, float]:
        """The largest contact force on [0, t], N, and its time."""

    def peak_compression(self, t: float) -> float:
        """The largest compression on [0, t], m."""


class Law(Protocol):
    """A contact law: m_C v_C' = -F - c v_C, m_B v_B' = F - c v_B with force F and drag c."""

    #: As the FMU's enumeration shows it.
    name: str
    description: str

    def refusal(self, p: Parameters, inputs: Inputs) -> str | None:
        """Why the law can't have these values, or None."""
        return None

    def refusal_of_touch(self, p: Parameters, club_speed: float) -> str | None:
        """Why it can't have a touch at this speed (m/s), or None."""
        return None

    def damping(self, p: Parameters, k: float, closing: float) -> float:
        """The damping (N.s/m) that gives the coefficient of restitution of the parameters.

        At this approach speed (m/s); asked for only if the law has accepted such parameters.
        """
        raise AssertionError("such parameters are refused")

    def contact(self, p: Parameters, k: float, b: float, start: Start) -> ContactPhase:
        """The phase that begins at `start`: first touch while closing, or a force above 0."""

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        """Contact force, N; past the end of contact it goes on below 0."""

    def drag(self, b: float) -> float:
        """The coefficient c of the drag on each body, N.s/m."""
        return 0.0
