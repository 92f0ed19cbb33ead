"""A club with loft: ClubBallImpact along the face normal, then Launch.fmu for spin and angle."""

from math import cos
from typing import Any

from golf_impact.ball import BALLS
from golf_impact.fmu import Fmu, Impact

#: What Launch.fmu takes from ClubBallImpact, and what it returns.
_IMPACT = ("ball_velocity", "club_velocity", "smash_factor", "coefficient_of_restitution")
_LAUNCH = ("ball_speed", "launch_angle", "backspin", "tangential_impulse")


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
    rows = launch.simulate(
        1e-3, _LAUNCH, start_values={**given, **values, **hit, "separated": True}
    )
    return {**hit, **{name: float(rows[name][-1]) for name in _LAUNCH}}


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
