"""Published measurements and computations of real impacts; measured.toml has them."""

from collections import namedtuple
from math import pi, radians
from pathlib import Path
from typing import Any, NamedTuple

from golf_impact.data.document import ROH_LEE
from golf_impact.data.files import read_toml
from golf_impact.data.quantities import QUANTITIES

#: One mile per hour, m/s.
MPH = 0.44704

#: One yard, m.
YARD = 0.9144

#: One revolution per minute, rad/s.
RPM = pi / 30.0

ROH = "W.-J. Roh, C.-W. Lee, 14th Int. Congress on Sound and Vibration, finite elements"

#: Directions without numbers: contact is shorter at higher club speed, longer with softer balls.
LOUGHBOROUGH = "Roberts, Jones, Rothberg, Measurement of contact time (Loughborough University)"

#: COR of ball and rigid club head: COR at zero speed, and slope -dCOR/dv, s/m (A. R. Penner, Am. J.
#: Phys. 69 (2001) 563 and Rep. Prog. Phys. 66 (2003) 131).
PENNER_AT_REST, PENNER_SLOPE = 0.86, 0.0029


class Measurement(NamedTuple):
    """A published result of an impact, for the FMU's start values of the masses."""

    what: str  #: its name in tables
    metric: str  #: the output of the FMU that it is compared with
    club_speed: float  #: of the impact, m/s
    low: float  #: the least value, SI units
    high: float  #: the largest; the same for a single value
    source: str  #: where it is published
    face: str = "rigid"  #: or "flexible": of the club
    short: str = ""  #: its label in figures, if it has one

    @property
    def middle(self) -> float:
        """The middle of the range, SI units."""
        return 0.5 * (self.low + self.high)


_DATA = read_toml(Path(__file__).with_suffix(".toml"))

MEASUREMENTS = [Measurement(**row) for row in _DATA["measurements"]]

#: Results that nothing was fitted to: `what`, `metric`, `club_speed` (m/s), `value` (SI), the
#: `factor` from SI to the unit in `what`, `source`.
PREDICTIONS: list[dict[str, Any]] = _DATA["predictions"]

#: The average stroke of a club, SI units, and a typical mass of its head.
Stroke = namedtuple(
    "Stroke",
    "club club_speed attack_angle ball_speed launch_angle backspin apex land_angle carry m_club",
)


def _stroke(club: str, *row: float) -> Stroke:
    speed, attack, ball, launch, rpm, apex, land, carry, mass = row
    attack, launch, land = map(radians, (attack, launch, land))
    spin, apex, carry = rpm * RPM, apex * YARD, carry * YARD
    speed, ball = speed * MPH, ball * MPH
    return Stroke(club, speed, attack, ball, launch, spin, apex, land, carry, mass)


#: Average strokes of the PGA Tour in 2023, by club, and where they are published.
PGA = {row[0]: _stroke(*row) for row in _DATA["pga"]["rows"]}
PGA_SOURCE = _DATA["pga"]["source"]

_U, _CLUB, _BALL = (ROH_LEE[name] for name in ("club_speed", "club_velocity", "ball_velocity"))

#: Roh & Lee's figures by the FMU's outputs (SI units).
ROH_LEE_FIGURES = {
    "club_velocity": _CLUB,
    "ball_velocity": _BALL,
    "smash_factor": _BALL / _U,
    "coefficient_of_restitution": (_BALL - _CLUB) / _U,
    **{name: ROH_LEE[name] for name in ("contact_time", "max_force", "time_of_max_force")},
}

#: The same as measurements, in the order of the figures.
FINITE_ELEMENTS = [
    Measurement(QUANTITIES[metric].plain, metric, _U, value, value, ROH)
    for metric, value in ROH_LEE_FIGURES.items()
]
