"""An underdamped linear contact in double precision: nearly every impact in golf.

Where double precision loses digits, `LinearLaw.contact` takes `ExtendedContact` instead.
"""

from collections.abc import Callable
from math import atan2, cos, exp, expm1, sin, sqrt

from ..numerics.gauss import GAUSS_5
from ..numerics.zeros import first_downward_zero, offset_of_real_root
from ..values import Motion, State
from .contact import ROUNDING, ContactPhase
from .extended import ExtendedContact, Row, slope

#: A damping ratio of the drag as small as this changes no bit of any result.
_LEAST_DAMPING = 1e-30

#: Largest damping ratios in double precision. Under drag the rates may meet beyond; a damper
#: leaves hardly an oscillation.
MOST_DRAG, MOST_DAMPING = 0.7, 0.999

#: Largest share of the real mode in the compression: with more, drag moves the bodies together or
#: apart much faster than they close, and the real mode and the pair nearly cancel.
MOST_REAL_MODE = 0.5


#: Over a shorter time (in units of 1/ω) an integral is Gauss's, since its closed form is the small
#: difference of large numbers.
_SHORT = 0.5

#: A slope (relative to ω times the value) that is smaller may have changed its sign by rounding.
_FLAT = 1e-6


class ClosedFormContact(ContactPhase):
    """An underdamped contact in double precision, under either a damper or a drag.

    In units of 1/ω, ω² = k/μ, with the mass fractions p of the ball and q of the club, and drag =
    2ζμω, the rates are the roots of s³ - 2ζs² + (1 + 4ζ²pq)s - 4ζpq. One of them, r, lies between
    the drags 2ζp of the club and 2ζq of the ball. Without drag the centre of mass moves uniformly,
    and the compression is a damped oscillation.

    Either damper or drag is 0. A force on the club head (N) shifts what the compression oscillates
    about, and accelerates the centre of mass. `duration` is 0 where double precision loses digits:
    the rates nearly meet, the real mode nearly cancels the pair, the force hardly reaches 0, or
    contact doesn't end with the first half period; and with a force beside a drag.
    """

    __slots__ = (
        "_acceleration", "_arguments", "_d", "_dense", "_force", "_rates", "_start", "_v_ball",
        "_v_club",
    )  # fmt: skip

    def __init__(
        self, k: float, damper: float, drag: float, m_club: float, m_ball: float, start: Motion,
        club_force: float = 0.0,
    ) -> None:  # fmt: skip
        self._arguments = k, damper, drag, m_club, m_ball, start, club_force
        _, _, v_club, v_ball, compression, closing = self._start = start
        self._dense: tuple[Callable[[float], State], float] | None = None
        self.duration = 0.0
        total = m_club + m_ball
        p = m_ball / total
        q = m_club / total
        mu = m_club * p
        self.rate = omega = sqrt(k / mu)
        zeta = (damper or drag) / (2.0 * mu * omega)
        d = omega * compression
        if not drag:
            if zeta > MOST_DAMPING:
                return
            level = f_a = self._acceleration = 0.0
            if club_force:
                # The compression oscillates about a level, the centre of mass accelerates.
                self._acceleration = club_force / total
                level, f_a = p * club_force / k, p * club_force
                d -= omega * level
            h = zeta
            second = sqrt((1.0 - zeta) * (1.0 + zeta))
            w_s = -(h * closing + d) / second
            s0 = (closing + h * d) / second
            scale = mu * omega
            f_c = scale * (d + 2.0 * zeta * closing)
            f_s = scale * (s0 + 2.0 * zeta * w_s)
            angle = _end_above(f_a, h / second, f_c, f_s) if f_a else atan2(f_c, -f_s)
            frequency = second * omega
            mean = q * v_club + p * v_ball
            self._rates = 0.0, h * omega, frequency
            self._force = f_a, f_c, f_s
            self._d = level, d / omega, s0 / omega
            self._v_club = mean, p * closing, p * w_s
            self._v_ball = mean, -q * closing, -q * w_s
        else:
            if zeta > MOST_DRAG or club_force:
                return
            self._acceleration = 0.0
            if zeta < _LEAST_DAMPING:
                zeta = _LEAST_DAMPING
            drag_club = 2.0 * zeta * p
            drag_ball = 2.0 * zeta * q
            x = offset_of_real_root(p, q, drag_club, 2.0 * zeta * ((m_club - m_ball) / total))
            u = p + (drag_club + x) * x
            # How far r lies below the ball's drag: the same equation, and no cancellation.
            y = q * x / u
            # From the slower drag on, where the sum doesn't cancel.
            r = drag_club + x if x > 0.0 else drag_ball - y
            h = 0.5 * (drag_club + y)
            second = sqrt(4.0 * zeta * p * q / r - h * h)
            # (d, v_club, v_ball) is a·(x, p, u), the real mode with the left eigenvector
            # (-q x, q, u), and the rest, the pair; (s0, s1, s2) is (A + h)·rest / R.
            a = (q * (v_club - x * d) + u * v_ball) / (q * (p - x * x) + u * u)
            a0, a1, a2 = a * x, a * p, a * u
            c0, c1, c2 = d - a0, v_club - a1, v_ball - a2
            s0 = (closing + r * a0 + h * c0) / second
            if abs(a0) > MOST_REAL_MODE * (d + (closing if closing > 0.0 else 0.0)):
                return
            angle = first_downward_zero((h - r) / second, a0, c0, s0) or 0.0
            frequency = second * omega
            scale = k / omega
            self._rates = r * omega, h * omega, frequency
            self._force = scale * a0, scale * c0, scale * s0
            self._d = a0 / omega, c0 / omega, s0 / omega
            self._v_club = a1, c1, ((h - drag_club) * c1 - p * c0) / second
            self._v_ball = a2, c2, ((h - drag_ball) * c2 + q * c0) / second
        self.duration = angle / frequency

    def extended(self) -> ExtendedContact:
        """The same contact in extended precision."""
        return ExtendedContact(*self._arguments)

    def dense_output(self) -> tuple[Callable[[float], State], float]:
        """The dense output over the angle Rt; kept, since a change of inputs needs it again."""
        if self._dense is not None:
            return self._dense
        r, h, frequency = self._rates
        _, f_c, f_s = self._force
        a0, c0, s0 = self._d
        a1, c1, s1 = self._v_club
        a2, c2, s2 = self._v_ball
        k = self._arguments[0]
        decay, pair = -r / frequency, -h / frequency
        size = h * h + frequency * frequency
        x_c, x_s = (h * c1 + frequency * s1) / size, (frequency * c1 - h * s1) / size
        x_0 = self._start[0] + x_c
        x_a = -a1 / r if r else a1 / frequency

        def state(angle: float) -> State:
            size = exp(pair * angle)
            c = size * cos(angle)
            s = size * sin(angle)
            if decay:
                travel = expm1(decay * angle)
                e = 1.0 + travel
                d = a0 * e + c0 * c + s0 * s
                force = k * d
            else:
                travel, e = angle, 1.0
                d = c0 * c + s0 * s
                force = f_c * c + f_s * s
            x = x_0 + x_a * travel - x_c * c + x_s * s
            return [force, x, x - d, a1 * e + c1 * c + s1 * s, a2 * e + c2 * c + s2 * s, d]

        if not self._acceleration:
            self._dense = state, frequency
            return self._dense
        a, f_a = self._acceleration, self._force[0]

        def accelerated(angle: float) -> State:
            force, x, _, v_club, v_ball, d = state(angle)
            t, d = angle / frequency, d + a0
            x += 0.5 * a * t * t
            return [force + f_a, x, x - d, v_club + a * t, v_ball + a * t, d]

        self._dense = accelerated, frequency
        return self._dense

    def end_velocities(self) -> tuple[float, float]:
        t = self.duration
        r, h, frequency = self._rates
        size, angle = exp(-h * t), frequency * t
        c, s = size * cos(angle), size * sin(angle)
        a1, c1, s1 = self._v_club
        a2, c2, s2 = self._v_ball
        if r:
            e = 1.0 + expm1(-r * t)
            return a1 * e + c1 * c + s1 * s, a2 * e + c2 * c + s2 * s
        if not self._acceleration:
            return a1 + c1 * c + s1 * s, a2 + c2 * c + s2 * s
        gained = self._acceleration * t
        return a1 + c1 * c + s1 * s + gained, a2 + c2 * c + s2 * s + gained

    def end(self) -> Motion:
        t = self.duration
        r, h, frequency = self._rates
        size, angle = exp(-h * t), frequency * t
        c, s = size * cos(angle), size * sin(angle)
        v_club, v_ball = self.end_velocities()
        a2, c2, s2 = self._v_ball
        square = h * h + frequency * frequency
        x = self._start.x_club - self._start.compression
        x += ((h * c2 + frequency * s2) * (1.0 - c) + (frequency * c2 - h * s2) * s) / square
        if r:
            x -= a2 / r * expm1(-r * t)
            return Motion(x, x, v_club, v_ball, 0.0, v_club - v_ball)
        x += a2 * t
        _, c1, s1 = self._v_club
        level, c0, s0 = self._d
        left = c0 * c + s0 * s if self._arguments[1] else 0.0
        if self._acceleration:
            x += 0.5 * self._acceleration * t * t
            left = max(0.0, level + c0 * c + s0 * s)
        return Motion(x + left, x, v_club, v_ball, left, (c1 - c2) * c + (s1 - s2) * s)

    def value(self, name: str, t: float) -> float:
        return self._at(self._row(name), t)

    def _at(self, row: Row, t: float) -> float:
        a, c, s = row
        r, h, frequency = self._rates
        size, angle = exp(-h * t), frequency * t
        pair = c * (size * cos(angle)) + s * (size * sin(angle))
        return a * exp(-r * t) + pair if a else pair

    def closing(self, t: float) -> float:
        a, c, s = self._d
        r, h, frequency = self._rates
        size, angle = exp(-h * t), frequency * t
        cosine, sine = frequency * s - h * c, -h * s - frequency * c
        pair = cosine * (size * cos(angle)) + sine * (size * sin(angle))
        return -r * a * exp(-r * t) + pair if r else pair

    def _row(self, name: str) -> Row:
        if name == "force":
            return self._force
        return self._d if name == "d" else slope(self._d, self._rates)

    def impulse(self, begin: float, width: float) -> float:
        if width * self.rate <= _SHORT:
            end, half, row, total = begin + width, 0.5 * width, self._force, 0.0
            for node, weight in GAUSS_5:
                total += weight * self._at(row, end - half * (1.0 - node))
            return half * total
        r, h, frequency = self._rates
        a, c, s = self._force
        real = -a * exp(-r * begin) * expm1(-r * width) / r if r else a * width
        # The integral of the pair is a pair.
        size = h * h + frequency * frequency
        pair = 0.0, -(h * c + frequency * s) / size, (frequency * c - h * s) / size
        return real + (self._at(pair, begin + width) - self._at(pair, begin))

    def totals(self, t: float) -> tuple[tuple[float, float], float, float]:
        """As of `ContactPhase`, faster after a short time: every change of k or b needs it."""
        width = t * self.rate
        if width > _SHORT:
            return super().totals(t)
        r, h, frequency = rates = self._rates
        size, angle = exp(-h * t), frequency * t
        cosine, sine, real = size * cos(angle), size * sin(angle), exp(-r * t)
        largest = []
        for name, (a, c, s) in (("force", self._force), ("d", self._d)):
            slope_a, slope_c, slope_s = slope((a, c, s), rates)
            start, now = a + c, c * cosine + s * sine
            if a:
                now += a * real
            rises = slope_a + slope_c > 0.0
            left = slope_a * real + (slope_c * cosine + slope_s * sine)
            if rises and left <= _FLAT * self.rate * abs(now):
                # There may be a maximum in between.
                largest.append(self.largest(name, t))
            elif rises and now > start + ROUNDING * abs(start):
                largest.append((now, t))
            else:
                largest.append((start, 0.0))
        force, (d, _) = largest
        return force, d, self.impulse(0.0, t)

    def find_maxima(self, name: str) -> list[float]:
        """The only one, before the end of the half period, unless the row falls from the start."""
        r, h, frequency = rates = self._rates
        a, c, s = slope(self._row(name), rates)
        if a + c <= 0.0:
            return []
        angle = first_downward_zero((h - r) / frequency, a, c, s)
        if angle is None:
            # The slope hardly reaches 0.
            return self.extended().find_maxima(name)
        return [angle / frequency]


def _end_above(level: float, growth: float, cosine: float, sine: float) -> float:
    """The end of a contact whose force oscillates about a level, rad; 0 where digits are lost.

    Up to half of the pair's amplitude a zero is steep, and the only one of the half period.
    """
    angle = first_downward_zero(growth, level, cosine, sine)
    if angle is None:
        return 0.0
    amplitude = sqrt(cosine * cosine + sine * sine)
    if abs(level) * exp(growth * angle) > 0.5 * amplitude:
        return 0.0
    return angle
