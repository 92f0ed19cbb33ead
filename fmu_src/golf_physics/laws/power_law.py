"""The power law: a spring that stiffens and a matching damper between the bodies (n > 1).

The contact force is F = k d_r (d/d_r)^n + b (d/d_r)^((n-1)/2) d', with d the compression, d' the
closing speed and d_r the compression for which k and b are given; contact ends when it falls to
zero. The damper is that of Tsuji, Tanaka & Ishida (Powder Technology 71, 239–250, 1992, there with
n = 3/2) for any n. With it x ~ d^((n+1)/2) is a linear damped oscillator in a scaled time σ,
dσ ~ d^((n-1)/2) dt, so the coefficient of restitution is independent of speed. Everything is closed
form in σ; only t is an integral over σ.
"""

from itertools import pairwise
from math import atan2, inf, pi, sqrt

from ..numerics.chebyshev import NODES, ORDER, dot, evaluate, interpolate
from ..numerics.gauss import GAUSS_5
from ..numerics.oscillator import Oscillator
from ..values import Motion, Parameters, State
from .contact import ContactPhase

#: Where panels meet, as phases Ωσ since the last zero of x. Its other zeros (pi apart, along the
#: imaginary axis above critical damping) are so far away that coefficients fall as 7^-j or faster.
_CUTS_BELOW_CRITICAL = 0.385 * pi, 0.615 * pi
_CUTS_ABOVE_CRITICAL = tuple(1.6**n for n in range(1, 16))

#: Gauss's rule on (0, 1).
_PLACES, _WEIGHTS = zip(*((0.5 + 0.5 * node, 0.5 * weight) for node, weight in GAUSS_5))

#: A panel nearer than this many widths to a zero of x is expanded about that zero.
_NEAR = 1.5


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


class PowerLawContact(ContactPhase):
    """A contact phase in closed form, but for the time by quadrature.

    With m = (n+1)/2, P = (n-1)/(n+1) and any length L, x = (d/L)^m, dσ = ω (d/L)^(m-1) dt and
    ω² = m k (L/d_r)^(n-1)/μ give x' = u = m d'/(ωL), u' = -x - 2ζu and F ~ x^P (x + 2ζu). All
    events are at known ratios u/x, and σ is closed form at any ratio. The time, ∫ x^(-P) dσ / ω,
    is tabulated once, on one to three panels (up to seven at heavy damping). From a start without
    a force, and not of a first touch, the phase has duration 0.
    """

    #: Unbounded: the force has a kink at d = 0.
    rate = inf

    def __init__(self, parameters: Parameters, k: float, b: float, start: Motion) -> None:
        _, _, _, _, d, w = self._bodies = start
        exponent, reference_compression = parameters.exponent, parameters.reference_compression
        m_club, m_ball = parameters.m_club, parameters.m_ball
        total = m_club + m_ball
        p = m_ball / total
        mu = m_club * p
        m = 0.5 * (exponent + 1.0)
        power = (exponent - 1.0) / (exponent + 1.0)
        omega = sqrt(m * (k / mu))
        self._motion = motion = Oscillator(b / (2.0 * mu * omega))
        # L is what the speed could compress to, or the compression: of x and |u| one is 1.
        speed = abs(w)
        length = (m * speed / omega) ** (1.0 / m) * reference_compression**power
        if length >= d:
            omega = m * speed / length
        else:
            length = d
            omega *= (d / reference_compression) ** (m - 1.0)
            speed = length * omega / m
        u = w / speed
        x = (d / length) ** m
        drive = x + 2.0 * motion.zeta * u
        self._start = x, u
        self._p, self._q, self._mu = p, m_club / total, mu
        self._m, self._power = m, power
        self._length, self._speed, self._omega = length, speed, omega
        self._panels: list[Panel] = []
        #: Contact force (N), compression (m) and closing speed (m/s).
        self._initial = self._force(d / length, drive), d, w
        if drive > 0.0 or (x == 0.0 and u > 0.0):
            u = self._lay_out()
            d, w = length * (-2.0 * motion.zeta * u) ** (1.0 / m), speed * u
        self._final = 0.0, d, w
        self.duration = self._panels[-1].end if self._panels else 0.0

    def _lay_out(self) -> float:
        """Make the panels; return u at the end of contact."""
        x, u = self._start
        motion = self._motion
        zeta, slow, frequency = motion.zeta, motion.slow, motion.frequency
        # σ from the last zero of x to the start, and on to the end; on to the next zero: left.
        past = motion.until(x, u + zeta * x, u + slow * x)
        end = motion.until(
            x + 2.0 * zeta * u, zeta * x + (2.0 * zeta * zeta - 1.0) * u, slow * (x + slow * u)
        )
        left, cuts = inf, _CUTS_ABOVE_CRITICAL
        if motion.oscillates:
            left = atan2(2.0 * zeta * frequency, 1.0 - 2.0 * zeta * zeta) / frequency
            cuts = _CUTS_BELOW_CRITICAL
        edges = [cut / frequency - past for cut in cuts]
        edges = [0.0, *(edge for edge in edges if 0.0 < edge < end), end]
        m, omega = self._m, self._omega
        t = 0.0
        for begin, stop in pairwise(edges):
            width = stop - begin
            after = left + (end - stop)
            if past + begin < _NEAR * width:
                origin = 0.0, motion.after(x, u, -past)[1]
                first, last = past + begin, past + stop
            elif after < _NEAR * width:
                origin = 0.0, motion.after(x, u, end + left)[1]
                first, last = -(after + width), -after
            else:
                origin = motion.after(x, u, begin)[:2]
                first, last = 0.0, width
            panel = Panel(motion, m, omega, origin, first, last, stop, t)
            self._panels.append(panel)
            t = panel.end
        return motion.after(x, u, end)[1]

    def _force(self, relative: float, drive: float) -> float:
        """Contact force, N, from d/L and x + 2ζu."""
        scale = self._mu * self._omega * self._speed
        force = scale * relative ** (self._m - 1.0) * drive
        return force if force > 0.0 else 0.0

    def state(self, t: float) -> State:
        x_club, _, v_club, v_ball, d0, w0 = self._bodies
        p, q = self._p, self._q
        force, d, w = self._relative_motion(t)
        x = x_club + ((p * v_ball + q * v_club) * t - p * (d0 - d))
        return [force, x, x - d, v_club - p * (w0 - w), v_ball + q * (w0 - w), d]

    def value(self, name: str, t: float) -> float:
        return self._relative_motion(t)[("force", "d", "w").index(name)]

    def _relative_motion(self, t: float) -> tuple[float, float, float]:
        """Contact force (N), compression (m) and closing speed (m/s)."""
        if t >= self.duration:
            return self._final
        if t <= 0.0:
            return self._initial
        panel = next(panel for panel in self._panels if t < panel.end)
        relative, u, drive = panel.motion_at(panel.find(t))
        return self._force(relative, drive), self._length * relative, self._speed * u

    def impulse(self, begin: float, width: float) -> float:
        if not self._panels:
            return 0.0
        x, u = self._start
        motion = self._motion
        scale = self._mu * self._speed
        first, last = self._sigma(begin), self._sigma(begin + width)
        span = last - first
        if span * max(1.0, motion.fast) > 0.1:
            return scale * (motion.after(x, u, first)[1] - motion.after(x, u, last)[1])
        # ∫ F dt is ∫ (x + 2ζu) dσ up to a factor. Over a short time the rounding of σ cancels in
        # the quotient of that and of t = ∫ x^(-P) dσ (not smooth at x = 0, but σ is exact there).
        points = [motion.after(x, u, first + place * span) for place in _PLACES]
        compressions, _, drives = zip(*points)
        drive = dot(_WEIGHTS, drives)
        if max(compressions) >= 1.15 * min(compressions):
            return scale * drive * span
        time = dot(_WEIGHTS, [compression**-self._power for compression in compressions])
        return scale * self._omega * width * drive / time

    def _sigma(self, t: float) -> float:
        """σ from the start of the phase until t."""
        if t <= 0.0:
            return 0.0
        for panel in self._panels:
            if t < panel.end:
                return panel.sigma + panel.width * panel.find(t) ** panel.r
        return self._panels[-1].stop

    def find_maxima(self, name: str) -> list[float]:
        x, u = self._start
        motion, r = self._motion, 0.0
        if name == "force":
            # F' = 0 is 2ζP r² + (1 + P - 4ζ²) r - 2ζ = 0 with r = u/x, which only falls: F rises
            # until r is at the root that isn't negative (the other is beyond the end, r = -1/2ζ).
            zeta, power = motion.zeta, self._power
            half = 0.5 * (1.0 + power) - 2.0 * zeta * zeta
            other = 2.0 * zeta * sqrt(power)
            root = sqrt(half * half + other * other)
            r = 2.0 * zeta / (half + root) if half > 0.0 else (root - half) / (2.0 * zeta * power)
        if u <= r * x or not self._panels:
            return []
        # σ until u/x has fallen to r.
        sigma = motion.until(
            u - r * x,
            x + motion.zeta * u + r * (u + motion.zeta * x),
            x * (1.0 + r * motion.fast) + u * (motion.slow + r),
        )
        panel = next((panel for panel in self._panels if sigma < panel.stop), self._panels[-1])
        return [panel.time(sigma)]
