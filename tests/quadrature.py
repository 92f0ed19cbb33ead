"""A contact of law 2 with any exponent, in 40 digits: the path in closed form, time by quadrature.

With m = (n + 1)/2 and P = (n - 1)/(n + 1), x = (d/length)^m solves x'' + 2 ζ x' + x = 0 over σ from
x = 0, x' = 1 on, and dt = x^-P dσ/ω. Events are found by bisection. Nothing is shared with the FMU.
"""

from functools import cached_property
from itertools import pairwise

import mpmath

mp = mpmath.mp.clone()
mp.dps = 40


class PowerLawContact:
    """From touch to separation. Arguments are inputs and parameters by name (SI units)."""

    def __init__(
        self, k, b, club_speed, m_club, m_ball, ball_speed, exponent, reference_compression,
        restitution_at_rest=0, restitution_slope=0, **others,
    ):  # fmt: skip
        self.bodies = [mp.mpf(x) for x in (m_club, m_ball, club_speed, ball_speed)]
        m_club, m_ball, club_speed, ball_speed = self.bodies
        self.closing, n, length = club_speed - ball_speed, mp.mpf(exponent), reference_compression
        self.mu, self.m = m_club * m_ball / (m_club + m_ball), (n + 1) / 2
        self.power = (n - 1) / (n + 1)
        omega = mp.sqrt(self.m * mp.mpf(k) / self.mu)
        self.zeta = mp.mpf(b) / (2 * self.mu * omega)
        if restitution_at_rest:
            slope = mp.mpf(restitution_slope) * self.closing
            self.zeta = _damping_ratio(mp.mpf(restitution_at_rest) - slope)
        length = mp.mpf(length)
        self.length = length * (self.m * self.closing / (length * omega)) ** (1 / self.m)
        self.omega = self.m * self.closing / self.length
        self._root = mp.sqrt(mp.mpc(self.zeta**2 - 1))

    def motion(self, sigma):
        """x and x'."""
        decay = mp.exp(-self.zeta * sigma)
        sine = mp.sinc(1j * self._root * sigma).real * sigma
        cosine = mp.cosh(self._root * sigma).real
        return decay * sine, decay * (cosine - self.zeta * sine)

    def force(self, sigma):
        x, rate = self.motion(sigma)
        scale = self.mu * self.closing * self.omega
        return scale * abs(x) ** self.power * (x + 2 * self.zeta * rate)

    def compression(self, sigma):
        return self.length * abs(self.motion(sigma)[0]) ** (1 / self.m)

    def time(self, sigma):
        """s from touch, where σ = v^m removes the singularity."""
        cuts = [min(sigma, 1 / max(1, self.zeta))]
        while cuts[-1] < sigma:
            cuts.append(min(2 * cuts[-1], sigma))
        m, power = self.m, self.power
        first = [0, cuts[0] ** (1 / m)]
        total = mp.quad(lambda v: m * (self.motion(v**m)[0] / v**m) ** -power, first)
        for begin, end in pairwise(cuts):
            middle = (begin + end) / 2
            total += mp.quad(lambda s: abs(self.motion(s)[0]) ** -power, [begin, middle, end])
        return total / self.omega

    @cached_property
    def end(self):
        """σ at separation: the force's first zero."""
        zeta = self.zeta
        high = min(3 * mp.log(3 + 2 * zeta) / max(zeta, 1), mp.pi * mp.mpf("1.01"))

        def drive(sigma):
            x, rate = self.motion(sigma)
            return x + 2 * zeta * rate

        return _bisected(drive, 1 / (4 * (1 + zeta)), high)

    @cached_property
    def peak(self):
        """σ at the largest force."""

        def slope(sigma):
            x, rate = self.motion(sigma)
            drive = x + 2 * self.zeta * rate
            return self.power * rate * drive + x * (rate - 2 * self.zeta * drive)

        return _bisected(slope, mp.mpf("1e-30"), self.end)

    @cached_property
    def deepest(self):
        """σ at the largest compression."""
        return _bisected(lambda sigma: self.motion(sigma)[1], self.end / 1000, self.end)

    def path(self):
        """Outputs at some instants in contact."""
        m_club, m_ball, club_speed, ball_speed = self.bodies
        for share in ("1e-4", "0.25", "0.8", "0.995"):
            sigma = self.end * mp.mpf(share)
            time, change = self.time(sigma), self.closing * (1 - self.motion(sigma)[1])
            yield {
                "contact_time": time,
                "force": self.force(sigma),
                "compression": self.compression(sigma),
                "club_velocity": club_speed - m_ball / (m_club + m_ball) * change,
                "ball_velocity": ball_speed + m_club / (m_club + m_ball) * change,
                "impulse": self.mu * change,
            }

    def outputs(self):
        """Outputs after separation by name."""
        m_club, m_ball, club_speed, ball_speed = self.bodies
        end, peak, total = self.end, self.peak, m_club + m_ball
        restitution, time = -self.motion(end)[1], self.time(end)
        change = (1 + restitution) * self.closing
        ball_velocity = ball_speed + m_club / total * change
        drift = (m_club * club_speed + m_ball * ball_speed) / total
        return {
            "smash_factor": ball_velocity / club_speed,
            "coefficient_of_restitution": restitution,
            "club_velocity": club_speed - m_ball / total * change,
            "ball_velocity": ball_velocity,
            "impulse": self.mu * change,
            "max_force": self.force(peak),
            "max_compression": self.compression(self.deepest),
            "contact_time": time,
            "time_of_max_force": self.time(peak),
            "contact_displacement": drift * time - m_club / total * self.compression(end),
        }


def restitution(zeta):
    """The coefficient of restitution of a damping ratio, exp(-2 ζ arccos(ζ)/√(1 - ζ²))."""
    zeta = mp.mpf(zeta)
    # Above 1 both are imaginary.
    half = 1 if zeta == 1 else mp.re(mp.acos(zeta) / mp.sqrt(1 - zeta * zeta))
    return mp.exp(-2 * zeta * half)


def _damping_ratio(coefficient):
    return _bisected(lambda zeta: restitution(zeta) - coefficient, mp.mpf("1e-30"), mp.mpf(1))


def _bisected(function, low, high):
    """The last double above which it is negative, all digits; by halving ratios."""
    while high - low > high * mp.eps * 8:
        middle = mp.sqrt(low * high) if high > 2 * low else (low + high) / 2
        low, high = (middle, high) if function(middle) > 0 else (low, middle)
    return high
