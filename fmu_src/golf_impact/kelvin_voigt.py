"""Law 2 with exponent 1: a spring and a damper between the bodies (Kelvin–Voigt).

The contact force is F = k d + b d', with d the compression and d' the closing speed. It acts on
both bodies alike, so momentum is conserved, and contact ends when the force has fallen to zero:
the bodies can push but not pull (Schwager & Pöschel, Granular Matter 9, 465–469, 2007).
"""

from collections.abc import Callable
from math import atan2, cos, exp, expm1, inf, log, log1p, sin, sqrt

from .from_zero import FromZero

_OSCILLATING, _MEETING_RATES, _TWO_RATES = range(3)


class KelvinVoigtContact:
    """One contact phase under constant k and b, exact at every instant.

    The centre of mass moves uniformly and the compression is a damped oscillation about zero. Both
    are combinations of two decaying basis functions: exp(-γt)·(cos Ωt, sin Ωt) below critical
    damping; from there on exp(-λ₁t)·(1, (1 - exp(-Δt))/Δ) with Δ = λ₂ - λ₁, which stay apart where
    the two rates meet; and exp(-λ₁t), exp(-λ₂t) once they have parted.

    Args:
        k: contact stiffness, N/m, > 0.
        b: damping, N.s/m, >= 0.
        m_club: mass of the club head, kg.
        m_ball: mass of the ball, kg.
        x_club: position of the club face when the phase starts, m.
        compression: how far the club face is past the ball's rest shape then, m, >= 0.
        v_club: velocity of the club head then, m/s.
        v_ball: velocity of the ball then, m/s.
        closing: v_club - v_ball, where it is known better than that difference tells.

    The state must be one in contact: a force above zero, or first touch while closing.
    """

    #: Its impulse is a change of the closing speed, good however short the contact: see Impact.
    frequency = inf

    __slots__ = (
        "_basis",
        "_motion",
        "_mu",
        "_peak",
        "_start",
        "duration",
        "rate",
    )

    def __init__(
        self,
        k: float,
        b: float,
        m_club: float,
        m_ball: float,
        x_club: float,
        compression: float,
        v_club: float,
        v_ball: float,
        closing: float | None = None,
    ) -> None:
        total = m_club + m_ball
        p = m_ball / total
        q = m_club / total
        mu = m_club * p
        omega = sqrt(k / mu)
        zeta = b / (2.0 * mu * omega)
        d = compression
        if closing is None:
            closing = v_club - v_ball
        w = closing
        force = k * d + b * w
        gap_to_critical = 1.0 - zeta
        if gap_to_critical >= 0.0:
            gamma = zeta * omega
            # Exactly critical: a frequency this small changes nothing within a double.
            frequency = omega * (sqrt(gap_to_critical * (1.0 + zeta)) or 1e-10)
            pull = omega * omega * d
            d_s = (w + gamma * d) / frequency
            w_s = -(gamma * w + pull) / frequency
            force_s = mu * (w * (omega * omega - 2.0 * gamma * gamma) - gamma * pull) / frequency
            self._basis = _OSCILLATING
            #: s from the start of the phase until contact ends.
            self.duration = atan2(force, -force_s) / frequency
            #: The fastest rate of change in the phase, 1/s.
            self.rate = omega
            first, second = gamma, frequency
        else:
            root = sqrt(zeta - 1.0) * sqrt(zeta + 1.0)
            fast = omega * (zeta + root)
            slow = omega / (zeta + root)
            split = 2.0 * omega * root
            # The ratio of rates alone may be too large for a double.
            ratio = split * (force / mu / (w + fast * d)) / slow
            if ratio < 1e100 * slow:
                self.duration = log1p(ratio / slow) / split
            else:
                self.duration = (log(ratio) - log(slow)) / split
            self.rate = fast
            start_slow, start_fast = w + fast * d, w + slow * d
            if fast > 2.0 * slow:
                self._basis = _TWO_RATES
                first, second = slow, fast
                d, d_s = start_slow / split, -start_fast / split
                w, w_s = -slow * d, -fast * d_s
                force, force_s = -mu * slow * slow * d, -mu * fast * fast * d_s
            else:
                self._basis = _MEETING_RATES
                first, second = slow, split
                d_s = start_fast
                w_s = -fast * d_s
                force_s = mu * fast * w_s
        self._mu = mu
        self._start = (k, zeta, omega, b * closing + k * compression, compression)
        self._motion = (
            first,
            second,
            force,
            force_s,
            d,
            d_s,
            w,
            w_s,
            p,
            q,
            x_club - p * compression,
            q * v_club + p * v_ball,
        )
        self._peak: tuple[float, float] | None = None

    def state(self, t: float) -> list[float]:
        """Everything that moves, at one instant.

        Args:
            t: time since the start of the phase, s, from 0 to `duration`.

        Returns:
            Contact force (N), positions of club face and ball (m), velocities of club and
            ball (m/s), compression (m).
        """
        _, _, force, force_s, d, d_s, w, w_s, p, q, x, v = self._motion
        c, s = self._basis_at(t)
        compression = d * c + d_s * s
        closing = w * c + w_s * s
        x += v * t
        return [
            force * c + force_s * s,
            x + p * compression,
            x - q * compression,
            v + p * closing,
            v - q * closing,
            compression,
        ]

    def _basis_at(self, t: float) -> tuple[float, float]:
        motion = self._motion
        first, second = motion[0], motion[1]
        if self._basis == _OSCILLATING:
            size = exp(-first * t)
            angle = second * t
            return size * cos(angle), size * sin(angle)
        c = exp(-first * t)
        if self._basis == _TWO_RATES:
            return c, exp(-second * t)
        return c, c * -expm1(-second * t) / second

    def closing(self, t: float) -> float:
        """Closing speed v_club - v_ball at t, m/s, exact even where it is a tiny difference."""
        c, s = self._basis_at(t)
        return self._motion[6] * c + self._motion[7] * s

    def end(self) -> tuple[list[float], float]:
        """State and closing speed when contact ends: the force is 0, the ball not yet round."""
        t = self.duration
        _, _, _, _, d, d_s, w, w_s, p, q, x, v = self._motion
        c, s = self._basis_at(t)
        compression = d * c + d_s * s
        closing = w * c + w_s * s
        x += v * t
        return [
            0.0,
            x + p * compression,
            x - q * compression,
            v + p * closing,
            v - q * closing,
            compression,
        ], closing

    def fast_state(self) -> tuple[Callable[[float], list[float]], float, float]:
        """`state` for many instants: a function, and the scale and offset of time that it wants."""
        if self._basis == _OSCILLATING:
            gamma, frequency, force, force_s, d, d_s, w, w_s, *rest = self._motion
            zero = FromZero(gamma, frequency, d, d_s, self.duration)
            if zero.near:
                return _oscillating(zero, (force, force_s), (d, d_s), (w, w_s), *rest), *zero.time
        return self.state, 1.0, 0.0

    def impulse(self, begin: float, width: float) -> float:
        """Impulse of the contact force over [begin, begin + width] (s), N.s.

        The reduced mass times the change of the closing speed.
        """
        first, second, _, _, _, _, w, w_s, _, _, _, _ = self._motion
        c, s = self._basis_at(begin)
        if self._basis == _TWO_RATES:
            lost = -w * c * expm1(-first * width) - w_s * s * expm1(-second * width)
        else:
            # Amplitudes at the beginning.
            if self._basis == _OSCILLATING:
                w, w_s = w * c + w_s * s, w_s * c - w * s
            else:
                w, w_s = w * c + w_s * s, w_s * exp(-(first + second) * begin)
            c, s = self._basis_at(width)
            lost = w * (1.0 - c) - w_s * s
        return self._mu * lost

    def peak_force(self, t: float) -> tuple[float, float]:
        """The largest contact force on [0, t] and its time.

        Args:
            t: s since the start of the phase, at most `duration`.

        Returns:
            Force (N) and time since the start of the phase (s).
        """
        if self._peak is None:
            self._peak = self._find_peak()
        largest, when = self._peak
        return (largest, when) if t >= when else (self.state(t)[0], t)

    def _find_peak(self) -> tuple[float, float]:
        k, zeta, omega, force, d = self._start
        # From half of critical damping on, the force falls from the start.
        slope = k * (
            self.closing(0.0) * (1.0 - 2.0 * zeta) * (1.0 + 2.0 * zeta) - 2.0 * zeta * omega * d
        )
        if self._basis != _OSCILLATING or slope <= 0.0:
            return force, 0.0
        gamma, frequency, _, force_s = self._motion[:4]
        when = atan2(slope, gamma * force_s + frequency * force) / frequency
        return self.state(when)[0], when

    def peak_compression(self, t: float) -> float:
        """The largest compression on [0, t], m; t (s) at most `duration`."""
        d, w = self._start[4], self.closing(0.0)
        if w <= 0.0:
            return d
        first, second, _, _, _, _, _, w_s, _, _, _, _ = self._motion
        if self._basis == _OSCILLATING:
            when = atan2(w, -w_s) / second
        else:
            fast = second if self._basis == _TWO_RATES else first + second
            split = fast - first
            when = log1p(split * w / (first * (w + fast * d))) / split
        return self.state(min(t, when))[5]


def _oscillating(
    zero: FromZero,
    forces: tuple[float, float],
    compressions: tuple[float, float],
    closings: tuple[float, float],
    p: float,
    q: float,
    x: float,
    v: float,
) -> Callable[[float], list[float]]:
    rate = zero.rate
    force, force_s = zero.amplitudes(*forces)
    _, d_s = zero.amplitudes(*compressions)
    w, w_s = zero.amplitudes(*closings)
    x -= v * zero.shift
    v_angle = v / zero.frequency

    def state(angle: float) -> list[float]:
        size = exp(rate * angle)
        c = size * cos(angle)
        s = size * sin(angle)
        compression = d_s * s
        closing = w * c + w_s * s
        mean = x + v_angle * angle
        return [
            force * c + force_s * s,
            mean + p * compression,
            mean - q * compression,
            v + p * closing,
            v - q * closing,
            compression,
        ]

    return state
