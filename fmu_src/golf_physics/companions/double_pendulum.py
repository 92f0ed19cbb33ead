"""The double pendulum of golf: arms and club in the plane of the swing.

Two rods, driven by a torque at the shoulder and one at the wrist (T. P. Jorgensen, The Physics of
Golf, 2nd edition, Springer 1999). With the angles p of the arms and q of the club from straight
down, positive towards the target, c = cos(q - p), s = sin(q - p), and a force F on the club head:

    A p'' + B c q'' = B s q'^2 - a sin p + S - W - F R cos(p - d)
    I q'' + B c p'' = -B s p'^2 - b sin q + W - F L cos(q - d)

A = J + M R^2, B = R s_C, a = (s_A + M R) g sin(plane), b = s_C g sin(plane). Until the wrist is
released the club is held at its angle to the arms, q' = p'. F acts against the direction d, the
normal of the club face at the ball.

The motion is solved by Taylor series, each as far as its rounding errors allow: results don't
depend on the communication step size.
"""

from functools import partial
from math import atan2, cos, hypot, inf, sin
from typing import NamedTuple

from .taylor import ORDER, Series, bisect, empty, product, quotient, reach, slope, value

#: The stages of a swing, in their order.
HELD, RELEASED, BEYOND, FINISHED = range(4)

#: Most pieces of a swing (24 lead to the ball); a longer one has missed the ball and ends.
_MOST = 400


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
        return hypot(*self.head_velocity(golfer))

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
    """Part of a motion: start and end (s), its stage and that of the next piece, its series."""

    start: float
    end: float
    stage: int
    then: int
    series: list[Series]

    def state(self, t: float) -> State:
        return State(*[value(one, t - self.start) for one in self.series])


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
        self._add(0.0, state, stage)

    def at(self, t: float) -> tuple[State, int]:
        """State and stage."""
        piece = self._piece(t)
        return piece.state(t), piece.stage

    def _piece(self, t: float) -> _Piece:
        while t > self._pieces[-1].end:
            self._go_on()
        return next((one for one in reversed(self._pieces) if one.start <= t), self._pieces[0])

    def work_against(self, begin: float, end: float) -> float:
        """Work of the head against the force between two instants, J."""
        if not self.force:
            return 0.0
        before, after = (self.at(t)[0].head(self.golfer) for t in (begin, end))
        along, up = after[0] - before[0], after[1] - before[1]
        return self.force * (along * cos(self.direction) + up * sin(self.direction))

    def hands(self, t: float, state: State) -> tuple[float, float]:
        """Force (N) and torque (N.m) of the hands on the club in this state at t."""
        piece, golfer, force = self._piece(t), self.golfer, self.force
        if piece.stage == FINISHED:
            return 0.0, 0.0
        p, q, u, w, _, torque, _ = state
        p2, q2 = (value(slope(one), t - piece.start) for one in piece.series[2:4])
        r, mass, first = golfer.arm_length, golfer.club_mass, golfer.club_first_moment
        # Of the club's centre of mass, times its mass.
        along = mass * r * (cos(p) * p2 - sin(p) * u * u) + first * (cos(q) * q2 - sin(q) * w * w)
        up = mass * r * (sin(p) * p2 + cos(p) * u * u) + first * (sin(q) * q2 + cos(q) * w * w)
        along += force * cos(self.direction)
        up += force * sin(self.direction) + mass * golfer.gravity
        if piece.stage == HELD:
            _, mixed, _, weight = golfer.couples()
            torque = golfer.club_inertia * q2 + mixed * cos(q - p) * p2
            torque += mixed * sin(q - p) * u * u + weight * sin(q)
            torque += force * golfer.club_length * cos(q - self.direction)
        return hypot(along, up), torque

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
        state = piece.state(piece.start)
        along, up = state.head_velocity(self.golfer)
        normal, speed = atan2(up, along) + spin_loft, hypot(along, up) * cos(spin_loft)
        mass = state.effective_mass(self.golfer, normal)
        return Ball(piece.start + self.origin, speed, normal, mass)

    def _go_on(self) -> None:
        last = self._pieces[-1]
        self._add(last.end, last.state(last.end), last.then)

    def _add(self, start: float, state: State, stage: int) -> None:
        """A piece that begins with this state."""
        golfer = self.golfer
        if stage == HELD and state.arm >= -golfer.release_angle:
            stage = RELEASED
        if stage == FINISHED or len(self._pieces) >= _MOST:
            still = dict.fromkeys(("arm_rate", "club_rate", "shoulder_torque", "wrist_torque"), 0.0)
            rest = [[one] for one in state._replace(**still)]
            self._pieces.append(_Piece(start, inf, FINISHED, FINISHED, rest))
            return
        series, then = self._series(state, stage), stage
        scale = max(1.0, abs(state.arm_rate), abs(state.club_rate))
        step = reach(series[2:4], scale)
        goal = (-golfer.release_angle, 0.0, golfer.arm_start)[stage]
        if value(series[0], step) >= goal:
            to_go = [-one for one in series[0]]
            to_go[0] += goal
            step, then = bisect(partial(value, to_go), 0.0, step), stage + 1
        self._pieces.append(_Piece(start, start + step, stage, then, series))

    def _series(self, state: State, stage: int) -> list[Series]:
        golfer, force = self.golfer, self.force
        inertia, mixed, arm_weight, club_weight = golfer.couples()
        club_inertia, r, length = golfer.club_inertia, golfer.arm_length, golfer.club_length
        along, up = cos(self.direction), sin(self.direction)
        shoulder_goal = golfer.max_shoulder_torque if stage <= RELEASED else 0.0
        wrist_goal = golfer.max_wrist_torque if stage == RELEASED else 0.0
        p, q, u, w, shoulder, wrist, work = ([one] for one in state)
        sp, cp = [sin(state.arm)], [cos(state.arm)]
        sq, cq = [sin(state.club)], [cos(state.club)]
        # B cos(q - p), B sin(q - p), the squares of the rates; right-hand sides of the two
        # equations, the determinant, its numerators, p'' and q''.
        c, s, uu, ww, first, second, determinant, one, other, p2, q2 = empty(11)
        for n in range(ORDER):
            m = n + 1
            c.append(mixed * (product(cp, cq, n) + product(sp, sq, n)))
            s.append(mixed * (product(sq, cp, n) - product(cq, sp, n)))
            uu.append(product(u, u, n))
            ww.append(product(w, w, n))
            push_p = force * r * (along * cp[n] + up * sp[n])
            push_q = force * length * (along * cq[n] + up * sq[n])
            first.append(product(s, ww, n) - arm_weight * sp[n] + shoulder[n] - wrist[n] - push_p)
            second.append(-product(s, uu, n) - club_weight * sq[n] + wrist[n] - push_q)
            if stage == HELD:
                whole = inertia + club_inertia + 2.0 * c[0]
                p2.append((first[n] + second[n]) / whole)
                q2.append(p2[n])
            else:
                full = inertia * club_inertia if n == 0 else 0.0
                determinant.append(full - product(c, c, n))
                one.append(club_inertia * first[n] - product(c, second, n))
                other.append(inertia * second[n] - product(c, first, n))
                p2.append(quotient(one, determinant, p2, n))
                q2.append(quotient(other, determinant, q2, n))
            work.append((product(shoulder, u, n) + product(wrist, w, n) - product(wrist, u, n)) / m)
            p.append(u[n] / m)
            q.append(w[n] / m)
            u.append(p2[n] / m)
            w.append(q2[n] / m)
            for torque, goal in ((shoulder, shoulder_goal), (wrist, wrist_goal)):
                change = (goal if n == 0 else 0.0) - torque[n]
                torque.append(change / (m * golfer.torque_rise_time))
            # sin' = cos times the rate, cos' = -sin times the rate.
            sp.append(product(cp, u, n) / m)
            cp.append(-product(sp, u, n) / m)
            sq.append(product(cq, w, n) / m)
            cq.append(-product(sq, w, n) / m)
        return [p, q, u, w, shoulder, wrist, work]
