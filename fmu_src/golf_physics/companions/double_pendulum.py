"""The double pendulum of golf: arms and club in the plane of the swing.

Two rods, driven by a torque at the shoulder and one at the wrist (T. P. Jorgensen, The Physics of
Golf, 2nd edition, Springer 1999). With the angles p of the arms and q of the club from straight
down, positive towards the target, c = cos(q - p), s = sin(q - p), and a force F on the club head:

    A p'' + B c q'' = B s q'^2 - a sin p + S - W - F R cos(p - d)
    I q'' + B c p'' = -B s p'^2 - b sin q + W - F L cos(q - d)

A = J + M R^2, B = R s_C, a = (s_A + M R) g sin(plane), b = s_C g sin(plane). Until the wrist is
released the club is held at its angle to the arms, q' = p'. F acts against the direction d, the
normal of the club face at the ball.

Torques rise and fall exponentially. The motion is solved in steps of its own
(numerics/runge_kutta.py): results don't depend on the communication step size.
"""

from bisect import bisect_right
from math import atan2, cos, exp, inf, sin, sqrt
from typing import NamedTuple

from ..numerics.events import first_fall
from ..numerics.runge_kutta import Step, Values, next_step

#: The stages of a swing, in their order.
HELD, RELEASED, BEYOND, FINISHED = range(4)

#: Most pieces of a swing (some 60 lead to the ball); a longer one has missed the ball and ends.
_MOST = 2000

#: Errors of a step, relative to a radian, the rates and the torques.
_TOLERANCE = 1e-10

#: Added to a scale of errors that may be 0.
_LEAST = 1e-300


class Golfer(NamedTuple):
    """Arms and club; lengths in m, masses in kg, torques in N.m, angles in rad."""

    arm_length: float
    arm_first_moment: float
    arm_inertia: float
    club_length: float
    club_mass: float
    club_first_moment: float
    club_inertia: float
    max_shoulder_torque: float
    max_wrist_torque: float
    torque_rise_time: float
    arm_start: float
    wrist_start: float
    release_angle: float
    gravity: float

    def couples(self) -> tuple[float, float, float, float]:
        """A, B (kg.m2), a and b (N.m) of the equations."""
        r = self.arm_length
        return (
            self.arm_inertia + self.club_mass * r * r,
            r * self.club_first_moment,
            (self.arm_first_moment + self.club_mass * r) * self.gravity,
            self.club_first_moment * self.gravity,
        )


class State(NamedTuple):
    """An instant of a swing, SI units."""

    arm: float
    club: float
    arm_rate: float
    club_rate: float
    shoulder_torque: float
    wrist_torque: float
    work: float  #: of the torques, J

    def head(self, golfer: Golfer) -> tuple[float, float]:
        """Position of the head from the shoulder: towards the target, and up."""
        r, length = golfer.arm_length, golfer.club_length
        along = r * sin(self.arm) + length * sin(self.club)
        return along, -r * cos(self.arm) - length * cos(self.club)

    def head_velocity(self, golfer: Golfer) -> tuple[float, float]:
        """Towards the target, and up."""
        u, w = golfer.arm_length * self.arm_rate, golfer.club_length * self.club_rate
        along = u * cos(self.arm) + w * cos(self.club)
        return along, u * sin(self.arm) + w * sin(self.club)

    def head_speed(self, golfer: Golfer) -> float:
        """Along its path, m/s."""
        along, up = self.head_velocity(golfer)
        return sqrt(along * along + up * up)

    def energy(self, golfer: Golfer) -> float:
        """Kinetic and potential; 0 at rest straight down."""
        inertia, mixed, arm_weight, club_weight = golfer.couples()
        u, w = self.arm_rate, self.club_rate
        kinetic = 0.5 * (inertia * u * u + golfer.club_inertia * w * w)
        kinetic += mixed * cos(self.club - self.arm) * u * w
        return kinetic + arm_weight * (1.0 - cos(self.arm)) + club_weight * (1.0 - cos(self.club))

    def effective_mass(self, golfer: Golfer, direction: float) -> float:
        """Of the head for a force in this direction, kg."""
        inertia, mixed, _, _ = golfer.couples()
        mixed *= cos(self.club - self.arm)
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


class _Piece(NamedTuple):
    """Part of a motion: the step is that of both angles, their rates and the work."""

    start: float
    end: float
    stage: int
    then: int  #: stage of the next piece
    step: Step | None  #: None in a swing that has finished
    initial: State


class Motion:
    """A swing from a state on, under a constant force on the head.

    Args:
        golfer: arms and club.
        origin: when it begins, s; the times of the methods are since then.
        state: at the origin.
        stage: HELD, RELEASED, BEYOND (of the ball: the torques fall off as they rose) or FINISHED.
        force: on the head, N.
        direction: against which it acts, rad above the ground.
    """

    def __init__(
        self,
        golfer: Golfer,
        origin: float,
        state: State,
        stage: int,
        force: float = 0.0,
        direction: float = 0.0,
    ) -> None:
        self.arguments = golfer, origin, state, stage, force, direction
        self.golfer, self.origin, self.force, self.direction = golfer, origin, force, direction
        self._pieces: list[_Piece] = []
        #: Of the next piece, to be tried, s.
        self._size = 0.0
        self._add(0.0, state, stage)

    def at(self, t: float) -> tuple[State, int]:
        """State and stage."""
        piece = self._piece(t)
        return self._state(piece, t), piece.stage

    def _piece(self, t: float) -> _Piece:
        while t > self._pieces[-1].end:
            self._go_on()
        after = bisect_right(self._pieces, t, key=lambda piece: piece.start)
        return self._pieces[max(after - 1, 0)]

    def _state(self, piece: _Piece, t: float) -> State:
        if piece.step is None:
            return piece.initial
        arm, club, arm_rate, club_rate, work = piece.step.at(t)
        return State(arm, club, arm_rate, club_rate, *self._torques(piece, t), work)

    def _torques(self, piece: _Piece, t: float) -> tuple[float, float]:
        """Of the shoulder and the wrist, N.m: on their way to those of the stage."""
        golfer, start, stage = self.golfer, piece.initial, piece.stage
        shoulder = golfer.max_shoulder_torque if stage <= RELEASED else 0.0
        wrist = golfer.max_wrist_torque if stage == RELEASED else 0.0
        left = exp((piece.start - t) / golfer.torque_rise_time)
        shoulder += (start.shoulder_torque - shoulder) * left
        return shoulder, wrist + (start.wrist_torque - wrist) * left

    def _accelerations(self, stage: int, motion: Values) -> tuple[float, float]:
        """Of arms and club, rad/s²: the equations of the module's text."""
        p, q, u, w, shoulder, wrist = motion
        golfer, force, direction = self.golfer, self.force, self.direction
        inertia, mixed, arm_weight, club_weight = golfer.couples()
        club_inertia, c, s = golfer.club_inertia, mixed * cos(q - p), mixed * sin(q - p)
        first = s * w * w - arm_weight * sin(p) + shoulder - wrist
        first -= force * golfer.arm_length * cos(p - direction)
        second = -s * u * u - club_weight * sin(q) + wrist
        second -= force * golfer.club_length * cos(q - direction)
        if stage == HELD:
            both = (first + second) / (inertia + club_inertia + 2.0 * c)
            return both, both
        determinant = inertia * club_inertia - c * c
        arm = (club_inertia * first - c * second) / determinant
        return arm, (inertia * second - c * first) / determinant

    def work_against(self, begin: float, end: float) -> float:
        """Work of the head against the force between two instants, J."""
        if not self.force:
            return 0.0
        before, after = (self.at(t)[0].head(self.golfer) for t in (begin, end))
        along, up = after[0] - before[0], after[1] - before[1]
        return self.force * (along * cos(self.direction) + up * sin(self.direction))

    def hands(self, t: float, state: State) -> tuple[float, float]:
        """Force (N) and torque (N.m) of the hands on the club in this state at t."""
        stage, golfer, force = self._piece(t).stage, self.golfer, self.force
        if stage == FINISHED:
            return 0.0, 0.0
        p, q, u, w, _, torque, _ = state
        p2, q2 = self._accelerations(stage, state[:6])
        r, mass, first = golfer.arm_length, golfer.club_mass, golfer.club_first_moment
        # Of the club's centre of mass, times its mass.
        along = mass * r * (cos(p) * p2 - sin(p) * u * u) + first * (cos(q) * q2 - sin(q) * w * w)
        up = mass * r * (sin(p) * p2 + cos(p) * u * u) + first * (sin(q) * q2 + cos(q) * w * w)
        along += force * cos(self.direction)
        up += force * sin(self.direction) + mass * golfer.gravity
        if stage == HELD:
            _, mixed, _, weight = golfer.couples()
            torque = golfer.club_inertia * q2 + mixed * cos(q - p) * p2
            torque += mixed * sin(q - p) * u * u + weight * sin(q)
            torque += force * golfer.club_length * cos(q - self.direction)
        return sqrt(along * along + up * up), torque

    def ball(self, spin_loft: float) -> Ball | None:
        """How the head meets the ball; None if it doesn't reach it.

        Args:
            spin_loft: angle between the head's path and the normal of the club face, rad.
        """
        while self._pieces[-1].stage < BEYOND:
            self._go_on()
        piece = next(one for one in self._pieces if one.stage >= BEYOND)
        if piece.stage == FINISHED:
            return None
        state = piece.initial
        along, up = state.head_velocity(self.golfer)
        normal = atan2(up, along) + spin_loft
        speed = sqrt(along * along + up * up) * cos(spin_loft)
        mass = state.effective_mass(self.golfer, normal)
        return Ball(piece.start + self.origin, speed, normal, mass)

    def _go_on(self) -> None:
        last = self._pieces[-1]
        self._add(last.end, self._state(last, last.end), last.then)

    def _add(self, start: float, state: State, stage: int) -> None:
        """A piece that begins with this state."""
        golfer = self.golfer
        if stage == HELD and state.arm >= -golfer.release_angle:
            stage = RELEASED
        if stage == FINISHED or len(self._pieces) >= _MOST:
            still = dict.fromkeys(("arm_rate", "club_rate", "shoulder_torque", "wrist_torque"), 0.0)
            rest = state._replace(**still)
            self._pieces.append(_Piece(start, inf, FINISHED, FINISHED, None, rest))
            return
        piece = _Piece(start, inf, stage, stage, None, state)
        torque = abs(golfer.max_shoulder_torque) + abs(golfer.max_wrist_torque) + _LEAST

        def slopes(t: float, motion: Values) -> Values:
            *_, u, w, _ = motion
            shoulder, wrist = self._torques(piece, t)
            accelerations = self._accelerations(stage, (*motion[:4], shoulder, wrist))
            return u, w, *accelerations, shoulder * u + wrist * (w - u)

        def allowed(motion: Values) -> Values:
            *_, u, w, _ = motion
            rate = _TOLERANCE * max(1.0, abs(u), abs(w))
            return _TOLERANCE, _TOLERANCE, rate, rate, _TOLERANCE * torque

        # Where torques begin to change, a long step has no stage near its begin.
        begins = not self._pieces or self._pieces[-1].stage != stage
        size = golfer.torque_rise_time if begins else self._size
        step, self._size = next_step(slopes, start, size, (*state[:4], state.work), allowed)
        arm, arm_rate = step.quantity(0), step.quantity(2)
        goal = (-golfer.release_angle, 0.0, golfer.arm_start)[stage]
        end = first_fall(lambda t: goal - arm(t), lambda t: -arm_rate(t), (start, step.end))
        end, then = (step.end, stage) if end is None else (end, stage + 1)
        self._pieces.append(piece._replace(end=end, then=then, step=step.until(end)))
