"""Published measurements and computations of real impacts; measured.toml has them."""

from pathlib import Path
from typing import NamedTuple

from golf_impact.facts.document import ROH_LEE
from golf_impact.facts.toml import read_toml

#: One mile per hour, m/s.
MPH = 0.44704

PENNER = "A. R. Penner, Am. J. Phys. 69 (2001) 563 and Rep. Prog. Phys. 66 (2003) 131"
ROH = "W.-J. Roh, C.-W. Lee, 14th Int. Congress on Sound and Vibration, finite elements"

#: Directions without numbers: contact is shorter at higher club speed, longer with softer balls.
LOUGHBOROUGH = "Roberts, Jones, Rothberg, Measurement of contact time (Loughborough University)"

#: COR of ball and rigid club head: COR at zero speed, and slope -dCOR/dv, s/m.
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

#: Average launches of the PGA Tour: club, club speed (mph), attack angle (deg), ball speed (mph),
#: launch angle (deg), backspin (rpm), carry (yd); and a typical head mass (kg).
TOUR = _DATA["tour"]

_U, _CLUB, _BALL = (ROH_LEE[name] for name in ("club_speed", "club_velocity", "ball_velocity"))

#: Roh & Lee's figures by the FMU's outputs (SI units).
ROH_LEE_FIGURES = {
    "club_velocity": _CLUB,
    "ball_velocity": _BALL,
    "smash_factor": _BALL / _U,
    "coefficient_of_restitution": (_BALL - _CLUB) / _U,
    **{name: ROH_LEE[name] for name in ("contact_time", "max_force", "time_of_max_force")},
}
