"""Linear contacts in double precision: F = k d + damper · d', or F = k d and a drag on each body.

Times are in units of 1/ω, ω² = k/μ. With D = ω d, the closing speed w, the velocity V of the centre
of mass, and the mass fractions p of the ball and q of the club, a contact moves by

    D' = w,  w' = -D - α w + β V + push,  V' = δ w - γ V + q push.

Under drags 2ζp on the club and 2ζq on the ball α = 2ζ(1 - 2pq), β = 2ζ(q - p), γ = 4ζpq, δ = pqβ;
under a damper α = 2ζ, and the others are 0. There are a real rate r, which lies between the two
drags or is 0, and a pair of rates with the sum 2h and the product c = γ/r. The offsets x of r from
the slower drag and y from the faster one have all their digits, and c - 1 = -x y exactly.

In nearly every impact in golf the pair oscillates and ends the contact within its first half
period: an `UnderdampedContact`, where a quantity is the sum of a real mode and a pair. Elsewhere
these nearly cancel, or rates meet: a `LinearContact` has Newton's form of the exponential.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import chain, islice
from math import atan2, cos, exp, expm1, floor, frexp, inf, log, log1p, pi, sin, sqrt
from typing import NamedTuple

from ..numerics.gauss import integral
from ..refusals import failure
from ..values import Motion, State
from .contact import ROUNDING, ContactPhase

#: The coefficients of a quantity.
Row = tuple[float, ...]

#: A smaller damping ratio of the drag is replaced by this one: that changes no bit of any result.
_LEAST_DAMPING = 1e-30

#: Largest damping ratios of an `UnderdampedContact`. Under drag the rates may meet beyond; a damper
#: leaves hardly an oscillation.
_MOST_DRAG, _MOST_DAMPING = 0.7, 0.999

#: Its largest share of the real mode in the compression: with more, drag moves the bodies together
#: or apart much faster than they close, and the real mode and the pair nearly cancel.
_MOST_REAL = 0.5

#: A zero grazes if the slope there is less than this part of the pair's amplitude. At a zero the
#: real mode is no larger than the pair, so that rounding moves a steeper one by at most 1.4e-14.
_GRAZING = 1.0 / 16.0

#: Over a shorter time (times the fastest rate) an integral is Gauss's, since its closed form is the
#: small difference of large numbers.
_SHORT = 0.5

#: A slope (relative to ω times the value) that is smaller may have changed its sign by rounding.
_FLAT = 1e-6

#: Extrema between which zeros are searched: later oscillations are smaller, unless beside a level.
_FEW, _MORE, _MOST = 4, 45, 2000

#: No search for a zero needs so many steps.
_STEPS = range(200)


def linear_contact(
    k: float, damper: float, drag: float, m_club: float, m_ball: float, start: Motion,
    club_force: float = 0.0,
) -> ContactPhase:  # fmt: skip
    """The phase of a contact with either a damper or a drag. Arguments are in SI units.

    Raises ArithmeticError after `_MOST` extrema of a force that a push on the club head keeps from
    falling to 0.
    """
    contact = UnderdampedContact(k, damper, drag, m_club, m_ball, start, club_force)
    return contact if contact.duration else contact.general()


class UnderdampedContact(ContactPhase):
    """A contact with separate modes that ends within the first half period of its pair.

    A row (a, c, s) is a e^(-rt) + c e^(-ht) cos Rt + s e^(-ht) sin Rt. Arguments are in SI units;
    damper or drag is 0. `duration` is 0 if double precision loses digits in this form: then
    `general` gives the contact.
    """

    __slots__ = (
        "_acceleration", "_arguments", "_d", "_dense", "_force", "_rates", "_v_ball", "_v_club",
    )  # fmt: skip

    def __init__(
        self, k: float, damper: float, drag: float, m_club: float, m_ball: float, start: Motion,
        club_force: float = 0.0,
    ) -> None:  # fmt: skip
        self._arguments = k, damper, drag, m_club, m_ball, start, club_force
        _, _, v_club, v_ball, compression, w = start
        self._dense: tuple[Callable[[float], State], float] | None = None
        self.duration = self._acceleration = 0.0
        total = m_club + m_ball
        p = m_ball / total
        q = m_club / total
        mu = m_club * p
        self.rate = omega = sqrt(k / mu)
        zeta = (damper or drag) / (2.0 * mu * omega)
        d = omega * compression
        if not drag:
            if zeta > _MOST_DAMPING:
                return
            level = f_a = 0.0
            if club_force:
                # The compression oscillates about a level, the centre of mass accelerates.
                self._acceleration = club_force / total
                level, f_a = p * club_force / k, p * club_force
                d -= omega * level
            h = zeta
            second = sqrt((1.0 - zeta) * (1.0 + zeta))
            s_d, s_w = (w + h * d) / second, -(h * w + d) / second
            scale = mu * omega
            f_c, f_s = scale * (d + 2.0 * h * w), scale * (s_d + 2.0 * h * s_w)
            angle = first_downward_zero(h / second, f_a, f_c, f_s) if f_a else atan2(f_c, -f_s)
            # Up to half of the pair's amplitude a zero is steep, and the first one.
            if f_a and abs(f_a) * exp(h / second * angle) > 0.5 * sqrt(f_c * f_c + f_s * f_s):
                return
            frequency = second * omega
            mean = q * v_club + p * v_ball
            self._rates = 0.0, h * omega, frequency
            self._force = f_a, f_c, f_s
            self._d = level, d / omega, s_d / omega
            self._v_club = mean, p * w, p * s_w
            self._v_ball = mean, -q * w, -q * s_w
        else:
            if zeta > _MOST_DRAG or club_force:
                return
            if zeta < _LEAST_DAMPING:
                zeta = _LEAST_DAMPING
            slow, x, y = offsets_of_real_rate(p, q, zeta, abs(m_club - m_ball) / total)
            r, h = slow + x, 0.5 * (slow + y)
            second = sqrt(1.0 - x * y - h * h)
            if p > q:
                x = -y
            # (d, v_club, v_ball) is a (x, p, u), the real mode, with the left eigenvector
            # (-q x, q, u), and the pair. x is now how far r lies above the drag of the club.
            u = p + r * x
            a = (q * (v_club - x * d) + u * v_ball) / (q * (p - x * x) + u * u)
            a_d, a_club, a_ball = a * x, a * p, a * u
            if abs(a_d) > _MOST_REAL * (d + (w if w > 0.0 else 0.0)):
                return
            c_d, c_club, c_ball = d - a_d, v_club - a_club, v_ball - a_ball
            s_d = (w + r * a_d + h * c_d) / second
            angle = first_downward_zero((h - r) / second, a_d, c_d, s_d)
            frequency = second * omega
            scale = k / omega
            self._rates = r * omega, h * omega, frequency
            self._force = scale * a_d, scale * c_d, scale * s_d
            self._d = a_d / omega, c_d / omega, s_d / omega
            self._v_club = a_club, c_club, ((h - 2.0 * zeta * p) * c_club - p * c_d) / second
            self._v_ball = a_ball, c_ball, ((h - 2.0 * zeta * q) * c_ball + q * c_d) / second
        self.duration = angle / frequency

    def general(self) -> "LinearContact":
        """The same contact, whatever its modes."""
        return LinearContact(*self._arguments)

    def dense_output(self) -> tuple[Callable[[float], State], float]:
        """The dense output over the angle Rt; kept, since a change of inputs needs it again."""
        if self._dense is not None:
            return self._dense
        (r, h, frequency), k, gain = self._rates, self._arguments[0], self._acceleration
        (level, c_f, s_f), (a_d, c_d, s_d) = self._force, self._d
        (a_1, c_1, s_1), (a_2, c_2, s_2) = self._v_club, self._v_ball
        decay, pair, size = -r / frequency, -h / frequency, h * h + frequency * frequency
        c_x, s_x = (h * c_1 + frequency * s_1) / size, (frequency * c_1 - h * s_1) / size
        x_0, a_x = self._arguments[5].x_club + c_x, -a_1 / r if r else a_1 / frequency

        def state(angle: float) -> State:
            size = exp(pair * angle)
            c = size * cos(angle)
            s = size * sin(angle)
            if decay:
                travel = expm1(decay * angle)
                e = 1.0 + travel
                d = a_d * e + c_d * c + s_d * s
                force = k * d
            else:
                travel, e = angle, 1.0
                d = c_d * c + s_d * s
                force = c_f * c + s_f * s
            x = x_0 + a_x * travel - c_x * c + s_x * s
            return [force, x, x - d, a_1 * e + c_1 * c + s_1 * s, a_2 * e + c_2 * c + s_2 * s, d]

        def accelerated(angle: float) -> State:
            force, x, _, v_club, v_ball, d = state(angle)
            t, d = angle / frequency, d + a_d
            x += 0.5 * gain * t * t
            return [force + level, x, x - d, v_club + gain * t, v_ball + gain * t, d]

        self._dense = accelerated if gain else state, frequency
        return self._dense

    def state(self, t: float) -> State:
        dense, scale = self.dense_output()
        return dense(scale * t)

    def end_velocities(self) -> tuple[float, float]:
        (a_1, c_1, s_1), (a_2, c_2, s_2) = self._v_club, self._v_ball
        e, c, s = self._basis(self.duration)
        gained = self._acceleration * self.duration
        return a_1 * e + c_1 * c + s_1 * s + gained, a_2 * e + c_2 * c + s_2 * s + gained

    def end(self) -> Motion:
        v_club, v_ball = self.end_velocities()
        return super().end()._replace(v_club=v_club, v_ball=v_ball)

    def _basis(self, t: float) -> Row:
        """The functions that a row has coefficients of."""
        r, h, frequency = self._rates
        size, angle = exp(-h * t), frequency * t
        return exp(-r * t), size * cos(angle), size * sin(angle)

    def _at(self, row: Row, t: float) -> float:
        return _sum(row, self._basis(t))

    def _slope(self, row: Row) -> Row:
        (r, h, frequency), (a, c, s) = self._rates, row
        return -r * a, frequency * s - h * c, -h * s - frequency * c

    def value(self, name: str, t: float) -> float:
        row = self._force if name == "force" else self._d
        return self._at(self._slope(row) if name == "w" else row, t)

    def impulse(self, begin: float, width: float) -> float:
        if width * self.rate <= _SHORT:
            return integral(partial(self._at, self._force), begin + width, width)
        (r, h, frequency), (a, c, s) = self._rates, self._force
        real = -a * exp(-r * begin) * expm1(-r * width) / r if r else a * width
        # The integral of the pair is a pair.
        size = h * h + frequency * frequency
        pair = 0.0, -(h * c + frequency * s) / size, (frequency * c - h * s) / size
        return real + (self._at(pair, begin + width) - self._at(pair, begin))

    def largest(self, name: str, t: float) -> tuple[float, float]:
        """As of `ContactPhase`, faster after a short time: every change of k or b needs it."""
        if t * self.rate > _SHORT:
            return super().largest(name, t)
        row, basis = self._force if name == "force" else self._d, self._basis(t)
        slope, start, now = self._slope(row), row[0] + row[1], _sum(row, basis)
        rises = slope[0] + slope[1] > 0.0
        # There may be a maximum in between.
        if rises and _sum(slope, basis) <= _FLAT * self.rate * abs(now):
            return super().largest(name, t)
        return (now, t) if rises and now > start + ROUNDING * abs(start) else (start, 0.0)

    def find_maxima(self, name: str) -> list[float]:
        """The only one, before the end of the half period, unless the row falls from the start."""
        (r, h, frequency), row = self._rates, self._force if name == "force" else self._d
        a, c, s = self._slope(row)
        if a + c <= 0.0:
            return []
        angle = first_downward_zero((h - r) / frequency, a, c, s)
        return [angle / frequency] if angle else self.general().find_maxima(name)


def _sum(row: Row, basis: Row) -> float:
    (a, c, s), (real, cosine, sine) = row, basis
    return a * real + (c * cosine + s * sine)


class Modes(NamedTuple):
    """The functions that a row of a `LinearContact` has coefficients of; times in units of 1/ω.

    A pair of rates h ± iR has C = e^(-ht) cos Rt and S = e^(-ht) sin(Rt)/R, two real rates a >= b
    have C = e^(-at) and S = (e^(-bt) - e^(-at))/(a - b). G is S convolved with e^(-rt), and H the
    integral of G. A row (e, s, g, j) is e C + s S + g G + j H, the fastest rate first: if the pair
    oscillates more slowly than e^(-rt) decays, that and its convolution with C take the place of C
    and S. No function cancels where rates meet, which therefore is no case of its own.
    """

    r: float  #: the real rate; of three the least
    lead: float  #: h, or a
    trail: float  #: h, or b
    second: float  #: R, or (a - b)/2
    oscillates: bool

    @property
    def real_first(self) -> bool:
        return self.oscillates and self.r > self.trail

    @property
    def nodes(self) -> Row:
        """(a, b, c, x, y): f' has the coefficients (s - a e, g - b s - c e, j - x g - y s)."""
        r, lead, trail, second, _ = self
        square = second * second if self.oscillates else 0.0
        return (r, trail, 0.0, trail, square) if self.real_first else (lead, trail, square, r, 0.0)

    @property
    def fastest(self) -> float:
        return max(self.r, self.lead + self.trail, 1.0)

    def slowed(self, row: Row) -> "Modes":
        """Those of a row times e^(slowest rate · t): it keeps its zeros, and doesn't underflow."""
        r, lead, trail, second, oscillates = self
        # Without a part in e^(-rt) the slowest rate is one of the pair's, and r has no effect.
        slowest = 0.0 if row[3] else min(r, trail) if row[2] else trail
        return Modes(max(r - slowest, 0.0), lead - slowest, trail - slowest, second, oscillates)

    def slope(self, row: Row) -> Row:
        """The derivative of a row, with the level lost."""
        (a, b, c, x, y), (e, s, g, j) = self.nodes, row
        return s - a * e, g - b * s - c * e, j - x * g - y * s, 0.0

    def _pair(self, t: float) -> tuple[float, float]:
        """C and S."""
        if self.oscillates:
            size, angle = exp(-self.trail * t), self.second * t
            return size * cos(angle), size * sin(angle) / self.second
        gap = 2.0 * self.second
        return exp(-self.lead * t), exp(-self.trail * t) * -expm1(-gap * t) / gap

    def at(self, t: float) -> Row:
        """The four functions, and the integral of the last one."""
        r, lead, trail, second, oscillates = self
        two_h = lead + trail
        product = lead * trail + second * second if oscillates else lead * trail
        halvings = max(0, frexp(self.fastest * t)[1])
        for _ in range(halvings):
            t *= 0.5
        # Power series of G, its derivative n, and its integrals h and k, for a short time.
        x, y, z, decay, term = 1.0, 0.0, 0.0, 1.0, t
        g = h = k = n = twice = 0.0
        for power in range(2, 28):
            n += x * term
            term *= t / power
            g += x * term
            twice += decay * term
            decay *= -r
            longer = term * (t / (power + 1))
            h += x * longer
            k += x * longer * (t / (power + 2))
            x, y, z = -((two_h + r) * x + (product + r * two_h) * y + r * product * z), x, y
        # Twice the time, by the motion from there on: u is S' + 2h S, or S' + (a + b) S.
        c, s = self._pair(t)
        for _ in range(halvings):
            e, once, u = exp(-r * t), -expm1(-r * t) / r if r else t, c + lead * s
            k = k * (1.0 + u) + t * h + g * twice + s * h
            h = h * (1.0 + u) + g * (once + s)
            g, n = g * (e + u) + n * s, n * (e + c - trail * s) - product * g * s
            twice = twice * (1.0 + e) + t * once
            t *= 2.0
            c, s = self._pair(t)
        if self.real_first:
            return exp(-r * t), n + trail * g, g, h, k
        return c, s, g, h, k

    def integrals(self, t: float, functions: Row) -> Row:
        """Those of the four functions, which are `at(t)`."""
        r, trail, (_, s, g, h, k) = self.r, self.trail, functions
        if self.real_first:
            return -expm1(-r * t) / r, g + trail * h, h, k
        of_s = g + r * h
        return s + trail * of_s, of_s, h, k

    def extrema(self, row: Row) -> Iterator[float]:
        """Points between which a row without a level has at most one zero, in order.

        There f' + r f, or with the real rate first f' + a f, is 0, which has but the pair (Rolle).
        """
        (e, s, g, _), (a, b, c, x, _) = row, self.nodes
        if self.real_first:
            e, s = s, g
        else:
            e, s = s + (x - a) * e, g + (x - b) * s - c * e
        if not self.oscillates:
            gap = 2.0 * self.second
            if s and e / s < 0.0:
                yield log1p(-gap * (e / s)) / gap
            return
        angle = atan2(e * self.second, -s) % pi or pi
        if self.real_first:
            # Long before, the real mode outweighs the pair, which decays more slowly.
            _, real, pair = self.parts(row, 0.0)
            if abs(real) > pair > 0.0:
                after = log(abs(real) / pair) / (self.r - self.trail)
                angle += pi * floor(after * self.second / pi)
        while True:
            yield angle / self.second
            angle += pi

    def parts(self, row: Row, t: float) -> tuple[float, float, float]:
        """Level, real mode and amplitude of the pair, which oscillates."""
        (e, s, g, j), r, h = row, self.r, self.trail
        apart = h - r
        size = apart * apart + self.second * self.second
        if self.real_first:
            s, g = s + apart * e, g + apart * s + size * e
        level = j / (r * (h * h + self.second * self.second)) if j else 0.0
        real = (g - j / r if j else g) / size
        cosine, sine = e - real - level, (s - apart * real - h * level) / self.second
        pair = sqrt(cosine * cosine + sine * sine)
        return level, real * exp(-r * t), pair * exp(-h * t)

    def is_settled(self, row: Row, t: float) -> bool:
        """Whether level and real mode outweigh the pair from t on."""
        level, real, pair = self.parts(row, t)
        now = level + real
        if pair >= abs(now) or now * level < 0.0:
            return False
        # The pair decays below the sum of both: faster, or that grows, or the level is enough.
        return self.r <= self.trail or real * level < 0.0 or pair < abs(level)


class LinearContact(ContactPhase):
    """Any contact with either a damper or a drag, in rows of `Modes`.

    Coefficients follow from a quantity and its derivatives at the start, by formulas that don't
    cancel. Arguments and errors are those of `linear_contact`.
    """

    def __init__(
        self, k: float, damper: float, drag: float, m_club: float, m_ball: float, start: Motion,
        club_force: float = 0.0,
    ) -> None:  # fmt: skip
        total = m_club + m_ball
        self._start, self._has_drag = start, bool(drag)
        self._p, self._q = p, q = m_ball / total, m_club / total
        mu = m_club * p
        self._omega = omega = sqrt(k / mu)
        self._push, zeta = club_force / (m_club * omega), (damper or drag) / (2.0 * mu * omega)
        self._scales = {"force": mu * omega, "d": 1.0 / omega, "w": 1.0}
        r, two_h, product = 0.0, 2.0 * zeta, 1.0
        self._gamma = self._beta = self._kappa = self._forced = slow = fast = 0.0
        if drag:
            zeta = max(zeta, _LEAST_DAMPING)
            unequal = (m_club - m_ball) / total
            slow, x, y = offsets_of_real_rate(p, q, zeta, abs(unequal))
            self._gamma, self._beta = 4.0 * zeta * p * q, 2.0 * zeta * unequal
            self._forced = 2.0 * zeta * q * self._push
            #: c - 1, or the same of the two faster ones of three real rates.
            self._kappa = -x * y
            r, two_h, fast = slow + x, slow + y, slow + x + y
            product = self._gamma / r
        h = 0.5 * two_h
        square = product - h * h
        second = sqrt(abs(square))
        if square >= 0.0:
            self._modes = Modes(r, h, h, second or 1e-10 * h, True)
        else:
            least, trail, lead = sorted((r, product / (h + second), h + second))
            if least != r:
                self._kappa = (slow - least) * (fast - least)
            self._modes = Modes(least, lead, trail, 0.5 * (lead - trail) or 1e-10 * lead, False)
        self.rate = self._modes.fastest * omega
        mean = q * start.v_club + p * start.v_ball
        self._rows = self._rows_from(omega * start.compression, start.closing, mean)
        force = self._rows["force"]
        falls = (t for t, falls in self._zeros(force, _MOST if force[3] else _FEW) if falls)
        self.duration = next(falls, inf) / omega

    def _rows_from(self, d: float, w: float, mean: float) -> dict[str, Row]:
        """Of force, compression, closing speed and mean velocity, from D, w and V."""
        (a, b, c, x, y), push, kappa = self._modes.nodes, self._push, self._kappa
        p, q, beta, gamma, rest = self._p, self._q, self._beta, self._gamma, self._gamma - a - b
        delta, drive, forced = p * q * beta, beta * mean + push, self._forced
        of_d, of_w = kappa, kappa * x
        if self._modes.real_first:
            of_d, of_w = a * b - 1.0, gamma - x
        first, g = w + a * d, of_d * d + of_w * w + drive
        d_row = d, first, g, forced
        w_row = w, drive - d + (of_w - b) * w, forced - x * g - y * first, 0.0
        rise = delta * w + (a - gamma) * mean + q * push
        bend = (1.0 - y + x * rest) * mean - delta * (d + x * w) + (delta - q * rest) * push
        force = d_row
        if not self._has_drag:
            slope = push - d - b * w
            force = d + (a + b) * w, b * slope + c * w + a * push, push, 0.0
        return {"force": force, "d": d_row, "w": w_row, "mean": (mean, rise, bend, q * push)}

    def state(self, t: float) -> State:
        start, p, omega, rows = self._start, self._p, self._omega, self._rows
        functions = self._modes.at(omega * t)
        d, w, mean = (_total(rows[name], functions) for name in ("d", "w", "mean"))
        force = self._scales["force"] * _total(rows["force"], functions)
        moved = _total(rows["mean"], self._modes.integrals(omega * t, functions))
        x = start.x_club - p * start.compression + (moved + p * d) / omega
        return [force, x, x - d / omega, mean + p * w, mean - self._q * w, d / omega]

    def value(self, name: str, t: float) -> float:
        return self._scales[name] * _total(self._rows[name], self._modes.at(self._omega * t))

    def impulse(self, begin: float, width: float) -> float:
        if width * self.rate <= _SHORT:
            return integral(partial(self.value, "force"), begin + width, width)
        omega, modes, rows = self._omega, self._modes, self._rows
        functions = modes.at(omega * begin)
        later = self._rows_from(*(_total(rows[name], functions) for name in ("d", "w", "mean")))
        integrals = modes.integrals(omega * width, modes.at(omega * width))
        return self._scales["force"] / omega * _total(later["force"], integrals)

    def find_maxima(self, name: str) -> list[float]:
        row, end = self._rows[name], self._omega * self.duration
        zeros = self._zeros(self._modes.slope(row), _MORE if row[3] else _FEW)
        found = [t / self._omega for t, falls in zeros if falls and t <= end]
        # Without drag the first is the largest; of equal ones rounding would choose.
        return found if self._has_drag else found[:1]

    def _zeros(self, row: Row, most: int) -> Iterator[tuple[float, bool]]:
        """The zeros of a row after the start, and whether it falls there."""
        modes, slope = self._modes.slowed(row), self._modes.slope(row)
        e, s, g, j = row
        positive = (e or slope[0] or self._modes.slope(slope)[0]) > 0.0
        # With a level the extrema are the zeros of the slope, which has none.
        points: Iterable[float] = islice(modes.extrema(row), most)
        if j:
            points = (t for t, _ in self._zeros(slope, _MOST))
        # In the end the sign is that of the slowest mode: the level, or the last real one.
        endless, low = () if modes.oscillates and not j else (inf,), 0.0
        for count, high in enumerate(chain(points, endless), 1):
            later = (j or g or s or e) if high == inf else _total(row, modes.at(high))
            if later and (later > 0.0) != positive:
                yield _zero(row, modes, low, high, positive), positive
                positive = not positive
            elif modes.oscillates and high < inf:
                if modes.is_settled(row, high):
                    return
                if count == _MOST:
                    raise failure("TOO_MANY_EXTREMA", most=_MOST, time=high / self._omega)
            low = high


def _total(row: Row, functions: Row) -> float:
    (e, s, g, j), (of_e, of_s, of_g, of_j, *_) = row, functions
    return e * of_e + s * of_s + g * of_g + j * of_j


def _zero(row: Row, modes: Modes, low: float, high: float, falls: bool) -> float:
    """The only zero between low and high, which may be infinite: by Newton's method, or halving."""
    slope = modes.slope(row)
    t = 2.0 * low + 1.0 / modes.fastest if high == inf else 0.5 * (low + high)
    for _ in _STEPS:
        functions = modes.at(t)
        f, rise = _total(row, functions), _total(slope, functions)
        low, high = (t, high) if (f > 0.0) == falls else (low, t)
        if high == inf:
            t *= 2.0
            continue
        step = f / rise if abs(f) < (high - low) * abs(rise) else inf
        t -= step
        # Convergence is quadratic: the next step would be below a double's resolution. By rounding
        # this one may leave the bracket.
        if abs(step) <= 1e-10 * t:
            break
        if not low < t < high:
            t = 0.5 * (low + high)
    return t


def first_downward_zero(growth: float, real: float, cosine: float, sine: float) -> float:
    """The first downward zero of real·e^(growth·θ) + cosine·cos θ + sine·sin θ, rad; 0 if unsure.

    Divided by e^(growth·θ) it falls from its first maximum until its minimum, half a period later.
    Newton's method is confined to that interval, with Chebyshev's correction at the start and at
    the end: 0 if it has no zero, or one that grazes (`_GRAZING`). growth is below 1; without a real
    part the cosine isn't below 0.
    """
    if not real:
        return atan2(cosine, -sine)
    maximum = atan2(sine - growth * cosine, cosine + growth * sine)
    low, high = max(maximum, 0.0), maximum + pi
    # The pair's own zero, where all derivatives are known without another cosine.
    angle = pi - atan2(cosine, sine)
    term = real * exp(growth * angle)
    rise = growth * term
    amplitude = sqrt(cosine * cosine + sine * sine)
    slope = rise - amplitude
    step = term / slope if slope else high
    if abs(step) < 0.1 * angle:
        angle -= step * (1.0 + 0.5 * step * growth * rise / slope)
    for _ in _STEPS:
        if not low < angle < high:
            return 0.0
        c = cos(angle)
        s = sin(angle)
        term = real * exp(growth * angle)
        rise = growth * term
        pair = cosine * c + sine * s
        slope = rise + sine * c - cosine * s
        if slope >= -_GRAZING * amplitude:
            return 0.0
        step = (term + pair) / slope
        if abs(step) <= 5e-6 * angle:
            # The remaining error is of the third order of the step.
            angle -= step * (1.0 + 0.5 * step * (growth * rise - pair) / slope)
            return angle if low < angle < high else 0.0
        angle -= step
    return 0.0


def offsets_of_real_rate(
    p: float, q: float, zeta: float, unequal: float
) -> tuple[float, float, float]:
    """The slower drag, how far the real rate r lies above it, and how far below the faster drag.

    p and q are the mass fractions, `unequal` is their difference. With x, r = slow + x, by Newton's
    method on (span - x)(less + r x) = more x, bracketed, with Chebyshev's correction.
    """
    less, more = (p, q) if p < q else (q, p)
    slow, high = 2.0 * zeta * less, 2.0 * zeta * unequal
    span, low, x = high, 0.0, less * high
    x += x * more * span * (slow + x)
    for _ in _STEPS:
        rest, rate, grow = span - x, slow + 2.0 * x, less + (slow + x) * x
        # If it is 0 any step will do: one that leaves the bracket is replaced.
        fall = rest * rate - grow - more or -1.0
        off = rest * grow - more * x
        step = off / fall
        bend = step * (rest - rate) / fall
        if abs(step) <= 3e-6 * x and abs(bend) <= 1e-5:
            x -= step * (1.0 + bend)
            break
        # Where rates meet only the equation itself holds to the last digits.
        if abs(off) <= 1e-15 * more * x:
            break
        if step * fall > 0.0:
            low = x
        else:
            high = x
        x -= step
        if not low <= x <= high:
            x = 0.5 * (low + high)
    return slow, x, more * x / (less + (slow + x) * x)
