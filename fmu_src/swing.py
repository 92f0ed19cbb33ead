"""A companion FMU: a golf swing as a double pendulum, coupled with the impact by its impulse.

From address the club is taken back, in `backswing_time`, along the path of its downswing; at the
top it rests. From there on a double pendulum (double_pendulum.py) moves until the arms point
straight down: there lies the ball. Then the torques decay, and the swing ends when the arms are as
far beyond the ball as they were before it.

`club_speed`, `impulse`, `reaction_impulse` and `effective_mass` are components along the normal of
the club face, which points `spin_loft` above the head's path at impact; `head_speed` is along the
path.

A step applies the difference between `impulse`, what the contact has transmitted since the start,
and `reaction_impulse`, what earlier steps have applied, as a constant force against the normal.
Before the top and after the end the golfer holds the club, and the impulse has no effect on it.

`club_speed` is for an importer that holds it over each step, of unknown length. It is positive
before the ball only with the speed at the ball, V: a head that starts at the ball or behind it
touches the ball with V, for every sequence of step sizes. It is negative while the club is taken
back and 0 then, until the time left to the ball is what the distance left takes with V. After touch
it is the head's own speed.

An importer that needs a speed and no mechanics sets its peak, `prescribed_speed`: the club is taken
back at `takeaway_speed`, far enough for a smooth rise in `rise_time` to a peak that is held; touch
falls after the peak if steps are equal or shorter than half of `rise_time`. The other outputs are
0 then.

The start values are those of C.-C. Chiang, The Simple Golf Simulator (GTS Sporting, 2016,
github.com/markccchiang/Simple-Golf-Simulator).
"""

from math import cos, pi, sin

from companion import Companion
from double_pendulum import HELD, Ball, Golfer, Motion, State

_CLUB_INERTIA = "Of the club about the wrist; at least club_first_moment^2 / club_mass"
_RELEASE = "The wrist is held until the arms are this far from straight down; arm_start: not held"
_PRESCRIBED = "Peak of a prescribed speed instead of a swing; 0: none"
_LOFT = "Angle between the head's path at the ball and the normal of the club face"

#: Name, unit, start, least and greatest allowed value, description.
PARAMETERS = (
    ("arm_length", "m", 0.57541289523263207, 1e-3, 1e3, "From the shoulder to the wrist"),
    ("arm_first_moment", "kg.m", 1.2369940958785244, 0.0, 1e6, "Of the arms about the shoulder"),
    ("arm_inertia", "kg.m2", 0.44607395, 1e-6, 1e6, "Of the arms about the shoulder"),
    ("club_length", "m", 1.05, 1e-3, 1e3, "From the wrist to the middle of the head"),
    ("club_mass", "kg", 0.3, 1e-6, 1e3, "Mass of the club: its head has 0.2 kg of it"),
    ("club_first_moment", "kg.m", 0.26, 1e-6, 1e6, "Of the club about the wrist"),
    ("club_inertia", "kg.m2", 0.26**2 / 0.3, 1e-6, 1e6, _CLUB_INERTIA),
    ("max_shoulder_torque", "N.m", 100.0, -1e6, 1e6, "Of the body on the arms, once risen"),
    ("max_wrist_torque", "N.m", 20.64, -1e6, 1e6, "Of the hands on the club, once risen"),
    ("torque_rise_time", "s", 0.01, 1e-4, 1e3, "Time constant with which torques rise and fall"),
    ("arm_start", "rad", 0.75 * pi, 0.01, pi, "Of the arms from straight down, at the top"),
    ("wrist_start", "rad", 2.0 * pi / 3.0, -pi, pi, "Between arms and club at the top"),
    ("release_angle", "rad", 0.75 * pi, 0.0, pi, _RELEASE),
    ("gravity", "m/s2", 9.806, 0.0, 1e3, "Gravitational acceleration"),
    ("plane_angle", "rad", pi / 3.0, 0.0, 0.5 * pi, "Of the swing's plane above the ground"),
    ("backswing_time", "s", 0.75, 1e-3, 1e3, "From address to the top"),
    ("spin_loft", "rad", 0.0, -1.5, 1.5, _LOFT),
    ("prescribed_speed", "m/s", 0.0, 0.0, 1e6, _PRESCRIBED),
    ("rise_time", "s", 0.01, 1e-9, 1e3, "Duration of its rise"),
    ("takeaway_speed", "m/s", 10.0, 1e-9, 1e6, "Speed at which the club is taken back before"),
)

#: Name, unit, start, least and greatest allowed value, description.
INPUTS = (
    ("impulse", "N.s", 0.0, -1e9, 1e9, "On the club head since the start, against the normal"),
)

#: Name, unit, description.
OUTPUTS = (
    ("club_speed", "m/s", "Along the normal, for the next step; the head's own after touch"),
    ("head_speed", "m/s", "Of the club head along its path; negative while it is taken back"),
    ("arm_angle", "rad", "Of the arms from straight down, towards the target"),
    ("club_angle", "rad", "Of the club from straight down, towards the target"),
    ("shoulder_torque", "N.m", "Of the body on the arms; 0 while the club is taken back"),
    ("wrist_torque", "N.m", "Of the hands on the club, also where it is held; 0 as above"),
    ("hand_force", "N", "Of the hands on the club, in the plane of the swing; 0 as above"),
    ("energy", "J", "Kinetic and potential, of arms and club; 0 at rest straight down"),
    ("work", "J", "Of the two torques since the top"),
    ("reaction_work", "J", "Of the head against the impulse"),
    ("reaction_impulse", "N.s", "Applied so far: `impulse` at the begin of the last step"),
    ("effective_mass", "kg", "Of the head at the ball along the normal, with club and arms"),
)

DESCRIPTION = "A golf swing as a double pendulum, from address through the ball"

#: References of the outputs that are computed from the motion when they are read.
_MOVING = {
    len(PARAMETERS) + len(INPUTS) + n
    for n, (name, *_) in enumerate(OUTPUTS)
    if name not in ("club_speed", "reaction_work", "reaction_impulse")
}

#: Of the time since the start: differences smaller than this are rounding errors.
_ROUNDING = 1e-12


class Swing(Companion):
    """A golf swing over time; see the module's text."""

    reaction_impulse: float

    inside = ("_time", "_lost", "_rise", "_motion", "_origin", "_ball", "_position", "_current")
    objects = ("_motion", Motion), ("_ball", Ball)
    tables = PARAMETERS, INPUTS, OUTPUTS

    #: Sum of the accepted steps, s, and its Kahan compensation: the same in every importer, however
    #: that counts its time.
    _time = _lost = 0.0
    #: Start of the rise of a prescribed speed, s since the start.
    _rise: float | None = None
    #: The motion, its begin (s since the start), and how it meets the ball, likewise.
    _motion: Motion | None = None
    _origin = 0.0
    _ball: Ball | None = None
    #: The integral of club_speed over the steps: the importer's head, m from the ball.
    _position = 0.0
    #: Whether the outputs of the motion belong to this communication point.
    _current = False

    def _begin(self) -> str | None:
        if self.prescribed_speed:
            self.club_speed = -self.takeaway_speed
            return None
        if self.club_inertia * self.club_mass < self.club_first_moment**2 * (1.0 - 1e-12):
            return (
                f"club_inertia = {self.club_inertia!r} is refused: with this mass and first moment "
                f"it must be at least {self.club_first_moment**2 / self.club_mass:g}"
            )
        values = {name: getattr(self, name) for name in Golfer._fields}
        golfer = Golfer(**values | {"gravity": self.gravity * sin(self.plane_angle)})
        top = State(-self.arm_start, -self.arm_start - self.wrist_start, *[0.0] * 5)
        try:
            motion = Motion(golfer, top, HELD)
            ball = motion.ball(self.spin_loft)
        except (ArithmeticError, ValueError) as error:
            return f"these parameters leave the range of a double ({error})"
        if ball is None:
            return "these parameters are refused: the arms don't reach the ball"
        self._motion, self._origin = motion, self.backswing_time
        self._ball = ball._replace(time=ball.time + self._origin)
        return None

    def _step(self, current_time: float, size: float) -> str | None:
        exact = size - self._lost
        end = self._time + exact
        if self._motion and self._ball:
            problem = self._swing(size, end, self._motion, self._origin, self._ball)
            if problem:
                return problem
        else:
            self._follow_prescribed_speed(size, end)
        self._time, self._lost, self._current = end, (end - self._time) - exact, False
        self.reaction_impulse = self.impulse
        return None

    def _swing(
        self, size: float, end: float, motion: Motion, origin: float, ball: Ball
    ) -> str | None:
        begin = self._time
        if begin < ball.time and size > 0.5 * ball.time:
            return (
                f"step size = {size!r} s is refused: until the ball is hit it must be at most "
                f"{0.5 * ball.time:g} s, half of the swing"
            )
        force = (self.impulse - self.reaction_impulse) / size
        if force != motion.force and begin >= origin:
            motion = Motion(motion.golfer, *motion.at(begin - origin), force, ball.normal)
            origin = begin
            if begin < ball.time:
                met = motion.ball(self.spin_loft)
                if met:
                    ball = met._replace(time=met.time + origin, normal=ball.normal)
        work = motion.work_against(begin - origin, end - origin) if motion.force else 0.0
        position = self._position + self.club_speed * size
        flat, rounding = cos(self.spin_loft), ball.speed * end * _ROUNDING
        if position >= -rounding and (self.club_speed > 0.0 or end >= ball.time):
            speed = motion.at(end - origin)[0].head_speed(motion.golfer) * flat
        else:
            waiting, after = position, end + size
            if after <= self.backswing_time:
                # To half the distance of the line at the top, but not faster than V: a next step
                # longer than the last one would bring it far off.
                back = 0.5 * ball.speed * (ball.time - self.backswing_time)
                head = max(-back * after / self.backswing_time, position - ball.speed * size)
                waiting = min(position, head)
            speed = _approach(position, waiting, end, size, ball, rounding)
        self._motion, self._origin, self._ball = motion, origin, ball
        self._position, self.club_speed = position, speed
        self.reaction_work += work
        return None

    def get_real(self, vrs):
        motion, ball, time = self._motion, self._ball, self._time
        if motion and ball and not self._current and not _MOVING.isdisjoint(vrs):
            golfer, state = motion.golfer, _state_at(motion, self._origin, ball, time)
            speed, down = state.head_speed(golfer), time - self._origin
            self.head_speed = -speed if down < 0.0 else speed
            self.arm_angle, self.club_angle = state.arm, state.club
            hands = (0.0, 0.0) if down < 0.0 else motion.hands(down, state)
            self.hand_force, self.wrist_torque = hands
            self.shoulder_torque, self.effective_mass = state.shoulder_torque, ball.effective_mass
            self.energy, self.work, self._current = state.energy(golfer), state.work, True
        return super().get_real(vrs)

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


def _state_at(motion: Motion, origin: float, ball: Ball, time: float) -> State:
    """The state at a time (s) since the start of the swing.

    The backswing is the downswing in reverse: from the ball to the top with
    x^3 (10 - 15 x + 6 x^2), which begins and ends at rest.
    """
    if time >= origin:
        return motion.at(time - origin)[0]
    x, down = time / origin, ball.time - origin
    share = x * x * x * (10.0 - x * (15.0 - 6.0 * x))
    pace = -30.0 * (x * (1.0 - x)) ** 2 * down / origin
    state = motion.at(down * (1.0 - share))[0]
    back = {"arm_rate": state.arm_rate * pace, "club_rate": state.club_rate * pace}
    return state._replace(**back, shoulder_torque=0.0, wrist_torque=0.0, work=0.0)
