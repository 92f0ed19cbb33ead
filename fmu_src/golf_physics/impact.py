"""One impact as a sequence of phases, each exact: approach, contact, flight.

Nothing is stepped. A phase answers where everything is at a time since its start and knows when it
ends; the next one is made when somebody asks for a later time. Times come as a pair (high, low)
whose sum is the time since the start: an instant a nanosecond into a contact that began after a
long approach is still exact.
"""

from math import inf
from operator import attrgetter
from typing import NamedTuple

from .laws.contact import EARLY, ContactPhase, Start, State
from .parameters import Inputs, Parameters

#: Of a host's clock, relative.
_RESOLUTION = 2.0**-52

#: So many changes of k or b in one contact are remembered before their peaks are looked up.
_REMEMBERED = 64

#: A named tuple by its values in a third of the time of its own way: every impact makes one.
_made = tuple.__new__


def added(high: float, low: float, elapsed: float) -> tuple[float, float]:
    """A pair and a number, summed up without loss: 10⁶ steps are as exact as one."""
    total = high + elapsed
    back = total - high
    low += (high - (total - back)) + (elapsed - back)
    # The larger part is the sum's nearest double: the same one, however the steps were added.
    nearest = total + low
    return nearest, low - (nearest - total)


class Free(NamedTuple):
    """Both bodies move freely: before first touch and after the contact.

    Attributes:
        x_ball: position of the ball at the start of the phase, m.
        v_club, v_ball: velocities, m/s.
        compression: how far the club face is past the ball's near side at the start, m; below 0
            before touch.
        closing: at what speed that grows, m/s.
        compression_low: what the double above leaves of the compression, m.
        duration: s until first touch; inf if there will be none.
    """

    x_ball: float
    v_club: float
    v_ball: float
    compression: float
    closing: float
    compression_low: float = 0.0
    duration: float = inf

    def state(self, t: float) -> State:
        """Force, positions, velocities and compression at t, s since the start of the phase."""
        x_ball, v_club, v_ball, compression, closing, low, _ = self
        x_ball += v_ball * t
        compression += low + closing * t
        # Bodies that close aren't compressed yet, whatever the last bits say.
        left = compression if compression > 0.0 >= closing else 0.0
        return [0.0, x_ball + compression, x_ball, v_club, v_ball, left]


def approach(x_ball: float, gap: float, gap_low: float, u_club: float, u_ball: float) -> Free:
    """Free motion until the gap (m, as a pair) is closed."""
    closing = u_club - u_ball
    duration = max(0.0, gap + gap_low) / closing if closing > 0.0 else inf
    return _made(Free, (x_ball, u_club, u_ball, -gap, closing, -gap_low, duration))


#: First touch: when (s since the start, as a pair), where (m), and how fast the club was (m/s).
Touch = tuple[float, float, float, float]


#: What an impact is made of; see there.
_FIELDS = (
    *("parameters", "free", "contact", "_last", "_finished", "in_force", "began_high"),
    *("began_low", "touch", "contact_start", "_offset", "_peaks"),
)
_everything = attrgetter(*_FIELDS)


class Impact:
    """State and results of one impact at any time, asked for in order of time.

    Args:
        parameters: the fixed values.
        inputs: k, b and club_speed from the start on.
    """

    __slots__ = _FIELDS

    def __init__(self, parameters: Parameters, inputs: Inputs) -> None:
        #: The fixed values.
        self.parameters = parameters
        #: The inputs that act now.
        self.in_force = inputs
        #: The present phase is `contact`, or without one `free`; and when it began (s since the
        #: start, as a pair).
        self.free = approach(0.0, parameters.gap, 0.0, inputs[2], parameters.ball_speed)
        self.contact: ContactPhase | None = None
        self.began_high = 0.0
        self.began_low = 0.0
        #: First touch, or None before it.
        self.touch: Touch | None = None
        #: What the last contact phase was made from (k, b, where the bodies were); and that phase
        #: when it is over, because a communication step may reach back into it.
        self.contact_start: tuple[float, float, Start] | None = None
        self._last: ContactPhase | None = None
        #: s from first touch to the start of the present phase.
        self._offset = 0.0
        #: Contact phases that ended (phase, when it ended, offset), not yet summed up in _peaks:
        #: largest force (N) and when (s since touch), largest compression (m), impulse (N.s).
        self._finished: tuple[tuple[ContactPhase, float, float], ...] = ()
        self._peaks = 0.0, 0.0, 0.0, 0.0

    # The phases

    def elapsed(self, high: float, low: float) -> float:
        """Time since the start of the present phase, s; of an instant not before it."""
        t = (high - self.began_high) + (low - self.began_low)
        # To a host, an instant is the event's if they differ by no more than the clock's last bit.
        return t if t > _RESOLUTION * self.began_high else 0.0

    def advance(self, high: float, low: float) -> float:
        """Go on to the phase of this instant; return the time since its start, s.

        Each phase is made whole before it takes the place of the one before it.
        """
        while True:
            contact = self.contact
            duration = self.free.duration if contact is None else contact.duration
            began = self.began_high
            t = (high - began) + (low - self.began_low)
            if t < duration:
                return t if t > _RESOLUTION * began else 0.0
            # As `added`, written out: every impact comes here twice (2 % of it).
            end = began + duration
            back = end - began
            low_part = self.began_low + ((began - (end - back)) + (duration - back))
            nearest = end + low_part
            end, end_low = nearest, low_part - (nearest - end)
            if contact is None:
                x_ball, v_club, v_ball, _, closing, _, _ = self.free
                x_ball += v_ball * duration
                start = _made(Start, (x_ball, 0.0, v_club, v_ball, closing))
                p = self.parameters
                k, b, _ = self.in_force
                if p.restitution_at_rest:
                    b = p.contact_law.damping(p, k, closing)
                self.contact = p.contact_law.contact(p, k, b, start)
                self.contact_start = k, b, start
                self.touch = (end, end_low, x_ball, v_club)
            else:
                self.free = _made(Free, (*contact.end(), 0.0, inf))
                self._finished += ((contact, duration, self._offset),)
                self._offset += duration
                self._last, self.contact = contact, None
            self.began_high, self.began_low = end, end_low

    def settled(self, state: State, high: float, low: float) -> State:
        """The state of this instant in contact as a host may see it.

        Within a rounding error of touch or separation, force and compression may be below 0, but
        bodies push, they don't pull. A phase begins exactly where it was told to, and just after
        touch what is small is told by itself.
        """
        contact = self.contact
        assert contact is not None
        assert self.contact_start is not None
        t = self.elapsed(high, low)
        k, b, start = self.contact_start
        if not t:
            x_club, compression, v_club, v_ball, closing = start
            p = self.parameters
            force = p.contact_law.force(p, k, b, compression, closing)
            state[:] = force, x_club, x_club - compression, v_club, v_ball, compression
        elif t * contact.rate <= EARLY and not start.compression:
            p = self.parameters
            state[5] = contact.compression(t)
            state[0] = p.contact_law.force(p, k, b, state[5], contact.closing(t))
        if state[0] < 0.0:
            state[0] = 0.0
        if state[5] < 0.0:
            state[2], state[5] = state[1], 0.0
        return state

    def refusal_of_touch(
        self, high: float, low: float, inputs: Inputs, step: float
    ) -> tuple[bool, str | None]:
        """Whether these inputs lead to a touch that the law refuses; if in this step, why.

        Nothing changes.
        """
        p = self.parameters
        problem = p.contact_law.refusal_of_touch(p, inputs[2])
        if problem is None:
            return False, None
        t = self.advance(high, low)
        if self.touch is None:
            _, x_club, x_ball, *_ = self.free.state(t)
            if x_ball - x_club > (inputs[2] - p.ball_speed) * step * (1.0 + 1e-12):
                return True, None
        elif self._offset or not self._is_now(self.touch, high, low):
            return False, None
        return True, problem

    def hold(self, high: float, low: float, inputs: Inputs) -> None:
        """Take these inputs from this instant on (the start of a communication step).

        A touch that falls on this very instant hasn't been passed yet, so it is decided anew.

        Raises:
            ArithmeticError, ValueError: the contact that follows leaves the range of a double;
                nothing has changed.
        """
        p, free, touch = self.parameters, self.free, self.touch
        k, b, club_speed = inputs
        if touch is None:
            t = (high - self.began_high) + (low - self.began_low)
            duration = free.duration
            if t <= duration and club_speed == free.v_club:
                # The usual case: nothing that acts has changed yet.
                self.in_force = inputs
                return
            if t >= duration:
                end = added(self.began_high, self.began_low, duration)
                touch = *end, free.x_ball + free.v_ball * duration, free.v_club
        if touch is None:
            self._approach_anew(club_speed, t)
            self.began_high, self.began_low = high, low
        elif not self._offset and self._is_now(touch, high, low):
            self.free = approach(touch[2], 0.0, 0.0, club_speed, p.ball_speed)
            self.began_high, self.began_low = touch[:2]
            self.touch = self.contact = self.contact_start = None
        else:
            t = self.advance(high, low)
            if self.contact is not None and self.contact_start is not None:
                if p.restitution_at_rest:
                    b = p.contact_law.damping(p, k, touch[3] - p.ball_speed)
                if (k, b) != self.contact_start[:2]:
                    self._change_contact(self.contact, k, b, t, high, low)
                    self.began_high, self.began_low = high, low
        self.in_force = inputs

    @staticmethod
    def _is_now(touch: Touch, high: float, low: float) -> bool:
        """Whether no step has moved past a touch yet, to the last bit of the clock."""
        return (high - touch[0]) + (low - touch[1]) <= _RESOLUTION * touch[0]

    def _approach_anew(self, club_speed: float, t: float) -> None:
        x_ball, _, v_ball, compression, closing, compression_low, _ = self.free
        # Two-sum again: a speed that changes at 10⁶ points still closes the right gap.
        step = -closing * t
        gap = step - compression
        back = gap - step
        gap_low = (step - (gap - back)) - (compression + back) - compression_low
        self.free = approach(x_ball + v_ball * t, gap, gap_low, club_speed, v_ball)

    def _change_contact(
        self, contact: ContactPhase, k: float, b: float, t: float, high: float, low: float
    ) -> None:
        """`k` or `b` changed during contact: a new phase starts from the present state."""
        p, law = self.parameters, self.parameters.contact_law
        if len(self._finished) >= _REMEMBERED:
            self._sum_up()
        course, scale = contact.course()
        _, x_club, x_ball, v_club, v_ball, d = self.settled(course(scale * t), high, low)
        closing = contact.closing(t)
        if law.force(p, k, b, d, closing) > 0.0 or (not d and closing > 0.0):
            start = Start(x_club, d, v_club, v_ball, closing)
            self.contact = law.contact(p, k, b, start)
            self.contact_start = k, b, start
        else:
            self.free = Free(x_ball, v_club, v_ball, d, closing)
            self.contact = None
        self._finished += ((contact, t, self._offset),)
        self._offset += t

    # State

    def snapshot(self) -> tuple:
        """Everything that changes, for `restored`; its parts are never changed in place."""
        return _everything(self)

    @classmethod
    def restored(cls, snapshot: tuple) -> "Impact":
        """The impact that a snapshot was taken of."""
        self = cls.__new__(cls)
        self.restore(snapshot)
        return self

    def restore(self, snapshot: tuple) -> None:
        """Become the impact that a snapshot was taken of."""
        (
            self.parameters, self.free, self.contact, self._last, self._finished, self.in_force,
            self.began_high, self.began_low, self.touch, self.contact_start, self._offset,
            self._peaks,
        ) = snapshot  # fmt: skip

    def packed(self) -> list:
        """The same as numbers and lists of numbers, for `unpacked` in another process."""
        self._sum_up()
        parameters, free, contact, last, _, *plain = _everything(self)
        return [parameters.values(), free, contact is not None, last is not None, *plain]

    @classmethod
    def unpacked(cls, packed: list) -> "Impact":
        """The impact that `packed` was taken of; a contact is made again from the same numbers."""
        values, free, goes_on, is_over, in_force, high, low, touch, start, offset, peaks = packed
        p = Parameters(*values)
        contact = None
        if start is not None:
            k, b, bodies = start
            start = k, b, Start(*bodies)
            contact = p.contact_law.contact(p, *start)
        contacts = contact if goes_on else None, contact if is_over else None
        touch = None if touch is None else tuple(touch)
        changing = tuple(in_force), high, low, touch, start, offset, tuple(peaks)
        return cls.restored((p, Free(*free), *contacts, (), *changing))

    # Results so far, each at an instant whose phase has been gone on to.

    @property
    def in_contact(self) -> bool:
        """Whether the bodies are in contact now."""
        return self.contact is not None

    def contact_time(self, high: float, low: float) -> float:
        """Time in contact so far, s."""
        return self._offset + (self.elapsed(high, low) if self.in_contact else 0.0)

    def contact_displacement(self, state: State) -> float:
        """How far the ball has moved while in contact, m."""
        if self.touch is None:
            return 0.0
        x_ball = self.free.x_ball if self.contact is None else state[2]
        return x_ball - self.touch[2]

    def impulse(self, high: float, low: float) -> float:
        """Impulse of the contact force so far, N.s."""
        so_far = self._sum_up()[3]
        if self.contact is not None:
            so_far += self.contact.impulse(0.0, self.elapsed(high, low))
        return so_far

    def peak_force(self, high: float, low: float) -> tuple[float, float]:
        """Largest contact force so far (N) and when it was, s since first touch."""
        best = self._sum_up()[:2]
        if self.contact is None:
            return best
        return _later_peak(best, self._offset, *self.contact.peak_force(self.elapsed(high, low)))

    def peak_compression(self, high: float, low: float) -> float:
        """Largest compression so far, m."""
        best = self._sum_up()[2]
        if self.contact is None:
            return best
        return max(best, self.contact.peak_compression(self.elapsed(high, low)))

    def _sum_up(self) -> tuple[float, float, float, float]:
        """What the contact phases that ended leave behind; see `_peaks`."""
        force, time, compression, impulse = self._peaks
        for contact, end, offset in self._finished:
            force, time = _later_peak((force, time), offset, *contact.peak_force(end))
            compression = max(compression, contact.peak_compression(end))
            impulse += contact.impulse(0.0, end)
        self._peaks, self._finished = (force, time, compression, impulse), ()
        return self._peaks

    def impulse_of_step(self, high: float, low: float, step: float) -> float:
        """Impulse of the contact force over the last `step` seconds, N.s.

        Relative to the step, not to the whole impulse: the mean force over a nanosecond is as good
        as the one over a millisecond.
        """
        contact = self.contact or self._last
        if contact is None:
            return 0.0
        # Since the start of the contact, of which the present phase began at its end if it is over.
        passed = contact.duration if self.contact is None else 0.0
        end = min(passed + self.elapsed(high, low), contact.duration)
        # Where the step began, from its own clock: with a step far longer than the contact, the
        # difference of two late times would tell nothing.
        before = high - step
        back = high - before
        lost = (high - (before + back)) + (back - step)
        begin = passed + ((before - self.began_high) + ((low - self.began_low) + lost))
        begin = max(0.0, begin)
        if begin >= end:
            return 0.0
        # The step itself is known better than the difference of two times.
        width = step if not passed and begin > 0.0 else end - begin
        return contact.impulse(begin, width)


def _later_peak(
    best: tuple[float, float], offset: float, force: float, when: float
) -> tuple[float, float]:
    """The larger of the peak so far and that of a phase that begins at `offset`, and its time.

    Where a phase takes over just before the peak, both are the same to the last digits: if the
    force goes on rising, the later one counts.
    """
    goes_on = when > 0.0 and best[1] == offset and force >= best[0] * (1.0 - 1e-15)
    return (max(force, best[0]), offset + when) if goes_on or force > best[0] else best
