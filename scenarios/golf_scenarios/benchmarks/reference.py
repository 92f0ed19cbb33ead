"""The right answer to 30 digits, by mpmath and by nothing that the peers or the product use.

In contact the equations of motion are linear with constant coefficients. Law 2's compression and
force combine one pair of exponentials; their zeros are closed forms. Law 1 adds a real one,
exp(-r t), so its zeros are searched, and the search can't miss any: between neighbouring zeros of
f' + r f, which holds only the pair, f has at most one zero (Rolle, for exp(r t) f).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import mpmath

from golf_scenarios.peers.problem import Case, Outcome

_mp: Any = mpmath.mp.clone()  # a context of its own: nobody else's precision changes
_mp.dps = 100  # 30 are promised; the rest is for cancellation and for the squarings in expm
Real = Any  # an mpmath number: the package has no types


class _Pair:
    """f(t) with f'' = 2 sigma f' - q f, from f(0) and f'(0)."""

    def __init__(self, sigma: Real, q: Real, f: Real, slope: Real) -> None:
        self.sigma = sigma
        self.square = q - sigma * sigma  # of the angular frequency w; negative if overdamped
        self.w = _mp.sqrt(abs(self.square))
        self.f = f
        self.s = slope - sigma * f  # f = exp(sigma t) (f cos(w t) + s sin(w t)/w)

    def __call__(self, t: Real) -> Real:
        f, s, w = self.f, self.s, self.w
        if self.square > 0:
            shape = f * _mp.cos(w * t) + s * _mp.sin(w * t) / w
        elif self.square < 0:
            shape = f * _mp.cosh(w * t) + s * _mp.sinh(w * t) / w
        else:
            shape = f + s * t
        return _mp.exp(self.sigma * t) * shape

    def zeros(self) -> Iterator[Real]:
        """All t > 0 with f(t) = 0, in order; without end if the pair oscillates."""
        f, s, w = self.f, self.s, self.w
        if self.square > 0:
            angle = _mp.pi if f == 0 else _mp.atan2(-f * w, s) % _mp.pi
            while True:
                yield angle / w
                angle += _mp.pi
        elif f * s < 0 and abs(f) * w < abs(s):
            yield _mp.atanh(-f * w / s) / w if w else -f / s


class _AbsoluteContact:
    """Law 1. A quantity is a row (a, b, c), which means a d + b v_club + c v_ball."""

    def __init__(self, case: Case) -> None:
        m_club, m_ball, k, b = map(_mp.mpf, (case.m_club, case.m_ball, case.k, case.b))
        drags = b / m_club, b / m_ball
        self.start = _mp.matrix([0, case.club_speed, case.ball_speed])
        self.matrix = _mp.matrix(
            [[0, 1, -1], [-k / m_club, -drags[0], 0], [k / m_ball, 0, -drags[1]]]
        )

        def characteristic(s: Real) -> Real:
            club, ball = s + drags[0], s + drags[1]
            return s * club * ball + k / m_club * ball + k / m_ball * club

        # -r is its real zero: between the two drags, where its signs differ.
        low, high = sorted(drags)
        sign = _mp.sign(characteristic(-low))
        while high - low > 2 * _mp.eps * high:
            middle = (low + high) / 2
            if characteristic(-middle) * sign > 0:
                low = middle
            else:
                high = middle
        self.r = high
        self.sigma = (high - drags[0] - drags[1]) / 2
        self.q = drags[0] * drags[1] + k / m_club + k / m_ball + 2 * self.sigma * high

    def state(self, t: Real) -> Sequence[Real]:
        return list(_mp.expm(self.matrix * t) * self.start)

    def zeros(self, quantity: Sequence[Real]) -> Iterator[Real]:
        """All t > 0 at which the quantity is 0, in order."""
        row = _mp.matrix([list(quantity)])
        slope = row * self.matrix
        f0, f1, f2 = ((x * self.start)[0] for x in (row, slope, slope * self.matrix))

        def f(t: Real) -> Real:
            return _mp.fdot(row, self.state(t))

        def root(low: Real, high: Real) -> Real:
            """By Newton's method, kept in a bracket; `sign` is f's between low and the root."""
            t = (low + high) / 2
            while high - low > 2 * _mp.eps * high:
                state = self.state(t)
                value = _mp.fdot(row, state)
                if value * sign > 0:
                    low = t
                else:
                    high = t
                step = value / _mp.fdot(slope, state)
                if abs(step) < _mp.mpf(10) ** -40 * t:
                    return t - step
                t = t - step if low < t - step < high else (low + high) / 2
            return t

        low, sign = _mp.mpf(0), _mp.sign(f0) or _mp.sign(f1)
        for high in self._separators(f0, f1, f2):
            if f(high) * sign < 0:
                yield root(low, high)
                sign = -sign
            low = high
        # With three real exponentials one zero can follow: the slowest one has the last word.
        w = _mp.sqrt(max(_mp.mpf(0), self.sigma**2 - self.q))
        fast, middle, _ = sorted((-self.r, self.sigma - w, self.sigma + w))
        if w and sign * (f2 - (fast + middle) * f1 + fast * middle * f0) < 0:
            high = 2 * low + 1 / self.r
            while f(high) * sign > 0:
                high *= 2
            yield root(low, high)

    def _separators(self, f0: Real, f1: Real, f2: Real) -> Iterator[Real]:
        """Times between which f is 0 once at most, as long as zeros are to come."""
        r, sigma, q = self.r, self.sigma, self.q
        pair = _Pair(sigma, q, f1 + r * f0, f2 + r * f1)
        # f = c exp(-r t) + a pair: if that oscillates, there is an end when it has become smaller.
        c = (f2 - 2 * sigma * f1 + q * f0) / (r * r + 2 * sigma * r + q)
        rest = _Pair(sigma, q, f0 - c, f1 + r * c)
        for t in pair.zeros():
            yield t
            if pair.square > 0 and sigma < -r:
                amplitude = _mp.hypot(rest.f, rest.s / pair.w)
                if amplitude * _mp.exp((sigma + r) * t) < abs(c):
                    return


def _absolute(case: Case) -> Outcome:
    contact = _AbsoluteContact(case)
    end = next(contact.zeros((1, 0, 0)), _mp.inf)
    largest = _mp.mpf(0)
    for t in contact.zeros((0, 1, -1)):
        if t > end:
            break
        largest = max(largest, contact.state(t)[0])
    _, v_club, v_ball = contact.state(end) if end < _mp.inf else (0, _mp.mpf(0), _mp.mpf(0))
    return Outcome(v_club, v_ball, end, _mp.mpf(case.k) * largest)


def _relative(case: Case) -> Outcome:
    m_club, m_ball, k, b = map(_mp.mpf, (case.m_club, case.m_ball, case.k, case.b))
    u_club, u_ball = _mp.mpf(case.club_speed), _mp.mpf(case.ball_speed)
    mass = m_club + m_ball
    mu = m_club * m_ball / mass
    speed = u_club - u_ball
    sigma, q = -b / (2 * mu), k / mu
    start = b * speed, (k - b * b / mu) * speed  # force and its slope
    force = _Pair(sigma, q, start[0], start[1])
    rise = _Pair(sigma, q, start[1], 2 * sigma * start[1] - q * start[0])
    end = next(force.zeros())
    peak = force(next(rise.zeros())) if start[1] > 0 else start[0]
    closing = _Pair(sigma, q, speed, 2 * sigma * speed)(end)
    together = (m_club * u_club + m_ball * u_ball) / mass
    return Outcome(
        together + m_ball / mass * closing, together - m_club / mass * closing, end, peak
    )


def solve(case: Case) -> Outcome:
    """The outcome as mpmath numbers.

    Law 1 with much damping may never separate: then contact_time is inf and the velocities are
    their limits, 0.

    Raises:
        ValueError: the bodies don't approach each other.
    """
    if not case.club_speed > case.ball_speed:
        raise ValueError(f"no impact: {case.club_speed=} must be above {case.ball_speed=}")
    return _absolute(case) if case.law == 1 else _relative(case)
