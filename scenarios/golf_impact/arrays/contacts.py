"""Impacts with a contact in closed form: a table of formulas for each contact law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from golf_impact.arrays.elementwise import Values


class Motion(NamedTuple):
    """The bodies in contact."""

    force: Values  #: N
    compression: Values  #: m
    club_velocity: Values  #: m/s
    ball_velocity: Values
    travel: Values  #: of the ball since first touch, m


class Contacts:
    """Impacts, each with a touch and a separation; attributes are computed on demand.

    Attributes are `values`, which are all inputs and parameters by name (SI units), and what the
    formulas give: outputs at the end of the communication step, whose size `horizon` (s) has to be
    among the values for those that depend on it; what they are made of; `closed`, without which
    the others are meaningless; `motion`, a function that gives the Motion t s after first touch.
    """

    def __init__(self, formulas: Mapping[str, Formula], values: Mapping[str, Values]) -> None:
        vars(self).update(values, formulas=formulas)

    def __getattr__(self, name: str) -> Any:
        if name not in self.formulas:
            raise AttributeError(name)
        value = self.__dict__[name] = self.formulas[name](self)
        return value

    def energy(self, v_club: Values, v_ball: Values) -> Values:
        """Kinetic energy of bodies with these velocities (m/s), J."""
        return 0.5 * (self.m_club * v_club * v_club + self.m_ball * v_ball * v_ball)


Formula = Callable[[Contacts], Any]

#: Of all laws. p and q are the mass fractions of ball and club, mu is the reduced mass, kg; `left`
#: is the compression at separation, `apart` minus the distance at the end, m.
COMMON: dict[str, Formula] = {
    "closing": lambda c: c.club_speed - c.ball_speed,
    "p": lambda c: c.m_ball / (c.m_club + c.m_ball),
    "q": lambda c: c.m_club / (c.m_club + c.m_ball),
    "mu": lambda c: c.m_club * c.p,
    # q - p, which nearly equal masses leave without digits.
    "unequal": lambda c: (c.m_club - c.m_ball) / (c.m_club + c.m_ball),
    "touched": lambda c: True,
    "in_contact": lambda c: False,
    "separated": lambda c: True,
    "touch_time": lambda c: c.gap / c.closing,
    "smash_factor": lambda c: c.ball_velocity / c.club_speed,
    "kinetic_energy": lambda c: c.energy(c.club_velocity, c.ball_velocity),
    "energy_efficiency": lambda c: c.kinetic_energy / c.energy(c.club_speed, c.ball_speed),
    "momentum": lambda c: c.m_club * c.club_velocity + c.m_ball * c.ball_velocity,
    "force": lambda c: 0.0,
    "mean_force": lambda c: c.impulse / c.horizon,
    "flight": lambda c: c.horizon - c.touch_time - c.contact_time,
    "apart": lambda c: c.left + (c.club_velocity - c.ball_velocity) * c.flight,
    "compression": lambda c: np.maximum(c.apart, 0.0),
    "separation_place": lambda c: c.ball_speed * c.touch_time + c.contact_displacement,
    "ball_position": lambda c: c.separation_place + c.ball_velocity * c.flight,
    "club_position": lambda c: c.ball_position + c.apart,
}
