"""Impacts with a contact in closed form: a table of formulas for each contact law.

Values are floats or arrays of one length. They may be complex, with an imaginary part that is too
small to change the real one: that of a result is its derivative (Squire & Trapp, SIAM Rev. 40,
110-112, 1998). What decides between formulas is the real part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Values = Any

#: Newton's method ends when a step is this small (relative): the next one would be below rounding.
_CONVERGED = 1e-9
_MOST_STEPS = 30


class Contacts:
    """Impacts, each with a touch and a separation; attributes are computed on demand.

    Attributes are `values`, which are all inputs and parameters by name (SI units), and what the
    formulas give: outputs once the bodies have separated, by name; what they are made of; `closed`,
    without which the others are meaningless; `force_at`, a function of the time since touch.
    """

    def __init__(self, formulas: Mapping[str, Formula], values: Mapping[str, Values]) -> None:
        vars(self).update(values, formulas=formulas)

    def __getattr__(self, name: str) -> Any:
        if name not in self.formulas:
            raise AttributeError(name)
        # Of formulas that aren't for a case, or aren't chosen, the results are unused.
        with np.errstate(all="ignore"):
            value = self.__dict__[name] = self.formulas[name](self)
        return value

    def forces(self, times: np.ndarray) -> np.ndarray:
        """Contact force (N) of a single impact at times since touch (s): 0 outside the contact."""
        inside = (times > 0.0) & (times < self.contact_time)
        force = np.zeros(times.shape)
        with np.errstate(all="ignore"):
            force[inside] = self.force_at(times[inside])
        return force


Formula = Callable[[Contacts], Any]


def _energy(c: Contacts, club: Values, ball: Values) -> Values:
    return 0.5 * (c.m_club * club * club + c.m_ball * ball * ball)


#: Of all laws. p and q are the mass fractions of ball and club, mu is the reduced mass, kg.
COMMON: dict[str, Formula] = {
    "closing": lambda c: c.club_speed - c.ball_speed,
    "p": lambda c: c.m_ball / (c.m_club + c.m_ball),
    "q": lambda c: c.m_club / (c.m_club + c.m_ball),
    "mu": lambda c: c.m_club * c.p,
    "touched": lambda c: True,
    "in_contact": lambda c: False,
    "separated": lambda c: True,
    "touch_time": lambda c: c.gap / c.closing,
    "smash_factor": lambda c: c.ball_velocity / c.club_speed,
    "kinetic_energy": lambda c: _energy(c, c.club_velocity, c.ball_velocity),
    "energy_efficiency": lambda c: c.kinetic_energy / _energy(c, c.club_speed, c.ball_speed),
    "momentum": lambda c: c.m_club * c.club_velocity + c.m_ball * c.ball_velocity,
}


def angle(y: Values, x: Values) -> Values:
    """The angle of the point (x, y), rad."""
    result = np.arctan2(np.real(y), np.real(x))
    if np.iscomplexobj(y) or np.iscomplexobj(x):
        turn = np.real(x) * np.imag(y) - np.real(y) * np.imag(x)
        result = result + 1j * turn / (np.real(x) ** 2 + np.real(y) ** 2)
    return result


def cos_sin(theta: Values) -> tuple[Values, Values]:
    """Cosine and sine from one tangent, which NumPy computes eight times as fast as either."""
    half = np.tan(0.5 * np.real(theta))
    size = 1.0 / (1.0 + half * half)
    cos, sin = (1.0 - half * half) * size, 2.0 * half * size
    if np.iscomplexobj(theta):
        turn = 1j * np.imag(theta)
        return cos - turn * sin, sin + turn * cos
    return cos, sin


def newton(function: Callable[[Values], tuple[Values, Values]], x: Values) -> Values:
    """The zero near x of a function that returns value and slope, or NaN."""
    for _ in range(_MOST_STEPS):
        value, slope = function(x)
        x = x - value / slope
        moving = np.abs(np.real(value / slope)) > _CONVERGED * np.abs(np.real(x))
        if not np.any(moving):
            break
    else:
        x = np.where(moving, np.nan, x)
    if np.iscomplexobj(x):
        # An imaginary part follows the real one by a step.
        value, slope = function(x)
        x = x - value / slope
    return x
