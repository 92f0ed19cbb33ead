"""Law 2 with exponent 1: a spring and a damper between the bodies (Kelvin–Voigt).

The contact force is F = k d + b d', with d the compression and d' the closing speed. It acts on
both bodies alike, so momentum is conserved, and contact ends when the force has fallen to zero:
the bodies can push but not pull (Schwager & Pöschel, Granular Matter 9, 465–469, 2007).
"""

from cmath import exp as complex_exp
from collections.abc import Callable
from math import atan2, exp, expm1, log1p, sqrt


class KelvinVoigtContact:
    """One contact phase under constant k and b, exact at every instant.

    The centre of mass moves uniformly and the compression is a damped oscillation about zero. Both
    are combinations of two decaying basis functions, (C, S) = exp(-γt)·(cos Ωt, sin Ωt) below
    critical damping and exp(-λ₁t)·(1, (1 - exp(-Δt))/Δ) from there on, with Δ = λ₂ - λ₁. Those stay
    accurate where the two rates meet.

    Args:
        k: contact stiffness, N/m, > 0.
        b: damping, N.s/m, >= 0.
        m_club: mass of the club head, kg.
        m_ball: mass of the ball, kg.
        x_club: position of the club face when the phase starts, m.
        compression: how far the club face is past the ball's rest shape then, m, >= 0.
        v_club: velocity of the club head then, m/s.
        v_ball: velocity of the ball then, m/s.

    The state must be one in contact: a force above zero, or first touch while closing.
    """

    __slots__ = (
        "_force",
        "_motion",
        "_mu",
        "_oscillates",
        "_peak",
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
    ) -> None:
        total = m_club + m_ball
        p = m_ball / total
        q = m_club / total
        mu = m_club * p
        omega = sqrt(k / mu)
        zeta = b / (2.0 * mu * omega)
        d = compression
        w = v_club - v_ball
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
            first, second = gamma, frequency
            self._oscillates = True
            #: s from the start of the phase until contact ends.
            self.duration = atan2(force, -force_s) / frequency
            #: The fastest rate of change in the phase, 1/s.
            self.rate = omega
        else:
            root = sqrt(zeta - 1.0) * sqrt(zeta + 1.0)
            fast = omega * (zeta + root)
            slow = omega / (zeta + root)
            split = 2.0 * omega * root
            d_s = w + slow * d
            w_s = -fast * d_s
            force_s = mu * fast * w_s
            first, second = slow, split
            self._oscillates = False
            self.duration = log1p(split * (force / mu) / (slow * slow * (w + fast * d))) / split
            self.rate = fast
        self._mu = mu
        self._force = (k, b, zeta, omega)
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
            x_club - p * d,
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
        first, second, force, force_s, d, d_s, w, w_s, p, q, x, v = self._motion
        if self._oscillates:
            z = complex_exp(complex(-first * t, second * t))
            c = z.real
            s = z.imag
        else:
            c = exp(-first * t)
            s = c * -expm1(-second * t) / second
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

    def fast_state(self) -> Callable[[float], list[float]]:
        """`state` for many instants: a function over constants."""
        return _oscillating(*self._motion) if self._oscillates else self.state

    def impulse(self, t: float) -> float:
        """Impulse of the contact force over [0, t], N.s: the reduced mass times the change of w."""
        _, _, _, v_club, v_ball, _ = self.state(t)
        return self._mu * (self._motion[6] - (v_club - v_ball))

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
        k, b, zeta, omega = self._force
        gamma, frequency, force, force_s, d, _, w, *_ = self._motion
        # From half of critical damping on, the force falls from the start.
        slope = k * (w * (1.0 - 2.0 * zeta) * (1.0 + 2.0 * zeta) - 2.0 * zeta * omega * d)
        if slope <= 0.0:
            return force, 0.0
        when = atan2(slope, gamma * force_s + frequency * force) / frequency
        return self.state(when)[0], when

    def peak_compression(self, t: float) -> float:
        """The largest compression on [0, t], m; t (s) at most `duration`."""
        rate, second, _, _, d, _, w, w_s, *_ = self._motion
        if w <= 0.0:
            return d
        if self._oscillates:
            when = atan2(w, -w_s) / second
        else:
            when = log1p(second * w / (rate * (w + (rate + second) * d))) / second
        return self.state(min(t, when))[5]


def _oscillating(
    gamma: float,
    frequency: float,
    force: float,
    force_s: float,
    d: float,
    d_s: float,
    w: float,
    w_s: float,
    p: float,
    q: float,
    x: float,
    v: float,
) -> Callable[[float], list[float]]:
    rate = complex(-gamma, frequency)

    def state(t: float) -> list[float]:
        z = complex_exp(rate * t)
        c = z.real
        s = z.imag
        compression = d * c + d_s * s
        closing = w * c + w_s * s
        mean = x + v * t
        return [
            force * c + force_s * s,
            mean + p * compression,
            mean - q * compression,
            v + p * closing,
            v - q * closing,
            compression,
        ]

    return state
