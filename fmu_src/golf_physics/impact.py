"""One impact as a sequence of exact phases: approach, contact, flight.

An impact is a value: `following` returns the impact from its next phase on, `changed` the one that
other inputs lead to; neither changes anything. `arguments` are those of the constructor: they make
the same impact in another process.
"""

from collections.abc import Callable
from math import inf
from operator import attrgetter
from typing import Any, NamedTuple

from .laws import LAWS
from .values import SLOWEST, Inputs, Instant, Motion, Parameters, State, added, new

#: Of a host's clock, relative.
RESOLUTION = 2.0**-52


class Touch(NamedTuple):
    """First touch."""

    instant: Instant
    x_ball: float  #: position of the ball's near side, m
    club_speed: float  #: m/s


class Results(NamedTuple):
    """Results of the contact so far."""

    contact_time: float = 0.0  #: s
    max_force: float = 0.0  #: N
    time_of_max_force: float = 0.0  #: since first touch, s
    max_compression: float = 0.0  #: m
    impulse: float = 0.0  #: of the force, N.s


_NONE_YET = Results()


class Impact:
    """An impact from the start of one of its phases on."""

    __slots__ = ()

    in_contact = False
    parameters: Parameters
    begin: Instant  #: of the phase
    duration: float  #: of the phase, s; inf if it doesn't end
    touch: Touch | None
    #: At the start of a phase; the compression is below 0 before touch. From touch on positions are
    #: those since touch: differences of positions after a long approach would lose digits.
    motion: Motion
    velocities: tuple[float, float]  #: of club and ball at separation, m/s
    at_separation: Motion | None = None

    def since_begin(self, instant: Instant) -> float:
        """Time since the start of the phase, s; below 0 before it."""
        high, low = self.begin
        return (instant[0] - high) + (instant[1] - low)

    def elapsed(self, instant: Instant) -> float:
        """Time since the start of the phase, s, to an instant of the phase."""
        high, low = self.begin
        t = (instant[0] - high) + (instant[1] - low)
        # To a host, an instant is the event's if they differ by no more than the clock's last bit.
        return t if t > RESOLUTION * high else 0.0

    def following(self, inputs: Inputs) -> "Impact":
        """The impact from the next phase on, with these inputs; not of flight.

        It is this one if its phase turns out to last longer than `duration`, which then has grown.
        """
        raise NotImplementedError

    def displacement(self, instant: Instant) -> float:
        """Displacement of the ball in contact so far, m."""
        return 0.0

    def last_contact(self, instant: Instant) -> tuple[Any, float] | None:
        """The last contact phase and how long it has lasted, s; None before touch."""
        return None

    def mean_force(self, instant: Instant, step: float) -> float:
        """Mean contact force, N, over the last `step` seconds, however short they are."""
        last = self.last_contact(instant)
        if last is None or not step:
            return 0.0
        contact, end = last
        # From the start of the phase: the difference of two late times would lose all digits.
        begin = self.since_begin(added(instant, -step))
        whole = contact is self and begin > 0.0
        begin = max(0.0, begin if contact is self else begin + end)
        if not begin < end:
            return 0.0
        return contact.phase.impulse(begin, step if whole else end - begin) / step


def advance(impact: Impact, inputs: Inputs, instant: Instant) -> Impact:
    """The impact from the phase on that holds an instant, under these inputs.

    Raises ArithmeticError or ValueError if the contact leaves the range of a double.
    """
    high, low = instant
    while True:
        begin, begin_low = impact.begin
        if (high - begin) + (low - begin_low) < impact.duration:
            return impact
        impact = impact.following(inputs)


def _acting(p: Parameters, inputs: Inputs, closing: float) -> Inputs:
    """The inputs that act in a contact with this approach speed, m/s: b may follow from a COR."""
    return inputs._replace(b=LAWS[p.law].damping(p, inputs.k, closing))


class Approach(Impact):
    """The bodies before first touch.

    At its start the ball is at x_ball (m); compression and compression_low (m) add up to minus the
    distance.
    """

    touch = None
    #: The touch and the motion there, once they have been found: many impacts may begin with one
    #: approach, restored again and again.
    _at_touch: tuple[Touch, Motion] | None

    arguments = property(
        attrgetter(
            "parameters", "motion.v_club", "begin", "motion.x_ball", "motion.compression",
            "compression_low",
        )
    )  # fmt: skip

    def __init__(
        self, parameters: Parameters, club_speed: float, begin: Instant, x_ball: float,
        compression: float, compression_low: float,
    ) -> None:  # fmt: skip
        self.parameters, self.begin, self.compression_low = parameters, begin, compression_low
        self._at_touch = None
        v_ball = parameters.ball_speed
        closing = club_speed - v_ball
        x_club = x_ball + compression
        self.motion = new(Motion, (x_club, x_ball, club_speed, v_ball, compression, closing))
        gap = -(compression + compression_low)
        self.duration = (gap if gap > 0.0 else 0.0) / closing if closing > SLOWEST else inf

    def state(self, instant: Instant) -> State:
        """Contact force, positions, velocities and compression at an instant of the phase."""
        t = self.since_begin(instant)
        _, x_ball, v_club, v_ball, compression, closing = self.motion
        x_ball += v_ball * t
        compression += self.compression_low + closing * t
        # Bodies that close aren't compressed yet, whatever the rounding.
        left = compression if compression > 0.0 >= closing else 0.0
        return [0.0, x_ball + compression, x_ball, v_club, v_ball, left]

    def following(self, inputs: Inputs) -> "Contact":
        p = self.parameters
        if self._at_touch is None:
            duration = self.duration
            _, x_ball, v_club, v_ball, _, closing = self.motion
            x_ball += v_ball * duration
            begin = added(self.begin, duration)
            touch = new(Touch, (begin, x_ball, v_club))
            start = new(Motion, (0.0, 0.0, v_club, v_ball, 0.0, closing))
            self._at_touch = touch, start
        else:
            touch, start = self._at_touch
        if p.restitution_at_rest:
            inputs = _acting(p, inputs, start.closing)
        return Contact(p, inputs, touch.instant, touch, start, _NONE_YET)

    def is_undecided(self, instant: Instant) -> bool:
        """Whether no step has moved past the touch yet, by more than the clock's last bit."""
        if self.since_begin(instant) <= self.duration:
            return True
        high, low = added(self.begin, self.duration)
        return (instant[0] - high) + (instant[1] - low) <= RESOLUTION * high

    def with_speed(self, club_speed: float, instant: Instant) -> "Approach":
        """The impact with another club speed (m/s) from an instant on, where it is undecided."""
        t, duration = self.since_begin(instant), self.duration
        p, (_, x_ball, _, v_ball, compression, closing) = self.parameters, self.motion
        if t >= duration:
            return Approach(p, club_speed, instant, x_ball + v_ball * duration, 0.0, 0.0)
        # Without loss: a speed that changes at 10⁶ points still closes the right gap.
        moved = added((compression, self.compression_low), closing * t)
        return Approach(p, club_speed, instant, x_ball + v_ball * t, *moved)


class Contact(Impact):
    """The bodies in contact, from touch or from a change of inputs on; `inputs` are those that act.

    `results_before` are those of the contact phases before this one.
    """

    __slots__ = (
        "begin", "duration", "inputs", "motion", "parameters", "phase", "results_before", "touch",
    )  # fmt: skip

    in_contact = True
    touch: Touch
    arguments = property(
        attrgetter("parameters", "inputs", "begin", "touch", "motion", "results_before")
    )

    def __init__(
        self, parameters: Parameters, inputs: Inputs, begin: Instant, touch: Touch,
        motion: Motion, results_before: Results,
    ) -> None:  # fmt: skip
        self.parameters, self.inputs, self.begin = parameters, inputs, begin
        self.touch, self.motion, self.results_before = touch, motion, results_before
        self.phase = LAWS[parameters.law].contact(parameters, inputs, motion)
        self.duration = self.phase.duration

    def following(self, inputs: Inputs) -> "Contact | Flight":
        phase = self.phase
        if phase.extend():
            self.duration = phase.duration
            return self
        begin = added(self.begin, self.duration)
        return Flight(self, begin, self.duration, None, inputs.club_force)

    def changed(self, inputs: Inputs, instant: Instant) -> Impact:
        """The impact with other inputs from this instant on."""
        p, touch = self.parameters, self.touch
        law = LAWS[p.law]
        if p.restitution_at_rest:
            inputs = _acting(p, inputs, touch.club_speed - p.ball_speed)
        k, b, _, club_force = inputs
        acting = self.inputs
        if k == acting[0] and b == acting[1] and club_force == acting[3]:
            return self
        if club_force:
            refusal = law.refusal_of_push(p, inputs, touch.club_speed - p.ball_speed)
            if refusal is not None:
                raise ArithmeticError(refusal.sentence)
        t = self.elapsed(instant)
        _, x_club, x_ball, v_club, v_ball, d = self._state_since_touch(t)
        closing = self.phase.value("w", t) if t else self.motion.closing
        motion = new(Motion, (x_club, x_ball, v_club, v_ball, d, closing))
        # Not of NaN, which the new phase refuses.
        if not law.force(p, k, b, d, closing) <= 0.0 or (not d and closing > 0.0):
            return Contact(p, inputs, instant, touch, motion, self.results(t))
        return Flight(self, instant, t, motion, club_force)

    def dense_output(self) -> tuple[Callable[[float], State], float]:
        """As of the phase, with the host's positions."""
        dense, scale = self.phase.dense_output()
        x = self.touch.x_ball
        if not x:
            return dense, scale

        def state(time: float) -> State:
            force, x_club, x_ball, *others = dense(time)
            return [force, x + x_club, x + x_ball, *others]

        return state, scale

    def clamp(self, state: State, t: float, x: float) -> None:
        """Change a state of the dense output, t s after the start, to what a host may see.

        Exact at the start; and neither force nor compression is below 0, whatever the rounding:
        bodies push, they don't pull. x is the position of the ball at touch, m, or 0.
        """
        if not t:
            p = self.parameters
            x_club, _, v_club, v_ball, d, closing = self.motion
            force = LAWS[p.law].force(p, *self.inputs[:2], d, closing)
            state[:] = force, x + x_club, x + (x_club - d), v_club, v_ball, d
        if state[0] < 0.0:
            state[0] = 0.0
        if state[5] < 0.0:
            state[2], state[5] = state[1], 0.0

    def _state_since_touch(self, t: float) -> State:
        dense, scale = self.phase.dense_output()
        state = dense(scale * t)
        self.clamp(state, t, 0.0)
        return state

    def displacement(self, instant: Instant) -> float:
        return self._state_since_touch(self.elapsed(instant))[2]

    def last_contact(self, instant: Instant) -> "tuple[Contact, float]":
        return self, self.elapsed(instant)

    # Results until t, s since the start of the phase.

    def results(self, t: float) -> Results:
        """All of them."""
        peak, compression = self.peak_force(t), self.peak_compression(t)
        return Results(self.contact_time(t), *peak, compression, self.total_impulse(t))

    def contact_time(self, t: float) -> float:
        """Total time in contact, s."""
        return self.results_before.contact_time + t

    def peak_force(self, t: float) -> tuple[float, float]:
        """The largest contact force, N, and its time since first touch, s."""
        time, most, when, _, _ = self.results_before
        force, later = self.phase.largest("force", t)
        # k or b changed just before the peak: if the force keeps rising, the later phase counts.
        rising = later > 0.0 and when == time
        if force > most or (rising and force >= most * (1.0 - 1e-15)):
            return max(force, most), time + later
        return most, when

    def peak_compression(self, t: float) -> float:
        """The largest compression, m."""
        return max(self.results_before.max_compression, self.phase.largest("d", t)[0])

    def total_impulse(self, t: float) -> float:
        """Impulse of the contact force so far, N.s."""
        return self.results_before.impulse + self.phase.impulse(0.0, t)


class Flight(Impact):
    """The bodies after a contact that lasted so long (s), free, under a force on the club head (N).

    `motion` is that at its start; None where the contact ended by itself. `first` is the flight
    from separation on, if the force has changed since. While the ball `recovers` its compression
    falls; once it has vanished, or would grow, it stays 0: there is no second contact.
    """

    __slots__ = (
        "_motion", "begin", "club_force", "contact", "first", "lasted", "parameters", "recovers",
        "touch", "velocities",
    )  # fmt: skip

    touch: Touch
    duration = inf
    arguments = property(
        attrgetter("contact", "begin", "lasted", "motion", "club_force", "first", "recovers")
    )

    def __init__(
        self, contact: Contact, begin: Instant, lasted: float, motion: Motion | None,
        club_force: float, first: "Flight | None" = None, recovers: bool = True,
    ) -> None:  # fmt: skip
        self.parameters, self.touch = contact.parameters, contact.touch
        self.contact, self.begin, self.lasted = contact, begin, lasted
        self._motion, self.club_force, self.first = motion, club_force, first
        self.recovers = recovers
        if first is not None:
            self.velocities = first.velocities
        else:
            self.velocities = contact.phase.end_velocities() if motion is None else motion[2:4]

    @property
    def motion(self) -> Motion:  # type: ignore[override]
        motion = self._motion
        if motion is None:
            motion = self._motion = self.contact.phase.end()
        return motion

    def state(self, instant: Instant) -> State:
        """As of an `Approach`."""
        high, low = self.begin
        t = (instant[0] - high) + (instant[1] - low)
        _, x_ball, v_club, v_ball, distance, closing = self._motion or self.motion
        x_ball = self.touch.x_ball + (x_ball + v_ball * t)
        gained = self.club_force / self.parameters.m_club * t
        falls = self.recovers and distance > 0.0 >= closing + gained
        distance += (closing + 0.5 * gained) * t
        left = distance if falls and distance > 0.0 else 0.0
        return [0.0, x_ball + distance, x_ball, v_club + gained, v_ball, left]

    def changed(self, inputs: Inputs, instant: Instant) -> "Flight":
        """The impact with other inputs from this instant on."""
        club_force = inputs.club_force
        if club_force == self.club_force:
            return self
        _, x_club, x_ball, v_club, v_ball, left = self.state(instant)
        # The difference of the velocities would cancel.
        gained = self.club_force / self.parameters.m_club * self.since_begin(instant)
        closing = self.motion.closing + gained
        touch = self.touch.x_ball
        distance = left or x_club - x_ball
        motion = Motion(x_club - touch, x_ball - touch, v_club, v_ball, distance, closing)
        first = self if self.first is None else self.first
        return Flight(self.contact, instant, self.lasted, motion, club_force, first, left > 0.0)

    @property
    def at_separation(self) -> Motion:  # type: ignore[override]
        return (self.first or self).motion

    def displacement(self, instant: Instant) -> float:
        return self.at_separation.x_ball

    def last_contact(self, instant: Instant) -> tuple[Contact, float]:
        return self.contact, self.lasted

    def mean_force(self, instant: Instant, step: float) -> float:
        return Impact.mean_force(self.first or self, instant, step)
