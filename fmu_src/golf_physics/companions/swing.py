"""A golf swing as a double pendulum, coupled with the impact by its impulse.

Arms and club in the plane of the swing are two rods, driven by a torque at the shoulder and one at
the wrist (T. P. Jorgensen, The Physics of Golf, 2nd edition, Springer 1999). With the angles p of
the arms and q of the club from straight down, positive towards the target, c = cos(q - p), s =
sin(q - p), and a force F on the club head against the direction d:

    A p'' + B c q'' = B s q'^2 - a sin p + S - W - F R cos(p - d)
    I q'' + B c p'' = -B s p'^2 - b sin q + W - F L cos(q - d)

A = J + M R^2, B = R s_C, a = (s_A + M R) g sin(plane), b = s_C g sin(plane). The torques S and W
rise and fall exponentially.

The club rests at the top for `backswing_time`. Until the wrist is released the club is held at its
angle to the arms, q' = p'. The ball lies where the head comes when the arms point straight down;
then the torques decay, and the swing ends when the arms are as far beyond the ball as they were
before it. d is the normal of the club face at the ball.

A step applies the difference between `impulse`, what the contact has transmitted since the start,
and `reaction_impulse`, what earlier steps have applied, as a constant force. Before the top and
after the end the golfer holds the club, and the impulse has no effect on it.

`club_speed` is for an importer that holds it over each step, of unknown length. Before the ball it
is at most 0, or V, the speed at the ball: a head that starts at the ball or behind it touches the
ball with V, for every sequence of step sizes, and after touch it is the head's own speed. It is a
tenth of V backwards until the time left to the ball is what the distance left takes with V.
"""

from cmath import polar, rect
from functools import cached_property
from math import cos, inf, sin
from typing import ClassVar, NamedTuple

from ..numerics.runge_kutta import Solution, Values
from ..values import START, Refusal, added, rejected
from .companion import Companion

#: The stages of a swing, in their order: the wrist is held; it is released; behind the ball the
#: torques fall off as they rose; at rest, as far beyond the ball as it was before it.
HELD, RELEASED, BEYOND, FINISHED = range(4)

#: Errors of a step, relative to a radian, the rates and the torques.
_TOLERANCE = 1e-10

#: Of the time since the start: differences smaller than this are rounding errors.
_ROUNDING = 1e-12


class State(NamedTuple):
    """An instant of a swing, SI units."""

    arm: float
    club: float
    arm_rate: float = 0.0
    club_rate: float = 0.0
    shoulder_torque: float = 0.0
    wrist_torque: float = 0.0
    stage: int = HELD  #: HELD, RELEASED, BEYOND the ball or FINISHED


class Golfer:
    """Arms and club, from the values of Swing's parameters by name."""

    def __init__(self, given: dict[str, float]) -> None:
        self.arguments = (given,)
        self.arm_length, self.club_length = given["arm_length"], given["club_length"]
        self.shoulder, self.wrist = given["max_shoulder_torque"], given["max_wrist_torque"]
        self.rise_time, self.release = given["torque_rise_time"], given["release_angle"]
        self.start, self.club_inertia = given["arm_start"], given["club_inertia"]
        moment, outer = given["club_first_moment"], given["club_mass"] * self.arm_length
        weight = given["gravity"] * sin(given["plane_angle"])
        # A, B, a and b of the module's text.
        self.inertia = given["arm_inertia"] + outer * self.arm_length
        self.mixed = self.arm_length * moment
        self.arm_weight = (given["arm_first_moment"] + outer) * weight
        self.club_weight = moment * weight

    def head_velocity(self, state: State) -> tuple[float, float]:
        """Speed of the head along its path (m/s), and its direction above the ground."""
        hands = rect(self.arm_length * state.arm_rate, state.arm)
        return polar(hands + rect(self.club_length * state.club_rate, state.club))

    def effective_mass(self, state: State, direction: float) -> float:
        """Of the head for a force in this direction, kg."""
        mixed = self.mixed * cos(state.club - state.arm)
        p = self.arm_length * cos(state.arm - direction)
        q = self.club_length * cos(state.club - direction)
        determinant = self.inertia * self.club_inertia - mixed * mixed
        return determinant / (
            self.club_inertia * p * p - 2.0 * mixed * p * q + self.inertia * q * q
        )


class Motion:
    """A swing from a state on, to the end of its stage and then by the following motion.

    Args:
        golfer: arms and club.
        origin: when it begins, s.
        state: at the origin, and before it.
        force: on the head, constant, N.
        direction: against which it acts, rad above the ground.
    """

    def __init__(
        self, golfer: Golfer, origin: float, state: State, force: float, direction: float
    ) -> None:
        self.arguments = golfer, origin, state, force, direction
        self.golfer, self.origin, self.force, self.direction = golfer, origin, force, direction
        *start, self.stage = state
        if self.stage == FINISHED:
            start[2:] = [0.0] * 4
        # A wrist that isn't held is released at once.
        goal = (-golfer.release, 0.0, golfer.start, inf)[self.stage]
        left, slope = (lambda m: goal - m[0]), (lambda m: -m[2])
        self._path = Solution(self._slopes, start, golfer.rise_time, self._allowed, left, slope)

    @cached_property
    def following(self) -> "Motion":
        """The motion from the end of this stage on."""
        self._path.covers(inf)
        stage = self.stage + 1 if self._path.has_ended else FINISHED
        state, end = State._make((*self._path.values[-1], stage)), self.origin + self._path.end
        return Motion(self.golfer, end, state, self.force, self.direction)

    def at(self, time: float) -> State:
        t = max(time - self.origin, 0.0)
        if not self._path.covers(t):
            return self.following.at(time)
        return State._make((*self._path.at(t), self.stage))

    def _allowed(self, motion: Values) -> Values:
        """Errors of a step."""
        golfer = self.golfer
        rate = _TOLERANCE * max(1.0, abs(motion[2]), abs(motion[3]))
        torque = _TOLERANCE * (abs(golfer.shoulder) + abs(golfer.wrist) + _TOLERANCE)
        return _TOLERANCE, _TOLERANCE, rate, rate, torque, torque

    def _slopes(self, motion: Values) -> Values:
        """Of a `State` without its stage: the equations of the module's text."""
        if self.stage == FINISHED:
            return (0.0,) * len(motion)
        p, q, u, w, shoulder, wrist = motion
        golfer, force, direction = self.golfer, self.force, self.direction
        inertia, club_inertia = golfer.inertia, golfer.club_inertia
        c, s = golfer.mixed * cos(q - p), golfer.mixed * sin(q - p)
        first = s * w * w - golfer.arm_weight * sin(p) + shoulder - wrist
        first -= force * golfer.arm_length * cos(p - direction)
        second = -s * u * u - golfer.club_weight * sin(q) + wrist
        second -= force * golfer.club_length * cos(q - direction)
        if self.stage == HELD:
            u2 = w2 = (first + second) / (inertia + club_inertia + 2.0 * c)
        else:
            determinant = inertia * club_inertia - c * c
            u2 = (club_inertia * first - c * second) / determinant
            w2 = (inertia * second - c * first) / determinant
        shoulder_left = golfer.shoulder * (self.stage <= RELEASED) - shoulder
        wrist_left = golfer.wrist * (self.stage == RELEASED) - wrist
        rate = 1.0 / golfer.rise_time
        return u, w, u2, w2, rate * shoulder_left, rate * wrist_left


class Swing(Companion):
    """A golf swing over time; see the module's text."""

    club_speed: float
    reaction_impulse: float

    inside: ClassVar = ("_instant", "_motion", "_ball", "_position")
    classes: ClassVar = (Motion, Golfer, State)

    #: Sum of the accepted steps: the same in every importer, however that counts its time.
    _instant = START
    #: The motion from the top on or from the last change of the force.
    _motion: Motion = None  # type: ignore[assignment]
    #: When the head meets the ball (s), its speed along the normal of the club face then (m/s), and
    #: the direction of that (rad above the ground).
    _ball = 0.0, 0.0, 0.0
    #: The integral of club_speed over the steps: m from the ball.
    _position = 0.0

    def _begin(self) -> Refusal | None:
        least = self.club_first_moment**2 / self.club_mass
        if self.club_inertia < least * (1.0 - 1e-12):
            why = f"with this mass and first moment it must be at least {least:g}"
            return rejected("club_inertia", self.club_inertia, why)
        golfer = Golfer(self.values())
        top = State(-self.arm_start, -self.arm_start - self.wrist_start)
        self._motion = motion = Motion(golfer, self.backswing_time, top, 0.0, 0.0)
        try:
            while motion.stage < BEYOND:
                motion = motion.following
            reached = motion.stage == BEYOND
        except ArithmeticError:
            reached = False
        if not reached:
            return Refusal("these parameters are refused: the arms don't reach the ball")
        state = motion.at(motion.origin)
        speed, path = golfer.head_velocity(state)
        normal = path + self.spin_loft
        self._ball = motion.origin, speed * cos(self.spin_loft), normal
        self.effective_mass = golfer.effective_mass(state, normal)
        self._show(top)
        return None

    def _step(self, point: float, size: float) -> Refusal | None:
        (ball, _, normal), begin = self._ball, self._instant[0]
        motion, instant = self._motion, added(self._instant, size)
        if begin < ball and size > 0.5 * ball:
            why = f"until the ball is hit it must be at most {0.5 * ball:g} s, half of the swing"
            return rejected("step size", size, why, " s")
        force = (self.impulse - self.reaction_impulse) / size
        if force != motion.force and begin >= motion.origin:
            motion = Motion(motion.golfer, begin, motion.at(begin), force, normal)
        state = motion.at(instant[0])
        self._motion, self._instant, self.reaction_impulse = motion, instant, self.impulse
        self._show(state)
        self._position += self.club_speed * size
        self.club_speed = self._next_speed(instant[0], size)
        return None

    def _show(self, state: State) -> None:
        self.head_speed, _ = self._motion.golfer.head_velocity(state)
        self.arm_angle, self.club_angle = state.arm, state.club

    def _next_speed(self, end: float, size: float) -> float:
        """`club_speed` after a step of this size, the best guess at that of the next one.

        A head on the line `distance = V * (time left)` meets the ball in time.
        """
        (ball, speed, _), position = self._ball, self._position
        if position > speed * end * _ROUNDING:  # else it may still have to touch
            return self.head_speed * cos(self.spin_loft)
        line, after = (speed * (time - ball) for time in (end, end + size))
        # Too early now, or too late after another step: what is less.
        if position - line < after - position:
            return speed
        waiting = position - 0.1 * speed * size
        # The last point at which the line can be reached without a positive speed.
        target = waiting if after + speed * size <= waiting else after
        return min(target - position, 0.0) / size
