"""Impacts and trajectories as sequences of calls of one instance, in an FMU or in this process."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, Generic, TypeVar

import numpy as np

from golf_impact.errors import unknown_name
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


class ImpactRuns:
    """Impacts by an instance that can start, step and read; see `LoadedFmu` for these methods."""

    default: Callable[[str], float]
    start: Callable[..., None]
    step: Callable[[float, float], None]
    read: Callable[..., Any]
    read_flag: Callable[[str], bool]

    def impact(self, outputs: Sequence[str] = METRICS, **values: Any) -> Named[float]:
        """Compute an impact in one communication step; see `golf_impact.run_impact`.

        Results have no value if the bodies don't touch or separate within `horizon`.
        """
        self.run_to_end(self.horizon(values).item(), values)
        results = Named(self.read(outputs))
        undefined = undefined_results(self.read_flag("touched"), self.read_flag("separated"))
        results.update((name, undefined[name]) for name in undefined.keys() & results.keys())
        return results

    def run_to_end(self, horizon: float, values: Mapping[str, Any]) -> float:
        """Make a run of this length, s; one with a force on the club head ends at separation.

        Returns its length.
        """
        self.start(**values)
        self.step(0.0, horizon)
        if values.get("club_force") and self.read_flag("separated"):
            # The head would go on accelerating, for seconds after an impact of 0.6 ms.
            end = sum(self.read(("touch_time", "contact_time")).values())
            horizon = end * (1.0 + 2.0**-51)
            self.start(**values)
            self.step(0.0, horizon)
        return horizon

    @np.errstate(all="ignore")
    def horizon(self, values: Mapping[str, Any]) -> np.ndarray:
        """A communication step (s) within which the bodies touch and separate, if they ever do.

        The values (SI units; defaults for the others) are numbers or arrays of one shape, which is
        that of the result. They may be values that the FMU rejects.
        """
        gap, club, ball = self._values(values, "gap", "club_speed", "ball_speed")
        approach = np.where(club > ball, gap / (club - ball), 0.0)
        steps = np.fmax(HORIZON, 20.0 * self.half_period(values)) + approach
        return np.where(np.isfinite(steps) & (steps > 0.0), steps, HORIZON)

    def _values(self, values: Mapping[str, Any], *names: str) -> list[np.ndarray]:
        return [np.asarray(values.get(name, self.default(name)), float) for name in names]

    @np.errstate(all="ignore")
    def half_period(self, values: Mapping[str, Any]) -> np.ndarray:
        """The contact time without damping, s: π √(μ/k); an estimate if the exponent isn't 1."""
        m_club, m_ball, k, n = self._values(values, "m_club", "m_ball", "k", "exponent")
        club, ball, d_r = self._values(values, "club_speed", "ball_speed", "reference_compression")
        mu = 1.0 / (1.0 / m_club + 1.0 / m_ball)
        period, closing = math.pi * np.sqrt(mu / k), np.abs(club - ball)
        # Kinetic energy μ v²/2 = k d_r^(1-n) d^(n+1)/(n+1) at the largest compression d.
        ratio = closing * period / (math.pi * d_r)
        # Not **, which rounds a single number differently from an array's element.
        compression = d_r * np.power(0.5 * (n + 1.0) * ratio * ratio, 1.0 / (n + 1.0))
        return np.where((n > 1.0) & (closing > 0.0), math.pi * compression / closing, period)

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
            contact = 10.0 * self.half_period(values).item()
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
