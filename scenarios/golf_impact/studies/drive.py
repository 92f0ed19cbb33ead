"""A club with loft: ClubBallImpact along the face normal, Launch for spin and angle, BallFlight."""

from math import cos, isnan
from typing import Any

from golf_build.system import DRIVE
from golf_impact.data.balls import BALLS
from golf_impact.data.balls import ball as ball_of
from golf_impact.data.errors import refused, unknown_name
from golf_impact.data.runs import METRICS, Named
from golf_impact.data.units import number
from golf_impact.fmu import Fmu, Impact, current_fmu

#: What Launch.fmu takes from ClubBallImpact, and what it returns.
_IMPACT = ("ball_velocity", "club_velocity", "smash_factor", "coefficient_of_restitution")
_LAUNCH = ("ball_speed", "launch_angle", "backspin", "tangential_impulse")

_FLIGHT = ("carry", "apex", "flight_time", "land_angle")

#: The head of `drive` where nothing else is given: the driver of GolfSwing.ssp.
_HEAD = ("m_club", "strike_height", "centre_depth", "head_inertia")


def drive(
    ball: str = "tour",
    club_speed: float | str = "113 mph",
    loft: float | str = "14 deg",
    attack_angle: float | str = "0 deg",
    **parameters: float | str,
) -> dict[str, float]:
    """Compute impact, launch and flight of a shot, through their FMUs.

    ClubBallImpact, Launch and BallFlight are built if necessary. The head is the driver of
    GolfSwing.ssp, struck 10 mm above its centre of mass, unless parameters say otherwise.

    Args:
        ball: a preset (`balls()`), or a file .toml.
        club_speed: of the head along its path, m/s; its component along the face normal is
            ClubBallImpact's `club_speed`.
        loft: dynamic loft: of the face normal above the ground at impact, rad.
        attack_angle: of the head's path above the ground, rad.
        parameters: k, b, club_force and the parameters of the three FMUs by name; `m_club` is that
            of the head. As all other values in SI units, or text with a unit ("10.5 deg").

    Returns:
        The outputs of the three FMUs by name (SI units): those of `run_impact`, ball_speed,
        launch_angle, backspin, tangential_impulse, carry, apex, flight_time, land_angle.

    Raises:
        UserError: an FMU rejects a value or has no parameter of a name, or the head doesn't hit the
            ball.

    Example:
        >>> found = drive(club_speed="100 mph", loft="12 deg")
        >>> round(found["smash_factor"], 3), round(found["carry"])
        (1.463, 198)
    """
    with (
        Impact() as impact,
        Fmu(current_fmu("Launch")) as launch,
        Fmu(current_fmu("BallFlight")) as flight,
    ):
        variables = flight.variables | launch.variables | impact.variables
        known = {n for n, v in variables.items() if v.causality == "parameter"}
        known = (known | {"k", "b", "club_force"}) - {"dynamic_loft", "attack_angle"}
        values: dict[str, Any] = {name: DRIVE["Launch"][name] for name in _HEAD}
        values |= ball_of(ball).values
        for name, given in parameters.items():
            if name not in known:
                own_names = {"ball", "club_speed", "loft", "attack_angle"}
                raise unknown_name("parameter", name, sorted(known | own_names))
            values[name] = number(name, given, variables[name].unit or "")
        speed = number("club_speed", club_speed)
        face = _angle("loft", loft, variables["dynamic_loft"])
        path = _angle("attack_angle", attack_angle, variables["attack_angle"])

        def own(fmu: Fmu) -> dict[str, Any]:
            return {name: value for name, value in values.items() if name in fmu.variables}

        # A head that turns gives way: 1/m_club + strike_height^2/head_inertia along the normal.
        turning = values["strike_height"] ** 2 / values["head_inertia"]
        effective = 1.0 / (1.0 / values["m_club"] + turning)
        normal = {"m_club": effective, "club_speed": speed * cos(face - path)}
        hit = impact(METRICS, **own(impact) | normal)
        if isnan(hit["contact_time"]):
            reason = "club and ball must meet, and separate"
            raise refused("club_speed", club_speed, reason)
        start = own(launch) | {"dynamic_loft": face, "attack_angle": path}
        left = _launch(launch, start, hit)
        start = own(flight) | {name: left[name] for name in ("launch_angle", "backspin")}
        start |= {"ball_velocity": left["ball_speed"], "separated": True}
        landed = flight.simulate(1e-3, _FLIGHT, start_values=start)[-1]
    return Named(hit | left | {name: float(landed[name]) for name in _FLIGHT})


def _angle(name: str, given: float | str, variable: Any) -> float:
    """An angle within the range of Launch's variable, rad."""
    angle, low, high = number(name, given, "rad"), float(variable.min), float(variable.max)
    if not low <= angle <= high:
        reason = (
            f"it must be between {low} and {high} rad; of degrees write text such as '10.5 deg'"
        )
        raise refused(name, given, reason)
    return angle


def _launch(launch: Fmu, start: dict[str, Any], hit: dict[str, float]) -> dict[str, float]:
    """The outputs of Launch after an impact."""
    given = {name: hit[name] for name in _IMPACT}
    rows = launch.simulate(1e-3, _LAUNCH, start_values={**start, **given, "separated": True})
    return {name: float(rows[name][-1]) for name in _LAUNCH}


def shot(
    impact: Impact,
    launch: Fmu,
    speed: float,
    loft: float,
    attack: float = 0.0,
    ball: str = "penner",
    m_club: float = 0.210,
    **values: float,
) -> dict[str, float]:
    """The results of ClubBallImpact and Launch for a head speed (m/s) and a loft.

    Args:
        impact: ClubBallImpact, whose speeds are components along the face normal.
        launch: Launch.fmu.
        speed: of the club head, m/s.
        loft: dynamic loft at impact, rad.
        attack: attack angle, rad.
        ball: a preset.
        m_club: kg.
        values: further parameters of Launch.
    """
    normal = {"m_club": m_club, "club_speed": speed * cos(loft - attack)}
    hit = impact(_IMPACT, **{**BALLS[ball].values, **normal})
    given: dict[str, Any] = {"dynamic_loft": loft, "attack_angle": attack, "m_club": m_club}
    return {**hit, **_launch(launch, {**given, **values}, hit)}


def shot_of(
    impact: Impact, launch: Fmu, speed: float, angle: float, attack: float, **values: Any
) -> dict[str, float]:
    """The shot whose launch has this angle (rad), with its `dynamic_loft`; see `shot`."""
    loft = angle
    for _ in range(40):
        found = shot(impact, launch, speed, loft, attack, **values)
        # The ball leaves at 0.6 to 0.9 of the loft: this is a contraction.
        error = angle - found["launch_angle"]
        if abs(error) < 1e-13:
            break
        loft += error
    return found | {"dynamic_loft": loft}
