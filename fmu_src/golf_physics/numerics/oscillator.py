"""A damped linear oscillator in closed form."""

from math import atan2, cos, exp, expm1, log1p, sin, sqrt


class Oscillator:
    """The motion x' = u, u' = -x - 2ζu, whichever way it is damped.

    Basis functions: (C, S) = exp(-ζσ)·(cos Ωσ, sin Ωσ / Ω) up to critical damping; beyond, with the
    rates λ₁ < λ₂ and Δ = λ₂ - λ₁ = 2Ω, exp(-λ₁σ)·(1, (1 - exp(-Δσ))/Δ): accurate where they meet.
    """

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
        return log1p(split * numerator / slow_part) / split
