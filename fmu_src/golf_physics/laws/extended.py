"""Any linear contact in extended precision: one form for every rate, damping and initial state.

A linear contact has F = k d + damper · d' and a drag on each body, with the compression d:

    m_C v_C' = -F - drag v_C,  m_B v_B' = F - drag v_B,  d' = w = v_C - v_B.

It has one real rate -r (0 without drag) and a pair of rates -h ± iR. Every quantity is a row
(a, c, s) of coefficients, and so are sums, derivatives and integrals of rows:

    a e^(-rt) + c e^(-ht) cos Rt + s e^(-ht) sin Rt.

Every event is a zero of a row. In double precision these closed forms cancel where two rates meet,
where drag is heavy, or where the bodies move much faster than they close; with 57 digits a
cancellation of 40 is harmless.

The state is x = (d, w, V), with the velocity V of the centre of mass. It obeys

    d' = w,  w' = -ω² d - α w + β V,  V' = δ w - γ V.

Newton's form of the exponential needs no eigenvectors:

    x(t) = E x(0) + S y + G z,  y = (A + r) x(0),  z = (A + 2h - r) y,
    E = e^(-rt),  S = e^(-ht) sin(Rt)/R,  G = (E - e^(-ht) cos Rt - (h - r) S)/((h - r)² + R²),

with sinh and cosh where R² < 0; collected by E, cos and sin it is a row for each quantity. The
derivative of e^(rt) f, for a row f, has no real mode, so its extrema have a closed form.
Between two of them f has at most one zero (Rolle's theorem), which is bracketed: none is missed.
"""

from collections.abc import Iterator, Sequence
from decimal import Decimal
from math import atan2, pi, sqrt
from typing import Any

from ..numerics.decimals import PI, arithmetic
from ..numerics.zeros import zero_between
from ..values import Motion, State
from .contact import ContactPhase

#: The coefficients (a, c, s) of a quantity, or the rates (r, h, R); float or Decimal.
Row = tuple[Any, Any, Any]


#: Digits; and those for a ratio of damping, masses or speeds (to the closing speed) beyond these:
#: then up to 70 cancel.
_DIGITS, _MANY_DIGITS = 57, 95
_HEAVY, _UNEQUAL, _FAST = 5e4, 1e8, 1e5

#: A row beside a level has maxima in so many times the window.
_MORE = 15

#: So many extrema of the force are examined for the end of a contact under a force.
_MOST_EXTREMA = 2000

#: Why a contact isn't computed then, with {} in place of the time.
TOO_MANY_EXTREMA = (
    f"after {_MOST_EXTREMA} extrema of the contact force, at {{!r}} s, the force on the club head "
    "neither keeps the bodies together nor parts them"
)

#: A smaller damping ratio is replaced by this one, and a pair of rates that are nearer (relative,
#: squared) by two real ones so far apart: that changes no bit of any result.
_LEAST_DAMPING = _APART = Decimal(10) ** -30

_ZERO, _INFINITY = Decimal(0), Decimal("Infinity")


def slope(row: Row, rates: Row, sign: int = 1) -> Row:
    """The derivative of a row; sign is -1 for cosh and sinh instead of cos and sin."""
    a, c, s = row
    r, h, second = rates
    return -r * a, second * s - h * c, -h * s - sign * second * c


class ExtendedContact(ContactPhase):
    """A linear contact in extended precision."""

    def __init__(
        self, k: float, damper: float, drag: float, m_club: float, m_ball: float, start: Motion,
        club_force: float = 0.0,
    ) -> None:  # fmt: skip
        mu = m_club * (m_ball / (m_club + m_ball))
        omega = sqrt(k / mu)
        moved = abs(start.closing) + omega * start.compression
        many = (
            max(damper, drag) > 2.0 * _HEAVY * mu * omega
            or max(m_club, m_ball) > _UNEQUAL * min(m_club, m_ball)
            or max(abs(start.v_club), abs(start.v_ball)) > _FAST * moved
            or abs(club_force) > _FAST * mu * omega * moved
            or (drag and abs(club_force) > _FAST * drag * moved)
        )
        self._in_use, self._exp, self._cos_sin = arithmetic(_MANY_DIGITS if many else _DIGITS)
        self._start = start
        with self._in_use():
            self._set_up(*map(Decimal, (k, damper, drag, m_club, m_ball, club_force)))

    def _set_up(
        self, k: Any, damper: Any, drag: Any, m_club: Any, m_ball: Any, club_force: Any
    ) -> None:
        total = m_club + m_ball
        p = m_ball / total
        q = m_club / total
        mu = m_club * p
        if drag:
            drag = max(drag, 2 * _LEAST_DAMPING * (k * mu).sqrt())
        slow, fast = sorted((drag / m_club, drag / m_ball))
        apart, gamma = drag * (m_club - m_ball) / total, 2 * drag / total
        alpha, beta, delta = damper / mu + slow + fast - gamma, apart / mu, apart / total
        omega_squared = k / mu
        trace = alpha + gamma
        minors, product = alpha * gamma - beta * delta + omega_squared, omega_squared * gamma
        # A real rate is between those of the drags; with a damper as well, it may be any.
        bracket = (_ZERO, trace) if damper and slow < fast else (slow, fast)
        self._find_rates(trace, minors, product, *bracket)
        self.rate = float(max(trace, omega_squared.sqrt()))

        matrix = (_ZERO, 1, _ZERO), (-omega_squared, -alpha, beta), (_ZERO, delta, -gamma)

        def shifted(x: Sequence[Any], rate: Decimal) -> list[Any]:
            """(A + rate) x."""
            d, w, mean = x
            return [a * d + b * w + c * mean + rate * e for (a, b, c), e in zip(matrix, x)]

        r, h, second = self._rates
        start = self._start
        d, w = Decimal(start.compression), Decimal(start.closing)
        self._initial = d, w, q * Decimal(start.v_club) + p * Decimal(start.v_ball)
        # Under a force the motion is that about a fixed point: with drag one that moves uniformly,
        # without it one that accelerates uniformly.
        level, drift = p * club_force / k, _ZERO
        if drag:
            level, drift = club_force / (2 * k), club_force / (2 * drag)
        x = d - level, w, self._initial[2] - drift
        y = shifted(x, r)
        z = shifted(y, 2 * h - r)
        g = 1 / ((h - r) * (h - r) + self._sign * second * second)
        # Without drag exactly 0: a rounding error in the real mode, which doesn't decay, would
        # outlast all else.
        real = [e + f * g for e, f in zip(x, z)] if drag else (_ZERO, _ZERO, x[2])
        # The first two coefficients add up to the initial value, exactly where that is 0.
        d_row, w_row, mean = [
            (a, e - a, (s - (h - r) * f * g) / second) for a, e, s, f in zip(real, x, y, z)
        ]
        force = tuple(k * e + damper * f for e, f in zip(d_row, w_row))
        self._rows: dict[str, Any] = {"force": force, "d": d_row, "w": w_row, "mean": mean}
        self._levels = {"force": k * level, "d": level, "w": _ZERO, "mean": drift}
        # Exactly 0 at touch, which the sum of level and coefficients may miss by rounding.
        self._first_force = k * d + damper * w
        self._bodies = drag, total, m_ball, q, club_force
        if level:
            self._window *= _MORE
        self.duration = float(self._end_of_contact())

    def _find_rates(
        self, trace: Decimal, minors: Decimal, product: Decimal, low: Decimal, high: Decimal
    ) -> None:
        """Set the rates, from s³ + trace s² + minors s + product: a real one is between these."""

        def value(r: Decimal) -> Row:
            slope = r * (2 * trace - 3 * r) - minors
            return product - r * (minors - r * (trace - r)), slope, 2 * trace - 6 * r

        r = zero_between(value, low, high, True) if low < high else low
        h, c = (trace - r) / 2, product / r if r else minors
        square = c - h * h
        if abs(square) < _APART * c:
            square = -_APART * c
        second = abs(square).sqrt()
        self._oscillates = oscillates = square > 0
        self._rates, self._sign = (r, h, second), 1 if oscillates else -1
        self._fast = h if oscillates else h + second
        self._slow = h if oscillates else c / self._fast
        # Maxima and first zeros lie within three half periods: earlier oscillations are larger.
        self._window = 3 * PI / second if oscillates else _INFINITY

    def _basis(self, t: Decimal) -> Row:
        """The three functions that a row has coefficients of."""
        r, _, second = self._rates
        slow = self._exp(-self._slow * t)
        if self._oscillates:
            # Once nothing is left, the angle may exceed its digits.
            cosine, sine = self._cos_sin(second * t) if slow else (slow, slow)
            return self._exp(-r * t), slow * cosine, slow * sine
        fast = self._exp(-self._fast * t)
        return self._exp(-r * t), (slow + fast) / 2, (slow - fast) / 2

    def _at(self, t: Decimal, *rows: Row) -> Any:
        e, c, s = self._basis(t)
        return [row[0] * e + row[1] * c + row[2] * s for row in rows]

    def _slope(self, row: Row) -> Row:
        return slope(row, self._rates, self._sign)

    def value(self, name: str, t: float | Decimal) -> float:
        with self._in_use():
            return float(self._levels[name] + self._at(Decimal(t), self._rows[name])[0])

    def _motion(self, t: float | Decimal) -> list[Decimal]:
        """Force, compression, closing speed, and of the ball velocity and displacement."""
        t = Decimal(t)
        d_0, _, mean_0 = self._initial
        drag, total, _, q, club_force = self._bodies
        values = self._at(t, *self._rows.values())
        force, d, w, mean = (x + level for x, level in zip(values, self._levels.values()))
        moved = mean * t - q * (d - d_0)
        if drag:
            # Drag times the sum of the paths is the momentum that is lost.
            moved = ((total * (mean_0 - mean) + club_force * t) / drag - (d - d_0)) / 2
        elif club_force:
            gained = club_force / total * t
            mean, moved = mean + gained, moved + gained * t / 2
        return [force, d, w, mean - q * w, moved]

    def impulse(self, begin: float, width: float) -> float:
        with self._in_use():
            first, last = self._motion(begin), self._motion(Decimal(begin) + Decimal(width))
            drag, _, m_ball, *_ = self._bodies
            return float(m_ball * (last[3] - first[3]) + drag * (last[4] - first[4]))

    def state(self, t: float) -> State:
        with self._in_use():
            force, d, w, v_ball, moved = self._motion(t)
            x_ball = Decimal(self._start.x_club) - self._initial[0] + moved
            return [float(x) for x in (force, x_ball + d, x_ball, v_ball + w, v_ball, d)]

    def find_maxima(self, name: str) -> list[float]:
        with self._in_use():
            slope, end = self._slope(self._rows[name]), min(Decimal(self.duration), self._window)
            return [float(t) for t, falls in self._sign_changes(slope, end) if falls]

    def _extrema(self, row: Row) -> Iterator[Decimal]:
        """The extrema of e^(rt) f, s, in order."""
        r, h, second = self._rates
        _, c, s = row
        # (e^(rt) f)' is e^((r-h)t) (u cos Rt + v sin Rt).
        u, v = (r - h) * c + second * s, (r - h) * s - self._sign * second * c
        if not self._oscillates:
            if abs(v + u) < abs(v - u) and (v + u) * (v - u) > 0:
                yield ((v - u) / (v + u)).ln() / (2 * second)
            return
        # Double precision suffices for the ends of brackets.
        size = max(abs(u), abs(v))
        angle = Decimal(atan2(u / size, -v / size) % pi or pi) if size else PI
        while True:
            yield angle / second
            angle += PI

    def _sign_changes(
        self, row: Row, end: Decimal, level: Decimal = _ZERO
    ) -> Iterator[tuple[Decimal, bool]]:
        """The zeros of a row up to `end`, s, and whether it falls there; in order.

        With a level, those of the force: its row and that.
        """
        slope = self._slope(row)
        bend = self._slope(slope)
        value = self._first_force if level else row[0] + row[1]
        starts = value, slope[0] + slope[1], bend[0] + bend[1]
        positive = next((f for f in starts if f), 0) > 0
        # With a level the extrema are zeros of the slope, which has none.
        points = (t for t, _ in self._sign_changes(slope, end)) if level else self._extrema(row)
        low, examined = _ZERO, 0
        # A number with the sign of f after a long time, for a pair of real rates. One of them is
        # the slowest: from half of their sum Halley's method finds the largest of three roots, r.
        last = level or row[1] + row[2]
        while low < end and not (end == _INFINITY and self._is_settled(row, level, low)):
            high = min(next(points, end), end)
            examined += 1
            if examined == _MOST_EXTREMA:
                raise ArithmeticError(TOO_MANY_EXTREMA.format(float(low)))
            later = last if high == _INFINITY else level + self._at(high, row)[0]
            if later and (later > 0) != positive:
                if high == _INFINITY:
                    high = 2 * low + 1 / self._fast
                    while (level + self._at(high, row)[0] > 0) == positive:
                        low, high = high, 2 * high
                    end = high
                yield self._zero(row, low, high, positive, level), positive
                positive = not positive
            low = high

    def _is_settled(self, row: Row, level: Decimal, t: Decimal) -> bool:
        """Whether an oscillating row and a level keep their sign after t, s."""
        r, h, _ = self._rates
        if not (self._oscillates and t) or (not level and r >= h):
            return False
        real = row[0] * self._exp(-r * t)
        # Its amplitude: a bound above it would never be reached without damping.
        pair = (row[1] * row[1] + row[2] * row[2]).sqrt() * self._exp(-h * t)
        if level:
            now = level + real
            if not (now * level > 0 and pair < abs(now)):
                return False
            # The pair decays below the sum of both: faster, or that grows, or the level is enough.
            return h >= r or real * level <= 0 or pair < abs(level)
        return pair < abs(real)

    def _zero(
        self, row: Row, low: Decimal, high: Decimal, falls: bool, level: Decimal = _ZERO
    ) -> Decimal:
        slope = self._slope(row)
        rows = row, slope, self._slope(slope)

        def value(t: Decimal) -> list[Decimal]:
            f, *slopes = self._at(t, *rows)
            return [level + f, *slopes]

        return zero_between(value, low, high, falls)

    def _end_of_contact(self) -> Decimal:
        """The first downward zero of the force, s."""
        r, h, second = self._rates
        force, level, growth = self._rows["force"], self._levels["force"], r - h
        end = _INFINITY if level else self._window
        for when, _ in self._sign_changes(force, end, level):
            return when
        if not self._oscillates or growth <= 0 or level:
            return _INFINITY
        # e^(rt) F oscillates about the real mode's coefficient with a growing amplitude.
        points = self._extrema(force)
        extrema = next(points), next(points)
        lowest, when = min((self._exp(r * t) * self._at(t, force)[0], t) for t in extrema)
        level, half_period = force[0], PI / second
        periods = (level / (level - lowest)).ln() / (growth * 2 * half_period)
        when += periods.to_integral_value() * 2 * half_period
        while self._at(when, force)[0] > 0:
            when += 2 * half_period
        return self._zero(force, when - half_period, when, True)
