"""Scales of errors by output: the tolerance table, in one place."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from golf_impact.data.runs import reduced_mass

_PLACES = ("club_position", "ball_position")

#: For every error without unit.
TOLERANCE = 1e-13


class Scales:
    """The scales of one impact that is over (or as far as it got).

    Args:
        values: inputs and parameters at the start, and start_time.
        outputs: max_force, max_compression, impulse and contact_time in the end. A contact without
            a time (0 or NaN) is measured by the time since touch. With a force on the head, or a
            stiffness that rises, energy is gained: club_velocity, ball_velocity and kinetic_energy.
        approach: s from the start to first touch.
        span: s from the start to the end.
        changes: instants, s from the start, and inputs from then on.
    """

    def __init__(
        self,
        values: Mapping[str, Any],
        outputs: Mapping[str, Any],
        approach: float,
        span: float,
        changes: Sequence[tuple[float, Mapping[str, float]]] = (),
    ) -> None:
        self.approach, self.span = approach, span
        self.start_time = abs(values.get("start_time", 0.0))
        names = ("max_force", "max_compression", "impulse", "contact_time")
        force, compression, impulse, time = (float(outputs[name]) for name in names)
        self.contact_time = time if time > 0.0 else span - approach
        stiffer, n = 1.0, values.get("exponent", 1.0)
        if n != 1.0:
            relative = compression / values["reference_compression"]
            stiffer = max(1.0, n * relative ** (n - 1.0))
        #: The fastest rate in the contact, 1/s: an error in time, 4e-16 of the approach, becomes
        #: one of the outputs in contact by this rate.
        self.fastest = 0.0
        now, u_club = dict(values), values["club_speed"]
        for instant, inputs in ((0.0, {}), *changes):
            now |= inputs
            mu = reduced_mass(now)
            self.fastest = max(self.fastest, math.sqrt(now["k"] * stiffer / mu), now["b"] / mu)
            if instant <= approach:  # the speed that counts is the last one set before touch
                u_club = now["club_speed"]
        m_club, m_ball, u_ball = values["m_club"], values["m_ball"], values["ball_speed"]
        speed, energy = abs(u_club) + abs(u_ball), 0.5 * (m_club * u_club**2 + m_ball * u_ball**2)
        most = energy
        if changes or values.get("club_force"):
            v_club, v_ball = (abs(float(outputs[f"{body}_velocity"])) for body in ("club", "ball"))
            speed, most = max(speed, v_club + v_ball), max(energy, float(outputs["kinetic_energy"]))
        self._table: dict[str, float] = {
            **dict.fromkeys(("club_velocity", "ball_velocity"), speed),
            "smash_factor": speed / abs(u_club) if u_club else 1.0,
            "coefficient_of_restitution": speed / (abs(u_club - u_ball) or 1.0),
            **dict.fromkeys(("force", "mean_force", "max_force"), force),
            **dict.fromkeys(("compression", "max_compression"), compression),
            "impulse": impulse,
            **dict.fromkeys((*_PLACES, "contact_displacement"), speed * self.contact_time),
            **dict.fromkeys(("contact_time", "time_of_max_force", "touch_time"), self.contact_time),
            "kinetic_energy": most,
            "energy_efficiency": most / (energy or 1.0),
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
            return math.inf
        excess = float(abs(exact - value)) / scale - self.rounding_of_time(name)
        return 0.0 if excess <= 0.0 else excess  # NaN stays

    def rounding_of_time(self, name: str) -> float:
        """Error due to rounding of times: 4e-16 A/T, or more if the output changes faster."""
        before, growth, time = self.approach, 1.0, self.contact_time
        if name == "touch_time":
            before += self.start_time
        elif name in (*_PLACES, "mean_force"):
            before = max(before, self.span)  # these reach over all the time that has passed
        if name in _PLACES:
            # Afterwards a body moves at up to twice the scale of its velocity.
            before *= 2.0
            # The effect of an error in velocity on a position grows with time.
            growth = max(1.0, (self.span - self.approach) / time)
        return max(4e-16 * before / time, 4e-16 * self.approach * self.fastest * growth)
