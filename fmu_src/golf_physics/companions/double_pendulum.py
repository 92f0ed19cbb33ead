"""The double pendulum of golf: arms and club in the plane of the swing.

Two rods, driven by a torque at the shoulder and one at the wrist (T. P. Jorgensen, The Physics of
Golf, 2nd edition, Springer 1999). With the angles p of the arms and q of the club from straight
down, positive towards the target, c = cos(q - p), s = sin(q - p), and a force F on the club head:

    A p'' + B c q'' = B s q'^2 - a sin p + S - W - F R cos(p - d)
    I q'' + B c p'' = -B s p'^2 - b sin q + W - F L cos(q - d)

A = J + M R^2, B = R s_C, a = (s_A + M R) g sin(plane), b = s_C g sin(plane). Until the wrist is
released the club is held at its angle to the arms, q' = p'. F acts against the direction d, the
normal of the club face at the ball. The torques S and W rise and fall exponentially.
"""

from functools import partial
from math import atan2, cos, inf, sin, sqrt
from typing import NamedTuple

from ..numerics.runge_kutta import Solution, Values

#: The stages of a swing, in their order: the wrist is held; it is released; behind the ball the
#: torques fall off as they rose; at rest, as far beyond the ball as it was before it.
HELD, RELEASED, BEYOND, FINISHED = range(4)

#: Errors of a step, relative to a radian, the rates and the torques.
_TOLERANCE = 1e-10


class Golfer(NamedTuple):
    """Arms and club: parameters by name, and the couples of the equations (SI units)."""

    arm_length: float
    club_length: float
    club_inertia: float
    max_shoulder_torque: float
    max_wrist_torque: float
    torque_rise_time: float
    arm_start: float
    release_angle: float
    inertia: float  #: A
    mixed: float  #: B
    arm_weight: float  #: a
    club_weight: float  #: b


class State(NamedTuple):
    """An instant of a swing, SI units."""

    arm: float
    club: float
    arm_rate: float = 0.0
    club_rate: float = 0.0
    shoulder_torque: float = 0.0
    wrist_torque: float = 0.0
    work: float = 0.0  #: of the torques, J
    stage: int = HELD  #: HELD, RELEASED, BEYOND the ball or FINISHED

    def head(self, golfer: Golfer) -> tuple[float, float]:
        """Position of the head from the shoulder: towards the target, and up."""
        r, length = golfer.arm_length, golfer.club_length
        along = r * sin(self.arm) + length * sin(self.club)
        return along, -r * cos(self.arm) - length * cos(self.club)

    def head_velocity(self, golfer: Golfer) -> tuple[float, float]:
        """Speed of the head along its path (m/s), and its direction above the ground."""
        u, w = golfer.arm_length * self.arm_rate, golfer.club_length * self.club_rate
        along = u * cos(self.arm) + w * cos(self.club)
        up = u * sin(self.arm) + w * sin(self.club)
        return sqrt(along * along + up * up), atan2(up, along)

    def energy(self, golfer: Golfer) -> float:
        """Kinetic and potential; 0 at rest straight down."""
        u, w = self.arm_rate, self.club_rate
        kinetic = 0.5 * (golfer.inertia * u * u + golfer.club_inertia * w * w)
        kinetic += golfer.mixed * cos(self.club - self.arm) * u * w
        potential = golfer.arm_weight * (1.0 - cos(self.arm))
        return kinetic + potential + golfer.club_weight * (1.0 - cos(self.club))

    def effective_mass(self, golfer: Golfer, direction: float) -> float:
        """Of the head for a force in this direction, kg."""
        inertia, mixed = golfer.inertia, golfer.mixed * cos(self.club - self.arm)
        p = golfer.arm_length * cos(self.arm - direction)
        q = golfer.club_length * cos(self.club - direction)
        determinant = inertia * golfer.club_inertia - mixed * mixed
        return determinant / (golfer.club_inertia * p * p - 2.0 * mixed * p * q + inertia * q * q)


class Ball(NamedTuple):
    """How the head meets the ball, which lies where it comes when the arms point straight down."""

    time: float  #: as that of the motion's origin, s
    speed: float  #: of the head along the normal of the club face, m/s
    normal: float  #: its direction, rad above the ground
    effective_mass: float  #: of the head along the normal, kg


class Motion:
    """A swing from a state on, under a constant force on the head.

    Args:
        golfer: arms and club.
        origin: when it begins, s.
        state: at the origin, and before it.
        force: on the head, N.
        direction: against which it acts, rad above the ground.
    """

    def __init__(
        self,
        golfer: Golfer,
        origin: float,
        state: State,
        force: float = 0.0,
        direction: float = 0.0,
    ) -> None:
        self.arguments = golfer, origin, state, force, direction
        self.golfer, self.origin, self.force, self.direction = golfer, origin, force, direction
        #: Of each stage when it begins (s), and the solution.
        self._parts: list[tuple[float, int, Solution]] = []
        self._add(origin, state)

    def at(self, time: float) -> State:
        time = max(time, self.origin)
        while not self._parts[-1][2].covers(time - self._parts[-1][0]):
            self._go_on()
        begin, stage, part = next(part for part in reversed(self._parts) if part[0] <= time)
        return State._make((*part.at(time - begin), stage))

    def ball(self, spin_loft: float) -> Ball | None:
        """How the head meets the ball; None if it doesn't reach it.

        Args:
            spin_loft: angle between the head's path and the normal of the club face, rad.
        """
        while self._parts[-1][1] < BEYOND:
            self._go_on()
        time, stage, part = self._parts[-1]
        if stage == FINISHED:
            return None
        state = State._make((*part.values[0], stage))
        speed, direction = state.head_velocity(self.golfer)
        normal = direction + spin_loft
        mass = state.effective_mass(self.golfer, normal)
        return Ball(time, speed * cos(spin_loft), normal, mass)

    def _go_on(self) -> None:
        """To the next stage."""
        begin, stage, part = self._parts[-1]
        part.covers(inf)
        following = stage + 1 if part.has_ended else FINISHED
        self._add(begin + part.end, State._make((*part.values[-1], following)))

    def _add(self, begin: float, state: State) -> None:
        golfer, (*start, stage) = self.golfer, state
        if stage == HELD and state.arm >= -golfer.release_angle:
            stage = RELEASED
        if stage == FINISHED:
            start[2:6] = [0.0] * 4
        goal = (-golfer.release_angle, 0.0, golfer.arm_start, inf)[stage]
        f, size = partial(self._slopes, stage), golfer.torque_rise_time
        part = Solution(f, start, size, self._allowed, lambda m: goal - m[0], lambda m: -m[2])
        self._parts.append((begin, stage, part))

    def _allowed(self, motion: Values) -> Values:
        """Errors of a step."""
        golfer = self.golfer
        rate = _TOLERANCE * max(1.0, abs(motion[2]), abs(motion[3]))
        torque = abs(golfer.max_shoulder_torque) + abs(golfer.max_wrist_torque) + _TOLERANCE
        return _TOLERANCE, _TOLERANCE, rate, rate, *[_TOLERANCE * torque] * 3

    def _slopes(self, stage: int, motion: Values) -> Values:
        """Of a `State` without its stage: the equations of the module's text."""
        if stage == FINISHED:
            return (0.0,) * len(motion)
        p, q, u, w, shoulder, wrist, _ = motion
        golfer, force, direction = self.golfer, self.force, self.direction
        inertia, club_inertia = golfer.inertia, golfer.club_inertia
        c, s = golfer.mixed * cos(q - p), golfer.mixed * sin(q - p)
        first = s * w * w - golfer.arm_weight * sin(p) + shoulder - wrist
        first -= force * golfer.arm_length * cos(p - direction)
        second = -s * u * u - golfer.club_weight * sin(q) + wrist
        second -= force * golfer.club_length * cos(q - direction)
        if stage == HELD:
            u2 = w2 = (first + second) / (inertia + club_inertia + 2.0 * c)
        else:
            determinant = inertia * club_inertia - c * c
            u2 = (club_inertia * first - c * second) / determinant
            w2 = (inertia * second - c * first) / determinant
        shoulder_left = golfer.max_shoulder_torque * (stage <= RELEASED) - shoulder
        wrist_left = golfer.max_wrist_torque * (stage == RELEASED) - wrist
        rate = 1.0 / golfer.torque_rise_time
        return u, w, u2, w2, rate * shoulder_left, rate * wrist_left, shoulder * u + wrist * (w - u)
