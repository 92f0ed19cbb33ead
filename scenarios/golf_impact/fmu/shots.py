"""Shots: ClubBallImpact, Launch and BallFlight in a row, one shot at a time."""

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import cos
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.ball import BALLS
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.fmu.system import build_system

_IMPACT = ("ball_velocity", "club_velocity", "smash_factor", "coefficient_of_restitution")
_LAUNCH = ("ball_speed", "launch_angle", "backspin", "tangential_impulse")
_FLIGHT = ("carry", "apex", "flight_time", "land_angle")

#: A measured driver head: mass (kg), depth of the centre of mass (m) and inertia (kg.m2), taken
#: as that in the vertical plane. PING, Proceedings 2020, 49(1), 47, Table 1: 204 g, 42.3 mm,
#: principal moments 2843, 5679 and 4085 g.cm2, without their axes.
HEAD, DEPTH, INERTIA = 0.204, 0.0423, 4.085e-4


def bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a rising function is 0, to 1e-12 of the interval."""
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if function(middle) > 0.0 else (middle, high)
    return high


class Shots:
    """Shots of a club with loft, in SI units; the ball is one of the presets."""

    def __init__(self, fmu: ImpactFmu, launch: LoadedFmu, flight: LoadedFmu) -> None:
        self.fmu, self.launch, self.flight = fmu, launch, flight

    def shot(
        self,
        speed: float,
        loft: float,
        attack: float = 0.0,
        ball: str = "penner",
        m_club: float = 0.210,
        height: float | None = None,
        **values: float,
    ) -> dict[str, float]:
        """The results of head speed (m/s), loft, attack angle (rad) and strike height (m).

        `values` are further parameters of Launch. With a strike height, 0 too, the head turns:
        `HEAD`'s depth and inertia.
        """
        head = {"dynamic_loft": loft, "attack_angle": attack, "m_club": m_club}
        if height is not None:
            head |= {"strike_height": height, "centre_depth": DEPTH, "head_inertia": INERTIA}
            m_club = 1.0 / (1.0 / m_club + height**2 / INERTIA)
        normal = {"m_club": m_club, "club_speed": speed * cos(loft - attack)}
        impact = self.fmu.impact(_IMPACT, **{**BALLS[ball].values, **normal})
        self.launch.start(**head, **values)
        self.launch.set({**impact, "separated": True})
        self.launch.step(0.0, 1e-3)
        return impact | self.launch.read(_LAUNCH)

    def lofted(self, speed: float, angle: float, attack: float, **values: Any) -> dict[str, float]:
        """The shot with the dynamic loft (rad) whose launch has this angle (rad)."""

        def excess(loft: float) -> float:
            return self.shot(speed, loft, attack, **values)["launch_angle"] - angle

        loft = bisect(excess, max(attack, 0.0), 0.9)
        return self.shot(speed, loft, attack, **values) | {"dynamic_loft": loft}

    def fly(self, speed: float, angle: float, backspin: float, **air: float) -> dict[str, float]:
        """The flight of a launch (m/s, rad, rad/s): carry, apex, flight time and land angle."""
        launch = {"ball_velocity": speed, "launch_angle": angle, "backspin": backspin}
        self.flight.start(**launch, **air)
        self.flight.set({"separated": True})
        self.flight.step(0.0, 1e-3)
        return self.flight.read(_FLIGHT)

    def contact(
        self, ball: str, m_club: float, approach: float, u: np.ndarray
    ) -> Iterator[np.ndarray]:
        """Time, force and compression (SI units) where the relative velocity is u × approach."""
        given = {**BALLS[ball].values, "m_club": m_club, "club_speed": approach}
        end = self.fmu.impact(("contact_time",), **given)["contact_time"]
        time = np.linspace(0.0, end, 2001)
        self.fmu.start(**given)
        names = ("force", "compression", "club_velocity", "ball_velocity")
        force, compression, club, velocity = self.fmu.sample(time, names).values()
        falling = (velocity - club) / approach
        return (np.interp(-u, falling, column) for column in (time, force, compression))


@contextmanager
def loaded_shots(fmu: ImpactFmu) -> Iterator[Shots]:
    """Shots with this FMU, and with Launch.fmu and BallFlight.fmu built for them."""
    with tempfile.TemporaryDirectory(prefix="golf-impact-shots-") as folder:
        files = build_system(Path(folder))
        with LoadedFmu(files["Launch"]) as launch, LoadedFmu(files["BallFlight"]) as flight:
            yield Shots(fmu, launch, flight)
