"""A golf swing as a double pendulum, coupled with the impact by its impulse.

From address the club is taken back, in `backswing_time`, along the path of its downswing; at the
top it rests. From there on a double pendulum (double_pendulum.py) moves until the arms point
straight down: there lies the ball. Then the torques decay, and the swing ends when the arms are as
far beyond the ball as they were before it.

A step applies the difference between `impulse`, what the contact has transmitted since the start,
and `reaction_impulse`, what earlier steps have applied, as a constant force against the normal.
Before the top and after the end the golfer holds the club, and the impulse has no effect on it.

`club_speed` is for an importer that holds it over each step, of unknown length. Before the ball it
is at most 0, or V, the speed at the ball: a head that starts at the ball or behind it touches the
ball with V, for every sequence of step sizes. It is negative while the club is taken back and 0
then, until the time left to the ball is what the distance left takes with V. After touch it is the
head's own speed.

An importer that needs a speed and no mechanics sets its peak, `prescribed_speed`: the club is taken
back at `takeaway_speed`, far enough for a smooth rise in `rise_time` to a peak that is held; touch
falls after the peak if steps are equal or shorter than half of `rise_time`. The other outputs are
0 then. The start values, with their source: swing.toml.
"""

from math import cos, nan, pi, sin
from typing import ClassVar

from ..values import Refusal, rejected
from .companion import Companion
from .double_pendulum import HELD, Ball, Golfer, Motion, State

#: Outputs that a step computes; the others are computed from the motion when they are read.
_STEPPED = ("club_speed", "reaction_work", "reaction_impulse")

#: Of the time since the start: differences smaller than this are rounding errors.
_ROUNDING = 1e-12


class Swing(Companion):
    """A golf swing over time; see the module's text."""

    reaction_work: float

    inside: ClassVar = ("_time", "_lost", "_rise", "_motion", "_ball", "_position", "_current")
    classes: ClassVar = (Motion, Golfer, State, Ball)

    #: Sum of the accepted steps, s, and its Kahan compensation: the same in every importer, however
    #: that counts its time.
    _time = _lost = 0.0
    #: Start of the rise of a prescribed speed, s since the start.
    _rise: float | None = None
    #: The motion from the top on or from the last change of the force, and how it meets the ball.
    _motion: Motion | None = None
    _ball: Ball | None = None
    #: The integral of club_speed over the steps: the importer's head, m from the ball.
    _position = 0.0
    #: Whether the outputs of the motion belong to this communication point.
    _current = False

    def _begin(self) -> Refusal | None:
        if self.prescribed_speed:
            self.club_speed = -self.takeaway_speed
            return None
        if self.club_inertia * self.club_mass < self.club_first_moment**2 * (1.0 - 1e-12):
            least = self.club_first_moment**2 / self.club_mass
            why = f"with this mass and first moment it must be at least {least:g}"
            return rejected("club_inertia", self.club_inertia, why)
        values = {name: getattr(self, name) for name in Golfer._fields}
        golfer = Golfer(**values | {"gravity": self.gravity * sin(self.plane_angle)})
        top = State(-self.arm_start, -self.arm_start - self.wrist_start, *[0.0] * 5)
        try:
            motion = Motion(golfer, self.backswing_time, top, HELD)
            ball = motion.ball(self.spin_loft)
        except (ArithmeticError, ValueError) as error:
            return Refusal(f"these parameters leave the range of a double ({error})")
        if ball is None:
            return Refusal("these parameters are refused: the arms don't reach the ball")
        self._motion, self._ball = motion, ball
        return None

    def _step(self, current_time: float, size: float) -> Refusal | None:
        exact = size - self._lost
        end = self._time + exact
        if self._motion and self._ball:
            problem = self._swing(size, end, self._motion, self._ball)
            if problem:
                return problem
        else:
            self._follow_prescribed_speed(size, end)
        self._time, self._lost, self._current = end, (end - self._time) - exact, False
        self.reaction_impulse = self.impulse
        return None

    def _swing(self, size: float, end: float, motion: Motion, ball: Ball) -> Refusal | None:
        begin = self._time
        if begin < ball.time and size > 0.5 * ball.time:
            half = f"{0.5 * ball.time:g} s, half of the swing"
            why = f"until the ball is hit it must be at most {half}"
            return rejected("step size", size, why, " s")
        force = (self.impulse - self.reaction_impulse) / size
        if force != motion.force and begin >= motion.origin:
            motion = Motion(
                motion.golfer, begin, *motion.at(begin - motion.origin), force, ball.normal
            )
            met = motion.ball(self.spin_loft) if begin < ball.time else None
            ball = met._replace(normal=ball.normal) if met else ball
        work = motion.work_against(begin - motion.origin, end - motion.origin)
        position = self._position + self.club_speed * size
        rounding = ball.speed * end * _ROUNDING
        if position >= -rounding and (self.club_speed > 0.0 or end >= ball.time):
            head = motion.at(end - motion.origin)[0]
            speed = head.head_speed(motion.golfer) * cos(self.spin_loft)
        else:
            waiting, after = position, end + size
            if after <= self.backswing_time:
                # To half the distance of the line at the top, but not faster than V: a next step
                # longer than the last one would bring it far off.
                back = 0.5 * ball.speed * (ball.time - self.backswing_time)
                line = max(-back * after / self.backswing_time, position - ball.speed * size)
                waiting = min(position, line)
            speed = _approach(position, waiting, end, size, ball, rounding)
        self._motion, self._ball = motion, ball
        self._position, self.club_speed = position, speed
        self.reaction_work += work
        return None

    def reals(self, references: list[int]) -> list[float]:
        motion, ball = self._motion, self._ball
        rows = (self._rows.get(("Real", reference)) for reference in references)
        stepped = (row is None or row.name in _STEPPED for row in rows)
        if motion and ball and not self._current and not all(stepped):
            try:
                self._evaluate(motion, ball, self._time)
            except (ArithmeticError, ValueError) as error:
                self._report(Refusal(f"this swing leaves the range of a double ({error})"))
                return [nan] * len(references)
        return super().reals(references)

    def _evaluate(self, motion: Motion, ball: Ball, time: float) -> None:
        down = time - motion.origin
        state = motion.at(down)[0] if down >= 0.0 else _backswing(motion, ball, time)
        speed = state.head_speed(motion.golfer)
        self.head_speed = speed if down >= 0.0 else -speed
        hands = motion.hands(down, state) if down >= 0.0 else (0.0, 0.0)
        self.arm_angle, self.club_angle = state.arm, state.club
        self.hand_force, self.wrist_torque = hands
        self.shoulder_torque, self.effective_mass = state.shoulder_torque, ball.effective_mass
        self.energy, self.work = state.energy(motion.golfer), state.work
        self._current = True

    def _follow_prescribed_speed(self, size: float, end: float) -> None:
        peak, back = self.prescribed_speed, self.takeaway_speed
        # A step more than needed: some importers pass an output on only one step later.
        if self._rise is None and back * end >= peak * self.rise_time + back * size:
            self._rise = end
        since = 0.0 if self._rise is None else min(end - self._rise, self.rise_time)
        share = 0.5 * (1.0 - cos(pi * since / self.rise_time))
        self.club_speed = share * peak - (1.0 - share) * back


def _approach(
    position: float, waiting: float, end: float, size: float, ball: Ball, rounding: float
) -> float:
    """The speed to be held over the next step, on the way to the ball.

    A head on the line `distance = ball.speed * (time left)` meets the ball in time with
    `ball.speed`. Every other speed is at most 0, since the next step may be of any length.

    Args:
        position: of the importer's head, m from the ball.
        waiting: where it waits for the line after the next step; at most `position`.
        end: time since the start, s.
        size: of the last step, s: the best guess at that of the next.
        ball: how the head meets the ball.
        rounding: m, a difference that counts as none.
    """
    line, after = (ball.speed * (time - ball.time) for time in (end, end + size))
    if position <= line + rounding:
        return ball.speed
    if position < after - rounding:
        # Too early now, too late after another step: what is less.
        return ball.speed if position - line < after - position else 0.0
    # The last point at which the line can be reached without a positive speed.
    target = after if waiting < after + ball.speed * size - rounding else waiting
    return min((min(target, position) - position) / size, 0.0)


def _backswing(motion: Motion, ball: Ball, time: float) -> State:
    """The state at a time (s) before the top: the downswing in reverse.

    The path from the ball to the top is x^3 (10 - 15 x + 6 x^2), which begins and ends at rest.
    """
    x, down = time / motion.origin, ball.time - motion.origin
    share = x * x * x * (10.0 - x * (15.0 - 6.0 * x))
    pace = -30.0 * (x * (1.0 - x)) ** 2 * down / motion.origin
    state = motion.at(down * (1.0 - share))[0]
    back = {"arm_rate": state.arm_rate * pace, "club_rate": state.club_rate * pace}
    return state._replace(**back, shoulder_torque=0.0, wrist_torque=0.0, work=0.0)
