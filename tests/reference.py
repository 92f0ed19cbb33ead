"""An independent reference: the impact at 50 digits, which the tests hold the product against.

In contact the equations of motion are linear with constant coefficients, x' = A x. The product
solves them in closed form with doubles; here A is exponentiated with mpmath by scaling and
squaring, and events are bracketed and bisected (with Newton steps). None can slip between two
samples: a function f has at most one zero between neighbouring zeros of f' - s f, whatever the
real number s, because exp(-s t) f is monotone there (Rolle). SI units throughout.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, count

import mpmath

# A context of its own, so that nobody else's precision changes. 50 digits are wanted; the other 40
# are for cancellation and for the squarings: each doubles the relative error, and there may be 50.
_mp = mpmath.mp.clone()
_mp.dps = 90
mpf = _mp.mpf

Row = Sequence[mpf]  # a state, or a linear function of it
Matrix = Sequence[Row]

# The state in contact: d = x_club - x_ball, d', v_ball, x_ball, impulse. With d and d' instead of
# the club's position and velocity, their signs stay right where they die out.
_COMPRESSION = tuple(mpf(x) for x in (1, 0, 0, 0, 0))


def _dot(row: Row, state: Row) -> mpf:
    return _mp.fdot(zip(row, state))  # a shorter row is a function of the first components only


def _product(left: Matrix, right: Matrix) -> Matrix:
    columns = list(zip(*right))
    return [[_mp.fdot(zip(row, column)) for column in columns] for row in left]


def _root_of_cubic(c2: mpf, c1: mpf, c0: mpf) -> mpf:
    """A real root of s³ + c2 s² + c1 s + c0, by bisection of [-c2, 0], where law 1 has one."""
    low, high = -c2, mpf(0)
    while high - low > 2 * _mp.eps * -low:
        middle = (low + high) / 2
        if ((middle + c2) * middle + c1) * middle + c0 > 0:
            high = middle
        else:
            low = middle
    return high


class _Contact:
    """The motion in contact with one stiffness `k` (N/m) and one damping `b` (N.s/m)."""

    def __init__(self, law: int, m_club: mpf, m_ball: mpf, k: mpf, b: mpf) -> None:
        zero, one = mpf(0), mpf(1)
        mu = m_club * m_ball / (m_club + m_ball)
        if law == 1:  # m_C v_C' = -k d - b v_C, m_B v_B' = k d - b v_B, with v_C = v_B + d'
            force = (k, zero)
            acceleration = (-k / mu, -b / m_club, b / m_ball - b / m_club)
            ball_acceleration = (k / m_ball, zero, -b / m_ball)
            self._real_root = _root_of_cubic(
                b / mu, b * b / (m_club * m_ball) + k / mu, 2 * k * b / (m_club * m_ball)
            )
            self._order = 3  # the components of the state that d depends on
        else:  # m_C v_C' = -F, m_B v_B' = F, F = k d + b d'
            force = (k, b)
            acceleration = (-k / mu, -b / mu, zero)
            ball_acceleration = (k / m_ball, b / m_ball, zero)
            self._real_root = None
            self._order = 2
        self.force = (*force, zero, zero, zero)
        self.ends_at_zero_of = _COMPRESSION if law == 1 else self.force
        self._rates = (
            (zero, one, zero, zero, zero),
            (*acceleration, zero, zero),
            (*ball_acceleration, zero, zero),
            (zero, zero, one, zero, zero),
            self.force,
        )
        self._norm = _mp.sqrt(k / mu) + 2 * b / mu  # 1/s; of A, in units that make it small
        self.propagator = functools.lru_cache(maxsize=8)(self._propagator)

        # d, d' and the force solve the same linear equation. Its characteristic polynomial is
        # (s - real_root)(s² + 2 decay s + q) in law 1 and the second factor in law 2.
        self._decay, q = b / mu / 2, k / mu
        if self._real_root is not None:
            self._decay += self._real_root / 2
            q += b * b / (m_club * m_ball) + 2 * self._decay * self._real_root
        discriminant = self._decay**2 - q
        self._frequency = _mp.sqrt(-discriminant) if discriminant < 0 else None  # rad/s
        if self._frequency is None:
            fast = self._decay + _mp.sqrt(discriminant)
            roots = [-fast, -q / fast, self._real_root]
            self._real_roots = sorted(root for root in roots if root is not None)

    def _propagator(self, t: mpf, size: int) -> Matrix:
        """exp(A t) for the first `size` components, which must not depend on the others."""
        halvings = max(0, _mp.mag(self._norm * t) + 5)
        scaled = [[rate * t / 2**halvings for rate in row[:size]] for row in self._rates[:size]]
        identity = [[mpf(i == j) for j in range(size)] for i in range(size)]
        result = identity
        for n in range(40, 0, -1):  # Horner; norm 1/32, so the first neglected term is 2e-112
            result = _product([[x / n for x in row] for row in scaled], result)
            result = [[x + one for x, one in zip(*rows)] for rows in zip(result, identity)]
        for _ in range(halvings):
            result = _product(result, result)
        return result

    def at(self, t: mpf, state: Row) -> Row:
        """The state a time `t` (s) after `state`."""
        return [_dot(row, state) for row in self.propagator(t, 5)]

    def rate(self, row: Row, shift: mpf | int = 0) -> Row:
        """As a function of the state: the time derivative of `row`, less `shift` times `row`."""
        return [_dot(row, column) - shift * x for column, x in zip(zip(*self._rates), row)]

    def sign_after(self, row: Row, state: Row) -> int:
        """The sign of `row` just after the instant of `state`."""
        for _ in range(self._order):  # 0 happens at touch: the first derivative that isn't decides
            value = _dot(row, state)
            if value != 0:
                return 1 if value > 0 else -1
            row = self.rate(row)
        return 1  # 0 for good: either sign will do

    def crossings(
        self, row: Row, state: Row, end: mpf, roots: Sequence[mpf] | None = None
    ) -> Iterator[mpf]:
        """The times (s) in (0, end] after `state` at which `row` changes sign, in order.

        `roots`, where all are real: those of the exponentials that `row` is a sum of, fastest
        first (default: all).
        """
        if self._frequency is not None:
            cuts = self._cuts_of_oscillation(row, state, end)
        else:
            roots = self._real_roots if roots is None else roots
            if len(roots) == 1:
                return
            # The slow ones stay to the last: they rule the far end, where the others are lost.
            cuts = self.crossings(self.rate(row, roots[0]), state, end, roots[1:])
        left, sign = mpf(0), self.sign_after(row, state)
        for cut in chain(cuts, (end,)):
            if sign * self._value(row, state, cut) <= 0:
                yield self._zero(row, state, left, cut, sign)
                sign = -sign
            left = cut

    def maximum(self, row: Row, state: Row, end: mpf) -> tuple[mpf, mpf]:
        """The largest value of `row` from `state` on to `end` (s), and its time (s)."""
        best, at = _dot(row, state), mpf(0)
        for t in chain(self.crossings(self.rate(row), state, end), (end,)):
            value = self._value(row, state, t)
            if value > best:
                best, at = value, t
            if self._bound(row, state, t) < best:  # spares thousands of ever smaller maxima
                break
        return best, at

    def _cuts_of_oscillation(self, row: Row, state: Row, end: mpf) -> Iterator[mpf]:
        """Times between which exp(-s t)·f is monotone, f being `row`.

        s is the real root or, in law 2, -decay; the times are the zeros of
        f' - s f = exp(-decay t)(a cos(frequency t) + c sin(frequency t)).
        """
        shift = -self._decay if self._real_root is None else self._real_root
        oscillation = self.rate(row, shift)
        a = _dot(oscillation, state)
        c = _dot(self.rate(oscillation, -self._decay), state) / self._frequency
        phase = _mp.atan2(-a, c) % _mp.pi
        settled = self._settled(row, state)
        for n in count():
            cut = (phase + n * _mp.pi) / self._frequency
            if cut >= end:
                return
            if cut > 0:
                yield cut
            if cut > settled:
                return

    def _settled(self, row: Row, state: Row) -> mpf:
        """A time after which `row` changes sign no more, its real exponential being the slower one.

        Infinite if it isn't. Without this bound a club that never leaves the ball would be searched
        through all the periods of a long step.
        """
        real, amplitude = self._amplitudes(row, state)
        slower_by = self._decay + (self._real_root or 0)
        if not real or slower_by < 0:
            return _mp.inf
        if amplitude < abs(real):
            return mpf(0)
        return _mp.log(amplitude / abs(real)) / slower_by if slower_by else _mp.inf

    def _amplitudes(self, row: Row, state: Row) -> tuple[mpf, mpf]:
        """R and A: `row` is R exp(real_root t) and an oscillation within ± A exp(-decay t)."""
        real, real_rate = mpf(0), self._real_root or mpf(0)
        if self._real_root is not None:
            twice = self.rate(self.rate(row, -self._decay), -self._decay)
            without_pair = [x + self._frequency**2 * y for x, y in zip(twice, row)]
            slower_by = self._decay + real_rate
            real = _dot(without_pair, state) / (slower_by**2 + self._frequency**2)
        a = _dot(row, state) - real
        c = (_dot(self.rate(row), state) - real_rate * real + self._decay * a) / self._frequency
        return real, _mp.hypot(a, c)

    def _bound(self, row: Row, state: Row, t: mpf) -> mpf:
        """What `row` doesn't exceed from `t` (s) on; infinite where nothing oscillates."""
        if self._frequency is None:
            return _mp.inf
        real, amplitude = self._amplitudes(row, state)
        slow = abs(real) * _mp.exp((self._real_root or 0) * t)
        return slow + amplitude * _mp.exp(-self._decay * t)

    def _value(self, row: Row, state: Row, t: mpf) -> mpf:
        """`row`, one that depends on what d depends on, a time `t` (s) after `state`."""
        head = state[: self._order]
        return _dot(row, [_dot(line, head) for line in self.propagator(t, self._order)])

    def _zero(self, row: Row, state: Row, low: mpf, high: mpf, sign: int) -> mpf:
        """The zero of `row` in (low, high], which has `sign` before it."""
        head, slope = state[: self._order], self.rate(row)
        t, step, newton = high, high - low, None
        while True:
            previous = t
            if newton is not None and low <= newton <= high and abs(newton - t) < step / 2:
                t = newton
            elif high < 8 * low:
                t = (low + high) / 2
            else:  # a step may be 1e12 contact times long: halve the exponent
                t = _mp.sqrt(max(low, high / 2**40) * high)
            step = abs(t - previous)
            if step <= t * mpf(10) ** -45:  # Newton's error is about the square of its last step
                return t
            # Not by way of the cache, which is for the steps of the host.
            there = [_dot(line, head) for line in self._propagator(t, self._order)]
            value, derivative = _dot(row, there), _dot(slope, there)
            if sign * value > 0:
                low = t
            else:
                high = t
            newton = t - value / derivative if derivative else None


class Reference:
    """The impact at 50 digits, stepped by a host, by a matrix exponential and bisection.

    With d = x_C - x_B:
    law 1, absolute drag: m_C v_C' = -k d - b v_C, m_B v_B' = k d - b v_B; F = k d; ends at d = 0.
    law 2, Kelvin-Voigt: m_C v_C' = -F, m_B v_B' = F; F = k d + b d'; ends at F = 0.

    At the start the ball lies at 0 and the club face at -gap; the club moves with `club_speed`
    until first touch. Parameters and inputs are doubles, taken as exact: masses in kg, speeds in
    m/s, `gap` in m, `k` in N/m, `b` in N.s/m, `start_time` in s.
    A copy keeps the present instant.
    """

    def __init__(
        self,
        *,
        law: int,
        m_club: float = 0.210,
        m_ball: float = 0.04593,
        ball_speed: float = 0.0,
        gap: float = 0.0,
        k: float = 1e6,
        b: float = 9.0,
        club_speed: float = 35.0,
        start_time: float = 0.0,
    ) -> None:
        self._law = law
        self._m_club, self._m_ball = mpf(m_club), mpf(m_ball)
        self._k, self._b, self._club_speed = mpf(k), mpf(b), mpf(club_speed)
        self._start_time = mpf(start_time)
        self._elapsed = mpf(0)
        self._u_ball = mpf(ball_speed)
        self._u_club = None  # the club speed at first touch
        self._gap = mpf(gap)
        self._d, self._closing_speed = -self._gap, self._club_speed - self._u_ball
        self._v_ball, self._x_ball = self._u_ball, mpf(0)
        self._impulse = self._mean_force = mpf(0)
        self._touched = self._separated = False
        self._contact = self._contact_law()
        self._approach_time = self._contact_time = mpf(0)
        self._max_force = self._time_of_max_force = self._max_compression = mpf(0)
        self._touch_position = self._contact_displacement = mpf(0)

    def step(
        self,
        h: float,
        *,
        k: float | None = None,
        b: float | None = None,
        club_speed: float | None = None,
    ) -> None:
        """Move on by `h` (s), with inputs set just before and held over it; None: unchanged."""
        if k is not None or b is not None:
            changed = (self._k if k is None else mpf(k), self._b if b is None else mpf(b))
            if changed != (self._k, self._b):
                self._k, self._b = changed
                self._contact = self._contact_law()
        if club_speed is not None:
            self._club_speed = mpf(club_speed)

        left, impulse = mpf(h), self._impulse
        if not self._touched:
            left = self._approach(left)
        if self._touched and not self._separated and left > 0:
            left = self._stay_in_contact(left)
        self._fly(left)
        self._elapsed += mpf(h)
        self._mean_force = (self._impulse - impulse) / mpf(h)

    def outputs(self) -> dict[str, mpf | bool]:
        """Every output variable of the FMU, under its name, at the present instant.

        At an instant of touch they are the limit from the right.
        """
        if self._is_at_touch():
            later = copy.copy(self)
            later._touch(later._elapsed)
            return later.outputs()

        in_contact = self._touched and not self._separated
        v_club, x_club = self._v_ball + self._closing_speed, self._x_ball + self._d
        energy = self._kinetic_energy(v_club, self._v_ball)
        smash_factor = restitution = mpf(0)
        efficiency = mpf(1)
        if self._touched:
            smash_factor = self._v_ball / self._u_club if self._u_club else mpf(0)
            restitution = -self._closing_speed / (self._u_club - self._u_ball)
            efficiency = energy / self._kinetic_energy(self._u_club, self._u_ball)
        return {
            "force": _dot(self._contact.force, self._state()) if in_contact else mpf(0),
            "mean_force": self._mean_force,
            "club_position": x_club,
            "ball_position": self._x_ball,
            "club_velocity": v_club,
            "ball_velocity": self._v_ball,
            "compression": max(mpf(0), self._d),
            "touched": self._touched,
            "in_contact": in_contact,
            "separated": self._separated,
            "touch_time": self._start_time + self._approach_time,
            "smash_factor": smash_factor,
            "coefficient_of_restitution": restitution,
            "energy_efficiency": efficiency,
            "contact_time": self._contact_time,
            "max_force": self._max_force,
            "time_of_max_force": self._time_of_max_force,
            "max_compression": self._max_compression,
            "contact_displacement": self._contact_displacement,
            "impulse": self._impulse,
            "momentum": self._m_club * v_club + self._m_ball * self._v_ball,
            "kinetic_energy": energy,
        }

    def scales(self) -> Scales:
        """The scales on which the outputs of this impact are judged.

        Take them when the impact is over. T is the time in contact so far, which a case that never
        separates has too. Before any touch it is the time since the start or, if longer, the time
        the bodies need for the gap.
        """
        u_club, contact_time = self._u_club, self._contact_time
        if not self._touched:
            u_club, contact_time = self._club_speed, self._elapsed
            if speed := abs(u_club) + abs(self._u_ball):
                contact_time = max(contact_time, self._gap / speed)
        return Scales(
            mass=self._m_club + self._m_ball,
            u_club=u_club,
            u_ball=self._u_ball,
            contact_time=contact_time,
            approach_time=self._approach_time,
            start_time=self._start_time,
            force=self._max_force,
            compression=self._max_compression,
            impulse=self._impulse,
            energy=self._kinetic_energy(u_club, self._u_ball),
        )

    def __deepcopy__(self, memo: dict) -> Reference:
        # Nothing is changed in place, and a deep copy would round every number to 53 bits: mpmath
        # rebuilds them in its global context.
        return copy.copy(self)

    def _contact_law(self) -> _Contact:
        return _Contact(self._law, self._m_club, self._m_ball, self._k, self._b)

    def _state(self) -> Row:
        return (self._d, self._closing_speed, self._v_ball, self._x_ball, self._impulse)

    def _kinetic_energy(self, v_club: mpf, v_ball: mpf) -> mpf:
        return (self._m_club * v_club**2 + self._m_ball * v_ball**2) / 2

    def _is_at_touch(self) -> bool:
        return not self._touched and self._d == 0 and self._closing_speed > 0

    def _approach(self, h: mpf) -> mpf:
        """Move up to first touch, if it lies before the end; return the time that is left."""
        self._closing_speed = self._club_speed - self._u_ball
        if self._closing_speed * h <= -self._d:  # exact, unlike a quotient
            return h
        flight = -self._d / self._closing_speed
        self._fly(flight)
        self._touch(self._elapsed + flight)
        return h - flight

    def _touch(self, elapsed: mpf) -> None:
        self._touched = True
        self._approach_time = elapsed
        self._d = mpf(0)
        self._u_club = self._club_speed
        self._touch_position = self._x_ball
        self._max_force = _dot(self._contact.force, self._state())

    def _stay_in_contact(self, h: mpf) -> mpf:
        """Move on in contact for at most `h`; return the time that is left after separation."""
        contact, start = self._contact, self._state()
        if contact.sign_after(contact.ends_at_zero_of, start) < 0:  # k or b was changed, in law 2
            self._separated = True
            return h
        end = next(contact.crossings(contact.ends_at_zero_of, start, h), None)
        duration = h if end is None else end

        compression, _ = contact.maximum(_COMPRESSION, start, duration)
        self._max_compression = max(self._max_compression, compression)
        force, t = contact.maximum(contact.force, start, duration)
        if force > self._max_force:
            self._max_force, self._time_of_max_force = force, self._contact_time + t

        end_state = contact.at(duration, start)
        self._d, self._closing_speed, self._v_ball, self._x_ball, self._impulse = end_state
        self._contact_time += duration
        self._contact_displacement = self._x_ball - self._touch_position
        self._separated = end is not None
        return h - duration

    def _fly(self, h: mpf) -> None:
        self._d += self._closing_speed * h
        self._x_ball += self._v_ball * h


@dataclass(frozen=True)
class Scales:
    """What an error of each output is measured by, and how large it may be (dimensionless)."""

    mass: mpf  # kg, of both bodies
    u_club: mpf  # m/s, at first touch
    u_ball: mpf  # m/s
    contact_time: mpf  # s, T
    approach_time: mpf  # s, A: from the start to first touch
    start_time: mpf  # s
    force: mpf  # N, the largest; likewise:
    compression: mpf  # m
    impulse: mpf  # N.s
    energy: mpf  # J, at first touch

    def of(self, name: str) -> mpf:
        """The scale of an output, in its unit.

        Momentum gets what an error of the velocities comes to, kinetic energy that of its fraction.
        """
        speed = abs(self.u_club) + abs(self.u_ball)
        if name in ("club_velocity", "ball_velocity"):
            return speed
        if name == "smash_factor":  # as a velocity
            return speed / abs(self.u_club) if self.u_club else mpf(0)
        if name == "coefficient_of_restitution":  # as a velocity
            return speed / abs(self.u_club - self.u_ball)
        if name in ("force", "mean_force", "max_force"):
            return self.force
        if name in ("compression", "max_compression"):
            return self.compression
        if name == "impulse":
            return self.impulse
        if name in ("club_position", "ball_position", "contact_displacement"):
            return speed * self.contact_time
        if name in ("contact_time", "time_of_max_force", "touch_time"):
            return self.contact_time
        if name == "energy_efficiency":
            return mpf(1)
        if name == "kinetic_energy":
            return self.energy
        if name == "momentum":
            return self.mass * speed
        raise KeyError(name)

    def error(self, name: str, value: float | bool, exact: mpf | bool) -> float:
        """How far `value` is from `exact`, in units of the scale; infinite if that is zero."""
        if value == exact:
            return 0.0
        if isinstance(exact, bool):
            return float("inf")
        difference, scale = abs(mpf(value) - exact), self.of(name)
        return float(difference / scale) if scale else float("inf")

    def allowed(self, name: str, bar: float = 1e-13) -> float:
        """The largest error to accept: `bar`, plus the rounding of the time of touch over T."""
        before = self.approach_time
        if name == "touch_time":  # a double: it can't be finer than the host's time
            before = before + abs(self.start_time)
        return float(bar + mpf("4e-16") * before / self.contact_time) if before else bar
