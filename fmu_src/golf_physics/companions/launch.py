"""Launch of the ball by a club with loft, between ClubBallImpact and BallFlight.

ClubBallImpact solves the contact along the normal of the club face. Across the face a tangential
spring and damper of the same material, k_t / k = kappa, transmits the tangential force; Coulomb
friction limits it to mu times the normal force. With the scaled time dx/dsigma = u, in units of the
approach speed, the contact of law 2 is a linear oscillator for every exponent:

    x' = u,  u' = -f,  f = x + 2 zeta u       F_n = N f,  x(0) = 0,  u(0) = 1,  until f = 0
    stick    y' = p,  T = kappa (y + 2 zeta p)                                  F_t = N T
    slip     T = s mu f,  kappa (y + 2 zeta y') = T,  until p - y' = 0          s = +1 or -1
    both     p' = -rho T + gamma f

p is the speed with which the face slides down the ball's surface. The contact sticks while abs(T)
<= mu f. For a solid homogeneous ball and a head with strike height h above its centre of mass, that
centre at depth c behind the face, and inertia I:

    W_nn = 1/m_ball + 1/m_club + h^2 / I      rho   = (3.5/m_ball + 1/m_club + c^2 / I) / W_nn
    W_nt = h c / I                            gamma = -W_nt / W_nn   (vertical gear effect)

The tangential force is left out of the normal motion, and so is the head's change of direction
during contact.
"""

from functools import partial
from math import acos, acosh, atan2, exp, hypot, inf, isfinite, log, sqrt, tan
from typing import NamedTuple

from ..values import Refusal, rejected
from .companion import Companion
from .taylor import ORDER, Series, bisect, first_zero, slope, value

#: Pieces of a contact at least, and at most: half a second; contacts in golf have up to 100. Phases
#: at most: contacts in golf have up to three, random ones 15.
_PIECES, _MOST, _PHASES = 64, 10_000, 100

#: Share of the contact left out at its end. Friction transmits at most 1e-20 mu of the impulse
#: there, and the sign of the normal force is lost in rounding errors.
_END = 1e-10


def duration(zeta: float) -> float:
    """Duration of a contact with this damping ratio, in scaled time.

    2 arccos(zeta) / sqrt(1 - zeta^2), continued analytically beyond 1 (T. Schwager and T. Poeschel,
    Granular Matter 9 (2007) 465).
    """
    square = (1.0 - zeta) * (1.0 + zeta)
    if square == 0.0:
        return 2.0
    angle = acos(zeta) if square > 0.0 else acosh(zeta)
    return 2.0 * angle / sqrt(abs(square))


def damping_ratio(restitution: float) -> float:
    """The damping ratio with this coefficient of restitution: COR = exp(-zeta duration).

    Raises:
        ValueError: no contact of law 2 has this coefficient of restitution.
    """
    # 1 may be exceeded by a rounding error.
    if not 0.0 < restitution <= 1.0 + 1e-12:
        raise ValueError(f"coefficient_of_restitution = {restitution!r}: it must be > 0 and <= 1")
    # Not 0, which would need a form of its own where the decay rate 1 / (2 zeta) occurs.
    low, high = 1e-300, 1.0 + 1.0 / sqrt(restitution)
    return bisect(lambda zeta: -log(restitution) - zeta * duration(zeta), low, high)


class Contact(NamedTuple):
    """A contact in the equations of the module's text: zeta, mu, kappa, rho and gamma."""

    zeta: float
    friction: float
    ratio: float
    rho: float
    gamma: float

    def impulse(self, p: float) -> float:
        """The tangential impulse, divided by N, for a p(0); ArithmeticError: phases don't end."""
        total = 0.0
        if self.friction == 0.0 or p == self.gamma == 0.0:
            return total
        double, ratio = 2.0 * self.zeta, self.friction / self.ratio
        left, size = duration(self.zeta), self._piece()
        if not left <= _MOST * size:
            raise ArithmeticError(
                "tangential_stiffness_ratio is too large: with this coefficient of restitution and "
                f"this head the contact would be solved in more than {_MOST} pieces"
            )
        least, phases = _END * left, 1
        x, u, y = 0.0, 1.0, 0.0
        # The phase: stick is 0, slip 1 (the face slides down the ball) or -1 (up). A sticking phase
        # may begin at one of its limits. `decaying` is the part of side y' in slip that decays with
        # exp(-t / (2 zeta)); a contact that begins with slip has no tangential deformation yet.
        side = (1 if p > 0.0 else -1) if abs(p) > ratio else 0
        limit, decaying = 0, 0.0
        while left > least:
            piece, following = min(size, left), side
            series = xs, us, ys, ps = self._series(x, u, y, p)
            drive = self.rho * self.friction - side * self.gamma
            if side:
                slip = partial(self._slip, us, side * p - drive * u, drive - ratio, decaying)
                change = partial(self._slip, slope(us), 0.0, drive - ratio, -decaying / double)
                events = [(0, slip, change)]
            else:
                events = []
                for sign in (1, -1):
                    margin = [
                        self.friction * (x + double * u) - sign * self.ratio * (y + double * p)
                        for x, u, y, p in zip(xs, us, ys, ps)
                    ]
                    if sign == limit:
                        # Rounding errors here would end the phase where it begins.
                        margin[0], margin[1] = 0.0, max(margin[1], 0.0)
                    events.append((sign, partial(value, margin), partial(value, slope(margin))))
            for phase, function, of_time in events:
                end = first_zero(function, of_time, piece)
                if end is not None:
                    piece, following = end, phase
            # Not from before and after: with much friction the last slip is so short that their
            # difference has no digits left.
            loss, slide = -piece * value(us[1:], piece), p
            x, u, y, p = (value(one, piece) for one in series)
            if side:
                decaying *= exp(-piece / double)
                y, p = side * (ratio * x + double * decaying), slide - side * drive * loss
                total += side * self.friction * loss
            else:
                total += (slide - p + self.gamma * loss) / self.rho
            left, limit = left - piece, 0
            if following != side:
                phases += 1
                if phases > _PHASES:
                    raise ArithmeticError("stick and slip alternate without end")
                decaying, limit, side = ratio * u - following * p, side, following
        return total

    def _slip(self, us: Series, constant: float, drive: float, decaying: float, t: float) -> float:
        """side (p - y') in slip, or its slope."""
        return constant + drive * value(us, t) + decaying * exp(-0.5 * t / self.zeta)

    def _piece(self) -> float:
        """A scaled time in which the series converge like those of exp(t) for t < 1."""
        stiffness, double = self.ratio * self.rho, 2.0 * self.zeta
        whole = duration(self.zeta)
        return whole / (_PIECES + whole * (1.0 + double + sqrt(stiffness) + double * stiffness))

    def _series(self, *start: float) -> list[Series]:
        """The series of x, u, y and p in scaled time while the contact sticks, from their start."""
        series = xs, us, ys, ps = [[one] for one in start]
        for n in range(ORDER):
            m, double = n + 1, 2.0 * self.zeta
            force = xs[n] + double * us[n]
            xs.append(us[n] / m)
            us.append(-force / m)
            ys.append(ps[n] / m)
            tangential = self.ratio * (ys[n] + double * ps[n])
            ps.append((self.gamma * force - self.rho * tangential) / m)
        return series


class Launch(Companion):
    """The launch of the ball at separation; see the module's text."""

    launched: bool

    def _begin(self) -> Refusal | None:
        if abs(self.dynamic_loft - self.attack_angle) < 1.5:
            return None
        why = (
            f"with dynamic_loft = {self.dynamic_loft!r} the spin loft, their difference, must be "
            "-1.5 to 1.5"
        )
        return rejected("attack_angle", self.attack_angle, why)

    def _step(self, point: float, size: float) -> None:
        if not self.separated or self.launched:
            return
        restitution, ball = self.coefficient_of_restitution, self.ball_velocity
        zeta = damping_ratio(restitution)
        approach = (ball - self.club_velocity) / restitution
        if not 0.0 < approach < inf:
            raise ValueError(f"the approach speed = {approach!r} m/s must be > 0 and finite")
        h, c, inertia = self.strike_height, self.centre_depth, self.head_inertia
        masses = 1.0 / self.m_ball + 1.0 / self.m_club
        normal = masses + h * h / inertia
        rho = (masses + 2.5 / self.m_ball + c * c / inertia) / normal
        gamma = -h * c / inertia / normal
        contact = Contact(zeta, self.friction, self.tangential_stiffness_ratio, rho, gamma)
        # The club's velocity along the normal at touch; 0 if it stood still there.
        club = ball / self.smash_factor if self.smash_factor else 0.0
        sliding = club * tan(self.dynamic_loft - self.attack_angle) / approach
        impulse = contact.impulse(sliding) * approach / normal
        across = impulse / self.m_ball
        spin, speed = impulse / (0.2 * self.m_ball * self.ball_diameter), hypot(ball, across)
        if not (isfinite(spin) and isfinite(speed)):
            raise OverflowError("it leaves the range of a double")
        self.tangential_impulse, self.backspin, self.ball_speed = impulse, spin, speed
        self.launch_angle = self.dynamic_loft - atan2(across, ball)
        self.launched = True
