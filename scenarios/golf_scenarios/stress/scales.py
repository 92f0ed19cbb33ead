"""What an error of each output is measured by: the tolerance table of the design, in one place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

_SPEEDS = ("club_velocity", "ball_velocity")
_FORCES = ("force", "mean_force", "max_force")
_COMPRESSIONS = ("compression", "max_compression")
_PLACES = ("club_position", "ball_position")
_TIMES = ("contact_time", "time_of_max_force", "touch_time")

#: The bar for every error without unit.
BAR = 1e-13


@dataclass(frozen=True)
class Scales:
    """The scales of one impact that is over (or as far as it got).

    Attributes:
        values: what the run began with, and start_time.
        largest: the outputs then: max_force, max_compression, impulse and contact_time count.
        approach: s from the start to first touch.
        span: s from the start to where the outputs are looked at.
        fastest: the fastest rate in the contact, 1/s: where a time is known to 4e-16 of the
            approach, this fast the outputs in contact change with it.
        speed_after, energy_after: |v_C| + |v_B| (m/s) and kinetic energy (J) after the contact, for
            impacts that may gain some: a stiffness that rises adds energy.
    """

    values: Mapping[str, float]
    largest: Mapping[str, float]
    approach: float
    span: float = 0.0
    fastest: float = 0.0
    speed_after: float = 0.0
    energy_after: float = 0.0

    @property
    def contact_time(self) -> float:
        """T, s."""
        return self.largest["contact_time"]

    @property
    def speed(self) -> float:
        """|u_C| + |u_B|, or the same after the contact if that is more, m/s."""
        return max(
            abs(self.values["club_speed"]) + abs(self.values["ball_speed"]), self.speed_after
        )

    @property
    def energy_at_touch(self) -> float:
        """Kinetic energy of both bodies, J."""
        v = self.values
        return 0.5 * (v["m_club"] * v["club_speed"] ** 2 + v["m_ball"] * v["ball_speed"] ** 2)

    def of(self, name: str) -> float:
        """The scale of an output, in its unit."""
        v = self.values
        closing = abs(v["club_speed"] - v["ball_speed"])
        if name in _SPEEDS:
            return self.speed
        if name == "smash_factor":
            return self.speed / abs(v["club_speed"]) if v["club_speed"] else 1.0
        if name == "coefficient_of_restitution":
            return self.speed / closing
        if name in _FORCES:
            return self.largest["max_force"]
        if name in _COMPRESSIONS:
            return self.largest["max_compression"]
        if name == "impulse":
            return self.largest["impulse"]
        if name in (*_PLACES, "contact_displacement"):
            return self.speed * self.contact_time
        if name in _TIMES:
            return self.contact_time
        if name == "kinetic_energy":
            return max(self.energy_after, self.energy_at_touch)
        if name == "energy_efficiency":
            return max(1.0, self.energy_after / self.energy_at_touch)
        if name == "momentum":
            return (v["m_club"] + v["m_ball"]) * self.speed
        return 1.0

    def error(self, name: str, value: Any, exact: Any) -> float:
        """How far a value is from the exact one, without unit; the approach's share taken off.

        A flag is right (0) or wrong (inf).
        """
        if value == exact:
            return 0.0
        if isinstance(exact, bool):
            return float("inf")
        scale = self.of(name)
        if not scale:
            return float("inf")
        return max(0.0, float(abs(exact - value)) / scale - self.rounding_of_time(name))

    def rounding_of_time(self, name: str) -> float:
        """What the clock of a double leaves open: 4e-16 A/T, or more if things change faster."""
        before, growth = self.approach, 1.0
        if name == "touch_time":
            before += abs(self.values.get("start_time", 0.0))
        elif name in _PLACES or name == "mean_force":
            before = max(before, self.span)  # these reach over all the time that has passed
        if name in _PLACES:
            # Bodies that leave at another velocity get ever farther from where they should be.
            growth = max(1.0, (self.span - self.approach) / self.contact_time)
        slow = 4e-16 * before / self.contact_time
        return max(slow, 4e-16 * self.approach * self.fastest * growth)
