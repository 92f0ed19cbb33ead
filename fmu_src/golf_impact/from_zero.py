"""A decaying oscillation told from the instant at which its compression passes through zero.

There one of the compression's two amplitudes vanishes, and with the angle Ωt as time a product
less is needed: what a host reads at every step costs less.
"""

from cmath import exp as complex_exp
from math import atan, inf, pi


class FromZero:
    """Amplitudes C and S of e^(-γt)·(C cos Ωt + S sin Ωt), with time counted anew.

    Args:
        gamma: decay rate γ, 1/s.
        frequency: Ω, 1/s, > 0.
        d: C of the compression, m.
        d_s: S of the compression, m.
        duration: how long the oscillation is looked at, s.
    """

    __slots__ = ("_turn", "frequency", "near", "rate", "shift", "time")

    def __init__(
        self, gamma: float, frequency: float, d: float, d_s: float, duration: float
    ) -> None:
        angle = atan(d / d_s) if d_s else 0.5 * pi
        self.frequency = frequency
        #: How long before t = 0 the compression was zero, s; below 0: how long after it will be.
        self.shift = angle / frequency
        #: The new time is the angle since then: scale and offset of it.
        self.time = frequency, angle
        #: The rate of growth over the angle.
        self.rate = -gamma / frequency
        #: Whether zero is so near that amplitudes keep their magnitude, and time its digits.
        self.near = abs(self.shift) <= min(1.0 / gamma if gamma else inf, 2.0 * duration)
        turned = self.near and angle
        self._turn = complex_exp(complex(gamma * self.shift, -angle)) if turned else 1.0

    def amplitudes(self, c: float, s: float) -> tuple[float, float]:
        """C and S at the new origin of time."""
        turned = complex(c, -s) * self._turn
        return turned.real, -turned.imag
