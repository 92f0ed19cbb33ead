"""Sensitivities of the FMU's outputs to its parameters, and standard errors that follow."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

#: The FMU's ranges of the parameters that may be uncertain, and the least step of a difference: a
#: small part of what matters in an impact.
RANGES = {
    "k": (0.0, math.inf, 0.0),
    "b": (0.0, math.inf, 1e-3),
    "exponent": (1.0, 12.0, 0.0),
    "restitution_at_rest": (0.0, 1.0, 0.0),
    "restitution_slope": (0.0, math.inf, 1e-6),
}

Evaluate = Callable[[Mapping[str, float]], np.ndarray]


def gradient(evaluate: Evaluate, values: Mapping[str, float], names: Sequence[str]) -> np.ndarray:
    """Derivatives of outputs by central differences, one-sided at the end of a range.

    Args:
        evaluate: outputs of an impact, an array, from inputs and parameters by name (SI units).
        values: inputs and parameters of the impact.
        names: those of them to vary, (p,).

    Returns:
        Of the shape (p, *outputs).
    """
    slopes = []
    for name in names:
        value, (low, high, least) = values[name], RANGES[name]
        step = max(1e-4 * abs(value), least)
        ends = max(low, value - step), min(high, value + step)
        first, last = (evaluate({**values, name: end}) for end in ends)
        slopes.append((last - first) / (ends[1] - ends[0]))
    return np.array(slopes)


def standard_errors(
    evaluate: Evaluate, values: Mapping[str, float], names: Sequence[str], covariance: np.ndarray
) -> np.ndarray:
    """Standard errors of outputs by linear propagation of a covariance (p, p), see `gradient`."""
    slopes = gradient(evaluate, values, names)
    return np.sqrt(np.einsum("i...,ij,j...->...", slopes, covariance, slopes).clip(0.0))
