"""A golf swing as a double pendulum, coupled with the impact by its impulse.

The club rests at the top for `backswing_time`. From there on a double pendulum (double_pendulum.py)
moves until the arms point straight down: there lies the ball. Then the torques decay, and the swing
ends when the arms are as far beyond the ball as they were before it.

A step applies the difference between `impulse`, what the contact has transmitted since the start,
and `reaction_impulse`, what earlier steps have applied, as a constant force against the normal.
Before the top and after the end the golfer holds the club, and the impulse has no effect on it.

`club_speed` is for an importer that holds it over each step, of unknown length. Before the ball it
is at most 0, or V, the speed at the ball: a head that starts at the ball or behind it touches the
ball with V, for every sequence of step sizes, and after touch it is the head's own speed. It is a
tenth of V backwards until the time left to the ball is what the distance left takes with V. The
start values, with their source: swing.toml.
"""

from math import cos, sin
from typing import ClassVar

from ..values import START, Refusal, added, rejected
from .companion import Companion
from .double_pendulum import Ball, Golfer, Motion, State

#: Of the time since the start: differences smaller than this are rounding errors.
_ROUNDING = 1e-12


class Swing(Companion):
    """A golf swing over time; see the module's text."""

    club_speed: float
    head_speed: float
    reaction_impulse: float
    reaction_work: float

    inside: ClassVar = ("_instant", "_motion", "_ball", "_position")
    classes: ClassVar = (Motion, Golfer, State, Ball)

    #: Sum of the accepted steps: the same in every importer, however that counts its time.
    _instant = START
    #: The motion from the top on or from the last change of the force.
    _motion: Motion = None  # type: ignore[assignment]
    #: How the swing meets the ball, and the integral of club_speed over the steps: m from the ball.
    _ball: Ball = None  # type: ignore[assignment]
    _position = 0.0

    def _begin(self) -> Refusal | None:
        least = self.club_first_moment**2 / self.club_mass
        if self.club_inertia < least * (1.0 - 1e-12):
            why = f"with this mass and first moment it must be at least {least:g}"
            return rejected("club_inertia", self.club_inertia, why)
        r, weight = self.arm_length, self.gravity * sin(self.plane_angle)
        couples = {
            "inertia": self.arm_inertia + self.club_mass * r * r,
            "mixed": r * self.club_first_moment,
            "arm_weight": (self.arm_first_moment + self.club_mass * r) * weight,
            "club_weight": self.club_first_moment * weight,
        }
        own = [name for name in Golfer._fields if name not in couples]
        golfer = Golfer(**{name: getattr(self, name) for name in own}, **couples)
        top = State(-self.arm_start, -self.arm_start - self.wrist_start)
        self._motion = Motion(golfer, self.backswing_time, top)
        try:
            ball = self._motion.ball(self.spin_loft)
        except ArithmeticError:
            ball = None
        if ball is None:
            return Refusal("these parameters are refused: the arms don't reach the ball")
        self._ball, self.effective_mass = ball, ball.effective_mass
        self._show(top, golfer)
        return None

    def _step(self, point: float, size: float) -> Refusal | None:
        motion, ball, begin = self._motion, self._ball, self._instant[0]
        instant = added(self._instant, size)
        if begin < ball.time and size > 0.5 * ball.time:
            half = f"{0.5 * ball.time:g} s, half of the swing"
            why = f"until the ball is hit it must be at most {half}"
            return rejected("step size", size, why, " s")
        force = (self.impulse - self.reaction_impulse) / size
        if force != motion.force and begin >= motion.origin:
            motion = Motion(motion.golfer, begin, motion.at(begin), force, ball.normal)
        golfer, state = motion.golfer, motion.at(instant[0])
        if motion.force:
            before, after = motion.at(begin).head(golfer), state.head(golfer)
            along, up = after[0] - before[0], after[1] - before[1]
            self.reaction_work += force * (along * cos(ball.normal) + up * sin(ball.normal))
        self._motion, self._instant, self.reaction_impulse = motion, instant, self.impulse
        self._show(state, golfer)
        self._position += self.club_speed * size
        self.club_speed = self._next_speed(instant[0], size)
        return None

    def _show(self, state: State, golfer: Golfer) -> None:
        self.head_speed, _ = state.head_velocity(golfer)
        self.arm_angle, self.club_angle, self.work = state.arm, state.club, state.work
        self.energy = state.energy(golfer)

    def _next_speed(self, end: float, size: float) -> float:
        """`club_speed` after a step of this size, the best guess at that of the next one.

        A head on the line `distance = V * (time left)` meets the ball in time.
        """
        ball, position = self._ball, self._position
        rounding = ball.speed * end * _ROUNDING
        if position >= -rounding and (self.club_speed > 0.0 or end >= ball.time):
            return self.head_speed * cos(self.spin_loft)
        line, after = (ball.speed * (time - ball.time) for time in (end, end + size))
        # Too early now, or too late after another step: what is less.
        if position - line < max(rounding, after - position):
            return ball.speed
        waiting = position - 0.1 * ball.speed * size
        # The last point at which the line can be reached without a positive speed.
        target = waiting if after + ball.speed * size <= waiting else after
        return min(target - position, 0.0) / size
