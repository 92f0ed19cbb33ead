"""Sensitivities of an impact's outputs to its parameters, and standard errors that follow."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

#: The FMU's ranges of the parameters that may be uncertain.
RANGES = {
    "k": (0.0, math.inf),
    "b": (0.0, math.inf),
    "exponent": (1.0, 12.0),
    "restitution_at_rest": (0.0, 1.0),
    "restitution_slope": (0.0, math.inf),
}

Evaluate = Callable[[Mapping[str, float]], np.ndarray]


def gradient(evaluate: Evaluate, values: Mapping[str, float], names: Sequence[str]) -> np.ndarray:
    """Derivatives of outputs of an impact to p of its values: an array (p, *outputs), SI units.

    By central differences, one-sided at the end of a range.
    """
    slopes = []
    for name in names:
        value, (low, high) = values[name], RANGES[name]
        step = max(1e-4 * abs(value), 1e-6)
        ends = max(low, value - step), min(high, value + step)
        first, last = (evaluate({**values, name: end}) for end in ends)
        slopes.append((last - first) / (ends[1] - ends[0]))
    return np.array(slopes)


def standard_errors(slopes: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard errors of outputs by linear propagation of a covariance (p, p); see `gradient`."""
    return np.sqrt(np.einsum("i...,ij,j...->...", slopes, covariance, slopes).clip(0.0))
