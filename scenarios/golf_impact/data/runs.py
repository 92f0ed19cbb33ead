"""What is common to impacts by the engine and by an FMU: names of outputs, their steps, results."""

import math
from collections.abc import Mapping
from numbers import Integral
from typing import Any, Generic, TypeVar

import numpy as np
from golf_physics.values import SLOWEST
from golf_physics.variables import BY_NAME

from golf_impact.data.errors import refused, unknown_name
from golf_impact.data.quantities import START

#: A communication step (s) that is longer than any contact in golf; results don't depend on it.
HORIZON = 1.0

#: The outputs that are read once, at the end of an impact in one step.
METRICS = (
    "club_velocity", "ball_velocity", "touch_time", "smash_factor", "coefficient_of_restitution",
    "energy_efficiency", "contact_time", "max_force", "time_of_max_force", "max_compression",
    "contact_displacement", "impulse", "momentum", "kinetic_energy",
)  # fmt: skip

FLAGS = ("touched", "in_contact", "separated")

#: The other outputs.
REALS = tuple(
    row.name for row in BY_NAME.values() if row.causality == "output" and row.name not in FLAGS
)

#: The outputs that a trajectory records by default.
PATH = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity", "compression")

#: Outputs that go on changing after separation.
MOMENTARY = tuple(
    row.name for row in BY_NAME.values() if row.momentary and row.causality == "output"
)

Value = TypeVar("Value")


class Named(dict[str, Value], Generic[Value]):
    """Values by name; a name that isn't there raises a UserError with those that are."""

    def __missing__(self, name: str) -> Value:
        raise unknown_name("value", name, self)


def horizon(values: Mapping[str, float]) -> float:
    """A communication step (s) within which the bodies touch and separate, if they ever do.

    The values (SI units; start values for the others) may be such that the FMU rejects them. In C:
    fmu_src/native/rows.c.
    """
    given = {**START, **values}
    closing = given["club_speed"] - given["ball_speed"]
    try:
        approach = given["gap"] / closing if closing > SLOWEST else 0.0
        step = max(HORIZON, 20.0 * half_period(given)) + approach
    except (ArithmeticError, ValueError):
        return HORIZON
    return step if 0.0 < step < math.inf else HORIZON


def reduced_mass(values: Mapping[str, float]) -> float:
    """μ = m_C m_B / (m_C + m_B), kg, of inputs and parameters by name."""
    m_club, m_ball = values["m_club"], values["m_ball"]
    return m_club * (m_ball / (m_club + m_ball))


def half_period(values: Mapping[str, float]) -> float:
    """The contact time without damping, s: π √(μ/k); an estimate if the exponent isn't 1."""
    given = {**START, **values}
    period = math.pi * math.sqrt(reduced_mass(given) / given["k"])
    n, closing = given["exponent"], abs(given["club_speed"] - given["ball_speed"])
    if not (n > 1.0 and closing > SLOWEST):
        return period
    # Kinetic energy μ v²/2 = k d_r^(1-n) d^(n+1)/(n+1) at the largest compression d.
    d_r = given["reference_compression"]
    ratio = closing * period / (math.pi * d_r)
    compression: float = d_r * (0.5 * (n + 1.0) * ratio * ratio) ** (1.0 / (n + 1.0))
    return math.pi * compression / closing


def instants_of(values: Mapping[str, float], touch: float, contact: float, points: int) -> Any:
    """Instants (s) over a contact, and over a tenth of it before and after.

    Args:
        values: inputs and parameters of the impact.
        touch: when it begins, s; NaN without a contact.
        contact: the contact time, s; NaN if it doesn't end: then while it develops.
        points: number of instants.

    Raises:
        UserError: `points` isn't a number of at least 2.
    """
    if not isinstance(points, Integral) or points < 2:
        raise refused("points", points, "it must be a whole number of at least 2")
    touch = 0.0 if math.isnan(touch) else touch
    contact = 10.0 * half_period(values) if math.isnan(contact) else contact
    margin = 0.1 * contact
    return np.linspace(max(0.0, touch - margin), touch + contact + margin, int(points))


class ImpactArrays(Named[np.ndarray]):
    """Outputs of many impacts by name: arrays of one shape, of floats, or of bools for flags.

    They are NaN, or False, where a case is rejected, and NaN where a result doesn't exist.
    """

    refused: np.ndarray  #: whether a case is rejected, bool
    reason: str  #: why the first of these is, in C order; empty if there is none

    def __init__(self, found: Mapping[str, np.ndarray], refused: np.ndarray, reason: str) -> None:
        super().__init__(found)
        self.refused, self.reason = refused, reason
