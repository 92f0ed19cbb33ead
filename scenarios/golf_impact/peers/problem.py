"""The impact that every peer solves, and its results. SI units."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from golf_impact.closed_forms import reduced_mass


@dataclass(frozen=True)
class Case:
    """One impact: the club moves along x into the ball, d = x_club - x_ball starts at 0.

    Law 1 (absolute): F = k d, each body is also dragged by b times its own velocity, and contact
    ends at d = 0. Law 2 (relative): F = k d + b d', and contact ends at F = 0.
    """

    law: int = 1
    m_club: float = 0.210  # kg
    m_ball: float = 0.04593  # kg
    k: float = 1e6  # contact stiffness, N/m
    b: float = 9.0  # damping, N.s/m
    club_speed: float = 35.0  # at first touch, m/s
    ball_speed: float = 0.0  # at first touch, m/s

    @property
    def natural_frequency(self) -> float:
        """Of the two bodies on the spring, undamped, rad/s."""
        return math.sqrt(self.k / reduced_mass(self.m_club, self.m_ball))

    @property
    def time_limit(self) -> float:
        """Where a method gives up, s: ten undamped contact times; law 1 may last for ever."""
        return 10.0 * math.pi / self.natural_frequency


class Outcome(NamedTuple):
    """Results of an impact."""

    club_velocity: float  # at the end of contact, m/s
    ball_velocity: float  # at the end of contact, m/s
    contact_time: float  # s; inf if it did not end in time (velocities are then the last ones)
    max_force: float  # N


def errors(case: Case, outcome: Outcome, reference: Outcome) -> Outcome:
    """Velocities over |u_C| + |u_B|, the others relative; `reference` may hold mpmath numbers."""
    speed = abs(case.club_speed) + abs(case.ball_speed)
    scales = (speed, speed, reference.contact_time, reference.max_force)
    parts = zip(outcome, reference, scales, strict=True)
    return Outcome(*(0.0 if a == b else float(abs(a - b) / scale) for a, b, scale in parts))
