"""One impact as a sequence of phases, each exact: approach, contact, separated.

Nothing is stepped. A phase answers where everything is at a time since its start and knows when it
ends; the next one is made when somebody asks for a later time. Times come as a pair (high, low)
whose sum is the time since the start: an instant a nanosecond into a contact that began after a
long approach is still exact.
"""

from collections.abc import Callable
from functools import partial
from math import inf
from typing import Any, NamedTuple

from .absolute import AbsoluteContact
from .kelvin_voigt import KelvinVoigtContact
from .parameters import Inputs, Parameters
from .power_law import PowerLawContact
from .quadrature import GAUSS_5
from .restitution import damping, out_of_reach, restitution

#: Force, positions of club and ball, velocities of club and ball, compression.
State = list[float]

#: So near to touch or separation (relative) force and compression may be all rounding error.
_CLOSE = 1e-12

#: So many changes of k or b in one contact are remembered before their peaks are looked up.
_REMEMBERED = 64


class Approach:
    """Before first touch: both bodies move freely, the club at the speed that the host asks for."""

    __slots__ = ("duration", "u_ball", "u_club", "x_ball", "x_club", "x_club_low")

    def __init__(
        self, x_club: float, x_club_low: float, x_ball: float, u_club: float, u_ball: float
    ) -> None:
        self.x_club = x_club
        self.x_club_low = x_club_low
        self.x_ball = x_ball
        self.u_club = u_club
        self.u_ball = u_ball
        closing = u_club - u_ball
        #: s until first touch, inf if the bodies don't close.
        self.duration = max(0.0, (x_ball - x_club) - x_club_low) / closing if closing > 0.0 else inf

    def arguments(self) -> tuple[float, ...]:
        """What this phase was made from."""
        return self.x_club, self.x_club_low, self.x_ball, self.u_club, self.u_ball

    def state(self, t: float) -> State:
        """Force, positions, velocities and compression as a contact phase gives them."""
        x_club = self.x_club + (self.x_club_low + self.u_club * t)
        return [0.0, x_club, self.x_ball + self.u_ball * t, self.u_club, self.u_ball, 0.0]


class Flight:
    """After contact: both bodies move freely, and apart.

    Args:
        start: the state when the contact ended.
        closing: v_club - v_ball, m/s, which the difference of two velocities may not tell exactly.
    """

    __slots__ = ("closing", "start")

    duration = inf

    def __init__(self, start: State, closing: float) -> None:
        self.start = start
        self.closing = closing

    def arguments(self) -> tuple[State, float]:
        """What this phase was made from."""
        return self.start, self.closing

    def state(self, t: float) -> State:
        """Force, positions, velocities and compression as a contact phase gives them."""
        _, x_club, x_ball, v_club, v_ball, compression = self.start
        left = compression + self.closing * t
        return [
            0.0,
            x_club + v_club * t,
            x_ball + v_ball * t,
            v_club,
            v_ball,
            left if left > 0.0 else 0.0,
        ]


#: First touch: when (s since the start, as a pair), where (m), and how fast the club was (m/s).
Touch = tuple[float, float, float, float]


class Peaks(NamedTuple):
    """What finished contact phases leave behind: N, s since touch, m, N.s."""

    force: float = 0.0
    time: float = 0.0
    compression: float = 0.0
    impulse: float = 0.0


class Impact:
    """State and results of one impact at any time, asked for in order of time.

    Args:
        parameters: the fixed values.
        inputs: k, b and club_speed from the start on.
    """

    __slots__ = (
        "_contact",
        "_contact_start",
        "_finished",
        "_high",
        "_low",
        "_offset",
        "_peaks",
        "in_force",
        "parameters",
        "phase",
        "touch",
    )

    def __init__(self, parameters: Parameters, inputs: Inputs) -> None:
        #: The fixed values.
        self.parameters = parameters
        #: The inputs that act now.
        self.in_force = inputs
        #: The present phase, and when it started (s since the start, as a pair).
        self.phase: Any = Approach(-parameters.gap, 0.0, 0.0, inputs[2], parameters.ball_speed)
        self._high = 0.0
        self._low = 0.0
        #: First touch, or None before it.
        self.touch: Touch | None = None
        #: The last contact phase, and what it was made from; it outlives its end because a
        #: communication step may reach back into it.
        self._contact: Any = None
        self._contact_start: tuple[float, ...] = ()
        #: s from first touch to the start of the present phase.
        self._offset = 0.0
        #: Contact phases that ended (phase, when it ended, offset), not yet summed up in _peaks.
        self._finished: tuple[tuple[Any, float, float], ...] = ()
        self._peaks = Peaks()

    # The phases

    def state(self, high: float, low: float) -> State:
        """Force (N), positions (m) and velocities (m/s) of club and ball, compression (m)."""
        t = (high - self._high) + (low - self._low)
        while True:
            phase = self.phase
            elapsed = phase.duration
            if t < elapsed:
                now = phase.state(t)
                if t == 0.0 and phase is self._contact:
                    _, _, x_club, compression, v_club, v_ball, _ = self._contact_start
                    now[1:] = x_club, x_club - compression, v_club, v_ball, compression
                # Within a rounding error of touch or separation: bodies push, they don't pull.
                if now[0] < 0.0 or now[5] < 0.0:
                    now[0] = 0.0
                    if now[5] < 0.0:
                        now[2], now[5] = now[1], 0.0
                return now
            if elapsed:
                # Two-sum: the rounding error of the sum goes into the low part.
                begin = self._high
                end = begin + elapsed
                back = end - begin
                self._low += (begin - (end - back)) + (elapsed - back)
                self._high = end
                after = (high - end) + (low - self._low)
                if t == elapsed or after < 0.0:
                    # Now, to the last bit of the clock.
                    self._high, self._low = high, low
                    after = 0.0
                t = after
            if self.touch is None:
                u_club, u_ball = phase.u_club, phase.u_ball
                x_ball = phase.x_ball + u_ball * elapsed
                self.touch = (self._high, self._low, x_ball, u_club)
                self._enter_contact(x_ball, 0.0, u_club, u_ball, u_club - u_ball)
            else:
                self._finish(phase, elapsed)
                start, closing = phase.end()
                self.phase = Flight(start, closing)

    def course(
        self, high: float, low: float
    ) -> tuple[Callable[[float], State], float, float, float]:
        """The present phase: its `state`, how long it has lasted, and how long it lasts.

        Both as the state wants time, and last how that grows in a second.
        """
        t = (high - self._high) + (low - self._low)
        phase = self.phase
        if not self.in_contact:
            return phase.state, t, phase.duration, 1.0
        # Next to touch and separation `state` looks more closely.
        end = phase.duration * (1.0 - _CLOSE)
        state, scale, offset = phase.fast_state()
        until = scale * end + offset if t * phase.rate > _CLOSE else -inf
        return state, scale * t + offset, until, scale

    def _enter_contact(
        self, x_club: float, compression: float, v_club: float, v_ball: float, closing: float
    ) -> None:
        k, b, _ = self.in_force
        if self.parameters.restitution_at_rest:
            b = self._damping()
        start = self._contact_start = (k, b, x_club, compression, v_club, v_ball, closing)
        self.phase = self._contact = self._contact_phase(start)

    def _damping(self) -> float:
        """The damping that acts in this contact where it follows from a COR, N.s/m."""
        assert self.touch is not None
        p = self.parameters
        return damping(p, self.in_force[0], self.touch[3] - p.ball_speed)

    def refusal_of_touch(
        self, high: float, low: float, inputs: Inputs, step: float
    ) -> tuple[bool, str | None]:
        """Whether these inputs lead to a touch whose COR is out of reach; if in this step, why not.

        Nothing changes.
        """
        p = self.parameters
        closing = inputs[2] - p.ball_speed
        if closing <= 0.0 or not out_of_reach(p, closing):
            return False, None
        phase = self.phase
        t = (high - self._high) + (low - self._low)
        if self.touch is None:
            if t > phase.duration:
                return False, None
            _, x_club, x_ball, *_ = phase.state(t)
            if x_ball - x_club > closing * step * (1.0 + 1e-12):
                return True, None
        elif not (phase is self._contact and self._offset == t == 0.0):
            return False, None
        return True, (
            f"club_speed = {inputs[2]!r} m/s is refused at touch: restitution_at_rest - "
            f"restitution_slope * approach speed = {p.restitution_at_rest!r} - "
            f"{p.restitution_slope!r} * {closing!r} = {restitution(p, closing)!r} must be above 0 "
            "and at most 1; set a lower club_speed, or another restitution line at the start"
        )

    def _contact_phase(self, start: tuple[float, ...]) -> Any:
        k, b, x_club, compression, v_club, v_ball, closing = start
        p = self.parameters
        law: Any = KelvinVoigtContact if p.law == 2 else AbsoluteContact
        if p.exponent != 1.0:
            law = partial(
                PowerLawContact,
                exponent=p.exponent,
                reference_compression=p.reference_compression,
            )
        return law(k, b, p.m_club, p.m_ball, x_club, compression, v_club, v_ball, closing)

    def _finish(self, phase: Any, elapsed: float) -> None:
        self._finished += ((phase, elapsed, self._offset),)
        self._offset += elapsed
        if len(self._finished) >= _REMEMBERED:
            self._sum_up()

    def hold(self, high: float, low: float, inputs: Inputs) -> None:
        """Take these inputs from this instant on (the start of a communication step).

        A touch that falls on this very instant hasn't been passed yet, so it is decided anew.
        """
        before = self.in_force
        phase = self.phase
        t = (high - self._high) + (low - self._low)
        if self.touch is None:
            if t <= phase.duration:
                self.in_force = inputs
                if inputs[2] != before[2]:
                    self._approach_anew(phase, t, inputs[2])
                    self._high, self._low = high, low
                return
        elif phase is self._contact and self._offset == t == 0.0:
            x = self.touch[2]
            self.touch = self._contact = None
            self.in_force = inputs
            self.phase = Approach(x, 0.0, x, inputs[2], self.parameters.ball_speed)
            return
        self.state(high, low)
        self.in_force = inputs
        # With damping from a COR, b isn't used.
        acting = 1 if self.parameters.restitution_at_rest else 2
        if self.phase is self._contact and inputs[:acting] != before[:acting]:
            self._contact_changes(self.phase, (high - self._high) + (low - self._low))
            self._high, self._low = high, low

    def _approach_anew(self, phase: Approach, t: float, club_speed: float) -> None:
        # Two-sum again: a speed that changes at 10⁶ points still adds up to the right gap.
        step = phase.u_club * t
        x_club = phase.x_club + step
        back = x_club - phase.x_club
        x_low = phase.x_club_low + (phase.x_club - (x_club - back)) + (step - back)
        x_ball = phase.x_ball + phase.u_ball * t
        self.phase = Approach(x_club, x_low, x_ball, club_speed, self.parameters.ball_speed)

    def _contact_changes(self, phase: Any, t: float) -> None:
        """K or b changed in mid-contact: a new phase goes on from the present state."""
        now = phase.state(t)
        _, x_club, _, v_club, v_ball, compression = now
        self._finish(phase, t)
        k, b, _ = self.in_force
        p = self.parameters
        if p.restitution_at_rest:
            b = self._damping()
        closing = phase.closing(t)
        # A power law's phase ends at once by itself where its force is gone.
        if p.law == 2 and p.exponent == 1.0 and k * compression + b * closing <= 0.0:
            now[0] = 0.0
            self._contact = None
            self.phase = Flight(now, closing)
        else:
            self._enter_contact(x_club, compression, v_club, v_ball, closing)

    # State

    def snapshot(self) -> tuple:
        """Everything that changes, for `restored`; its parts are never changed in place."""
        return (
            self.parameters,
            self.in_force,
            self.phase,
            self._high,
            self._low,
            self.touch,
            self._contact,
            self._contact_start,
            self._offset,
            self._finished,
            self._peaks,
        )

    @classmethod
    def restored(cls, snapshot: tuple) -> "Impact":
        """The impact that a snapshot was taken of."""
        self = cls.__new__(cls)
        self.restore(snapshot)
        return self

    def restore(self, snapshot: tuple) -> None:
        """Become the impact that a snapshot was taken of."""
        (
            self.parameters,
            self.in_force,
            self.phase,
            self._high,
            self._low,
            self.touch,
            self._contact,
            self._contact_start,
            self._offset,
            self._finished,
            self._peaks,
        ) = snapshot

    def packed(self) -> list:
        """The same as numbers and lists of numbers, for `unpacked` in another process."""
        self._sum_up()
        phase = self.phase
        arguments = phase.arguments() if self.touch is None or phase is not self._contact else None
        return [
            self.parameters.values(),
            self.in_force,
            arguments,
            self._high,
            self._low,
            self.touch,
            self._contact_start,
            self._contact is not None,
            self._offset,
            self._peaks,
        ]

    @classmethod
    def unpacked(cls, packed: list) -> "Impact":
        """The impact that `packed` was taken of; phases are made again from the same numbers."""
        self = cls.__new__(cls)
        (
            parameters,
            in_force,
            arguments,
            high,
            low,
            touch,
            start,
            has_contact,
            offset,
            peaks,
        ) = packed
        self.parameters = Parameters(*parameters)
        self.in_force = tuple(in_force)
        self._high, self._low, self._offset = high, low, offset
        self.touch = tuple(touch) if touch is not None else None
        self._contact_start = tuple(start)
        self._contact = self._contact_phase(self._contact_start) if has_contact else None
        if arguments is None:
            self.phase = self._contact
        else:
            self.phase = (Approach if touch is None else Flight)(*arguments)
        self._finished = ()
        self._peaks = Peaks(*peaks)
        return self

    # Results so far. Each is asked for after `state` at the same instant, so the phase is right.

    @property
    def in_contact(self) -> bool:
        """Whether the bodies are in contact now."""
        return self.touch is not None and self.phase is self._contact

    def _now(self, high: float, low: float) -> float:
        return (high - self._high) + (low - self._low)

    def next_event(self, high: float, low: float) -> float:
        """The next touch or separation after this instant, s since the start; inf if none is."""
        self.state(high, low)
        return self._high + (self._low + self.phase.duration)

    def contact_time(self, high: float, low: float) -> float:
        """Time in contact so far, s."""
        return self._offset + (self._now(high, low) if self.in_contact else 0.0)

    def contact_displacement(self, state: State) -> float:
        """How far the ball has moved while in contact, m."""
        if self.touch is None:
            return 0.0
        x_ball = state[2] if self.in_contact else self.phase.start[2]
        return x_ball - self.touch[2]

    def impulse(self, high: float, low: float) -> float:
        """Impulse of the contact force so far, N.s."""
        self._sum_up()
        so_far = self._peaks.impulse
        if self.in_contact:
            so_far += _impulse_between(self.phase, 0.0, self._now(high, low))
        return so_far

    def peak_force(self, high: float, low: float) -> tuple[float, float]:
        """Largest contact force so far (N) and when it was, s since first touch."""
        self._sum_up()
        best = self._peaks.force, self._peaks.time
        if self.in_contact:
            force, when = self.phase.peak_force(self._now(high, low))
            if force > best[0]:
                return force, self._offset + when
        return best

    def peak_compression(self, high: float, low: float) -> float:
        """Largest compression so far, m."""
        self._sum_up()
        best = self._peaks.compression
        if self.in_contact:
            return max(best, self.phase.peak_compression(self._now(high, low)))
        return best

    def _sum_up(self) -> None:
        if not self._finished:
            return
        force, time, compression, impulse = self._peaks
        for phase, end, offset in self._finished:
            highest, when = phase.peak_force(end)
            if highest > force:
                force, time = highest, offset + when
            compression = max(compression, phase.peak_compression(end))
            impulse += _impulse_between(phase, 0.0, end)
        self._peaks = Peaks(force, time, compression, impulse)
        self._finished = ()

    def impulse_of_step(self, high: float, low: float, step: float) -> float:
        """Impulse of the contact force over the last `step` seconds, N.s.

        Relative to the step, not to the whole impulse: the mean force over a nanosecond is as good
        as the one over a millisecond.
        """
        contact = self._contact
        if contact is None:
            return 0.0
        end = self._now(high, low)
        if self.phase is not contact:
            end += contact.duration
        # Where the step began, from its own clock: with a step far longer than the contact, the
        # difference of two late times would tell nothing.
        before = high - step
        back = high - before
        lost = (high - (before + back)) + (back - step)
        begin = (before - self._high) + ((low - self._low) + lost)
        if self.phase is not contact:
            begin += contact.duration
        begin = max(0.0, begin)
        end = min(end, contact.duration)
        if begin >= end:
            return 0.0
        # The step itself is known better than the difference of two times.
        width = step if self.phase is contact and begin > 0.0 else end - begin
        return _impulse_between(contact, begin, end, width)


def _impulse_between(contact: Any, begin: float, end: float, width: float | None = None) -> float:
    """Impulse of the contact force from begin to end (s since the start of the phase), N.s.

    Over a short time the closed form is the small difference of large numbers; the force itself is
    smooth then, and Gauss's quadrature of it exact to a double.
    """
    width = end - begin if width is None else width
    rate = contact.rate
    if width * rate <= 0.5:
        return _gauss(contact, end, 0.5 * width)
    if contact.duration * contact.frequency > 1.0:
        return contact.impulse(begin, width)
    # Ended by the drag before the spring could, a contact has modes that nearly cancel. Panels are
    # short while the fastest one fades, and grow from then on.
    total = 0.0
    left = begin
    while left < end:
        panel = max(0.5 / rate, 0.15 * (left - 8.0 / rate))
        right = min(left + min(panel, 0.25 / contact.frequency), end)
        total += _gauss(contact, right, 0.5 * (right - left))
        left = right
    # The width is known better than its ends are.
    return total * (width / (end - begin))


def _gauss(contact: Any, end: float, half: float) -> float:
    """The integral of the contact force over the last 2 * half seconds before end, N.s."""
    return half * sum(
        weight * contact.state(end - half * (1.0 - node))[0] for node, weight in GAUSS_5
    )
