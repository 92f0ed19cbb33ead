"""Law 1: a spring between the bodies and a drag b·v on each of them (the source document's law).

m_C v_C' = -k d - b v_C,  m_B v_B' = k d - b v_B,  d' = v_C - v_B, in contact until d returns to 0.
The drag acts on absolute velocities, so momentum is lost to the surroundings, the answer depends
on the frame of reference, and heavy damping can keep the bodies together for ever.

In units of 1/ω, ω² = k/μ, and with the mass fractions p of the ball and q of the club, the rates
are the roots of s³ - 2ζs² + (1 + 4ζ²pq)s - 4ζpq. One of them, r, lies between the two drags, 2ζp of
the club and 2ζq of the ball. A usual contact has moderate damping, so that the other two are a pair
that oscillates far from r, and it ends when the pair has swung once: every impact in golf is one.
All others are told by `ExtendedContact`.
"""

from collections.abc import Callable
from math import cos, exp, expm1, sin, sqrt

from ..numerics.gauss import integral
from ..numerics.zeros import first_fall, offset_of_real_root
from .contact import EARLY, ContactPhase, End, Inputs, Law, Parameters, Start, State
from .extended import ExtendedContact

#: A damping ratio as small as this changes no bit of any result, and needs no case of its own.
_LEAST_DAMPING = 1e-30

#: With a higher damping ratio rates may meet, and digits are lost.
MOST_DAMPING = 0.7

#: If the real mode's share is more than this of what the bodies compress by themselves, it and the
#: pair's nearly cancel: drag moves the bodies together, or apart, much faster than they close.
MOST_REAL_MODE = 0.5


class UsualContact(ContactPhase):
    """A usual contact phase, in doubles; see `ContactPhase`.

    Each quantity is a sum of e^(-rt), e^(-ht) cos Rt and e^(-ht) sin Rt.
    """

    def __init__(self, k: float, b: float, m_club: float, m_ball: float, start: Start) -> None:
        self._arguments = k, b, m_club, m_ball, start
        #: s from the start of the phase until contact ends; 0 if it isn't a usual contact.
        self.duration = 0.0
        self._peak: tuple[float, float] | None = None
        _, compression, v_club, v_ball, closing = start
        total = m_club + m_ball
        p = m_ball / total
        q = m_club / total
        mu = m_club * p
        #: The fastest rate of change in the phase, 1/s.
        self.rate = omega = sqrt(k / mu)
        zeta = b / (2.0 * mu * omega)
        if zeta > MOST_DAMPING:
            return
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
        d = omega * compression

        # The state (d, v_club, v_ball) is a·(x, p, u), the real mode, and w, which is left for the
        # pair. (-q x, q, u) is the mode's left partner, and (g0, g1, g2) is (A + h) w / R.
        a = (q * (v_club - x * d) + u * v_ball) / (q * (p - x * x) + u * u)
        w0, w1, w2 = d - a * x, v_club - a * p, v_ball - a * u
        g0 = (closing + r * a * x + h * w0) / second
        g1 = ((h - drag_club) * w1 - p * w0) / second
        g2 = ((h - drag_ball) * w2 + q * w0) / second

        lone = a * x
        if abs(lone) > MOST_REAL_MODE * (d + max(closing, 0.0)):
            return
        angle = first_fall((h - r) / second, lone, w0, g0)
        if angle is None:
            return
        self.duration = angle / (second * omega)
        size = (h * h + second * second) * omega
        self._motion = (
            r * omega, h * omega, second * omega, lone / omega, w0 / omega, g0 / omega,
            a * p, w1, g1, a * u, w2, g2,
            (h * w1 + second * g1) / size, (second * w1 - h * g1) / size,
        )  # fmt: skip

    def course(self) -> tuple[Callable[[float], State], float]:
        """Time is the angle Rt."""
        r, h, frequency, a0, c0, s0, a1, c1, s1, a2, c2, s2, x_c, x_s = self._motion
        k, _, _, _, (x_club, *_) = self._arguments
        lone, pair = -r / frequency, -h / frequency
        x_0, x_a = x_club + x_c, -a1 / r

        def state(angle: float) -> State:
            size = exp(pair * angle)
            c = size * cos(angle)
            s = size * sin(angle)
            fallen = expm1(lone * angle)
            e = 1.0 + fallen
            d = a0 * e + c0 * c + s0 * s
            x = x_0 + x_a * fallen - x_c * c + x_s * s
            return [k * d, x, x - d, a1 * e + c1 * c + s1 * s, a2 * e + c2 * c + s2 * s, d]

        return state, frequency

    def end(self) -> End:
        t = self.duration
        r, h, frequency, _, _, _, a1, c1, s1, a2, c2, s2, x_c, x_s = self._motion
        size = exp(-h * t)
        angle = frequency * t
        c = size * cos(angle)
        s = size * sin(angle)
        fallen = expm1(-r * t)
        e = 1.0 + fallen
        x = self._arguments[4].x_club + (x_c - a1 / r * fallen - x_c * c + x_s * s)
        v_club = a1 * e + c1 * c + s1 * s
        v_ball = a2 * e + c2 * c + s2 * s
        return x, v_club, v_ball, 0.0, v_club - v_ball

    def closing(self, t: float) -> float:
        r, h, frequency, a0, c0, s0, *_ = self._motion
        angle = frequency * t
        pair = (frequency * s0 - h * c0) * cos(angle) - (h * s0 + frequency * c0) * sin(angle)
        return exp(-h * t) * pair - r * a0 * exp(-r * t)

    def impulse(self, begin: float, width: float) -> float:
        """K times the integral of d.

        Not from the momentum gained and what the drag took, which nearly cancel.
        """
        if width * self.rate <= 0.5:
            return integral(self._force, begin + width, width)
        r, h, frequency, a0, c0, s0, *_ = self._motion
        # The pair's amplitudes at the beginning.
        size = exp(-h * begin)
        angle = frequency * begin
        c = size * cos(angle)
        s = size * sin(angle)
        c0, s0 = c0 * c + s0 * s, s0 * c - c0 * s
        angle = frequency * width
        # 1 - e^(-x) cos(angle), also where it is small.
        fallen = 2.0 * sin(0.5 * angle) ** 2 - cos(angle) * expm1(-h * width)
        pair = (h * c0 + frequency * s0) * fallen
        pair += (frequency * c0 - h * s0) * exp(-h * width) * sin(angle)
        lone = a0 * exp(-r * begin) * expm1(-r * width) / r
        return self._arguments[0] * (pair / (h * h + frequency * frequency) - lone)

    def compression(self, t: float) -> float:
        r, h, frequency, a0, c0, s0, *_ = self._motion
        if t * self.rate <= EARLY and not self._arguments[4].compression:
            # Just after touch the modes nearly cancel.
            return integral(self.closing, t, t)
        angle = frequency * t
        pair = c0 * cos(angle) + s0 * sin(angle)
        return a0 * exp(-r * t) + exp(-h * t) * pair

    def _force(self, t: float) -> float:
        return self._arguments[0] * self.compression(t)

    def peak_force(self, t: float) -> tuple[float, float]:
        if self._peak is None:
            self._peak = self._find_peak()
        force, when = self._peak
        return (force, when) if t >= when else (self._force(t), t)

    def peak_compression(self, t: float) -> float:
        """Force and compression are largest together."""
        return self.peak_force(t)[0] / self._arguments[0]

    def _find_peak(self) -> tuple[float, float]:
        k, _, _, _, start = self._arguments
        if start.closing <= 0.0:
            return k * start.compression, 0.0
        r, h, frequency, a0, c0, s0, *_ = self._motion
        # Of d' as of d.
        angle = first_fall(
            (h - r) / frequency, -r * a0, frequency * s0 - h * c0, -h * s0 - frequency * c0
        )
        if angle is None:
            k, b, m_club, m_ball, start = self._arguments
            exact = ExtendedContact(k, 0.0, b, m_club, m_ball, start)
            return exact.peak_force(self.duration)
        when = angle / frequency
        return self._force(when), when


class AbsoluteLaw(Law):
    """Law 1; see `Law`."""

    name = "absolute"
    description = "A spring between the bodies and a drag b*v on each: the source document's"

    def refusal(self, p: Parameters, inputs: Inputs) -> str | None:
        """Neither a power law nor a given coefficient of restitution."""
        if p.exponent != 1.0:
            return (
                f"exponent = {p.exponent!r} is refused with law = 1 (absolute): set exponent = 1, "
                "or law = 2 (relative)"
            )
        if p.restitution_at_rest > 0.0:
            return (
                f"restitution_at_rest = {p.restitution_at_rest!r} is refused with law = 1 "
                "(absolute): set it to 0, or law = 2 (relative)"
            )
        return None

    def contact(self, p: Parameters, k: float, b: float, start: Start) -> ContactPhase:
        usual = UsualContact(k, b, p.m_club, p.m_ball, start)
        if usual.duration:
            return usual
        return ExtendedContact(k, 0.0, b, p.m_club, p.m_ball, start)

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        return k * compression

    def drag(self, b: float) -> float:
        return b
