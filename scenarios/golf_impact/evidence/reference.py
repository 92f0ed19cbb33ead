"""Every output at any instant to 30 digits, for inputs that change at any instant.

The one reference of stress, benchmark and tests.

In contact all quantities are sums of two (law 2) or three (law 1) exponentials whose rates are the
eigenvalues of the equations of motion. With 80 digits the coefficients follow from a value and its
derivatives: cancellation affects only digits far below those needed. The events are zeros of such
a sum f, searched between the zeros of f' - s f, s being a real rate: there exp(-s t) f is monotone,
so f has one zero at most (Rolle). That sum has one exponential less; what oscillates is in the end
one pair, whose zeros are a closed form.
SI units throughout. None of this is shared with the FMU.
"""

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import reduce
from itertools import count, islice, pairwise, takewhile
from operator import itemgetter
from typing import Any

import mpmath


@dataclass(frozen=True)
class Segment:
    """A communication step, or the time between two changes of its inputs, set before it."""

    length: float  #: s; rounded, so that its parts add up exactly
    k: float
    b: float
    club_force: float = 0.0


#: A way to step through an impact.
Steps = Sequence[Segment]

_mp: Any = mpmath.mp.clone()  # a context of its own: the precision of others is unchanged
_mp.dps = 80
Real = Any  # an mpmath number: the package has no types
_ZERO = _mp.mpf(0)

_LASTING = (
    "contact_time", "max_force", "time_of_max_force", "max_compression", "contact_displacement",
    "impulse",
)  # fmt: skip

#: A factor of b: two rates then never coincide, and results change in the 37th digit.
_APART = 1 + _mp.mpf(10) ** -36


class _Sum:
    """f(t) = Σ c exp(s t), from its value and derivatives at 0 (as many as there are rates s)."""

    def __init__(self, rates: list[Any], initial: list[Real]) -> None:
        self.rates, self.initial = rates, initial
        self.c = []
        for s in rates:
            # (D - r) leaves nothing of exp(r t), and of exp(s t) the s - r fold.
            others = [r for r in rates if r is not s]
            self.c.append(reduce(_less, others, initial)[0] / _mp.fprod(s - r for r in others))

    def _total(self, part: Callable[[Any], Any]) -> Real:
        return _mp.re(sum(c * part(s) for c, s in zip(self.c, self.rates)))

    def __call__(self, t: Real) -> Real:
        return self._total(lambda s: _mp.exp(s * t)) if t else self.initial[0]

    def integral(self, t: Real) -> Real:
        return self._total(lambda s: _mp.expm1(s * t) / s if s else t)

    def sign(self) -> int:
        """Its sign just after 0."""
        return -1 if next((value for value in self.initial if value), 1) < 0 else 1

    def largest(self, t: Real) -> tuple[Real, Real]:
        """The largest value on [0, t] and when that is; the first one if there are two."""
        slope = _Sum(self.rates, [*self.initial[1:], self._total(lambda s: s ** len(self.rates))])
        # Later maxima of a decaying oscillation are lower than the first few.
        extrema = takewhile(lambda zero: zero < t, islice(slope.zeros(), 60))
        return max(((self(time), time) for time in (_ZERO, *extrema, t)), key=itemgetter(0))

    def zeros(self) -> Iterator[Real]:
        """All t > 0 at which it changes sign, in order."""
        first, *others = self.rates
        if _mp.im(first):
            value, slope = self.initial
            sigma, w = _mp.re(first), abs(_mp.im(first))
            angle = _mp.pi if value == 0 else _mp.atan2(-value * w, slope - sigma * value) % _mp.pi
            yield from ((angle + n * _mp.pi) / w for n in count())
        cuts = _Sum(others, _less(self.initial, first)).zeros() if others else iter(())
        left, sign = _ZERO, self.sign()
        for cut in takewhile(self._open_at, cuts):
            if sign * self(cut) < 0:
                yield self._root(left, cut)
                sign = -sign
            left = cut
        # One more can follow the last cut; the slowest exponential decides whether.
        _, slowest = max(zip(self.rates, self.c), key=lambda pair: _mp.re(pair[0]))
        if sign * _mp.re(slowest) < 0:
            right = 2 * left + 1 / max(map(abs, self.rates))
            while sign * self(right) > 0:
                right *= 2
            yield self._root(left, right)

    def _open_at(self, t: Real) -> bool:
        """Whether others can still outweigh the slowest exponential, a real one, at t or later."""
        terms = zip(self.rates, self.c)
        (slowest, c), *others = sorted(terms, key=lambda pair: -_mp.re(pair[0]))
        if _mp.im(slowest) or not any(_mp.im(rate) for rate, _ in others):
            return True
        rest = sum(abs(c * _mp.exp(rate * t)) for rate, c in others)
        return bool(rest >= abs(c * _mp.exp(slowest * t)))

    def _root(self, left: Real, right: Real) -> Real:
        """The one zero in (left, right]."""
        scale, width = self(right) or 1, right - left
        while self(left + width) / scale > 0:
            width /= 2
        precision = _mp.mpf(10) ** -60 * right
        return _mp.findroot(
            lambda t: self(t) / scale,
            (left + width, left + 2 * width),
            solver="illinois",
            tol=precision,
            maxsteps=1000,
            verify=False,
        )


def _less(initial: list[Any], rate: Any) -> list[Any]:
    """Value and derivatives at 0 of f' - rate f, from those of f."""
    return [derived - rate * value for value, derived in pairwise(initial)]


class _Contact:
    """The motion from a state (d, v_club, v_ball, x_ball) on: x' = A x, with constant k and b.

    A force P on the club head is a further quantity, 1 at the start, that grows so slowly that
    results change in the 36th digit: then it has a rate of its own.
    """

    def __init__(
        self, law: int, m_club: Real, m_ball: Real, k: Real, b: Real, force: Real, state: list[Real]
    ) -> None:
        drag, damper = (b * _APART, _ZERO) if law == 1 else (_ZERO, b * _APART)
        omega = _mp.sqrt(k * (1 / m_club + 1 / m_ball))
        # The first quantity is ω d: a velocity, like the others.
        start = _mp.matrix([omega * state[0], *state[1:3], 1])
        contact = _mp.matrix([[k / omega, damper, -damper, 0]])
        matrix = _mp.matrix(4)
        matrix[0, 1], matrix[0, 2] = omega, -omega
        matrix[1, 1], matrix[1, 3] = -drag / m_club, force / m_club
        matrix[2, 2], matrix[3, 3] = -drag / m_ball, omega * (_APART - 1)
        matrix[1, :] -= contact / m_club
        matrix[2, :] += contact / m_ball
        if not force:
            start, contact, matrix = start[:3], contact[:, :3], matrix[:3, :3]
        rates = _mp.eig(matrix, left=False, right=False)
        rates = [s if abs(_mp.im(s)) > _mp.mpf(10) ** -40 * omega else _mp.re(s) for s in rates]
        if drag:
            rates = relative = sorted(rates, key=lambda s: abs(_mp.im(s)))
        else:
            # Momentum stays but for the force, and the compression is that of an oscillator.
            relative = sorted(rates, key=abs)[1:]
            rates = [_ZERO, *relative]

        def quantity(row: Any, rates: list[Any]) -> _Sum:
            x, initial = start, []
            for _ in rates:
                initial.append((row * x)[0])
                x = matrix * x
            return _Sum(rates, initial)

        rows = _mp.eye(len(start))
        self.d = quantity(rows[0, :] / omega, relative)
        self.force = quantity(contact, relative)
        self.v_club = quantity(rows[1, :], rates)
        self.v_ball = quantity(rows[2, :], rates)
        self.x_ball = state[3]
        #: s until contact ends: 0 if it has, inf if it never will.
        self.duration = _ZERO if self.force.sign() < 0 else next(self.force.zeros(), _mp.inf)

    def state(self, t: Real) -> list[Real]:
        return [self.d(t), self.v_club(t), self.v_ball(t), self.x_ball + self.v_ball.integral(t)]


class Reference:
    """One impact as a host steps it: `step` and `outputs` are those of the FMU.

    The ball starts at 0 and the club face at -gap. Arguments are doubles, taken as exact.
    """

    def __init__(self, values: Mapping[str, float]) -> None:
        exact = {name: _mp.mpf(value) for name, value in values.items()}
        self.law = int(values["law"])
        self.m_club, self.m_ball = exact["m_club"], exact["m_ball"]
        self.k, self.b, self.club_speed = exact["k"], exact["b"], exact["club_speed"]
        self.club_force = exact.get("club_force", _ZERO)
        self.u_ball, self.u_club = exact["ball_speed"], None
        self.start_time, self.clock = exact.get("start_time", _ZERO), _ZERO
        self.touch_clock: Real = None
        #: Velocities at separation, after it.
        self.parting: tuple[Real, ...] | None = None
        self.mean_force = _ZERO
        # The present phase, free motion or a contact with constant k and b, and its start:
        self.contact: _Contact | None = None
        self.begun = _ZERO
        self.state = [-exact["gap"], self.club_speed, self.u_ball, _ZERO]
        self.so_far = dict.fromkeys(_LASTING, _ZERO)

    @property
    def parted(self) -> bool:
        return self.parting is not None

    def step(
        self, size: Real, k: Real = None, b: Real = None, club_speed: Real = None,
        club_force: Real = None,
    ) -> None:  # fmt: skip
        """Move on by `size` s, with inputs (SI units) set just before, if given.

        `mean_force` is then that of this step, N. The club speed counts until first touch.
        """
        if club_speed is not None and self.touch_clock is None:
            self._begin_phase(self.clock)
            self.club_speed = self.state[1] = _mp.mpf(club_speed)
        before = self.k, self.b, self.club_force
        given = (k, b, club_force)
        inputs = [now if new is None else _mp.mpf(new) for new, now in zip(given, before)]
        if tuple(inputs) != before and self.contact is not None:
            self.k, self.b, self.club_force = inputs
            self._begin_phase(self.clock, in_contact=True)
        elif self.parted:
            self._begin_phase(self.clock)
        self.k, self.b, self.club_force = inputs
        impulse = self._impulse()
        self.clock += _mp.mpf(size)
        d, v_club, v_ball, _ = self.state
        if self.touch_clock is None and (v_club - v_ball) * (self.clock - self.begun) > -d:
            self._touch(self.begun - d / (v_club - v_ball))
        if self.contact is not None and self.clock - self.begun >= self.contact.duration:
            self._begin_phase(self.begun + self.contact.duration)
            self.parting = tuple(self.state[1:3])
        self.mean_force = (self._impulse() - impulse) / size

    def _touch(self, clock: Real) -> None:
        self._begin_phase(clock)
        self.state[0], self.u_club, self.touch_clock = _ZERO, self.club_speed, clock
        self._begin_phase(clock, in_contact=True)

    def _begin_phase(self, clock: Real, in_contact: bool = False) -> None:
        self.so_far, self.state = self._so_far(clock), self._state(clock)
        self.begun, self.contact = clock, None
        if in_contact:
            bodies = self.m_club, self.m_ball
            inputs = self.k, self.b, self.club_force
            self.contact = _Contact(self.law, *bodies, *inputs, self.state)

    def _state(self, clock: Real) -> list[Real]:
        t, (d, v_club, v_ball, x_ball) = clock - self.begun, self.state
        if self.contact is not None:
            return self.contact.state(t)
        gained = self.club_force / self.m_club * t if self.parted else _ZERO
        moved = (v_club - v_ball + gained / 2) * t
        return [d + moved, v_club + gained, v_ball, x_ball + v_ball * t]

    def _impulse(self) -> Real:
        t = self.clock - self.begun
        return self.so_far["impulse"] + (self.contact.force.integral(t) if self.contact else 0)

    def _so_far(self, clock: Real) -> dict[str, Real]:
        """The outputs that are constant after contact."""
        if self.contact is None:
            return self.so_far
        t, contact, now = clock - self.begun, self.contact, dict(self.so_far)
        force, when = contact.force.largest(t)
        if force > now["max_force"]:
            now |= {"max_force": force, "time_of_max_force": now["contact_time"] + when}
        now["max_compression"] = max(now["max_compression"], contact.d.largest(t)[0])
        now["contact_time"] += t
        now["contact_displacement"] += contact.v_ball.integral(t)
        now["impulse"] += contact.force.integral(t)
        return now

    def outputs(self) -> dict[str, Real]:
        """Every output but `mean_force` by name; flags as bool. At touch, the right limit."""
        d, v_club, v_ball, x_ball = self._state(self.clock)
        touched = self.touch_clock is not None
        if not touched and d == 0 and v_club > v_ball:
            later = copy(self)
            later._touch(self.clock)
            return later.outputs()
        energy = self._energy(v_club, v_ball)
        force = smash_factor = restitution = _ZERO
        efficiency = _mp.mpf(1)
        if touched:
            if self.contact is not None:
                force = self.contact.force(self.clock - self.begun)
            smash_factor = v_ball / self.u_club if self.u_club else _ZERO
            v_c, v_b = self.parting or (v_club, v_ball)
            restitution = (v_b - v_c) / (self.u_club - self.u_ball)
            efficiency = self._energy(v_c, v_b) / self._energy(self.u_club, self.u_ball)
        return {
            "force": force,
            "club_position": x_ball + d,
            "ball_position": x_ball,
            "club_velocity": v_club,
            "ball_velocity": v_ball,
            "compression": max(_ZERO, d) if v_club < v_ball or not self.parted else _ZERO,
            "touched": touched,
            "in_contact": touched and not self.parted,
            "separated": self.parted,
            "touch_time": self.start_time + (self.touch_clock or 0),
            "smash_factor": smash_factor,
            "coefficient_of_restitution": restitution,
            "energy_efficiency": efficiency,
            **self._so_far(self.clock),
            "momentum": self.m_club * v_club + self.m_ball * v_ball,
            "kinetic_energy": energy,
        }

    def _energy(self, v_club: Real, v_ball: Real) -> Real:
        return (self.m_club * v_club**2 + self.m_ball * v_ball**2) / 2


def outputs_after(
    values: Mapping[str, float], steps: Steps, chosen: Container[int], stretched: float = 1.0
) -> dict[int, dict[str, Real]]:
    """Every output after the chosen steps, by number from 0; `stretched` is a factor of times."""
    exact, after = Reference(values), {}
    for number, step in enumerate(steps):
        exact.step(_mp.mpf(step.length) * stretched, step.k, step.b, None, step.club_force)
        if number in chosen:
            after[number] = exact.outputs()
    return after
