"""Any linear contact in some 60 decimal digits: one form for every rate, damping and start.

The closed forms of a linear contact cancel where two rates meet, where drag is heavy, or where the
bodies move much faster than they close. In doubles each of these needs a form of its own, and each
border between two forms is a place to be wrong at. With 57 digits, losing 40 costs nothing, and
one form serves them all. It is slower than the laws' usual forms in doubles, which hand over to it
where their digits aren't safe.

The force is k d + damper · w, and each body is dragged by drag · its own velocity; one of the two
is 0, or both are light. The state is x = (d, w, V): compression, closing speed, velocity of the
centre of mass. It obeys

    d' = w,  w' = -ω² d - α w + β V,  V' = δ w - γ V.

One mode decays at a real rate r; the other two rates, a pair, are the roots of s² - 2hs + c = 0,
real or not. With R² = c - h², Newton's form of the exponential needs no eigenvectors:

    x(t) = E x(0) + S y + G z,  y = (A + r) x(0),  z = (A + 2h - r) y,
    E = e^(-rt),  S = e^(-ht) sin(Rt)/R,  G = (E - e^(-ht) cos Rt - (h - r) S)/((h - r)² + R²),

with sinh and cosh where R² < 0. Force, d, d' and their slopes are linear in x: f = l·x. And
e^(rt) f turns where l·(A + r) x(t) is zero. The mode of r has no part in that, so these points are
known in closed form; between two of them f has at most one zero (Rolle's theorem). So every zero
is bracketed before it is looked for, and none is missed.
"""

from collections.abc import Callable, Iterator
from decimal import Decimal
from math import atan2, pi, sqrt
from typing import NamedTuple

from ..numerics.decimals import PI, arithmetic
from ..numerics.zeros import zero_between
from .contact import ContactPhase, End, Start, State

#: Digits; and those for a damping ratio, a ratio of the masses or one of the speeds to what they
#: close by that are beyond these: then up to 70 cancel.
_DIGITS, _MANY_DIGITS = 57, 95
_HEAVY, _UNEQUAL, _FAST = 5e4, 1e8, 1e5

#: A damping ratio as small as this changes no bit of any result.
_LEAST_DAMPING = Decimal(10) ** -30

#: A pair of rates nearer than this (relative, squared) is told as two real ones that are so far
#: apart: that changes no bit either.
_APART = Decimal(10) ** -30

_INFINITY = Decimal("Infinity")

#: The coefficients of d, w and V in a function of the state; or its shares of E, S and G.
Row = tuple[Decimal, Decimal, Decimal]


class _Function(NamedTuple):
    """A linear function of the state, its slope and its bend, by their shares of E, S and G."""

    value: Row
    slope: Row
    bend: Row


class ExtendedContact(ContactPhase):
    """A contact phase of a linear law; see `ContactPhase`.

    Args:
        damper: damping between the bodies, N.s/m, >= 0.
        drag: on each body, N.s/m, >= 0.
    """

    def __init__(
        self, k: float, damper: float, drag: float, m_club: float, m_ball: float, start: Start
    ) -> None:
        mu = m_club * (m_ball / (m_club + m_ball))
        omega = sqrt(k / mu)
        moved = abs(start.closing) + omega * start.compression
        many = (
            max(damper, drag) > 2.0 * _HEAVY * mu * omega
            or max(m_club, m_ball) > _UNEQUAL * min(m_club, m_ball)
            or max(abs(start.v_club), abs(start.v_ball)) > _FAST * moved
        )
        self._in_use, self._exp, self._cos_sin = arithmetic(_MANY_DIGITS if many else _DIGITS)
        with self._in_use():
            self._set_up(start, *map(Decimal, (k, damper, drag, m_club, m_ball)))

    def _set_up(
        self, start: Start, k: Decimal, damper: Decimal, drag: Decimal, m_club: Decimal,
        m_ball: Decimal,
    ) -> None:  # fmt: skip
        total = m_club + m_ball
        p = m_ball / total
        self._q = q = m_club / total
        mu = m_club * p
        if drag:
            drag = max(drag, 2 * _LEAST_DAMPING * (k * mu).sqrt())
        slow, fast = sorted((drag / m_club, drag / m_ball))
        apart, gamma = drag * (m_club - m_ball) / total, 2 * drag / total
        #: α, β, γ and δ, 1/s.
        self._rates = damper / mu + slow + fast - gamma, apart / mu, gamma, apart / total
        self._m_ball, self._drag, self._omega_squared = m_ball, drag, k / mu
        #: The fastest rate of change in the phase, 1/s.
        self.rate = float(max(self._find_modes(slow, fast), self._omega_squared.sqrt()))

        d, w = Decimal(start.compression), Decimal(start.closing)
        x = d, w, q * Decimal(start.v_club) + p * Decimal(start.v_ball)
        y = self._grown(x, self._r)
        z = self._grown(y, 2 * self._h - self._r)
        #: Of E, S and G in d, w and V.
        self._shares = tuple(zip(x, y, z))
        self._x_ball = Decimal(start.x_club) - d
        zero = Decimal(0)
        self._compression: Row = Decimal(1), zero, zero
        self._force: Row = k, damper, zero
        self._peaks: dict[Row, list[tuple[Decimal, Decimal]]] = {}
        self._end = self._end_of_contact()
        #: s from the start of the phase until contact ends; inf if it never does.
        self.duration = float(self._end)

    def _find_modes(self, slowest: Decimal, fastest: Decimal) -> Decimal:
        """Set r, between these two, h, R and what depends on them; return the sum of the rates."""
        alpha, beta, gamma, delta = self._rates
        # The characteristic polynomial is s³ + total s² + minors s + product.
        total = alpha + gamma
        minors = alpha * gamma - beta * delta + self._omega_squared
        product = self._omega_squared * gamma

        def at(r: Decimal) -> tuple[Decimal, Decimal, Decimal]:
            slope = r * (2 * total - 3 * r) - minors
            return product - r * (minors - r * (total - r)), slope, 2 * total - 6 * r

        r = zero_between(at, slowest, fastest, True) if slowest < fastest else slowest
        h, c = (total - r) / 2, product / r if r else minors
        square = c - h * h
        if abs(square) < _APART * c:
            square = -_APART * c
        self._r, self._h = r, h
        self._apart = (h - r) * (h - r) + square
        self._oscillates = square > 0
        #: R, of cos and sin or of cosh and sinh.
        self._second = abs(square).sqrt()
        # A product takes a third of the time of a quotient.
        self._s_scale = 1 / (self._second if self._oscillates else 2 * self._second)
        self._g_scale = 1 / self._apart
        self._fast = h if self._oscillates else h + self._second
        self._slow = h if self._oscillates else c / self._fast
        return total

    # The solution

    def _grown(self, x: Row, rate: Decimal) -> Row:
        """(A + rate) x."""
        d, w, v = x
        alpha, beta, gamma, delta = self._rates
        return (
            w + rate * d,
            beta * v - self._omega_squared * d + (rate - alpha) * w,
            delta * w + (rate - gamma) * v,
        )

    def _function(self, row: Row) -> _Function:
        """The function of the state with these coefficients."""
        slope = self._slope(row)
        return _Function(*map(self._shares_in, (row, slope, self._slope(slope))))

    def _slope(self, row: Row) -> Row:
        """The coefficients of f' from those of f."""
        alpha, beta, gamma, delta = self._rates
        d, w, v = row
        return -self._omega_squared * w, d - alpha * w + delta * v, beta * w - gamma * v

    def _shares_in(self, row: Row) -> Row:
        of_d, of_w, of_v = self._shares
        d, w, v = row
        e, s, g = (d * a + w * b + v * c for a, b, c in zip(of_d, of_w, of_v))
        return e, s, g

    def _basis(self, t: Decimal) -> Row:
        """E, S and G."""
        e, slow = self._exp(-self._r * t), self._exp(-self._slow * t)
        if self._oscillates:
            # Once nothing is left, an angle may have too many turns for its digits.
            cosine, sine = self._cos_sin(self._second * t) if slow else (slow, slow)
            c, s = slow * cosine, slow * sine * self._s_scale
        else:
            fast = self._exp(-self._fast * t)
            c, s = (slow + fast) / 2, (slow - fast) * self._s_scale
        return e, s, (e - c - (self._h - self._r) * s) * self._g_scale

    def _moving(self, t: Decimal) -> tuple[Decimal, Decimal, Decimal, Decimal]:
        """Compression, closing speed, and the ball's position and velocity."""
        e, s, g = self._basis(t)
        d, w, v = [a * e + b * s + c * g for a, b, c in self._shares]
        d0, v0 = self._shares[0][0], self._shares[2][0]
        _, _, gamma, delta = self._rates
        # Drag takes momentum as the bodies move; without it their centre moves uniformly.
        mean = (delta * (d - d0) - (v - v0)) / gamma if gamma else v0 * t
        return d, w, self._x_ball + mean - self._q * (d - d0), v - self._q * w

    def course(self) -> tuple[Callable[[float], State], float]:
        return self._state, 1.0

    def _state(self, t: float) -> State:
        with self._in_use():
            d, w, x_ball, v_ball = self._moving(Decimal(t))
            force = self._force[0] * d + self._force[1] * w
            return [float(value) for value in (force, x_ball + d, x_ball, v_ball + w, v_ball, d)]

    def end(self) -> End:
        with self._in_use():
            d, w, x_ball, v_ball = self._moving(self._end)
            # Law 1's compression is 0 but for the last of many digits.
            return float(x_ball), float(v_ball + w), float(v_ball), max(0.0, float(d)), float(w)

    def compression(self, t: float) -> float:
        with self._in_use():
            return float(self._moving(Decimal(t))[0])

    def closing(self, t: float) -> float:
        with self._in_use():
            return float(self._moving(Decimal(t))[1])

    def impulse(self, begin: float, width: float) -> float:
        """What the ball has gained, and what the drag has taken from it."""
        with self._in_use():
            _, _, x, v = self._moving(Decimal(begin))
            _, _, x_later, v_later = self._moving(Decimal(begin) + Decimal(width))
            return float(self._m_ball * (v_later - v) + self._drag * (x_later - x))

    def peak_force(self, t: float) -> tuple[float, float]:
        return self._largest(self._force, t)

    def peak_compression(self, t: float) -> float:
        return self._largest(self._compression, t)[0]

    def _largest(self, row: Row, t: float) -> tuple[float, float]:
        """The largest value of a function on [0, t], and its time, s."""
        with self._in_use():
            f = self._function(row)
            if row not in self._peaks:
                slope = self._slope(row)
                # Whatever swings was larger a period before.
                end = min(self._end, 3 * PI / self._second) if self._oscillates else self._end
                tops = [when for when, falls in self._changes(slope, end) if falls]
                self._peaks[row] = [(self._value(f, when)[0], when) for when in tops]
            now = Decimal(t)
            seen = [peak for peak in self._peaks[row] if peak[1] <= now]
            value, when = max([(f.value[0], Decimal(0)), *seen, (self._value(f, now)[0], now)])
            return float(value), float(when)

    # Zeros

    def _value(self, f: _Function, t: Decimal) -> Row:
        """A function, its slope and its bend."""
        e, s, g = self._basis(t)
        value, slope, bend = (a * e + b * s + c * g for a, b, c in f)
        return value, slope, bend

    def _turning_points(self, f: _Function) -> Iterator[Decimal]:
        """Where e^(rt) f turns, s, in order."""
        second = self._second
        u, along = f.value[1], (f.slope[1] + self._h * f.value[1]) / second
        if not self._oscillates:
            if abs(along + u) < abs(along - u) and (along + u) * (along - u) > 0:
                yield ((along - u) / (along + u)).ln() / (2 * second)
            return
        # Double precision will do for the ends of brackets.
        size = max(abs(u), abs(along))
        angle = Decimal(atan2(u / size, -along / size) % pi or pi) if size else PI
        while True:
            yield angle / second
            angle += PI

    def _level(self, f: _Function) -> Decimal:
        """The share of the mode of r: none where d and w know nothing of V."""
        return f.value[0] + f.value[2] / self._apart if self._rates[1] else Decimal(0)

    def _at_last(self, f: _Function) -> Decimal:
        """Something with the sign of f after a long time, for a pair of real rates."""
        level = self._level(f)
        if level and self._r < self._slow:
            return level
        return f.value[1] - f.value[2] / (self._slow - self._r)

    def _changes(self, row: Row, end: Decimal) -> Iterator[tuple[Decimal, bool]]:
        """When a function changes its sign up to `end`, s, and whether it falls then; in order."""
        f = self._function(row)
        positive = (f.value[0] or f.slope[0] or f.bend[0]) > 0
        points = self._turning_points(f)
        low = Decimal(0)
        while low < end:
            high = min(next(points, end), end)
            later = self._at_last(f) if high == _INFINITY else self._value(f, high)[0]
            if later and (later > 0) != positive:
                if high == _INFINITY:
                    high = 2 * low + 1 / self._fast
                    while (self._value(f, high)[0] > 0) == positive:
                        low, high = high, 2 * high
                    end = high
                yield self._zero(f, low, high, positive), positive
                positive = not positive
            low = high

    def _zero(self, f: _Function, low: Decimal, high: Decimal, falls: bool) -> Decimal:
        return zero_between(lambda t: self._value(f, t), low, high, falls)

    def _end_of_contact(self) -> Decimal:
        """When the force has fallen to 0, s."""
        # The first fall of e^(rt) F ends within three half swings.
        first_fall = 3 * PI / self._second if self._oscillates else _INFINITY
        for when, _ in self._changes(self._force, first_fall):
            return when
        growth = self._r - self._h
        if not self._oscillates or growth <= 0:
            return _INFINITY
        # It swings about a level, ever more: when does it first swing through zero?
        f = self._function(self._force)
        points = self._turning_points(f)
        turns = next(points), next(points)
        lowest, when = min((self._exp(self._r * t) * self._value(f, t)[0], t) for t in turns)
        level, half_period = self._level(f), PI / self._second
        swings = (level / (level - lowest)).ln() / (growth * 2 * half_period)
        when += swings.to_integral_value() * 2 * half_period
        while self._value(f, when)[0] > 0:
            when += 2 * half_period
        return self._zero(f, when - half_period, when, True)
