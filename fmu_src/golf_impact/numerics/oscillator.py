"""The linear oscillator that the power law is in its own time σ."""

from math import atan2, cos, exp, expm1, hypot, log, log1p, sin, sqrt

#: A smaller x, σ or ω counts as 0: powers might underflow.
LEAST = 1e-290


class Oscillator:
    """The motion x' = u, u' = -x - 2ζu, whichever way it is damped.

    Two decaying basis functions carry it, (C, S) = exp(-ζσ)·(cos Ωσ, sin Ωσ / Ω) up to critical
    damping, and from there on, with the rates λ₁ < λ₂ and Δ = λ₂ - λ₁ = 2Ω,
    exp(-λ₁σ)·(1, (1 - exp(-Δσ))/Δ): accurate where the two rates meet.
    """

    __slots__ = ("fast", "frequency", "oscillates", "slow", "zeta")

    def __init__(self, zeta: float) -> None:
        self.zeta = zeta
        self.oscillates = zeta <= 1.0
        if self.oscillates:
            # Exactly critical: a frequency this small changes nothing within a double.
            self.frequency = sqrt((1.0 - zeta) * (1.0 + zeta)) or 1e-10
            self.slow = self.fast = zeta
        else:
            self.frequency = sqrt(zeta - 1.0) * sqrt(zeta + 1.0)
            self.fast = zeta + self.frequency
            self.slow = 1.0 / self.fast

    def basis(self, sigma: float) -> tuple[float, float]:
        """C and S."""
        decay = exp(-self.slow * sigma)
        if self.oscillates:
            phase = self.frequency * sigma
            return decay * cos(phase), decay * sin(phase) / self.frequency
        split = 2.0 * self.frequency
        return decay, decay * -expm1(-split * sigma) / split

    def after(self, x: float, u: float, sigma: float) -> tuple[float, float, float]:
        """x, u and x + 2ζu a time σ after these x and u."""
        c, s = self.basis(sigma)
        slow, fast = self.slow, self.fast
        x_after = x * c + (u + slow * x) * s
        if fast > 2.0 * slow:
            # Their own terms, so that u and the force stay exact when the faster one has died out.
            slow_term = slow * (u + fast * x) / (fast - slow) * c
            fast_term = fast * (u + slow * x) / (fast - slow) * exp(-fast * sigma)
            return x_after, fast_term - slow_term, fast * fast_term - slow * slow_term
        drive = x + 2.0 * self.zeta * u
        return x_after, u * c - (x + fast * u) * s, drive * c + (u - fast * drive) * s

    def until(self, numerator: float, denominator: float, slow_part: float) -> float:
        """σ from tan(Ωσ)/Ω or tanh(Ωσ)/Ω; slow_part is denominator - Ω numerator, for tanh."""
        if self.oscillates:
            return atan2(self.frequency * numerator, denominator) / self.frequency
        split = 2.0 * self.frequency
        ratio = numerator / slow_part
        return (log1p(split * ratio) if ratio < 1e150 else log(split) + log(ratio)) / split

    def amplitude(self, x: float, u: float) -> float:
        """√(x² + 2ζxu + u²), which falls as exp(-ζσ)."""
        if self.oscillates:
            return hypot(u + self.zeta * x, self.frequency * x)
        return sqrt(u + self.slow * x) * sqrt(u + self.fast * x)
