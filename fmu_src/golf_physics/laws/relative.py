"""Law 2: a spring and a damper between the bodies (Kelvin–Voigt).

The contact force is F = k d + b d', with d the compression and d' the closing speed. It acts on
both bodies alike, so momentum is conserved, and contact ends when the force has fallen to zero:
the bodies can push but not pull (Schwager & Pöschel, Granular Matter 9, 465–469, 2007).

The centre of mass moves uniformly, and the compression is a damped oscillation about zero with
ω² = k/μ and ζ = b/(2√(kμ)): in a usual contact below critical damping, where the bodies swing. A
contact with more damping is told by `ExtendedContact`. With an exponent the spring stiffens, and
a contact is a `PowerLawContact`.
"""

from collections.abc import Callable
from math import atan2, cos, exp, inf, sin, sqrt

from ..numerics.gauss import integral
from .contact import ContactPhase, End, Inputs, Law, Parameters, Start, State
from .extended import ExtendedContact
from .power_law import PowerLawContact
from .restitution import LEAST, damping_ratio, restitution

#: A larger exponent makes powers of ordinary lengths overflow.
_STEEPEST = 12.0

#: Lengths (m) and rates (1/s) to which a power law may lead.
_LARGEST = 1e75

#: With a higher damping ratio there is no swing, and no cosine and sine to tell it with.
MOST_DAMPING = 0.999


class UsualContact(ContactPhase):
    """A usual contact phase, in doubles; see `ContactPhase`.

    Each quantity is a sum of e^(-γt) cos Ωt and e^(-γt) sin Ωt, with γ = ζω and Ω² = ω² - γ².
    """

    def __init__(self, k: float, b: float, m_club: float, m_ball: float, start: Start) -> None:
        x_club, d, v_club, v_ball, w = start
        total = m_club + m_ball
        p = m_ball / total
        q = m_club / total
        self._mu = mu = m_club * p
        #: The fastest rate of change in the phase, 1/s.
        self.rate = omega = sqrt(k / mu)
        zeta = b / (2.0 * mu * omega)
        #: s from the start of the phase until contact ends; 0 if it isn't a usual contact.
        self.duration = 0.0
        if zeta > MOST_DAMPING:
            return
        gamma = zeta * omega
        frequency = omega * sqrt((1.0 - zeta) * (1.0 + zeta))
        pull = omega * omega * d
        force = k * d + b * w
        force_s = mu * (w * (omega * omega - 2.0 * gamma * gamma) - gamma * pull) / frequency
        self._motion = (
            gamma, frequency, force, force_s, d, (w + gamma * d) / frequency,
            w, -(gamma * w + pull) / frequency, p, q, x_club - p * d, q * v_club + p * v_ball,
        )  # fmt: skip
        self.duration = atan2(force, -force_s) / frequency
        self._peak: tuple[float, float] | None = None

    def course(self) -> tuple[Callable[[float], State], float]:
        """Time is the angle Ωt."""
        gamma, frequency, force, force_s, d, d_s, w, w_s, p, q, x, v = self._motion
        rate = -gamma / frequency
        v_angle = v / frequency

        def state(angle: float) -> State:
            size = exp(rate * angle)
            c = size * cos(angle)
            s = size * sin(angle)
            compression = d * c + d_s * s
            closing = w * c + w_s * s
            mean = x + v_angle * angle
            return [
                force * c + force_s * s, mean + p * compression, mean - q * compression,
                v + p * closing, v - q * closing, compression,
            ]  # fmt: skip

        return state, frequency

    def end(self) -> End:
        """The force is 0, the ball not yet round."""
        t = self.duration
        gamma, frequency, _, _, d, d_s, w, w_s, p, q, x, v = self._motion
        size = exp(-gamma * t)
        angle = frequency * t
        c = size * cos(angle)
        s = size * sin(angle)
        compression = d * c + d_s * s
        closing = w * c + w_s * s
        return x + v * t - q * compression, v + p * closing, v - q * closing, compression, closing

    def _swing(self, t: float, place: int) -> float:
        """What has its amplitudes at this place of the motion, and the next."""
        motion = self._motion
        size = exp(-motion[0] * t)
        angle = motion[1] * t
        return motion[place] * (size * cos(angle)) + motion[place + 1] * (size * sin(angle))

    def _force(self, t: float) -> float:
        return self._swing(t, 2)

    def compression(self, t: float) -> float:
        return self._swing(t, 4)

    def closing(self, t: float) -> float:
        return self._swing(t, 6)

    def impulse(self, begin: float, width: float) -> float:
        """The reduced mass times the change of the closing speed."""
        if width * self.rate <= 0.5:
            return integral(self._force, begin + width, width)
        return self._mu * (self.closing(begin) - self.closing(begin + width))

    def peak_force(self, t: float) -> tuple[float, float]:
        if self._peak is None:
            self._peak = self._find_peak()
        largest, when = self._peak
        return (largest, when) if t >= when else (self._force(t), t)

    def _find_peak(self) -> tuple[float, float]:
        gamma, frequency, force, force_s, *_ = self._motion
        # From half of critical damping on, the force falls from the start.
        slope = frequency * force_s - gamma * force
        if slope <= 0.0:
            return force, 0.0
        when = atan2(slope, gamma * force_s + frequency * force) / frequency
        return self._force(when), when

    def peak_compression(self, t: float) -> float:
        _, frequency, _, _, d, _, w, w_s, *_ = self._motion
        return d if w <= 0.0 else self.compression(min(t, atan2(w, -w_s) / frequency))


class RelativeLaw(Law):
    """Law 2; see `Law`."""

    name = "relative"
    description = "A spring and a damper between the bodies: conserves momentum"

    def refusal(self, p: Parameters, inputs: Inputs) -> str | None:
        """Powers must stay in the range of a double."""
        n, length = p.exponent, p.reference_compression
        if n == 1.0:
            return None
        closing = inputs[2] - p.ball_speed
        if n > _STEEPEST:
            return (
                f"exponent = {n!r} is refused: beyond {_STEEPEST:g} forces leave the range of a "
                "double"
            )
        if closing <= 0.0:
            return None
        # How far this speed compresses a ball that stiffens, and how fast that goes.
        m = 0.5 * (n + 1.0)
        k, total = inputs[0], p.m_club + p.m_ball
        omega = sqrt(k / (p.m_club * (p.m_ball / total)))
        reach = (m * closing / omega) ** (1.0 / m) * length ** (1.0 - 1.0 / m)
        if 0.0 < reach <= _LARGEST and closing <= _LARGEST * reach:
            return None
        return (
            f"exponent = {n!r}, reference_compression = {length!r}, k = {k!r} and an approach "
            f"speed of {closing!r} m/s together leave the range of a double: the compression that "
            f"they lead to ({reach:g} m) must be above 0 and below {_LARGEST:g} m, and the time in "
            f"which they do above {1.0 / _LARGEST:g} s"
        )

    def refusal_of_touch(self, p: Parameters, club_speed: float) -> str | None:
        """A coefficient of restitution that falls with speed must stay in 0…1."""
        closing = club_speed - p.ball_speed
        if not p.restitution_at_rest or closing <= 0.0:
            return None
        coefficient = restitution(p, closing)
        if LEAST <= coefficient <= 1.0:
            return None
        return (
            f"club_speed = {club_speed!r} m/s is refused at touch: "
            "restitution_at_rest - restitution_slope * approach speed = "
            f"{p.restitution_at_rest!r} - {p.restitution_slope!r} * {closing!r} = "
            f"{coefficient!r} must be above 0 and at most 1; set a lower club_speed, "
            "or another restitution line at the start"
        )

    def damping(self, p: Parameters, k: float, closing: float) -> float:
        # Before a step is refused for it, a COR out of reach may still be looked at.
        zeta = damping_ratio(max(restitution(p, closing), LEAST))
        mu = p.m_club * (p.m_ball / (p.m_club + p.m_ball))
        return 2.0 * zeta * mu * sqrt(0.5 * (p.exponent + 1.0) * (k / mu))

    def contact(self, p: Parameters, k: float, b: float, start: Start) -> ContactPhase:
        if p.exponent != 1.0:
            return PowerLawContact(
                k, b, p.m_club, p.m_ball, start, p.exponent, p.reference_compression
            )
        usual = UsualContact(k, b, p.m_club, p.m_ball, start)
        if usual.duration:
            return usual
        return ExtendedContact(k, b, 0.0, p.m_club, p.m_ball, start)

    def force(self, p: Parameters, k: float, b: float, compression: float, closing: float) -> float:
        n = p.exponent
        if n == 1.0:
            return k * compression + b * closing
        try:
            power = (abs(compression) / p.reference_compression) ** (0.5 * (n - 1.0))
        except OverflowError:
            power = inf
        return power * (k * power * compression + b * closing)
