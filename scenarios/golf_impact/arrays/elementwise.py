"""Functions whose results depend on their arguments alone.

NumPy may compute elements of long arrays, of their ends and of numbers by different methods, which
differ in the last bit. Arguments here are numbers or contiguous arrays whose length is a multiple
of `LANES`; a number is repeated as often. Arguments may be complex, with an imaginary part that is
too small to change the real one: that of the result is its derivative (Squire & Trapp, SIAM Rev.
40, 110-112, 1998). What decides between formulas is the real part.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

#: Numbers, or arrays of one length, floats or complex.
Values = Any

#: The longest vector registers hold 8 doubles, and loops over them are unrolled up to 8 times.
LANES = 64

#: Newton's method ends when a step is this small (relative): the next one would be below rounding.
_CONVERGED = 1e-9
_MOST_STEPS = 30


def _elementwise(function: Callable[..., np.ndarray]) -> Callable[..., Values]:
    def each(*arguments: Values) -> Values:
        length = max(map(np.size, arguments))
        full = (
            value if np.ndim(value) else np.full(max(length, LANES), value) for value in arguments
        )
        result = function(*full)
        return result if length > 1 else result[0]

    return each


exp, expm1, log, power, tan = map(_elementwise, (np.exp, np.expm1, np.log, np.power, np.tan))
_angle = _elementwise(np.arctan2)


def angle(y: Values, x: Values) -> Values:
    """The angle of the point (x, y), rad."""
    result = _angle(np.real(y), np.real(x))
    if np.iscomplexobj(y) or np.iscomplexobj(x):
        turn = np.real(x) * np.imag(y) - np.real(y) * np.imag(x)
        result = result + 1j * turn / (np.real(x) ** 2 + np.real(y) ** 2)
    return result


def cos_sin(theta: Values) -> tuple[Values, Values]:
    """Cosine and sine from one tangent, which NumPy computes several times as fast."""
    half = tan(0.5 * np.real(theta))
    square = half * half
    size = 1.0 / (1.0 + square)
    cos, sin = (1.0 - square) * size, 2.0 * half * size
    if np.iscomplexobj(theta):
        turn = 1j * np.imag(theta)
        return cos - turn * sin, sin + turn * cos
    return cos, sin


def newton(step: Callable[[Values], Values], x: Values) -> Values:
    """The zero near x by Newton's method, or NaN; each element stops by itself."""
    going: Any = True
    for _ in range(_MOST_STEPS):
        change = step(x)
        x = np.where(going, x + change, x)
        going = going & (np.abs(np.real(change)) > _CONVERGED * np.abs(np.real(x)))
        if not np.any(going):
            break
    else:
        x = np.where(going, np.nan, x)
    # An imaginary part follows the real one by a step.
    return x + step(x) if np.iscomplexobj(x) else x[()]
