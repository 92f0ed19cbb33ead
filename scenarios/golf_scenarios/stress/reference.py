"""Every output at any instant to 30 digits, for inputs that change when they like.

The one reference of stress, benchmark and tests.

In contact all quantities are sums of two (law 2) or three (law 1) exponentials whose rates are the
roots of the characteristic polynomial. With 80 digits the coefficients simply follow from a value
and its derivatives: what cancels, cancels far below the digits that are wanted. Law 2's events are
zeros of one pair of exponentials, which are closed forms. Law 1's are searched between the zeros of
f' - s f, s being the real root: there exp(-s t) f is monotone, so f has one zero at most (Rolle).
SI units throughout. None of this is shared with the FMU.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from itertools import islice
from typing import Any

import mpmath

from golf_scenarios.peers.problem import Case, Outcome

_mp: Any = mpmath.mp.clone()  # a context of its own: nobody else's precision changes
_mp.dps = 80
Real = Any  # an mpmath number: the package has no types

#: Roots nearer than this (relative) are moved apart by as much: that changes 30 digits later.
_APART = _mp.mpf(10) ** -32


class _Sum:
    """f(t) = Σ c exp(s t), from its values and derivatives at 0 (one for each rate s)."""

    def __init__(self, rates: Sequence[Any], initial: Sequence[Real]) -> None:
        self.rates = list(rates)
        self.initial = list(initial)
        self.c = _coefficients(self.rates, self.initial)

    def __call__(self, t: Real) -> Real:
        return _mp.re(sum(c * _mp.exp(s * t) for c, s in zip(self.c, self.rates)))

    def integral(self, t: Real) -> Real:
        return _mp.re(sum(c * _mp.expm1(s * t) / s for c, s in zip(self.c, self.rates)))

    def double_integral(self, t: Real) -> Real:
        parts = ((_mp.expm1(s * t) / s - t) / s for s in self.rates)
        return _mp.re(sum(c * part for c, part in zip(self.c, parts)))

    def slope(self) -> _Sum:
        derived = _Sum.__new__(_Sum)
        derived.rates = self.rates
        derived.c = [c * s for c, s in zip(self.c, self.rates)]
        power = [c * s ** len(self.rates) for c, s in zip(self.c, self.rates)]
        derived.initial = [*self.initial[1:], _mp.re(sum(power))]
        return derived

    def sign(self) -> int:
        """Its sign just after 0."""
        for value in self.initial:
            if value != 0:
                return 1 if value > 0 else -1
        return 1

    def zeros(self) -> Iterator[Real]:
        """All t > 0 at which it changes sign, in order."""
        yield from self._pair_zeros() if len(self.rates) == 2 else self._searched_zeros()

    def _pair_zeros(self) -> Iterator[Real]:
        f, g = self.initial
        first, second = self.rates
        if _mp.im(first):
            w, sigma = abs(_mp.im(first)), _mp.re(first)
            angle = _mp.pi if f == 0 else _mp.atan2(-f * w, g - sigma * f) % _mp.pi
            while True:
                yield angle / w
                angle += _mp.pi
        a, b = map(_mp.re, self.c)
        if f != 0 and a * b < 0:
            t = _mp.log(-b / a) / _mp.re(first - second)
            if t > 0:
                yield t

    def _searched_zeros(self) -> Iterator[Real]:
        real = self.rates[2]
        f0, f1, f2 = self.initial
        pair = _Sum(self.rates[:2], [f1 - real * f0, f2 - real * f1])
        left, sign = _mp.mpf(0), self.sign()
        settled = self._settled()
        for cut in pair.zeros():
            if sign * self(cut) < 0:
                yield self._root(left, cut, sign)
                sign = -sign
            left = cut
            if cut > settled:
                break
        if _mp.im(self.rates[0]) and settled == _mp.inf:
            return
        # One more can follow the last turning point; the slowest exponential decides whether.
        slowest = max(zip(self.rates, self.c), key=lambda pair: _mp.re(pair[0]))
        if sign * _mp.re(slowest[1]) < 0:
            right = 2 * left + 1 / max(abs(rate) for rate in self.rates)
            while sign * self(right) > 0:
                right *= 2
            yield self._root(left, right, sign)

    def _settled(self) -> Real:
        """When the real exponential has become larger than the oscillating pair, for good."""
        first, _, real = self.rates
        if not _mp.im(first):
            return _mp.inf
        slower_by = real - _mp.re(first)
        amplitude, rest = 2 * abs(self.c[0]), abs(_mp.re(self.c[2]))
        if slower_by <= 0 or rest == 0:
            return _mp.inf
        return max(_mp.mpf(0), _mp.log(amplitude / rest) / slower_by)

    def _root(self, low: Real, high: Real, sign: int) -> Real:
        """The zero in (low, high], by Newton's method kept in a bracket; `sign` holds before it."""
        slope = self.slope()
        t = (low + high) / 2
        for _ in range(2000):
            value = self(t)
            if sign * value > 0:
                low = t
            else:
                high = t
            if high - low <= _mp.mpf(10) ** -60 * high:
                break
            derivative = slope(t)
            newton = t - value / derivative if derivative else low
            if abs(newton - t) <= _mp.mpf(10) ** -45 * t:
                return newton
            if not low < newton < high:
                newton = _mp.sqrt(low * high) if high > 8 * low > 0 else (low + high) / 2
            t = newton
        return t


def _coefficients(rates: Sequence[Any], initial: Sequence[Real]) -> list[Any]:
    """The c of Σ c exp(s t) with these derivatives at 0: Lagrange's polynomials, by hand."""
    if len(rates) == 2:
        s, r = rates
        f, g = initial
        return [(g - r * f) / (s - r), (g - s * f) / (r - s)]
    f, g, h = initial
    s, p, q = rates
    turns = ((s, p, q), (p, q, s), (q, s, p))
    return [(h - (p + q) * g + p * q * f) / ((s - p) * (s - q)) for s, p, q in turns]


def _pair_of_roots(sigma: Real, product: Real) -> list[Any]:
    """The roots of s² - 2 sigma s + product; the faster one first if they are real."""
    square = sigma * sigma - product
    if abs(square) < _APART * product:
        square = _APART * product
    if square < 0:
        w = _mp.sqrt(-square)
        return [_mp.mpc(sigma, w), _mp.mpc(sigma, -w)]
    fast = sigma - _mp.sqrt(square)
    return [fast, product / fast]


class _Contact:
    """The motion from one state on, under constant k (N/m) and b (N.s/m)."""

    def __init__(
        self, law: int, m_club: Real, m_ball: Real, k: Real, b: Real, state: Mapping[str, Real]
    ) -> None:
        d, w, v, self.x_ball = (state[name] for name in ("d", "w", "v_ball", "x_ball"))
        self.v_ball_start, self.m_ball = v, m_ball
        mu = m_club * m_ball / (m_club + m_ball)
        self.drags = law == 1 and b != 0
        if self.drags:
            u = v + w
            w1 = -k / mu * d - b * u / m_club + b * v / m_ball
            v1 = (k * d - b * v) / m_ball
            rates = _roots_of_law1(m_club, m_ball, k, b)
            self.d = _Sum(rates, [d, w, w1])
            self.v_ball = _Sum(rates, [v, v1, (k * w - b * v1) / m_ball])
            self.force = _Sum(rates, [k * d, k * w, k * w1])
            ending = self.d
        else:
            if law == 1:
                b = _mp.mpf(0)
            rates = _pair_of_roots(-b / (2 * mu), k / mu)
            w1 = -(k * d + b * w) / mu
            self.d = _Sum(rates, [d, w])
            self.force = _Sum(rates, [k * d + b * w, k * w + b * w1])
            ending = self.d if law == 1 else self.force
        self.w = self.d.slope()
        #: s until contact ends: 0 if it has, inf if it never will.
        self.duration = _mp.mpf(0) if ending.sign() < 0 else next(ending.zeros(), _mp.inf)

    def at(self, t: Real) -> dict[str, Real]:
        impulse = self.force.integral(t)
        if self.drags:
            v_ball, moved = self.v_ball(t), self.v_ball.integral(t)
        else:
            v_ball = self.v_ball_start + impulse / self.m_ball
            moved = self.v_ball_start * t + self.force.double_integral(t) / self.m_ball
        return {
            "d": self.d(t),
            "w": self.w(t),
            "v_ball": v_ball,
            "x_ball": self.x_ball + moved,
            "impulse": impulse,
        }

    @staticmethod
    def largest(f: _Sum, t: Real) -> tuple[Real, Real]:
        """The largest f on [0, t] and when that is."""
        best, when = f.initial[0], _mp.mpf(0)
        # Later maxima of a motion that has settled are lower than the first few.
        for zero in islice(f.slope().zeros(), 60):
            if zero >= t:
                break
            value = f(zero)
            if value > best:
                best, when = value, zero
        end = f(t)
        return (end, t) if end > best else (best, when)


def _roots_of_law1(m_club: Real, m_ball: Real, k: Real, b: Real) -> list[Any]:
    """Those of s³ + c2 s² + c1 s + c0: a pair, then a real one."""
    c2 = b / m_club + b / m_ball
    c1 = b * b / (m_club * m_ball) + k / m_club + k / m_ball
    c0 = 2 * k * b / (m_club * m_ball)
    # Between the two drags the polynomial changes sign.
    low, high = sorted((b / m_club, b / m_ball))

    def value(r: Real) -> Real:
        return ((c2 - r) * r - c1) * r + c0

    sign = value(low)
    for _ in range(300):
        middle = _mp.sqrt(low * high)
        if value(middle) * sign > 0:
            low = middle
        else:
            high = middle
    r = high
    pair = _pair_of_roots((r - c2) / 2, c0 / r)
    if any(abs(root + r) < _APART * r for root in pair):
        r *= 1 + 2 * _APART
    return [*pair, -r]


class Reference:
    """One impact as a host steps it: `step` and `outputs` are those of the FMU.

    The ball starts at 0 and the club face at -gap. Arguments are doubles, taken as exact.
    """

    def __init__(self, values: Mapping[str, float]) -> None:
        exact = {name: _mp.mpf(value) for name, value in values.items()}
        self.law = int(values["law"])
        self.m_club, self.m_ball = exact["m_club"], exact["m_ball"]
        self.k, self.b, self.club_speed = exact["k"], exact["b"], exact["club_speed"]
        self.u_ball, gap = exact["ball_speed"], exact["gap"]
        self.start_time = exact.get("start_time", _mp.mpf(0))
        self.u_club: Real = None
        self.clock = _mp.mpf(0)
        self.touch_clock: Real = None
        self.contact: _Contact | None = None
        self.since = _mp.mpf(0)  # the present contact phase began, s since touch
        self.contact_time = _mp.mpf(0)
        self.parted = False
        zero = _mp.mpf(0)
        self.state = {"d": -gap, "v_ball": self.u_ball, "x_ball": zero}
        self.state |= {"w": self.club_speed - self.u_ball, "impulse": zero}
        self.impulse_before = self.impulse = self.touch_position = self.parted_at = zero
        self.max_force = self.time_of_max_force = self.max_compression = zero
        self.mean_force = zero

    def step(
        self,
        size: Real,
        k: float | None = None,
        b: float | None = None,
        club_speed: float | None = None,
    ) -> None:
        """Move on by `size` s, with k (N/m), b (N.s/m), club_speed (m/s) set just before, if given.

        `mean_force` is then that of this step, N. The club speed counts until first touch.
        """
        if club_speed is not None and self.touch_clock is None:
            self.club_speed = _mp.mpf(club_speed)
            self.state["w"] = self.club_speed - self.u_ball
        new = (self.k if k is None else _mp.mpf(k), self.b if b is None else _mp.mpf(b))
        if new != (self.k, self.b):
            self.k, self.b = new
            if self.contact is not None and not self.parted:
                self._begin_phase()
        left, impulse = _mp.mpf(size), self.impulse
        self.clock += left
        if self.touch_clock is None:
            left = self._approach(left)
        if self.contact is not None and not self.parted:
            left = self._in_contact(left)
        if left:
            self._fly(left)
        self.mean_force = (self.impulse - impulse) / _mp.mpf(size)

    def step_by(self, times: int, size: float) -> None:
        """Move on by that many equal steps at once: only their sum, which is exact, matters."""
        self.step(times * _mp.mpf(size))

    def _fly(self, t: Real) -> None:
        state = self.state
        self.state = {
            **state,
            "d": state["d"] + state["w"] * t,
            "x_ball": state["x_ball"] + state["v_ball"] * t,
        }

    def _approach(self, left: Real) -> Real:
        closing = self.club_speed - self.u_ball
        if closing * left <= -self.state["d"]:
            return left
        flight = -self.state["d"] / closing
        self._fly(flight)
        self.state["d"] = _mp.mpf(0)
        self._touch(self.clock - left + flight)
        return left - flight

    def _touch(self, clock: Real) -> None:
        self.touch_clock = clock
        self.u_club = self.club_speed
        self.touch_position = self.state["x_ball"]
        self._begin_phase()

    def _begin_phase(self) -> None:
        self.since = self.contact_time
        self.impulse_before = self.impulse
        self.contact = _Contact(self.law, self.m_club, self.m_ball, self.k, self.b, self.state)
        force = self.contact.force.initial[0]
        if force > self.max_force:
            self.max_force, self.time_of_max_force = force, self.since
        self._part_if_over(_mp.mpf(0))

    def _part_if_over(self, t: Real) -> None:
        assert self.contact is not None
        if t >= self.contact.duration:
            self.parted = True
            self.parted_at = self.state["x_ball"]

    def _in_contact(self, left: Real) -> Real:
        contact = self.contact
        assert contact is not None
        begun = self.contact_time - self.since
        t = min(begun + left, contact.duration)
        self.state = contact.at(t)
        self.impulse = self.impulse_before + self.state["impulse"]
        self.contact_time = self.since + t
        force, when = contact.largest(contact.force, t)
        if force > self.max_force:
            self.max_force, self.time_of_max_force = force, self.since + when
        compression, _ = contact.largest(contact.d, t)
        self.max_compression = max(self.max_compression, compression)
        self._part_if_over(t)
        return left - (t - begun)

    def outputs(self) -> dict[str, Real]:
        """Every output by name; flags as bool. At touch, the limit from the right."""
        if self.touch_clock is None and self.state["d"] == 0 and self.state["w"] > 0:
            later = copy(self)
            later._touch(self.clock)
            return later.outputs()
        state = self.state
        touched = self.touch_clock is not None
        in_contact = touched and not self.parted
        v_ball = state["v_ball"]
        v_club = v_ball + state["w"]
        force = _mp.mpf(0)
        if in_contact and self.contact is not None:
            force = self.contact.force(self.contact_time - self.since)
        moved = (self.parted_at if self.parted else state["x_ball"]) - self.touch_position
        energy = self._energy(v_club, v_ball)
        return {
            "force": force,
            "club_position": state["x_ball"] + state["d"],
            "ball_position": state["x_ball"],
            "club_velocity": v_club,
            "ball_velocity": v_ball,
            "compression": max(_mp.mpf(0), state["d"]),
            "touched": touched,
            "in_contact": in_contact,
            "separated": self.parted,
            "touch_time": self.start_time + (self.touch_clock or 0),
            "smash_factor": v_ball / self.u_club if touched and self.u_club else _mp.mpf(0),
            "coefficient_of_restitution": (
                -state["w"] / (self.u_club - self.u_ball) if touched else _mp.mpf(0)
            ),
            "energy_efficiency": (
                energy / self._energy(self.u_club, self.u_ball) if touched else _mp.mpf(1)
            ),
            "contact_time": self.contact_time,
            "max_force": self.max_force,
            "time_of_max_force": self.time_of_max_force,
            "max_compression": self.max_compression,
            "contact_displacement": moved if touched else _mp.mpf(0),
            "impulse": self.impulse,
            "momentum": self.m_club * v_club + self.m_ball * v_ball,
            "kinetic_energy": energy,
        }

    def _energy(self, v_club: Real, v_ball: Real) -> Real:
        return (self.m_club * v_club**2 + self.m_ball * v_ball**2) / 2


def exact_outcome(case: Case) -> Outcome:
    """Of a peer's case, as mpmath numbers; its bodies part within its time limit."""
    reference = Reference({**vars(case), "gap": 0.0})
    reference.step(case.time_limit)
    outputs = reference.outputs()
    return Outcome(*(outputs[name] for name in Outcome._fields))
