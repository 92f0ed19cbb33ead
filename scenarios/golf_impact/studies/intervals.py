"""Standard errors of an impact's results that follow from the covariance of a ball's parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from golf_impact.api import run_impacts
from golf_impact.data.balls import Ball

#: The FMU's ranges of the parameters that may be uncertain.
RANGES = {
    "k": (0.0, math.inf), "b": (0.0, math.inf), "exponent": (1.0, 12.0),
    "restitution_at_rest": (0.0, 1.0), "restitution_slope": (0.0, math.inf),
}  # fmt: skip

#: Steps of differences, relative, and the least values that they are relative to.
_STEP = 1e-5
_LEAST = {
    "b": 10.0, "restitution_slope": 1e-3,
    **dict.fromkeys(("touch", "offset", "drift"), 100.0),
}  # fmt: skip


def step_of(name: str, value: float) -> float:
    """The step of a difference over a parameter."""
    return _STEP * max(abs(value), _LEAST.get(name, 0.0))


def ends_of(name: str, value: float) -> tuple[float, float]:
    """The two values of a difference over a parameter: central, or one-sided at its limit."""
    step, (low, high) = step_of(name, value), RANGES.get(name, (-math.inf, math.inf))
    return max(low, value - step), min(high, value + step)


def standard_errors(
    outputs: Sequence[str], values: Mapping[str, Any], names: Sequence[str], covariance: Any
) -> dict[str, np.ndarray]:
    """Standard errors of results (SI units), by linear propagation; NaN where there is no result.

    Args:
        outputs: Real outputs of the FMU.
        values: its inputs and parameters (SI units), numbers or arrays of one shape.
        names: of p uncertain values, each a number.
        covariance: theirs, (p, p).
    """
    slopes: dict[str, list[np.ndarray]] = {output: [] for output in outputs}
    for name in names:
        ends = ends_of(name, values[name])
        low, high = (run_impacts(outputs, **{**values, name: end}) for end in ends)
        for output, rows in slopes.items():
            rows.append((high[output] - low[output]) / (ends[1] - ends[0]))
    return {
        output: np.sqrt(np.einsum("i...,ij,j...->...", rows, covariance, rows).clip(0.0))
        for output, rows in slopes.items()
    }


def result_intervals(
    ball: Ball, values: Mapping[str, float], outputs: Iterable[str]
) -> dict[str, float]:
    """Standard errors (SI units) of an impact's results that follow from a ball's covariance.

    Values that differ from the ball's count as certain; empty if no value is uncertain.
    """
    names = [name for name in ball.uncertain if values.get(name) == ball.values[name]]
    if not names:
        return {}
    places = [ball.uncertain.index(name) for name in names]
    covariance = np.array(ball.covariance)[np.ix_(places, places)]
    errors = standard_errors(tuple(outputs), values, names, covariance)
    return {output: float(error) for output, error in errors.items()}
