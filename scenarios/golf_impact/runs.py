"""Impacts and trajectories as sequences of calls of one instance, in an FMU or in this process."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, Generic, TypeVar

import numpy as np

from golf_impact.errors import UserError, unknown_name
from golf_impact.quantities import undefined_results

#: A communication step (s) that is longer than any contact in golf; results don't depend on it.
HORIZON = 1.0

#: The outputs that are read once, at the end of an impact in one step.
METRICS = (
    "club_velocity", "ball_velocity", "touch_time", "smash_factor", "coefficient_of_restitution",
    "energy_efficiency", "contact_time", "max_force", "time_of_max_force", "max_compression",
    "contact_displacement", "impulse", "momentum", "kinetic_energy",
)  # fmt: skip

FLAGS = ("touched", "in_contact", "separated")

#: The outputs that a trajectory records by default.
PATH = ("force", "club_position", "ball_position", "club_velocity", "ball_velocity", "compression")

Value = TypeVar("Value")


class Named(dict[str, Value], Generic[Value]):
    """Values by name; a name that isn't there raises a UserError with those that are."""

    def __missing__(self, name: str) -> Value:
        raise unknown_name("value", name, self)


def number(name: str, value: Any) -> float:
    """The single number of an input or parameter; UserError if the value is another thing."""
    try:
        # Shapes only of what is neither: np.ndim takes a microsecond.
        if not isinstance(value, (int, float)) and (
            isinstance(value, str | bytes) or np.ndim(value)
        ):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        why = "it must be a number in SI units"
        raise UserError(f"{name} = {value!r} is refused: {why}", name, value, why) from None


class ImpactRuns:
    """Impacts by an instance that can start, step and read; see `golf_impact.fmu.Fmu` for these."""

    default: Callable[[str], float]
    start: Callable[..., None]
    step: Callable[[float, float], None]
    read: Callable[..., Any]
    read_flag: Callable[[str], bool]

    def impact(self, outputs: Sequence[str] = METRICS, **values: Any) -> Named[float]:
        """Compute an impact in one communication step; see `golf_impact.run_impact`.

        Results have no value if the bodies don't touch or separate within the step.
        """
        self.start(**values)
        self.step(0.0, self._horizon(values))
        if values.get("club_force") and self.read_flag("separated"):
            # To separation: the head would go on accelerating, for seconds after 0.6 ms.
            end = sum(self.read(("touch_time", "contact_time")).values())
            self.start(**values)
            self.step(0.0, end * (1.0 + 2.0**-51))
        results = Named(self.read(outputs))
        undefined = undefined_results(self.read_flag("touched"), self.read_flag("separated"))
        results.update((name, undefined[name]) for name in undefined.keys() & results.keys())
        return results

    def _horizon(self, values: Mapping[str, Any]) -> float:
        """A communication step (s) within which the bodies touch and separate, if they ever do.

        The values (SI units; defaults for the others) may be such that the FMU rejects them.
        """
        gap, club, ball = self._values(values, "gap", "club_speed", "ball_speed")
        try:
            approach = gap / (club - ball) if club > ball else 0.0
            step = max(HORIZON, 20.0 * self._half_period(values)) + approach
        except (ArithmeticError, ValueError):
            return HORIZON
        return step if 0.0 < step < math.inf else HORIZON

    def _values(self, values: Mapping[str, Any], *names: str) -> list[float]:
        return [float(values.get(name, self.default(name))) for name in names]

    def _half_period(self, values: Mapping[str, Any]) -> float:
        """The contact time without damping, s: π √(μ/k); an estimate if the exponent isn't 1."""
        m_club, m_ball, k, n = self._values(values, "m_club", "m_ball", "k", "exponent")
        club, ball, d_r = self._values(values, "club_speed", "ball_speed", "reference_compression")
        mu = 1.0 / (1.0 / m_club + 1.0 / m_ball)
        period, closing = math.pi * math.sqrt(mu / k), abs(club - ball)
        if not (n > 1.0 and closing > 0.0):
            return period
        # Kinetic energy μ v²/2 = k d_r^(1-n) d^(n+1)/(n+1) at the largest compression d.
        ratio = closing * period / (math.pi * d_r)
        # NumPy's power and Python's ** differ in the last bit.
        compression = d_r * float(np.power(0.5 * (n + 1.0) * ratio * ratio, 1.0 / (n + 1.0)))
        return math.pi * compression / closing

    def trajectory(
        self, points: int = 301, names: Sequence[str] = PATH, **values: Any
    ) -> Named[np.ndarray]:
        """Sample an impact over the contact, and over a tenth of it before and after.

        See `golf_impact.run_trajectory`; `names` are its outputs.
        """
        touch, contact = self.impact(("touch_time", "contact_time"), **values).values()
        touch = 0.0 if math.isnan(touch) else touch
        if math.isnan(contact):
            # Not separated within the horizon: sample the time in which the contact develops.
            contact = 10.0 * self._half_period(values)
        margin = 0.1 * contact
        begin = max(0.0, touch - margin)
        self.start(**values)
        if begin:
            self.step(0.0, begin)
        times = np.linspace(begin, touch + contact + margin, points)
        return Named({"time": times, **self.sample(times, names)})

    def sample(self, times: np.ndarray, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Record Real outputs (SI units) by name at these times (s), the first of which is now."""
        rows = [list(self.read(names).values())]
        for before, time in pairwise(times):
            self.step(before, time - before)
            rows.append(list(self.read(names).values()))
        return dict(zip(names, np.array(rows).T.copy(), strict=True))


class ImpactArrays(Named[np.ndarray]):
    """Outputs of many impacts by name: arrays of one shape, of floats, or of bools for flags.

    They are NaN, or False, where a case is rejected, and NaN where a result doesn't exist.
    """

    refused: np.ndarray  #: whether a case is rejected, bool
    reason: str  #: why the first of these is, in C order; empty if there is none
    closed: np.ndarray  #: whether closed forms computed a case, bool

    def __init__(self, outputs: Sequence[str], number: int) -> None:
        """So many cases without results yet, in one dimension."""
        super().__init__(
            (name, np.zeros(number, bool if name in FLAGS else float)) for name in outputs
        )
        self.refused, self.closed = np.zeros(number, bool), np.zeros(number, bool)
        self.reason = ""

    def run(self, runs: ImpactRuns, places: np.ndarray, columns: Mapping[str, Any]) -> None:
        """Compute the cases at these places one by one, from values of all cases by name."""
        number, reals = len(self.refused), [name for name in self if name not in FLAGS]
        rows = (np.broadcast_to(column, number)[places].tolist() for column in columns.values())
        nothing = dict.fromkeys(reals, math.nan) | dict.fromkeys(FLAGS, False)
        for place, *row in zip(places.tolist(), *rows):
            try:
                found: dict[str, float] = dict(runs.impact(reals, **dict(zip(columns, row))))
                found |= {name: runs.read_flag(name) for name in FLAGS if name in self}
            except UserError as error:
                found, self.refused[place] = nothing, True
                self.reason = self.reason or str(error)
            for name, column in self.items():
                column[place] = found[name]

    def reshaped(self, shape: tuple[int, ...]) -> "ImpactArrays":
        """Itself, with its arrays in this shape."""
        self.update({name: column.reshape(shape) for name, column in self.items()})
        self.refused, self.closed = self.refused.reshape(shape), self.closed.reshape(shape)
        return self
