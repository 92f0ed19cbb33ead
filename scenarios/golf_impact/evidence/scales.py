"""Scales of errors by output: the tolerance table, in one place."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from golf_impact.data.runs import reduced_mass

_PLACES = ("club_position", "ball_position")
_LARGEST = ("max_force", "max_compression", "impulse", "contact_time")
_AFTER = ("club_velocity", "ball_velocity", "kinetic_energy")

#: For every error without unit.
TOLERANCE = 1e-13


@dataclass(frozen=True)
class Scales:
    """The scales of one impact that is over (or as far as it got)."""

    values: Mapping[str, float]  #: inputs and parameters at the start, and start_time
    largest: Mapping[str, float]  #: outputs then: max_force, max_compression, impulse, contact_time
    approach: float  #: s from the start to first touch
    span: float = 0.0  #: s from the start to the instant of the outputs
    #: The fastest rate in the contact, 1/s: an error in time, 4e-16 of the approach, becomes one of
    #: the outputs in contact by this rate.
    fastest: float = 0.0
    #: Outputs after the contact, for impacts that gain energy from a stiffness that rises.
    after: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def _table(self) -> dict[str, float]:
        v, time = self.values, self.largest["contact_time"]
        m_club, m_ball, u_club, u_ball = v["m_club"], v["m_ball"], v["club_speed"], v["ball_speed"]
        speed = abs(u_club) + abs(u_ball)
        energy = most = 0.5 * (m_club * u_club**2 + m_ball * u_ball**2)
        if self.after:
            speed = max(speed, abs(self.after["club_velocity"]) + abs(self.after["ball_velocity"]))
            most = max(energy, self.after["kinetic_energy"])
        return {
            **dict.fromkeys(("club_velocity", "ball_velocity"), speed),
            "smash_factor": speed / abs(u_club) if u_club else 1.0,
            "coefficient_of_restitution": speed / abs(u_club - u_ball),
            **dict.fromkeys(("force", "mean_force", "max_force"), self.largest["max_force"]),
            **dict.fromkeys(("compression", "max_compression"), self.largest["max_compression"]),
            "impulse": self.largest["impulse"],
            **dict.fromkeys((*_PLACES, "contact_displacement"), speed * time),
            **dict.fromkeys(("contact_time", "time_of_max_force", "touch_time"), time),
            "kinetic_energy": most,
            "energy_efficiency": most / energy,
            "momentum": (m_club + m_ball) * speed,
        }

    def of(self, name: str) -> float:
        """The scale of a Real output, in its unit."""
        return self._table[name]

    def error(self, name: str, value: Any, exact: Any) -> float:
        """Error of a value, without unit, less that which is due to the approach.

        A flag is right (0) or wrong (inf).
        """
        if value == exact:
            return 0.0
        scale = 0.0 if isinstance(exact, bool) else self.of(name)
        if not scale:
            return float("inf")
        return max(0.0, float(abs(exact - value)) / scale - self.rounding_of_time(name))

    def rounding_of_time(self, name: str) -> float:
        """Error due to rounding of times: 4e-16 A/T, or more if the output changes faster."""
        before, growth, time = self.approach, 1.0, self.largest["contact_time"]
        if name == "touch_time":
            before += abs(self.values.get("start_time", 0.0))
        elif name in (*_PLACES, "mean_force"):
            before = max(before, self.span)  # these reach over all the time that has passed
        if name in _PLACES:
            # Afterwards a body moves at up to twice the scale of its velocity.
            before *= 2.0
            # The effect of an error in velocity on a position grows with time.
            growth = max(1.0, (self.span - self.approach) / time)
        return max(4e-16 * before / time, 4e-16 * self.approach * self.fastest * growth)


def scales_of(
    values: Mapping[str, Any],
    outputs: Mapping[str, Any],
    approach: float,
    span: float,
    changes: Iterable[tuple[float, Mapping[str, float]]] = (),
    after: Mapping[str, Any] | None = None,
) -> Scales:
    """The scales of an impact.

    Args:
        values: inputs and parameters at the start, and start_time.
        outputs: max_force, max_compression, impulse and contact_time in the end. A contact without
            a time (0 or NaN) is measured by the time since touch.
        approach: s from the start to first touch.
        span: s from the start to the end.
        changes: instants, s from the start, and inputs from then on.
        after: club_velocity, ball_velocity and kinetic_energy, where the impact may gain energy.
    """
    start, now, fastest = dict(values), dict(values), 0.0
    largest = {name: float(outputs[name]) for name in _LARGEST}
    if not largest["contact_time"] > 0.0:
        largest["contact_time"] = span - approach
    stiffer, n = 1.0, values.get("exponent", 1.0)
    if n != 1.0:
        relative = largest["max_compression"] / values["reference_compression"]
        stiffer = max(1.0, n * relative ** (n - 1.0))
    for time, inputs in ((0.0, {}), *changes):
        now |= inputs
        mu = reduced_mass(now)
        fastest = max(fastest, math.sqrt(now["k"] * stiffer / mu), now["b"] / mu)
        if time <= approach:  # the speed that counts is the last one set before touch
            start["club_speed"] = now["club_speed"]
    after = {name: float(value) for name, value in (after or {}).items() if name in _AFTER}
    return Scales(start, largest, approach, span, fastest, after)
