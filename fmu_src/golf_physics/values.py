"""Named values that the modules exchange: inputs, parameters, refusals, instants, motions."""

from typing import Any, NamedTuple

#: Makes a named tuple in a third of the time of its constructor.
new = tuple.__new__


#: Bodies that approach no faster, m/s, don't touch.
SLOWEST = 1e-30


class Inputs(NamedTuple):
    """What a host may change at every communication point."""

    k: float  #: contact stiffness, N/m
    b: float  #: damping, N.s/m
    club_speed: float  #: until first touch, m/s
    club_force: float  #: on the club head from first touch on, towards the ball, N


class Parameters(NamedTuple):
    """What initialization fixes, in the order of the table of variables."""

    m_club: float  #: kg
    m_ball: float  #: kg
    ball_diameter: float  #: m
    ball_speed: float  #: m/s
    gap: float  #: m
    law: int
    exponent: float
    reference_compression: float  #: m
    restitution_at_rest: float
    restitution_slope: float  #: s/m


class Refusal(NamedTuple):
    """Why a value, or a call, is refused."""

    sentence: str
    variable: str = ""  #: the name, if a single one is to be corrected
    status: str = "Error"  #: FMI's, of the message: "Discard" of a communication step

    def __str__(self) -> str:
        return self.sentence


def rejected(name: str, value: Any, reason: str, unit: str = "") -> Refusal:
    """Why this value of this variable isn't accepted."""
    return Refusal(f"{name} = {value:.12g}{unit} is refused: {reason}", name)


#: Time since the start of the run, s: two doubles (high, low) whose sum it is, so that an instant a
#: nanosecond into a contact that began after a long approach is exact. A plain tuple: a named one
#: would make a step that is read in flight 8 % slower.
Instant = tuple[float, float]

#: The start of the run.
START: Instant = (0.0, 0.0)


def added(instant: Instant, elapsed: float) -> Instant:
    """The instant so much later, s, without loss (two-sum): 10⁶ steps are as exact as one."""
    high, low = instant
    if not high and not low:
        return elapsed, 0.0
    total = high + elapsed
    back = total - high
    low += (high - (total - back)) + (elapsed - back)
    # The larger part is the sum's nearest double: the same one, however the steps were added.
    nearest = total + low
    return nearest, low - (nearest - total)


class Motion(NamedTuple):
    """Both bodies at an instant."""

    x_club: float  #: position of the club face, m
    x_ball: float  #: position of the ball's near side, m
    v_club: float  #: m/s
    v_ball: float  #: m/s
    compression: float  #: x_club - x_ball, m: their difference may lose digits
    closing: float  #: v_club - v_ball, m/s: likewise


#: Contact force (N), and a `Motion` up to the compression. A list, since it is what a read of the
#: outputs returns: a named tuple would make a step that is read 9 % slower.
State = list[float]
