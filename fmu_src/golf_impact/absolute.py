"""Law 1: a spring between the bodies and a drag b·v on each of them (the source document's law).

m_C v_C' = -k d - b v_C,  m_B v_B' = k d - b v_B,  d' = v_C - v_B, in contact until d returns to 0.
The drag acts on absolute velocities, so momentum is lost to the surroundings, the answer depends
on the frame of reference, and heavy damping can keep the bodies together for ever.
"""

from collections.abc import Callable, Generator, Iterator
from math import atan2, ceil, cos, exp, expm1, inf, log, log1p, pi, sin, sqrt

from .decay import decayed, difference, divided_differences, mean_fall
from .from_zero import FromZero
from .quadrature import GAUSS_5
from .roots import falling_zero, offset_of_partner, offset_of_real_root, root_in_bracket

#: A damping ratio as small as this changes no bit of any result, and needs no case of its own.
_LEAST_DAMPING = 1e-30

#: A real root nearer than this to the pair (relative, squared) is not split off from it: splitting
#: costs a factor 1/this in rounding error.
_NEAR_TRIPLE = 1e-2

#: A contact shorter than this, over its fastest time scale, is brief.
_BRIEF = 0.4

#: What the roots are like: one real and an oscillating pair, three real, three of which two are
#: close, or nearly one.
_OSCILLATING, _THREE_RATES, _MEETING_RATES, _NEAR_TRIPLE_ROOTS = range(4)

#: Decay exponents beyond this leave nothing of a double.
_VANISHED = 745.0


class AbsoluteContact:
    """One contact phase under constant k and b, exact at every instant.

    With time in units of 1/ω0, ω0 = √(k/μ), the state (ω0·d, v_heavy, v_light) obeys a linear
    system of order 3 with the characteristic polynomial s³ + 2ζs² + (1 + 4ζ²pq)s + 4ζpq, where p
    and q are the mass fractions of the lighter and the heavier body. A real root -r is split off;
    the other two form a pair, oscillating or real. Each quantity is then a sum of three basis
    functions of time, chosen so that they stay independent where roots meet.

    Args, units and conditions are those of `KelvinVoigtContact`, but for the state: the compression
    must be positive, or the phase starts at first touch while closing.
    """

    __slots__ = (
        "_base",
        "_brief",
        "_initial",
        "_kind",
        "_maxima",
        "_middle",
        "_motion",
        "_omega",
        "_pair",
        "_system",
        "duration",
        "frequency",
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
        # The system keeps its form when the bodies change places and the axis is turned round.
        if m_club >= m_ball:
            p, q = m_ball / total, m_club / total
            v1, v2 = v_club, v_ball
        else:
            p, q = m_club / total, m_ball / total
            v1, v2 = -v_ball, -v_club
        mu = m_club * (m_ball / total)
        omega = sqrt(k / mu)
        zeta = b / (2.0 * mu * omega)
        if zeta < _LEAST_DAMPING:
            zeta = _LEAST_DAMPING
        drag1 = 2.0 * zeta * p
        drag2 = 2.0 * zeta * q
        span = 2.0 * zeta * (abs(m_club - m_ball) / total)
        x = offset_of_real_root(p, q, drag1, span)
        r = drag1 + x
        # How far below the faster drag it lies: the same equation, and no cancellation.
        y = q * x / (p + r * x)
        half = 0.5 * (drag1 + y)
        product = 4.0 * zeta * p * q / r
        square = product - half * half
        roots: list[tuple[float, float, float]] | None = None
        if square > 0.0:
            oscillates, slow, second = True, half, sqrt(square)
            fast = half
            apart = (r - half) * (r - half) + square
        else:
            oscillates = False
            second = 2.0 * sqrt(-square)
            fast = half + 0.5 * second
            slow = product / fast
            # Each root with its distances from the two drags.
            roots = sorted(
                (
                    (r, x, y),
                    (slow, offset_of_partner(slow, fast, x, y, p, q, drag1), x + fast),
                    (fast, offset_of_partner(fast, slow, x, y, p, q, drag1), x + slow),
                )
            )
            # The two rates with the smaller ratio make the pair.
            low, middle, high = (rate for rate, _, _ in roots)
            single = 0 if middle * middle > low * high else 2
            if roots[single][0] != r:
                r, x, y = roots[single]
                slow, fast = roots[1 - single // 2][0], roots[2 - single // 2][0]
                second = fast - slow
            apart = abs((r - slow) * (r - fast))
        d = omega * compression
        if closing is None:
            closing = v1 - v2
        # What is left when the real mode is removed from the state's growth: the pair alone.
        y0 = closing + r * d
        y1 = -p * d + x * v1
        y2 = q * d + (r - drag2) * v2
        self._base = (x_club, m_club, m_ball, v_club, v_ball, k, b, compression)
        self._system = (p, q, drag1, drag2, r, zeta)
        self._initial = (d, v1, v2, y0, y1, y2)
        self._omega = omega
        self._pair = (oscillates, slow, second)
        self._maxima: list[float] | None = None
        #: Of the undamped spring, rad/s.
        self.frequency = omega
        #: The fastest rate of change in the phase, 1/s.
        fastest = 2.0 * zeta if zeta > 0.5 else 1.0
        self.rate = omega * fastest
        duration = None
        # How long the drags alone need to part the bodies again, in units of 1/ω0: long before the
        # spring does if they move much faster than they close. Modes would cancel then.
        parting = drag1 * v1 - drag2 * v2
        brief = d == 0.0 and 2.0 * closing * fastest < _BRIEF * parting
        self._brief = brief
        if brief or apart < _NEAR_TRIPLE * r * r:
            self._kind = _NEAR_TRIPLE_ROOTS
            self._motion: tuple = ()
            guess = 2.0 * closing / (parting * omega) if brief else pi / omega
        elif roots is not None and fast > 2.0 * slow:
            self._kind = _THREE_RATES
            self._middle = sorted((r, slow, fast))[1]
            self._motion = tuple(_mode(*root, p, q, d, v1, v2, m_club >= m_ball) for root in roots)
            guess = pi / omega
        else:
            # The real mode is (x, p, u), its left partner (-q x, q, u).
            u = p + r * x if x >= 0.0 else q * x / y
            norm = q * (p - x * x) + u * u
            off = v1 - x * d
            a = (q * off + u * v2) / norm
            # The state less a·(x, p, u), written out: heavy drag leaves almost nothing of it.
            w0 = (d * (p * q + u * u) - x * (q * v1 + u * v2)) / norm if d else -x * a
            w1 = (v1 * (u * u - q * x * x) + p * (q * x * d - u * v2)) / norm
            w2 = q * (v2 * (p - x * x) - u * off) / norm
            # The closing speed less that of the real mode: unless they nearly cancel, it is better
            # than the difference of two velocities that may be far larger.
            h0 = closing - a * (p - u)
            if abs(h0) < 0.5 * abs(closing):
                h0 = w1 - w2
            h0 += slow * w0
            h1 = -p * w0 + (slow - drag1) * w1
            # Orthogonal to the left partner too; where the drag balances the spring, this is what
            # q·w0 and drag·w2 leave of each other.
            h2 = q * (x * h0 - h1) / u if x > 1.0 else q * w0 + (slow - drag2) * w2
            if m_club >= m_ball:
                a1, c1, s1, a2, c2, s2 = a * p, w1, h1, a * u, w2, h2
            else:
                a1, c1, s1, a2, c2, s2 = -a * u, -w2, -h2, -a * p, -w1, -h1
            if oscillates:
                s1 /= second
                h0 /= second
                lone = a * x
                self._kind = _OSCILLATING
                self._motion = (
                    r * omega,
                    slow * omega,
                    second * omega,
                    lone / omega,
                    w0 / omega,
                    h0 / omega,
                    a1,
                    c1,
                    s1,
                    a2,
                    c2,
                    s2 / second,
                    (slow * c1 + second * s1) / (product * omega),
                    (second * c1 - slow * s1) / (product * omega),
                )
                if compression == 0.0:
                    # The usual end: e^(rτ)·d rises from 0 to its first turning point, and falls
                    # through 0 before its second one. Looked for without the pair's decay, so that
                    # d doesn't vanish: its zeros stay exact.
                    turning = atan2(y0, (y2 - y1 - slow * y0) / second)
                    angle = falling_zero((slow - r) / second, lone, w0, h0, turning, turning + pi)
                    if angle is not None:
                        duration = angle / (second * omega)
                if duration is None:
                    guess = (pi + atan2(-w0, h0)) / (second * omega)
            else:
                self._kind = _MEETING_RATES
                self._motion = (a * x, w0, h0, a1, c1, s1, a2, c2, s2)
                guess = pi / omega
        if duration is None:
            crossings = self._crossings(self._compression, (y0, y1 - y2), 1.0, inf, guess)
            duration = next(crossings, inf)
        #: s from the start of the phase until contact ends; inf if it never does.
        self.duration = duration

    def state(self, t: float) -> list[float]:
        """Everything that moves, at one instant.

        Args:
            t: time since the start of the phase, s, from 0 to `duration`.

        Returns:
            Contact force (N), positions of club face and ball (m), velocities of club and
            ball (m/s), compression (m).
        """
        if self._kind != _OSCILLATING:
            if self._kind == _THREE_RATES:
                return self._three_rates(t)
            if self._kind == _MEETING_RATES:
                return self._meeting_rates(t)
            return self._near_triple(t)
        r, slow, frequency, a0, c0, s0, a1, c1, s1, a2, c2, s2, x_c, x_s = self._motion
        size = exp(-slow * t)
        angle = frequency * t
        c = size * cos(angle)
        s = size * sin(angle)
        e = exp(-r * t)
        return self._at(
            a0 * e + c0 * c + s0 * s,
            a1 * e + c1 * c + s1 * s,
            a2 * e + c2 * c + s2 * s,
            x_c - a1 * expm1(-r * t) / r - x_c * c + x_s * s,
        )

    def end(self) -> tuple[list[float], float]:
        """State and closing speed when contact ends: the compression is 0."""
        t = self.duration
        if self._kind == _OSCILLATING:
            # As `state` has it, but for d; written out, since every impact comes here (2 % of it).
            r, slow, frequency, _, _, _, a1, c1, s1, a2, c2, s2, x_c, x_s = self._motion
            size = exp(-slow * t)
            angle = frequency * t
            c = size * cos(angle)
            s = size * sin(angle)
            e = exp(-r * t)
            x_club = self._base[0] + (x_c - a1 * expm1(-r * t) / r - x_c * c + x_s * s)
            v_club = a1 * e + c1 * c + s1 * s
            v_ball = a2 * e + c2 * c + s2 * s
        else:
            _, x_club, _, v_club, v_ball, _ = self.state(t)
        return [0.0, x_club, x_club, v_club, v_ball, 0.0], v_club - v_ball

    def fast_state(self) -> tuple[Callable[[float], list[float]], float, float]:
        """`state` for many instants: a function, and the scale and offset of time that it wants."""
        # Over one time constant of the real rate at most, 1 - (1 - e^(-rt)) loses nothing.
        if self._kind == _OSCILLATING and self._motion[0] * self.duration <= 1.0:
            _, slow, frequency, _, c0, s0 = self._motion[:6]
            zero = FromZero(slow, frequency, c0, s0, self.duration)
            if zero.near:
                return _oscillating(self._base[5], self._base[0], self._motion, zero), *zero.time
        return self.state, 1.0, 0.0

    def _at(self, d: float, v_club: float, v_ball: float, moved: float) -> list[float]:
        x = self._base[0] + moved
        return [self._base[5] * d, x, x - d, v_club, v_ball, d]

    def _three_rates(self, t: float) -> list[float]:
        """`state` for three real rates."""
        omega = self._omega
        tau = omega * t
        # While two of the rates have hardly begun, their modes are large and nearly cancel: what
        # has changed since the start is then known better. Later it is what is left.
        begun = self._middle * tau > 1.0
        if begun:
            d = v_club = v_ball = 0.0
        else:
            d = omega * self._base[7]
            v_club, v_ball = self._base[3:5]
        moved = 0.0
        for rate, a0, a1, a2 in self._motion:
            fallen = expm1(-rate * tau)
            e = exp(-rate * tau) if begun else fallen
            d += a0 * e
            v_club += a1 * e
            v_ball += a2 * e
            moved -= a1 * fallen / rate
        return self._at(d / omega, v_club, v_ball, moved / omega)

    def _meeting_rates(self, t: float) -> list[float]:
        """`state` for three real rates of which two are close."""
        omega = self._omega
        tau = omega * t
        r = self._system[4]
        _, slow, second = self._pair
        fast = slow + second
        ramp = -expm1(-r * tau) / r
        e = exp(-r * tau)
        ramp_slow = -expm1(-slow * tau) / slow
        e_slow = exp(-slow * tau)
        s = difference(slow, second, tau)
        a0, c0, s0, a1, c1, s1, a2, c2, s2 = self._motion
        return self._at(
            (a0 * e + c0 * e_slow + s0 * s) / omega,
            a1 * e + c1 * e_slow + s1 * s,
            a2 * e + c2 * e_slow + s2 * s,
            (a1 * ramp + c1 * ramp_slow + s1 * ((ramp_slow - s) / fast)) / omega,
        )

    def _by_differences(self, t: float) -> tuple[float, float, float]:
        """ω0·d and the velocities of the heavier and the lighter body, without modes.

        Newton's form of the exponential: e^(-rτ)·x + S·y + G·z with S and G its second and third
        divided differences over the roots, y = (A + r)x and z = (A + g - r)y, A the system's matrix
        and s² + gs + c the pair's polynomial.
        """
        omega = self._omega
        tau = omega * t
        p, q, drag1, drag2, r, _zeta = self._system
        d0, v1, v2, y0, y1, y2 = self._initial
        oscillates, slow, second = self._pair
        half = slow if oscillates else slow + 0.5 * second
        square = second * second if oscillates else -0.25 * second * second
        shift = 2.0 * half - r
        z0 = y1 - y2 + shift * y0
        z1 = -p * y0 + (shift - drag1) * y1
        z2 = q * y0 + (shift - drag2) * y2
        e = exp(-r * tau)
        s, g = divided_differences(r, half, square, tau)
        d = e * d0 + s * y0 + g * z0
        heavy = e * v1 + s * y1 + g * z1
        light = e * v2 + s * y2 + g * z2
        return d, heavy, light

    def _near_triple(self, t: float) -> list[float]:
        """`state` where all three roots nearly meet (ζ ≈ 0.975, mass ratio ≈ 0.083), or contact
        is brief.
        """
        omega = self._omega
        p, q, _, _, _, zeta = self._system
        d0, v1, v2, _, _, _ = self._initial
        d, heavy, light = self._by_differences(t)
        if self._brief:
            index = 1 if self._base[1] >= self._base[2] else 2
            sign = 3 - 2 * index
            moved = sum(w * self._by_differences(0.5 * t * (1.0 + x))[index] for x, w in GAUSS_5)
            v_club, v_ball = (heavy, light) if index == 1 else (-light, -heavy)
            return self._at(d / omega, v_club, v_ball, 0.5 * t * sign * moved)
        # Heavily damped, so the displacements follow from the momentum that the drag took.
        lost = (q * (v1 - heavy) + p * (v2 - light)) / (2.0 * zeta * p * q)
        moved_heavy = 0.5 * (lost + (d - d0))
        if self._base[1] >= self._base[2]:
            return self._at(d / omega, heavy, light, moved_heavy / omega)
        return self._at(d / omega, -light, -heavy, -0.5 * (lost - (d - d0)) / omega)

    def _compression(self, t: float) -> tuple[float, float]:
        return self.state(t)[5], self.closing(t)

    def _closing(self, t: float) -> tuple[float, float]:
        force, _, _, v_club, v_ball, _ = self.state(t)
        _, m_club, m_ball, _, _, _, b, _ = self._base
        return self.closing(t), (b * v_ball - force) / m_ball - (b * v_club + force) / m_club

    def _turning_points(self, u: float, slope: float) -> Generator[float, int | None, None]:
        """Where the pair function with initial value u and this slope is zero, in order, s.

        Between them e^(rt)·f is monotone, so f has at most one zero (Rolle).
        """
        oscillates, slow, second = self._pair
        h = slope + slow * u
        if oscillates:
            n = 0
            first = atan2(u, -h / second)
            if first <= 0.0:
                first += pi
            while True:
                skip = yield (first + n * pi) / (second * self._omega)
                n += 1 + (skip or 0)
        elif h * u < 0.0:
            if second == 0.0:
                yield -u / (h * self._omega)
            elif second * u / h > -1.0:
                yield -log1p(second * u / h) / (second * self._omega)

    def _crossings(
        self,
        value: Callable[[float], tuple[float, float]],
        critical: tuple[float, float],
        sign: float,
        limit: float,
        guess: float,
    ) -> Iterator[float]:
        """Every t in (0, limit] where `value` changes sign, in order.

        Args:
            value: gives f(t) and f'(t), f a sum of the three basis functions.
            critical: the pair function (value, slope at 0) whose zeros are f's turning points.
            sign: the sign of f just after 0.
            limit: s.
            guess: where the first Newton iteration starts, s.
        """
        oscillates, slow, second = self._pair
        r = self._system[4]
        end = min(limit, _VANISHED / (self._omega * min(r, slow)))
        turning = self._turning_points(*critical)
        low = 0.0
        last = None
        skip: int | None = None
        while low < end:
            try:
                high = turning.send(skip) if skip else next(turning)
            except StopIteration:
                high = 2.0 * low + 1.0 / self._omega
            skip = None
            high = min(high, end)
            f = value(high)[0]
            if f == 0.0:
                return  # decayed below the least double
            if f * sign < 0.0:
                yield root_in_bracket(value, low, high, sign, guess)
                sign = -sign
                last = None
            elif oscillates and last is not None:
                # Two turning points on one side: e^(rt)·f swings about a level it doesn't cross,
                # ever less (then there is no further zero), or ever more.
                growth = (r - slow) * pi / second
                if growth <= 0.0:
                    return
                skip = _half_swings_to_zero(
                    last, f * exp(min(r * pi / second, _VANISHED - 45.0)), growth
                )
            if oscillates and f * sign > 0.0:
                last = f
            low = high

    def closing(self, t: float) -> float:
        """Closing speed d' at t, m/s, exact even where both bodies are much faster."""
        if self._kind == _OSCILLATING:
            r, slow, frequency, a0, c0, s0 = self._motion[:6]
            angle = frequency * t
            pair = (frequency * s0 - slow * c0) * cos(angle)
            pair -= (slow * s0 + frequency * c0) * sin(angle)
            return exp(-slow * t) * pair - r * a0 * exp(-r * t)
        tau = self._omega * t
        if self._kind == _THREE_RATES:
            return -sum(rate * a0 * exp(-rate * tau) for rate, a0, _, _ in self._motion)
        if self._kind == _MEETING_RATES:
            r = self._system[4]
            _, slow, second = self._pair
            a0, c0, s0 = self._motion[:3]
            pair = (s0 - slow * c0) * exp(-slow * tau)
            pair -= s0 * (slow + second) * difference(slow, second, tau)
            return pair - r * a0 * exp(-r * tau)
        _p, _q, _drag1, _, r, _ = self._system
        d0, _, _, y0, y1, y2 = self._initial
        oscillates, slow, second = self._pair
        half = slow if oscillates else slow + 0.5 * second
        square = second * second if oscillates else -0.25 * second * second
        _, g = divided_differences(r, half, square, tau)
        z0 = y1 - y2 + (2.0 * half - r) * y0
        c, s = decayed(half, square, tau)
        # The derivatives of e^(-rτ), S and G.
        slope = c - half * s
        return slope * y0 + (s - r * g) * z0 - r * exp(-r * tau) * d0

    def impulse(self, begin: float, width: float) -> float:
        """Impulse of the contact force over [begin, begin + width] (s), N.s: k times the integral
        of d.

        Not from the momentum gained and what the drag took, which nearly cancel under heavy drag.
        """
        omega = self._omega
        k = self._base[5]
        if self._kind == _OSCILLATING:
            r, slow, frequency, a0, c0, s0 = self._motion[:6]
            square = slow * slow + frequency * frequency
            # The pair's amplitudes at the beginning.
            size = exp(-slow * begin)
            angle = frequency * begin
            c = size * cos(angle)
            s = size * sin(angle)
            c0, s0 = c0 * c + s0 * s, s0 * c - c0 * s
            angle = frequency * width
            # 1 - e^(-x) cos(angle), also where it is small.
            fallen = 2.0 * sin(0.5 * angle) ** 2 - cos(angle) * expm1(-slow * width)
            pair = (slow * c0 + frequency * s0) * fallen
            pair += (frequency * c0 - slow * s0) * exp(-slow * width) * sin(angle)
            return k * (pair / square - a0 * exp(-r * begin) * expm1(-r * width) / r)
        start, tau = omega * begin, omega * width
        if self._kind == _THREE_RATES:
            if self._middle * (start + tau) > 1.0:
                total = sum(
                    -a0 * exp(-rate * start) * expm1(-rate * tau) / rate
                    for rate, a0, _, _ in self._motion
                )
            else:
                total = tau * omega * self.state(begin)[5] + tau * sum(
                    a0 * exp(-rate * start) * mean_fall(rate * tau)
                    for rate, a0, _, _ in self._motion
                )
            return k * total / (omega * omega)
        if self._kind == _MEETING_RATES:
            r = self._system[4]
            _, slow, second = self._pair
            a0, c0, s0 = self._motion[:3]
            c0 = c0 * exp(-slow * start) + s0 * difference(slow, second, start)
            s0 *= exp(-(slow + second) * start)
            ramp = -expm1(-slow * tau) / slow
            total = -a0 * exp(-r * start) * expm1(-r * tau) / r + c0 * ramp
            total += s0 * (ramp - difference(slow, second, tau)) / (slow + second)
            return k * total / (omega * omega)
        return self._momentum_taken(begin + width) - self._momentum_taken(begin)

    def _momentum_taken(self, t: float) -> float:
        """What the lighter body has gained from the contact, what the drag took back included."""
        x_club, m_club, m_ball, v_club0, v_ball0, _, b, d0 = self._base
        _, x, _, v_club, v_ball, d = self.state(t)
        if m_ball <= m_club:
            return m_ball * (v_ball - v_ball0) + b * ((x - x_club) - (d - d0))
        return m_club * (v_club0 - v_club) - b * (x - x_club)

    def peak_force(self, t: float) -> tuple[float, float]:
        """The largest contact force on [0, t] and its time.

        Args:
            t: s since the start of the phase, at most `duration`.

        Returns:
            Force (N) and time since the start of the phase (s).
        """
        d, when = self._largest(t)
        return self._base[5] * d, when

    def peak_compression(self, t: float) -> float:
        """The largest compression on [0, t], m; t (s) at most `duration`."""
        return self._largest(t)[0]

    def _largest(self, t: float) -> tuple[float, float]:
        if self._maxima is None:
            self._maxima = self._find_maxima()
        best = (self._base[7], 0.0)
        for when in (*self._maxima, t):
            if when <= t:
                d = self.state(when)[5]
                # Just past a maximum d is flat, and a later one larger by nothing but rounding.
                if d > best[0] * (1.0 + 1e-14):
                    best = (d, when)
        return best

    def _critical(self) -> tuple[float, float]:
        """Value and slope at the start of the pair function that is zero where e^(rt)·d turns."""
        _, _, _, y0, y1, y2 = self._initial
        return y0, y1 - y2

    def _find_maxima(self) -> list[float]:
        usual = self._only_maximum()
        if usual is not None:
            return [usual]
        oscillates, slow, second = self._pair
        fast = slow if oscillates else slow + second
        square = second * second if oscillates else 0.0
        u, slope = self._critical()
        bend = -(slow + fast) * slope - (slow * fast + square) * u
        closing, change = self._closing(0.0)
        sign = 1.0 if (closing or change) > 0.0 else -1.0
        guess = 0.5 * min(self.duration, pi / self._omega)
        # Whatever d is later, it was more a period or half a period before.
        limit = 2.0 * pi / (second * self._omega) if oscillates else inf
        limit = min(limit, self.duration)
        crossings = self._crossings(self._closing, (slope, bend), sign, limit, guess)
        return [t for n, t in enumerate(crossings) if (n % 2 == 0) == (sign > 0.0)]

    def _only_maximum(self) -> float | None:
        """When d is largest, s, in the usual case: e^(rt)·d' falls from the start or from its first
        turning point on, and contact ends before it could fall again. None otherwise.
        """
        if self._kind != _OSCILLATING or self._base[7]:
            return None
        u, slope = self._critical()
        _, slow, second = self._pair
        bend = -2.0 * slow * slope - (slow * slow + second * second) * u
        turning = atan2(slope, -(bend + slow * slope) / second)
        if turning <= 0.0:
            turning += pi
        r, slow, frequency, lone, cosine, sine = self._motion[:6]
        low, high = (turning, turning + pi) if slope > 0.0 else (0.0, turning)
        end = frequency * self.duration
        if end > high + pi:
            return None
        angle = falling_zero(
            (slow - r) / frequency,
            -r * lone,
            frequency * sine - slow * cosine,
            -frequency * cosine - slow * sine,
            low,
            min(high, end),
        )
        return None if angle is None else angle / frequency


def _oscillating(
    k: float, x_club: float, motion: tuple[float, ...], zero: FromZero
) -> Callable[[float], list[float]]:
    """`state` for one real rate and an oscillating pair: the usual case."""
    r, _, _, a0, c0, s0, a1, c1, s1, a2, c2, s2, x_c, x_s = motion
    real_rate = -r / zero.frequency
    rate = zero.rate
    x_0 = x_club + x_c
    # Since the new origin of time the real mode has fallen by the factor `fallen`.
    change = expm1(r * zero.shift)
    fallen = 1.0 + change
    x_0 += a1 / r * -change
    a0, a1, a2 = a0 * fallen, a1 * fallen, a2 * fallen
    x_a = -a1 / r
    _, s0 = zero.amplitudes(c0, s0)
    c1, s1 = zero.amplitudes(c1, s1)
    c2, s2 = zero.amplitudes(c2, s2)
    x_c, x_s = zero.amplitudes(-x_c, x_s)

    def state(angle: float) -> list[float]:
        size = exp(rate * angle)
        c = size * cos(angle)
        s = size * sin(angle)
        e = expm1(real_rate * angle)
        r = 1.0 + e
        d = a0 * r + s0 * s
        x = x_0 + x_a * e + x_c * c + x_s * s
        return [
            k * d,
            x,
            x - d,
            a1 * r + c1 * c + s1 * s,
            a2 * r + c2 * c + s2 * s,
            d,
        ]

    return state


def _mode(
    rate: float,
    x: float,
    y: float,
    p: float,
    q: float,
    d: float,
    v1: float,
    v2: float,
    club_is_heavier: bool,
) -> tuple[float, float, float, float]:
    """A real mode's rate and its share of ω0·d and of the velocities of club and ball."""
    u = q * x / y if y else p + rate * x
    a = (q * (v1 - x * d) + u * v2) / (q * (p - x * x) + u * u)
    if club_is_heavier:
        return rate, a * x, a * p, a * u
    return rate, a * x, -a * u, -a * p


def _half_swings_to_zero(before: float, now: float, growth: float) -> int:
    """How many turning points can safely be passed over before a growing swing reaches zero."""
    level = min(abs(before), abs(now))
    # A swing too small to see beside the level is at most a rounding error of it.
    swing = max(abs(before - now) / (1.0 + exp(growth)), 1e-17 * level)
    wait = log(level / swing + 1.0) / growth if swing else inf
    return 2 * max(0, ceil(min(wait, 1e15) / 2.0) - 2)
