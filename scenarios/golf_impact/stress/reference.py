"""Every output at any instant to 30 digits, for inputs that change when they like.

The one reference of stress, benchmark and tests.

In contact all quantities are sums of two (law 2) or three (law 1) exponentials whose rates are the
roots of the characteristic polynomial. With 80 digits the coefficients simply follow from a value
and its derivatives: what cancels, cancels far below the digits that are wanted. Law 2's events are
zeros of one pair of exponentials, which are closed forms. Law 1's are searched between the zeros of
f' - s f, s being the real root: there exp(-s t) f is monotone, so f has one zero at most (Rolle).
SI units throughout. None of this is shared with the FMU.
"""

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from copy import copy
from itertools import islice, pairwise, takewhile
from typing import Any

import mpmath

from golf_impact.peers.problem import Case, Outcome
from golf_impact.stress.cases import ImpactCase, Steps

_mp: Any = mpmath.mp.clone()  # a context of its own: nobody else's precision changes
_mp.dps = 80
Real = Any  # an mpmath number: the package has no types
_ZERO = _mp.mpf(0)

_LASTING = (
    "contact_time", "max_force", "time_of_max_force", "max_compression", "contact_displacement",
    "impulse",
)  # fmt: skip

#: Roots nearer than this (relative) are moved apart by as much: that changes 30 digits later.
_APART = _mp.mpf(10) ** -32


class _Sum:
    """f(t) = Σ c exp(s t), from its value and derivatives at 0 (as many as there are rates s)."""

    def __init__(
        self, rates: list[Any], initial: Sequence[Real], c: list[Any] | None = None
    ) -> None:
        self.rates, self.initial = rates, initial
        self.c = _coefficients(rates, initial) if c is None else c

    def _total(self, part: Callable[[Any], Any]) -> Real:
        return _mp.re(sum(c * part(s) for c, s in zip(self.c, self.rates)))

    def __call__(self, t: Real) -> Real:
        return self._total(lambda s: _mp.exp(s * t))

    def integral(self, t: Real) -> Real:
        return self._total(lambda s: _mp.expm1(s * t) / s if s else t)

    def slope(self) -> "_Sum":
        highest = self._total(lambda s: s ** len(self.rates))
        c = [c * s for c, s in zip(self.c, self.rates)]
        return _Sum(self.rates, [*self.initial[1:], highest], c)

    def sign(self) -> int:
        """Its sign just after 0."""
        return -1 if next((value for value in self.initial if value), 1) < 0 else 1

    def largest(self, t: Real) -> tuple[Real, Real]:
        """The largest value on [0, t] and when that is; the first one if there are two."""
        # Later maxima of a motion that has settled are lower than the first few.
        turns = takewhile(lambda zero: zero < t, islice(self.slope().zeros(), 60))
        values = [(self.initial[0], _ZERO), *((self(turn), turn) for turn in turns), (self(t), t)]
        return max(values, key=lambda pair: pair[0])

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
        left, sign, settled = _ZERO, self.sign(), self._settled()
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
        _, slowest = max(zip(self.rates, self.c), key=lambda pair: _mp.re(pair[0]))
        if sign * _mp.re(slowest) < 0:
            right = 2 * left + 1 / max(map(abs, self.rates))
            while sign * self(right) > 0:
                right *= 2
            yield self._root(left, right, sign)

    def _settled(self) -> Real:
        """When the real exponential has become larger than the oscillating pair, for good."""
        first, _, real = self.rates
        slower_by = real - _mp.re(first)
        amplitude, rest = 2 * abs(self.c[0]), abs(_mp.re(self.c[2]))
        if not _mp.im(first) or slower_by <= 0 or rest == 0:
            return _mp.inf
        return max(_ZERO, _mp.log(amplitude / rest) / slower_by)

    def _root(self, low: Real, high: Real, sign: int) -> Real:
        """The zero in (low, high], by Newton's method kept in a bracket; `sign` holds before it."""
        slope = self.slope()
        t = (low + high) / 2
        while high - low > _mp.mpf(10) ** -60 * high:
            value, derivative = self(t), slope(t)
            low, high = (t, high) if sign * value > 0 else (low, t)
            newton = t - value / derivative if derivative else low
            if abs(newton - t) <= _mp.mpf(10) ** -45 * t:
                return newton
            if not low < newton < high:
                newton = _mp.sqrt(low * high) if high > 8 * low > 0 else (low + high) / 2
            t = newton
        return t


def _coefficients(rates: list[Any], initial: Sequence[Real]) -> list[Any]:
    """The c of Σ c exp(s t): D - r leaves nothing of exp(r t), and of exp(s t) the s - r fold."""
    coefficients = []
    for n, s in enumerate(rates):
        left, scale = initial, _mp.mpf(1)
        for r in rates[:n] + rates[n + 1 :]:
            left = [derived - r * value for value, derived in pairwise(left)]
            scale *= s - r
        coefficients.append(left[0] / scale)
    return coefficients


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


def _roots_of_law1(m_club: Real, m_ball: Real, k: Real, b: Real) -> list[Any]:
    """Those of s³ + c2 s² + c1 s + c0: a pair, then a real one."""
    c2 = b / m_club + b / m_ball
    c1 = b * b / (m_club * m_ball) + k / m_club + k / m_ball
    c0 = 2 * k * b / (m_club * m_ball)

    def value(r: Real) -> Real:
        return ((c2 - r) * r - c1) * r + c0

    # Between the two drags the polynomial changes sign.
    low, r = sorted((b / m_club, b / m_ball))
    sign = value(low)
    for _ in range(300):
        middle = _mp.sqrt(low * r)
        low, r = (middle, r) if value(middle) * sign > 0 else (low, middle)
    pair = _pair_of_roots((r - c2) / 2, c0 / r)
    if any(abs(root + r) < _APART * r for root in pair):
        r *= 1 + 2 * _APART
    return [*pair, -r]


class _Contact:
    """The motion from one state on, under constant k (N/m) and b (N.s/m)."""

    def __init__(
        self, law: int, m_club: Real, m_ball: Real, k: Real, b: Real, state: Mapping[str, Real]
    ) -> None:
        d, w, v, self.x_ball = (state[name] for name in ("d", "w", "v_ball", "x_ball"))
        mu = m_club * m_ball / (m_club + m_ball)
        drag, damper = (b, _ZERO) if law == 1 else (_ZERO, b)
        w1 = -(k * d + damper * w) / mu - drag * (v + w) / m_club + drag * v / m_ball
        # Without a drag the last of these counts for nothing, and with one there is no damper.
        motion, force = [d, w, w1], [k * d + damper * w, k * w + damper * w1, k * w1]
        v1 = (force[0] - drag * v) / m_ball
        rates = _pair_of_roots(-damper / (2 * mu), k / mu)
        of_ball = [*rates, _ZERO]
        if drag:
            of_ball = rates = _roots_of_law1(m_club, m_ball, k, b)
        self.d = _Sum(rates, motion[: len(rates)])
        self.w = self.d.slope()
        self.force = _Sum(rates, force[: len(rates)])
        self.v_ball = _Sum(of_ball, [v, v1, (force[1] - drag * v1) / m_ball])
        ending = self.d if law == 1 else self.force
        #: s until contact ends: 0 if it has, inf if it never will.
        self.duration = _ZERO if ending.sign() < 0 else next(ending.zeros(), _mp.inf)

    def at(self, t: Real) -> dict[str, Real]:
        x_ball = self.x_ball + self.v_ball.integral(t)
        return {"d": self.d(t), "w": self.w(t), "v_ball": self.v_ball(t), "x_ball": x_ball}


class Reference:
    """One impact as a host steps it: `step` and `outputs` are those of the FMU.

    The ball starts at 0 and the club face at -gap. Arguments are doubles, taken as exact.
    """

    def __init__(self, values: Mapping[str, float]) -> None:
        exact = {name: _mp.mpf(value) for name, value in values.items()}
        self.law = int(values["law"])
        self.m_club, self.m_ball = exact["m_club"], exact["m_ball"]
        self.k, self.b, self.club_speed = exact["k"], exact["b"], exact["club_speed"]
        self.u_ball, self.u_club = exact["ball_speed"], None
        self.start_time, self.clock = exact.get("start_time", _ZERO), _ZERO
        self.touch_clock: Real = None
        self.contact: _Contact | None = None
        self.since = self.impulse_before = _ZERO  # contact time and impulse as this phase began
        self.parted = False
        self.state = {"d": -exact["gap"], "w": self.club_speed - self.u_ball}
        self.state |= {"v_ball": self.u_ball, "x_ball": _ZERO}
        self.mean_force = self.touch_position = _ZERO
        #: Outputs that stay what they are when contact is over.
        self.lasting = dict.fromkeys(_LASTING, _ZERO)

    def step(
        self, size: Real, k: Real = None, b: Real = None, club_speed: Real = None, times: int = 1
    ) -> None:
        """Move on by `size` s, with k (N/m), b (N.s/m), club_speed (m/s) set just before, if given.

        `mean_force` is then that of this step, N. The club speed counts until first touch. Of many
        equal steps (`times`) only the sum, which is exact, matters.
        """
        if club_speed is not None and self.touch_clock is None:
            self.club_speed = _mp.mpf(club_speed)
            self.state["w"] = self.club_speed - self.u_ball
        new = (self.k if k is None else _mp.mpf(k), self.b if b is None else _mp.mpf(b))
        if new != (self.k, self.b):
            self.k, self.b = new
            if self.contact is not None and not self.parted:
                self._begin_phase()
        whole, impulse = times * _mp.mpf(size), self.lasting["impulse"]
        self.clock += whole
        left, d, w = whole, self.state["d"], self.state["w"]
        if self.touch_clock is None and w * left > -d:
            self._fly(-d / w)
            self.state["d"] = _ZERO
            left += d / w
            self._touch(self.clock - left)
        if self.contact is not None and not self.parted:
            left -= self._in_contact(self.contact, left)
        if left:
            self._fly(left)
        self.mean_force = (self.lasting["impulse"] - impulse) / whole

    def _fly(self, t: Real) -> None:
        d, x_ball = (self.state[name] for name in ("d", "x_ball"))
        moved = {"d": d + self.state["w"] * t, "x_ball": x_ball + self.state["v_ball"] * t}
        self.state = self.state | moved

    def _touch(self, clock: Real) -> None:
        self.touch_clock, self.u_club = clock, self.club_speed
        self.touch_position = self.state["x_ball"]
        self._begin_phase()

    def _begin_phase(self) -> None:
        self.since, self.impulse_before = self.lasting["contact_time"], self.lasting["impulse"]
        self.contact = _Contact(self.law, self.m_club, self.m_ball, self.k, self.b, self.state)
        self._note_force(self.contact.force.initial[0], self.since)
        self.parted = self.contact.duration <= 0

    def _note_force(self, force: Real, when: Real) -> None:
        if force > self.lasting["max_force"]:
            self.lasting |= {"max_force": force, "time_of_max_force": when}

    def _in_contact(self, contact: _Contact, left: Real) -> Real:
        """At most `left` s on in this phase; how long it was."""
        begun = self.lasting["contact_time"] - self.since
        t = min(begun + left, contact.duration)
        self.state = contact.at(t)
        force, when = contact.force.largest(t)
        self._note_force(force, self.since + when)
        self.lasting |= {
            "contact_time": self.since + t,
            "max_compression": max(self.lasting["max_compression"], contact.d.largest(t)[0]),
            "contact_displacement": self.state["x_ball"] - self.touch_position,
            "impulse": self.impulse_before + contact.force.integral(t),
        }
        self.parted = t >= contact.duration
        return t - begun

    def outputs(self) -> dict[str, Real]:
        """Every output by name; flags as bool. At touch, the limit from the right."""
        state, touched = self.state, self.touch_clock is not None
        if not touched and state["d"] == 0 and state["w"] > 0:
            later = copy(self)
            later.lasting = dict(self.lasting)
            later._touch(self.clock)
            return later.outputs()
        v_ball, v_club = state["v_ball"], state["v_ball"] + state["w"]
        energy = self._energy(v_club, v_ball)
        force = smash_factor = restitution = _ZERO
        efficiency = _mp.mpf(1)
        if self.contact is not None:
            if not self.parted:
                force = self.contact.force(self.lasting["contact_time"] - self.since)
            smash_factor = v_ball / self.u_club if self.u_club else _ZERO
            restitution = -state["w"] / (self.u_club - self.u_ball)
            efficiency = energy / self._energy(self.u_club, self.u_ball)
        return {
            "force": force,
            "club_position": state["x_ball"] + state["d"],
            "ball_position": state["x_ball"],
            "club_velocity": v_club,
            "ball_velocity": v_ball,
            "compression": max(_ZERO, state["d"]),
            "touched": touched,
            "in_contact": touched and not self.parted,
            "separated": self.parted,
            "touch_time": self.start_time + (self.touch_clock or 0),
            "smash_factor": smash_factor,
            "coefficient_of_restitution": restitution,
            "energy_efficiency": efficiency,
            **self.lasting,
            "momentum": self.m_club * v_club + self.m_ball * v_ball,
            "kinetic_energy": energy,
        }

    def _energy(self, v_club: Real, v_ball: Real) -> Real:
        return (self.m_club * v_club**2 + self.m_ball * v_ball**2) / 2


def outputs_after(
    impact: ImpactCase, steps: Steps, chosen: Container[int], stretched: float = 1.0
) -> dict[int, dict[str, Real]]:
    """Every output after the chosen ones of all steps, by their number from 0 on.

    Steps (s) of a segment are multiples of one unit, so that their sums are exact; `stretched` is a
    factor of all times.
    """
    exact = Reference({**impact.values, "start_time": impact.start_time})
    told: dict[int, dict[str, Real]] = {}
    number = 0
    for place, (segment, sizes) in enumerate(zip(impact.segments, steps)):
        inputs = (segment.k, segment.b) if place else ()
        pending = 0.0
        for index, size in enumerate(sizes, 1):
            pending += size
            if number in chosen or index == len(sizes):
                exact.step(pending * stretched, *inputs)
                pending, inputs = 0.0, ()
            if number in chosen:
                told[number] = exact.outputs()
            number += 1
    return told


def exact_outcome(case: Case) -> Outcome:
    """Of a peer's case, as mpmath numbers; its bodies part within its time limit."""
    reference = Reference({**vars(case), "gap": 0.0})
    reference.step(case.time_limit)
    outputs = reference.outputs()
    return Outcome(*(outputs[name] for name in Outcome._fields))
