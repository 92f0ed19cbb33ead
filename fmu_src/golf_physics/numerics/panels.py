"""The power law in its scaled time σ: a linear oscillator, and time as a function of σ."""

from .chebyshev import NODES, ORDER, evaluate, interpolate
from .oscillator import Oscillator


class Panel:
    """An interval of σ on which time is a series.

    It is expanded about a zero of x or, away from those, about its own beginning; s is the σ from
    there (negative if the zero is ahead), H the largest |s|, and |s| = H v^r with r = m or 1. With
    g = (x/|s|)^(-P) or x^(-P), which is analytic, the time to or from s = 0 is H^(1/r) v G / ω,
    where s G' + G/r = g. m is (n + 1)/2; `origin` has x and u at s = 0; the panel lies between s =
    `first` and `last`, begins at the time t and ends at σ = `stop` (since the start of the phase).
    """

    def __init__(
        self, motion: Oscillator, m: float, omega: float, origin: tuple[float, float],
        first: float, last: float, stop: float, t: float,
    ) -> None:  # fmt: skip
        self.motion, self.m, self.omega, self.origin, self.stop = motion, m, omega, origin, stop
        self.at_zero = origin[0] == 0.0
        self.r = m if self.at_zero else 1.0
        #: H with the sign of s, and σ at s = 0.
        self.width = width = last if last > 0.0 else first
        self.sigma = stop - last
        self.direction = 1.0 if width > 0.0 else -1.0
        self.reach = abs(width) ** (1.0 / self.r)
        power = (1.0 - m) / m
        values = [self._ratio(0.5 * width * (1.0 + z)) ** power for z in NODES]
        g = interpolate(values)[::-1]
        # (1 + z) T_j' = j T_j + 2j (T_(j-1) + T_(j-2) + ... + T_0 / 2): solved from the top.
        above = 0.0
        self.series = []
        for j in range(ORDER - 1, 0, -1):
            coefficient = (g[j] - 2.0 * above) / (j + 1.0 / self.r)
            above += j * coefficient
            self.series.append(coefficient)
        self.series.append((g[0] - above) * self.r)
        #: When s = 0, and when the panel ends, s since the start of the phase.
        self.t_origin = t - self._time_to(first)
        self.end = self.t_origin + self._time_to(last)

    def _ratio(self, s: float) -> float:
        """x/|s| or x: what is far from zero all over the panel."""
        x, u = self.origin
        c, basis_s = self.motion.basis(s)
        if self.at_zero:
            return abs(u * (basis_s / s)) if s else abs(u)
        return x * c + (u + self.motion.slow * x) * basis_s

    def _clock(self, v: float) -> float:
        """Time to or from s = 0, s."""
        return self.reach / self.omega * v * evaluate(self.series, 2.0 * v**self.r - 1.0)

    def _time_to(self, s: float) -> float:
        return self.direction * self._clock((s / self.width) ** (1.0 / self.r))

    def time(self, sigma: float) -> float:
        """Time since the start of the phase, s, when σ has passed."""
        return self.t_origin + self._time_to(sigma - self.sigma)

    def find(self, t: float) -> float:
        """The v at a time since the start of the phase; time over v hardly bends for Newton."""
        clock = self.direction * (t - self.t_origin)
        power = (1.0 - self.m) / self.m
        v = min(1.0, clock / self._clock(1.0))
        for _ in range(20):
            slope = self._ratio(self.width * v**self.r) ** power * self.r * self.reach / self.omega
            step = (self._clock(v) - clock) / slope
            # A subnormal time has few digits: v mustn't fall below 0 for that.
            v = max(v - step, 0.5 * v)
            # Convergence is quadratic: the next step would be below a double's resolution.
            if abs(step) <= 1e-9 * v:
                break
        return v

    def motion_at(self, v: float) -> tuple[float, float, float]:
        """d/L, u and x + 2ζu."""
        s = self.width * v**self.r
        x, u, drive = self.motion.after(*self.origin, s)
        if self.at_zero:
            return self.reach * v * self._ratio(s) ** (1.0 / self.m), u, drive
        return x ** (1.0 / self.m), u, drive
