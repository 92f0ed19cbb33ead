"""Every output of an impact at any instant, to 25 digits and more: the reference of all evidence.

A linear contact is x' = A x; its matrix exponential is the sum of A's modes, with 80 digits, so
that cancellation affects only digits far below those needed. SI units. Nothing is the FMU's.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, count, islice, pairwise, takewhile
from typing import Any, NamedTuple

import mpmath

mp: Any = mpmath.mp.clone()  # a context of its own: the precision of others is unchanged
mp.dps = 80
Real = Any  # an mpmath number: the package has no types

#: Of rates that would coincide: then they don't, and results change in the 37th digit.
_APART = mp.mpf(10) ** -36
_STATE = ("d", "club_velocity", "ball_velocity", "ball_position")
_SO_FAR = (
    "contact_time", "max_force", "time_of_max_force", "max_compression", "contact_displacement",
    "impulse", "compression",
)  # fmt: skip


class _Sum:
    """f(t) = Σ c exp(s t); the rates s are real but for one conjugate pair."""

    def __init__(self, terms: Iterable[tuple[Any, Any]]) -> None:
        terms = [*terms]
        least = mp.mpf(10) ** -70 * max(abs(c) for _, c in terms)
        self.terms = sorted((x for x in terms if abs(x[1]) > least), key=lambda x: -mp.re(x[0]))
        self.fastest = max((abs(s) for s, _ in self.terms), default=mp.one)
        self.soon = mp.mpf(10) ** -25 / self.fastest

    def __call__(self, t: Real) -> Real:
        return mp.re(sum(c * mp.exp(s * t) for s, c in self.terms))

    def integral(self, t: Real) -> Real:
        return mp.re(sum(c * (mp.expm1(s * t) / s if s else t) for s, c in self.terms))

    def less(self, rate: Any) -> "_Sum":
        """f' - rate f, which has no term of this rate."""
        return _Sum([(s, c * (s - rate)) for s, c in self.terms])

    def zeros(self) -> Iterator[Real]:
        """All t > 0 at which it changes sign, in order.

        For a real s, exp(-s t) f is monotone between the zeros of f' - s f: f has one zero there at
        most (Rolle). What is left without the real rates is one pair: its zeros are a closed form.
        """
        real = [s for s, _ in self.terms if not mp.im(s)]
        if not real and self.terms:
            s, c = max(self.terms, key=lambda term: mp.im(term[0]))
            first = (mp.pi / 2 - mp.arg(c)) % mp.pi
            zeros = ((first + n * mp.pi) / mp.im(s) for n in count())
            yield from (t for t in zeros if t > self.soon)
        elif len(self.terms) > 1:
            end = self._settled()
            cuts = takewhile(lambda t: t < end, self.less(real[0]).zeros())
            edges = chain([self.soon], cuts, [end] if end < mp.inf else [])
            for (left, before), (right, after) in pairwise((t, self(t)) for t in edges):
                if before * after < 0:
                    yield self._root(left, right)

    def _settled(self) -> Real:
        """From when on the slowest term, if it is real, outweighs the others."""
        (slowest, c), *others = self.terms
        for n in range(0 if mp.im(slowest) else 300):
            t = mp.mpf(2) ** n / self.fastest
            if sum(abs(x * mp.exp((s - slowest) * t)) for s, x in others) < abs(c):
                return t
        return mp.inf

    def _root(self, left: Real, right: Real) -> Real:
        scale, middle = self(right), (left + right) / 2
        while self(middle) / scale > 0:
            right, middle = middle, (left + middle) / 2
        options = {"tol": mp.mpf(10) ** -60 * right, "maxsteps": 1000, "verify": False}
        return mp.findroot(lambda t: self(t) / scale, (middle, right), solver="pegasus", **options)

    def extrema(self, end: Real) -> list[Real]:
        """Before `end`; later ones of a decaying oscillation are lower than the first few."""
        return [*islice(takewhile(lambda t: t < end, self.less(0).zeros()), 60)]


class Contact:
    """From a state (d, v_club, v_ball) on, with constant k, b and force on the head.

    The force is that of a further quantity, 1 at the start, which grows so slowly that its rate is
    just not the momentum's.
    """

    def __init__(self, v: Mapping[str, Real], state: Sequence[Real]) -> None:
        b, m_club, m_ball = v["b"] * (1 + _APART), v["m_club"], v["m_ball"]
        drag, damper = (b, mp.zero) if v["law"] == 1 else (mp.zero, b)
        force, push = mp.matrix([[v["k"], damper, -damper, 0]]), v["club_force"]
        rates = mp.diag([0, -drag / m_club, -drag / m_ball, mp.sqrt(v["k"] / m_ball) * _APART])
        rates[0, 1], rates[0, 2], rates[1, 3] = 1, -1, push / m_club
        rates[1, :] -= force / m_club
        rates[2, :] += force / m_ball
        found, modes = mp.eig(rates)
        least = mp.mpf(10) ** -40 * max(map(abs, found))
        weights = mp.lu_solve(modes, mp.matrix([*state, 1 if push else 0]))

        def quantity(row: Any) -> _Sum:
            terms = [(s, c * weight) for s, c, weight in zip(found, row * modes, weights)]
            return _Sum(x if abs(mp.im(x[0])) > least else (*map(mp.re, x),) for x in terms)

        unit = mp.eye(4)
        self.d, self.v_club, self.v_ball = (quantity(unit[n, :]) for n in range(3))
        self.force = quantity(force)
        ending = self.d if drag else self.force
        #: s until contact ends: 0 if it has, inf if it never will.
        self.duration = mp.zero if ending(ending.soon) < 0 else next(ending.zeros(), mp.inf)
        self.extrema = {f: f.extrema(self.duration) for f in (self.force, self.d)}

    def at(self, t: Real) -> tuple[Real, ...]:
        """d, v_club, v_ball, how far the ball has moved, the force on it, its impulse."""
        ball, force = self.v_ball, self.force
        return self.d(t), self.v_club(t), ball(t), ball.integral(t), force(t), force.integral(t)

    def maxima(self, t: Real) -> tuple[Real, ...]:
        """The largest force so far, its time, and the largest compression."""
        peak, deepest = (
            max((mp.zero, *(time for time in extrema if time < t), t), key=f)
            for f, extrema in self.extrema.items()
        )
        return self.force(peak), peak, self.d(deepest)


class _Phase(NamedTuple):
    begin: Real  #: s from the start
    start: dict[str, Real]  #: state and results so far
    contact: Any = None
    acceleration: Real = mp.zero  #: of the head in flight

    def at(self, time: Real) -> dict[str, Real]:
        """State, force and results so far."""
        t, now, contact = time - self.begin, dict(self.start), self.contact
        v_club, v_ball, gained = now["club_velocity"], now["ball_velocity"], self.acceleration * t
        d = now["d"] + (v_club - v_ball + gained / 2) * t
        # After separation it falls, or is 0 from when on the bodies approach once more.
        falls = now["compression"] > 0 and v_club + gained <= v_ball
        now["compression"] = max(mp.zero, d) if falls else mp.zero
        state = d, v_club + gained, v_ball, v_ball * t, mp.zero, mp.zero
        if contact:
            state = contact.at(t)
            now["compression"] = max(mp.zero, state[0])
            force, when, deepest = contact.maxima(t)
            if force > now["max_force"]:
                now |= {"max_force": force, "time_of_max_force": now["contact_time"] + when}
            now["max_compression"] = max(now["max_compression"], deepest)
            now["contact_time"] += t
            now["contact_displacement"] += state[3]
            now["impulse"] += state[5]
        moved = {"ball_position": now["ball_position"] + state[3], "force": state[4]}
        return now | dict(zip(_STATE, state[:3])) | moved


class Reference:
    """An impact by a linear law; the ball starts at 0, the club face at -gap. Doubles are exact.

    Args:
        values: inputs and parameters by name, and the host's start_time.
        changes: an instant (s from the start) and the inputs from then on.
    """

    def __init__(
        self, values: Mapping[str, Any], changes: Iterable[tuple[Any, Mapping[str, Any]]] = ()
    ) -> None:
        usual = {"club_force": 0, "start_time": 0}
        v = self.v = {name: mp.mpf(value) for name, value in {**usual, **values}.items()}
        #: First touch and separation, s from the start, if there are any.
        self.touch = self.parting = mp.inf
        self.u_club, self.u_ball = v["club_speed"], v["ball_speed"]
        start = dict.fromkeys((*_STATE, *_SO_FAR), mp.zero) | {"d": -v["gap"]}
        start |= {"club_velocity": self.u_club, "ball_velocity": self.u_ball}
        self.phases = [_Phase(mp.zero, start)]
        for time, later in (*changes, (mp.inf, {})):
            self._pass_events(mp.mpf(time))
            v |= {name: mp.mpf(value) for name, value in later.items()}
            if later:
                self._begin(mp.mpf(time))

    def _pass_events(self, until: Real) -> None:
        begin, start, *_ = self.phases[-1]
        closing = start["club_velocity"] - start["ball_velocity"]
        if self.touch == mp.inf and closing > 0 and begin - start["d"] / closing < until:
            self.touch = begin - start["d"] / closing
            self._begin(self.touch)
        begin, _, contact, _ = self.phases[-1]
        if contact and contact.duration < mp.inf and begin + contact.duration <= until:
            self.parting = begin + contact.duration
            self._begin(self.parting)

    def _begin(self, time: Real) -> None:
        start, v = self.phases[-1].at(time), self.v
        acceleration = v["club_force"] / v["m_club"] if time >= self.parting else mp.zero
        contact: Any = None
        if time < self.touch:
            self.u_club = start["club_velocity"] = v["club_speed"]
        elif time < self.parting:
            start["d"] = start["d"] if time > self.touch else mp.zero
            contact = Contact(v, [start[name] for name in _STATE[:3]])
        self.phases.append(_Phase(time, start, contact, acceleration))

    def outputs(self, time: Any) -> dict[str, Any]:
        """Every output but mean_force, s from the start; flags as bool.

        Where an input changes they are the left limit, at touch the right one.
        """
        time = mp.mpf(time)
        *_, phase = (p for p in self.phases if p.begin < time or p.begin == time in (0, self.touch))
        now, v = phase.at(time), self.v
        touched, separated = phase.begin >= self.touch, phase.begin >= self.parting
        d, v_club, v_ball, x_ball = (now[name] for name in _STATE)
        del now["d"]
        # Coefficient of restitution and energy efficiency are those at separation.
        at_end = next((p.start for p in self.phases if p.begin >= self.parting), {})
        v_c, v_b = (at_end[n] for n in _STATE[1:3]) if separated else (v_club, v_ball)

        def energy(club: Real, ball: Real) -> Real:
            return (v["m_club"] * club**2 + v["m_ball"] * ball**2) / 2

        closing, before = self.u_club - self.u_ball, energy(self.u_club, self.u_ball)
        return now | {
            "club_position": x_ball + d,
            "touched": touched,
            "in_contact": touched and not separated,
            "separated": separated,
            "touch_time": v["start_time"] + (self.touch if touched else 0),
            "smash_factor": v_ball / self.u_club if touched and self.u_club else mp.zero,
            "coefficient_of_restitution": (v_b - v_c) / closing if touched else mp.zero,
            "energy_efficiency": energy(v_c, v_b) / before if touched else mp.one,
            "momentum": v["m_club"] * v_club + v["m_ball"] * v_ball,
            "kinetic_energy": energy(v_club, v_ball),
        }
