"""One impact as a sequence of exact phases: approach, contact, flight.

An impact is a value: `at` returns the impact from the phase that holds an instant on, `with_inputs`
the impact that other inputs lead to; neither changes anything. `arguments`
are those of the constructor: they make the same impact in another process. Instants are pairs
(high, low) whose sum is the time since the start, s: an instant a nanosecond into a contact that
began after a long approach is exact.
"""

from math import inf
from operator import attrgetter
from typing import NamedTuple

from .laws.contact import EndState, InitialState, State
from .parameters import Inputs, Parameters

#: Of a host's clock, relative.
RESOLUTION = 2.0**-52

Place = tuple[float, float, float]

#: Makes a named tuple in a third of the time of its constructor.
_new = tuple.__new__


def added(high: float, low: float, elapsed: float) -> tuple[float, float]:
    """The sum of a pair and a number, without loss (two-sum): 10⁶ steps are as exact as one."""
    total = high + elapsed
    back = total - high
    low += (high - (total - back)) + (elapsed - back)
    # The larger part is the sum's nearest double: the same one, however the steps were added.
    nearest = total + low
    return nearest, low - (nearest - total)


class Touch(NamedTuple):
    """First touch: the instant (s), position of the ball's near side (m), club speed (m/s)."""

    high: float
    low: float
    x_ball: float
    club_speed: float


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

    __slots__ = ("_following", "duration", "high", "inputs", "low", "motion", "parameters", "touch")

    in_contact = False
    parameters: Parameters
    inputs: Inputs  #: k, b and club_speed with which the phase began
    high: float  #: the instant at which the phase begins
    low: float
    duration: float  #: of the phase, s; inf if it doesn't end
    touch: Touch | None
    #: At the start of a phase of free motion; the compression is below 0 before touch.
    motion: EndState
    #: Of that compression, below the resolution of a double, m.
    low_part = 0.0
    _following: "Impact | None"

    @staticmethod
    def start(parameters: Parameters, inputs: Inputs) -> "Impact":
        """The impact at time 0: the ball lies at 0, the club face at -gap."""
        return Approach(parameters, inputs, 0.0, 0.0, (0.0, -parameters.gap, 0.0))

    def at(self, high: float, low: float) -> "Impact":
        """The impact whose phase holds this instant; no earlier than this one's."""
        impact = self
        while (high - impact.high) + (low - impact.low) >= impact.duration:
            impact = impact._following or impact._follow()
        return impact

    def elapsed(self, high: float, low: float) -> float:
        """Time since the start of the phase, s."""
        t = (high - self.high) + (low - self.low)
        # To a host, an instant is the event's if they differ by no more than the clock's last bit.
        return t if t > RESOLUTION * self.high else 0.0

    def _follow(self) -> "Impact":
        """The impact from the next phase on, which is then remembered; not of flight."""
        raise NotImplementedError

    def with_inputs(self, inputs: Inputs, high: float, low: float) -> "Impact":
        """The impact with these inputs from this instant on, the start of a communication step.

        A touch at this very instant hasn't been passed yet, so it is still undecided. Raises
        ArithmeticError or ValueError if the contact that follows leaves the range of a double.
        """
        impact = self.at(high, low)
        return impact.changed(inputs, high, low) if isinstance(impact, Contact) else impact

    def state(self, high: float, low: float) -> State:
        """Contact force, positions, velocities and compression at an instant of the phase."""
        t = (high - self.high) + (low - self.low)
        x_ball, v_club, v_ball, compression, closing = self.motion
        x_ball += v_ball * t
        compression += self.low_part + closing * t
        # Bodies that close aren't compressed yet, whatever the rounding.
        left = compression if compression > 0.0 >= closing else 0.0
        return [0.0, x_ball + compression, x_ball, v_club, v_ball, left]

    def contact_until(self, high: float, low: float) -> "tuple[Contact, float] | None":
        """The last contact phase, and how long it has lasted, s."""
        return None

    def impulse_of_step(self, high: float, low: float, step: float) -> float:
        """Impulse of the contact force over the last `step` seconds, N.s, however short it is."""
        last = self.contact_until(high, low)
        if last is None:
            return 0.0
        contact, end = last
        # From the start of the phase: the difference of two late times would lose all digits.
        before, rest = added(high, low, -step)
        begin = (before - self.high) + (rest - self.low)
        whole = contact is self and begin > 0.0
        begin = max(0.0, begin if contact is self else begin + end)
        return contact.phase.impulse(begin, step if whole else end - begin) if begin < end else 0.0


class Approach(Impact):
    """The bodies before first touch.

    `place` has the position of the ball (m) and the compression (m, as a pair): minus the distance.
    """

    __slots__ = ("low_part", "place")

    touch = None
    arguments = property(attrgetter("parameters", "inputs", "high", "low", "place"))

    def __init__(
        self, parameters: Parameters, inputs: Inputs, high: float, low: float, place: Place
    ) -> None:
        self.parameters, self.inputs, self.high, self.low = parameters, inputs, high, low
        x_ball, compression, low_part = self.place = place
        v_club, v_ball = inputs[2], parameters.ball_speed
        closing = v_club - v_ball
        self.motion = x_ball, v_club, v_ball, compression, closing
        self.low_part = low_part
        self.duration = max(0.0, -(compression + low_part)) / closing if closing > 0.0 else inf
        self._following = None

    def _follow(self) -> Impact:
        p, duration = self.parameters, self.duration
        k, b, _ = self.inputs
        x_ball, v_club, v_ball, _, closing = self.motion
        x_ball += v_ball * duration
        b = p.contact_law.damping(p, k, b, closing)
        high, low = self.high, self.low
        if duration:
            high, low = added(high, low, duration)
        touch = _new(Touch, (high, low, x_ball, v_club))
        start = _new(InitialState, (x_ball, 0.0, v_club, v_ball, closing))
        following = Contact(p, self.inputs, high, low, touch, b, start, _NONE_YET)
        self._following = following
        return following

    def with_inputs(self, inputs: Inputs, high: float, low: float) -> Impact:
        t, duration = (high - self.high) + (low - self.low), self.duration
        if t > duration:
            end, end_low = added(self.high, self.low, duration)
            if (high - end) + (low - end_low) > RESOLUTION * end:
                # A step has moved past the touch, by more than the clock's last bit.
                return super().with_inputs(inputs, high, low)
        p = self.parameters
        x_ball, v_club, v_ball, compression, closing = self.motion
        if inputs[2] == v_club:
            return Approach(p, inputs, self.high, self.low, self.place)
        if t >= duration:
            return Approach(p, inputs, high, low, (x_ball + v_ball * duration, 0.0, 0.0))
        # Without loss: a speed that changes at 10⁶ points still closes the right gap.
        moved = added(compression, self.low_part, closing * t)
        return Approach(p, inputs, high, low, (x_ball + v_ball * t, *moved))


class Contact(Impact):
    """The bodies in contact, from touch or from a change of k or b on; `before` has the results of
    the contact phases before. b (N.s/m) is that which acts.
    """

    __slots__ = ("b", "before", "initial", "phase")

    in_contact = True
    touch: Touch
    arguments = property(
        attrgetter("parameters", "inputs", "high", "low", "touch", "b", "initial", "before")
    )

    def __init__(
        self, parameters: Parameters, inputs: Inputs, high: float, low: float, touch: Touch,
        b: float, initial: InitialState, before: Results,
    ) -> None:  # fmt: skip
        self.parameters, self.inputs, self.high, self.low = parameters, inputs, high, low
        self.touch, self.b, self.initial, self.before = touch, b, initial, before
        self.phase = parameters.contact_law.contact(parameters, inputs[0], b, initial)
        self.duration = self.phase.duration
        self._following = None

    def _follow(self) -> Impact:
        high, low = added(self.high, self.low, self.duration)
        following = Flight(self, high, low, self.duration, self.phase.end())
        self._following = following
        return following

    def changed(self, inputs: Inputs, high: float, low: float) -> Impact:
        """With other inputs from this instant on."""
        p, law, touch = self.parameters, self.parameters.contact_law, self.touch
        k, b, _ = inputs
        b = law.damping(p, k, b, touch.club_speed - p.ball_speed)
        if (k, b) == (self.inputs[0], self.b):
            return self
        _, x_club, x_ball, v_club, v_ball, d = self.state(high, low)
        t = self.elapsed(high, low)
        closing = self.phase.value("w", t) if t else self.initial.closing
        if law.force(p, k, b, d, closing) > 0.0 or (not d and closing > 0.0):
            start = InitialState(x_club, d, v_club, v_ball, closing)
            peaks = *self.peak_force(t), self.peak_compression(t)
            before = Results(self.contact_time(t), *peaks, self.impulse(t))
            return Contact(p, inputs, high, low, touch, b, start, before)
        return Flight(self, high, low, t, (x_ball, v_club, v_ball, d, closing))

    def clamped(self, state: State, t: float) -> State:
        """A state of the dense output as a host may see it, t s after the start of the phase.

        Exact at the start; and neither force nor compression is below 0, whatever the rounding:
        bodies push, they don't pull.
        """
        if not t:
            p = self.parameters
            x_club, d, v_club, v_ball, closing = self.initial
            force = p.contact_law.force(p, self.inputs[0], self.b, d, closing)
            state[:] = force, x_club, x_club - d, v_club, v_ball, d
        if state[0] < 0.0:
            state[0] = 0.0
        if state[5] < 0.0:
            state[2], state[5] = state[1], 0.0
        return state

    def state(self, high: float, low: float) -> State:
        t = self.elapsed(high, low)
        motion, scale = self.phase.dense_output()
        return self.clamped(motion(scale * t), t)

    def contact_until(self, high: float, low: float) -> "tuple[Contact, float]":
        return self, self.elapsed(high, low)

    def contact_time(self, t: float) -> float:
        return self.before.contact_time + t

    def peak_force(self, t: float) -> tuple[float, float]:
        """The largest contact force, N, and its time since first touch, s."""
        time, most, when, _, _ = self.before
        force, later = self.phase.largest("force", t)
        # k or b changed just before the peak: if the force keeps rising, the later phase counts.
        rising = later > 0.0 and when == time
        if force > most or (rising and force >= most * (1.0 - 1e-15)):
            return max(force, most), time + later
        return most, when

    def peak_compression(self, t: float) -> float:
        return max(self.before.max_compression, self.phase.largest("d", t)[0])

    def impulse(self, t: float, state: State | None = None) -> float:
        """Impulse of the contact force until t, s since the start of the phase, N.s."""
        return self.before.impulse + self.phase.impulse(0.0, t)


class Flight(Impact):
    """The bodies after a contact that lasted so long, s."""

    __slots__ = ("contact", "lasted", "x_end")

    touch: Touch
    duration = inf
    arguments = property(attrgetter("contact", "high", "low", "lasted", "motion"))

    def __init__(
        self, contact: Contact, high: float, low: float, lasted: float, motion: EndState
    ) -> None:
        self.parameters, self.inputs, self.touch = contact.parameters, contact.inputs, contact.touch
        self.contact, self.high, self.low = contact, high, low
        self.lasted, self.motion, self.x_end = lasted, motion, motion[0]

    def contact_until(self, high: float, low: float) -> tuple[Contact, float]:
        return self.contact, self.lasted
