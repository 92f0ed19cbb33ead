"""Published measurements and computations of real impacts, each with its source."""

from dataclasses import dataclass

from golf_impact.facts.document import ROH_LEE

#: One mile per hour, m/s.
MPH = 0.44704


@dataclass(frozen=True)
class Measurement:
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


PENNER = "A. R. Penner, Am. J. Phys. 69 (2001) 563 and Rep. Prog. Phys. 66 (2003) 131"
USGA = "USGA, What happens in a collision between club and ball, Golf Journal, May 2025"
THOMAS = "F. Thomas, PGA seminar on the spring-like effect (franklygolf.com)"
TRACKMAN = (
    "TrackMan averages of the PGA Tour: Golf Monthly, How far PGA Tour players hit every club"
)
ROH = "W.-J. Roh, C.-W. Lee, 14th Int. Congress on Sound and Vibration, finite elements"

#: Directions without numbers: contact is shorter at higher club speed, longer with softer balls.
LOUGHBOROUGH = "Roberts, Jones, Rothberg, Measurement of contact time (Loughborough University)"

#: COR of ball and rigid club head: COR at zero speed, and slope -dCOR/dv, s/m.
PENNER_AT_REST, PENNER_SLOPE = 0.86, 0.0029

#: The speed at which the rules test a driver's COR: 160 ft/s.
RULES_SPEED = 160.0 * 0.3048

_COR, _SMASH, _TIME = "coefficient_of_restitution", "smash_factor", "contact_time"


def _tour(club: int, ball: int, short: str = "") -> Measurement:
    """Average speeds on tour, mph."""
    what, smash = f"S, tour drivers, {club} mph", ball / club
    return Measurement(what, _SMASH, club * MPH, smash, smash, TRACKMAN, "flexible", short)


MEASUREMENTS = (
    Measurement("COR, finite elements", _COR, 35.0, 0.743, 0.743, ROH, short="Roh & Lee"),
    # No speed is given; it is about the test of the rules.
    Measurement("COR, rigid head", _COR, RULES_SPEED, 0.78, 0.78, THOMAS, short="Thomas"),
    Measurement(
        "COR, the rules' limit", _COR, RULES_SPEED, 0.822, 0.830, USGA, "flexible", "rules' limit"
    ),
    _tour(113, 167, "tour"),
    _tour(115, 171),
    Measurement("contact time, driver", _TIME, 113 * MPH, 450e-6, 500e-6, USGA, "flexible"),
)

#: Roh & Lee's figures by the FMU's outputs (SI units).
ROH_LEE_FIGURES = {
    **{name: ROH_LEE[name] for name in ("club_velocity", "ball_velocity")},
    "smash_factor": ROH_LEE["ball_velocity"] / ROH_LEE["club_speed"],
    "coefficient_of_restitution": (
        (ROH_LEE["ball_velocity"] - ROH_LEE["club_velocity"]) / ROH_LEE["club_speed"]
    ),
    **{name: ROH_LEE[name] for name in ("contact_time", "max_force", "time_of_max_force")},
}
