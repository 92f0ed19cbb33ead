"""Impacts with a contact in closed form: their outputs at the end of a communication step."""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from golf_impact.arrays.elementwise import Values


class States(NamedTuple):
    """The bodies in contact; positions relative to that of first touch."""

    force: Values  #: N
    club_position: Values  #: m
    ball_position: Values
    club_velocity: Values  #: m/s
    ball_velocity: Values
    compression: Values  #: m


class Contacts:
    """Impacts, each with a touch and a separation; every output is an attribute, found on demand.

    Args:
        values: all inputs and parameters by name (SI units), and `horizon`, the communication step
            (s), if positions, the compression or the mean force are needed: see `Values`.

    Attributes:
        closed: whether an impact is in closed form; attributes are meaningless if it isn't.
        v_end, d_end: rate of change (m/s) and compression (m) at the end of contact.
    """

    k: Values
    b: Values
    club_speed: Values
    ball_speed: Values
    m_club: Values
    m_ball: Values
    gap: Values
    exponent: Values
    reference_compression: Values
    restitution_at_rest: Values
    restitution_slope: Values
    horizon: Values

    closed: Values
    club_velocity: Values
    ball_velocity: Values
    coefficient_of_restitution: Values
    contact_time: Values
    contact_displacement: Values
    impulse: Values
    max_force: Values
    time_of_max_force: Values
    max_compression: Values
    d_end: Values

    touched: ClassVar[bool] = True
    in_contact: ClassVar[bool] = False
    separated: ClassVar[bool] = True
    force: ClassVar[float] = 0.0

    def __init__(self, values: dict[str, Values]) -> None:
        vars(self).update(values)
        #: Approach speed (m/s), mass fractions of ball and club, reduced mass (kg).
        self.closing = self.club_speed - self.ball_speed
        total = self.m_club + self.m_ball
        self.p, self.q = self.m_ball / total, self.m_club / total
        self.mu = self.m_club * self.p

    def states(self, t: Values) -> States:
        """In contact, t s after first touch."""
        raise NotImplementedError

    @cached_property
    def touch_time(self) -> Values:
        return self.gap / self.closing

    @cached_property
    def smash_factor(self) -> Values:
        return self.ball_velocity / self.club_speed

    @cached_property
    def energy_efficiency(self) -> Values:
        return self.kinetic_energy / self.energy(self.club_speed, self.ball_speed)

    @cached_property
    def kinetic_energy(self) -> Values:
        return self.energy(self.club_velocity, self.ball_velocity)

    @cached_property
    def momentum(self) -> Values:
        return self.m_club * self.club_velocity + self.m_ball * self.ball_velocity

    def energy(self, v_club: Values, v_ball: Values) -> Values:
        """Kinetic energy of bodies with these velocities (m/s), J."""
        return 0.5 * (self.m_club * v_club * v_club + self.m_ball * v_ball * v_ball)

    @cached_property
    def mean_force(self) -> Values:
        return self.impulse / self.horizon

    @cached_property
    def _flight(self) -> Values:
        return self.horizon - self.touch_time - self.contact_time

    @cached_property
    def _apart(self) -> Values:
        """Minus the distance at the end of the step, m."""
        return self.d_end + (self.club_velocity - self.ball_velocity) * self._flight

    @cached_property
    def ball_position(self) -> Values:
        at_separation = self.ball_speed * self.touch_time + self.contact_displacement
        return at_separation + self.ball_velocity * self._flight

    @cached_property
    def club_position(self) -> Values:
        return self.ball_position + self._apart

    @cached_property
    def compression(self) -> Values:
        return np.maximum(self._apart, 0.0)
