"""The right answer to 30 digits, by mpmath and by nothing that the peers or the product use.

In contact the equations of motion are linear with constant coefficients. Law 2's compression and
force are combinations of one pair of exponentials, whose zeros are closed forms. Law 1 adds a real
one, exp(-r t), so its zeros need a search, and the search must not miss any: between neighbouring
zeros of f' + r f, which holds only the pair, f has at most one zero (Rolle, for exp(r t) f).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import mpmath

from .problem import Case, Outcome

_mp = mpmath.mp.clone()
_mp.dps = 100  # 30 are promised; the rest is for cancellation and for the squarings in expm
Real = Any  # an mpmath number: the package has no types
Row = Sequence[Real]


class _Pair:
    """f(t) with f'' = 2 sigma f' - q f, from f(0) and f'(0)."""

    def __init__(self, sigma: Real, q: Real, f: Real, slope: Real) -> None:
        self.sigma = sigma
        self.square = q - sigma * sigma  # of the angular frequency; negative if overdamped
        self.f = f
        self.s = slope - sigma * f  # f = exp(sigma t) (f cos(w t) + s sin(w t)/w)

    def __call__(self, t: Real) -> Real:
        w = _mp.sqrt(abs(self.square))
        if self.square > 0:
            shape = self.f * _mp.cos(w * t) + self.s * _mp.sin(w * t) / w
        elif self.square < 0:
            shape = self.f * _mp.cosh(w * t) + self.s * _mp.sinh(w * t) / w
        else:
            shape = self.f + self.s * t
        return _mp.exp(self.sigma * t) * shape

    def zeros(self) -> Iterator[Real]:
        """All t > 0 with f(t) = 0, in order; without end if the pair oscillates."""
        f, s = self.f, self.s
        w = _mp.sqrt(abs(self.square))
        if self.square > 0:
            angle = _mp.mpf(0) if f == 0 else _mp.atan2(-f * w, s) % _mp.pi
            while True:
                if angle > 0:
                    yield angle / w
                angle += _mp.pi
        elif f * s < 0 and abs(f) * w < abs(s):
            yield _mp.atanh(-f * w / s) / w if w else -f / s


class _AbsoluteContact:
    """Law 1. A quantity is a row (a, b, c), meaning a d + b v_club + c v_ball."""

    def __init__(self, case: Case) -> None:
        m_club, m_ball, k, b = map(_mp.mpf, (case.m_club, case.m_ball, case.k, case.b))
        drags = b / m_club, b / m_ball
        self.start = [_mp.mpf(0), _mp.mpf(case.club_speed), _mp.mpf(case.ball_speed)]
        self.matrix = _mp.matrix(
            [[0, 1, -1], [-k / m_club, -drags[0], 0], [k / m_ball, 0, -drags[1]]]
        )

        def characteristic(s: Real) -> Real:
            club, ball = s + drags[0], s + drags[1]
            return s * club * ball + k / m_club * ball + k / m_ball * club

        # Its real root is between the two drags, where its signs differ.
        low, high = sorted(drags)
        while high - low > 4 * _mp.eps * high:
            middle = (low + high) / 2
            same = characteristic(-middle) * characteristic(-low) > 0
            low, high = (middle, high) if same else (low, middle)
        self.r = r = high
        self.sigma = -(sum(drags) - r) / 2
        self.q = drags[0] * drags[1] + k / m_club + k / m_ball + 2 * self.sigma * r

    def state(self, t: Real) -> Row:
        return list(_mp.expm(self.matrix * t) * _mp.matrix(self.start))

    def slope(self, row: Row) -> Row:
        return list(_mp.matrix([list(row)]) * self.matrix)

    def zeros(self, row: Row) -> Iterator[Real]:
        """All t > 0 at which the quantity is 0, in order."""

        def f(t: Real) -> Real:
            return _mp.fdot(row, self.state(t))

        slope = self.slope(row)
        f0, f1, f2 = (_mp.fdot(x, self.start) for x in (row, slope, self.slope(slope)))
        low, sign = _mp.mpf(0), _mp.sign(f0) or _mp.sign(f1)
        for high in self._separators(f0, f1, f2):
            if high == _mp.inf:
                high = 2 * low + 1 / abs(self.sigma)
                while f(high) * sign > 0:
                    high *= 2
            if f(high) * sign < 0:
                yield self._root(row, slope, low, high, sign)
                sign = -sign
            low = high

    def _separators(self, f0: Real, f1: Real, f2: Real) -> Iterator[Real]:
        """Times between which f has one zero at most; inf where one more is to come, for good."""
        r, sigma, q = self.r, self.sigma, self.q
        pair = _Pair(sigma, q, f1 + r * f0, f2 + r * f1)
        if pair.square > 0:
            # f = c exp(-r t) + an oscillation: no zeros once the former is larger for good.
            c = (f2 - 2 * sigma * f1 + q * f0) / (r * r + 2 * sigma * r + q)
            rest = _Pair(sigma, q, f0 - c, f1 + r * c)
            amplitude = _mp.sqrt(rest.f**2 + rest.s**2 / pair.square)
            for t in pair.zeros():
                yield t
                if amplitude * _mp.exp((sigma + r) * t) < abs(c) and sigma < -r:
                    return
        # Three real exponentials: the slowest one decides the sign in the end.
        last = list(pair.zeros())
        yield from last
        w = _mp.sqrt(-pair.square)
        fast, middle, slow = sorted((-r, sigma - w, sigma + w))
        final = _mp.sign(f2 - (fast + middle) * f1 + fast * middle * f0)
        t = last[-1] if last else _mp.mpf(0)
        # Just after t; at t = 0 the quantity itself may be 0.
        now = self._sign_after(t, f0, f1, f2)
        if final * now < 0:
            yield _mp.inf

    def _sign_after(self, t: Real, f0: Real, f1: Real, f2: Real) -> Real:
        raise NotImplementedError

    def _root(self, row: Row, slope: Row, low: Real, high: Real, sign: Real) -> Real:
        raise NotImplementedError
