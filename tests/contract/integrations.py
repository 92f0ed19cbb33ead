"""The companions' models once more, integrated by scipy's DOP853: other methods and other code.

Each takes an instance with its values (SI units).
"""

import math
from types import SimpleNamespace

import numpy as np
from cases import restitution
from fmus import get
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def real_values(slave):
    """Of all its Real variables, as attributes."""
    names = [name for name, kind in slave.types.items() if kind == "Real"]
    return SimpleNamespace(**dict(zip(names, get(slave, *names), strict=True)))


def solution(slope, begin, end, start, event, *arguments, **options):
    """Until `event` falls to 0, or the end; with dense output."""
    if event:
        event.terminal, event.direction = True, -1
    options = {"rtol": 1e-12, "atol": 1e-13, "dense_output": True} | options
    return solve_ivp(slope, (begin, end), start, "DOP853", events=event, args=arguments, **options)


def swing(slave, instants, since, force, path):
    """Angles of arms and club, speed and direction of the head at instants, s from the top.

    By Newton's law in the plane, before the ball. Vectors are complex: towards the target, and up.

    Args:
        since: when a force on the head begins, s from the top.
        force: against the normal of the face, N.
        path: the direction of the head at the ball, rad above the ground.
    """
    p = real_values(slave)
    weight, centre = p.gravity * math.sin(p.plane_angle), p.club_first_moment / p.club_mass
    inertias = np.diag([p.arm_inertia, p.club_inertia - p.club_first_moment * centre])
    normal = np.exp(1j * (path + p.spin_loft))

    def slope(t, motion, released, force):
        rates, turned = motion[2:4], np.exp(1j * motion[:2])
        of_centre, of_head = (turned * (p.arm_length, r) for r in (centre, p.club_length))
        shoulder = p.max_shoulder_torque * (1.0 - math.exp(-t / p.torque_rise_time))
        wrist = p.max_wrist_torque * (1.0 - math.exp(min(released - t, 0.0) / p.torque_rise_time))
        arms = -p.arm_first_moment * weight * turned[0].imag
        pull = -1j * p.club_mass * (weight + of_centre @ rates**2)
        turning = (of_centre.conj() * pull - of_head.conj() * force * normal).real
        turning += shoulder - wrist + arms, wrist
        mass = inertias + p.club_mass * np.outer(of_centre.conj(), of_centre).real
        is_held = released == math.inf
        bends = [turning.sum() / mass.sum()] * 2 if is_held else np.linalg.solve(mass, turning)
        return [*rates, *bends]

    def to_release(t, motion, *_):
        return -p.release_angle - motion[0]

    begin, motion, found = 0.0, [-p.arm_start, -p.arm_start - p.wrist_start, 0.0, 0.0], []
    released = 0.0 if p.release_angle >= p.arm_start else math.inf
    for end, acting in ((since, 0.0), (instants[-1], force)):
        while begin < end:
            event = to_release if released == math.inf else None
            solved = solution(slope, begin, end, motion, event, released, acting)
            for a, c, u, w in map(solved.sol, (t for t in instants if begin < t <= solved.t[-1])):
                velocity = p.arm_length * u * np.exp(1j * a) + p.club_length * w * np.exp(1j * c)
                found.append([a, c, abs(velocity), np.angle(velocity)])
            begin, motion = solved.t[-1], solved.y[:, -1]
            released = begin if solved.status == 1 else released
    return np.array(found)


def tangential_impulse(slave):
    """Of the contact that Launch's inputs come from, N.s; k (1 N/m) and exponent don't matter."""
    p = real_values(slave)
    mu, kappa, e = p.friction, p.tangential_stiffness_ratio, p.coefficient_of_restitution
    h, c, i = p.strike_height, p.centre_depth, p.head_inertia
    normal = 1.0 / p.m_ball + 1.0 / p.m_club + h * h / i
    along = 3.5 / p.m_ball + 1.0 / p.m_club + c * c / i
    zeta = brentq(lambda zeta: float(restitution(zeta)) - e, 1e-9, 100.0, xtol=1e-15)
    b, approach = 2.0 * zeta / math.sqrt(normal), (p.ball_velocity - p.club_velocity) / e
    sliding = p.ball_velocity / p.smash_factor * math.tan(p.dynamic_loft - p.attack_angle)

    def forces(motion, side):
        """The normal and the tangential one, and the rate of the tangential deformation."""
        x, u, y, slide, _ = motion
        force = x + b * u
        rate = (side * mu * force / kappa - y) / b if side else slide
        return force, kappa * (y + b * rate), rate

    def slope(t, motion, side):
        force, across, rate = forces(motion, side)
        return [motion[1], -normal * force, rate, -along * across - h * c / i * force, across]

    def left(t, motion, side):
        force, across, rate = forces(motion, side)
        return side * (motion[3] - rate) if side else mu * force - abs(across)

    time, end = 0.0, -math.log(e) / zeta / math.sqrt(normal)
    motion, options = [0.0, approach, 0.0, sliding, 0.0], {"atol": 1e-15, "max_step": end / 50}
    side = math.copysign(1.0, sliding) if kappa * abs(sliding) > mu * approach else 0.0
    while time < end * (1.0 - 1e-12):
        solved = solution(slope, time, end, motion, left, side, **options)
        time, motion = solved.t[-1], solved.y[:, -1]
        side = 0.0 if side else math.copysign(1.0, forces(motion, side)[1])
    return motion[4]


def flight(slave):
    """Carry, apex, time of flight and land angle of BallFlight's values."""
    p = real_values(slave)
    factor = p.air_density * math.pi * p.ball_diameter**2 / (8.0 * p.m_ball)

    def slope(t, motion):
        _, y, u, h, spin = motion
        # A logarithmic profile with a roughness length of 3 cm.
        along = u - p.wind_speed * math.log1p(max(y, 0.0) / 0.03) / math.log1p(10.0 / 0.03)
        v = math.hypot(along, h)
        s = min(0.5 * p.ball_diameter * abs(spin) / v, p.spin_ratio_limit)
        r = v * p.ball_diameter / p.kinematic_viscosity / 1e5
        drag = p.drag_constant + p.drag_spin * s + p.drag_spin_squared * s * s + p.drag_reynolds * r
        lift = p.lift_constant + p.lift_spin * s + p.lift_spin_squared * s * s
        lift = np.sign(p.backspin) * (lift + p.lift_reynolds / r**2)
        slower = -factor * v * (drag * along + lift * h)
        rise = factor * v * (lift * along - drag * h) - p.gravity
        return [u, h, slower, rise, -2.0 * p.spin_decay * v / p.ball_diameter * spin]

    def height(t, motion):
        return motion[1]

    start = [0.0, 0.0, math.cos(p.launch_angle), math.sin(p.launch_angle), 0.0]
    start = p.ball_velocity * np.array(start) + [0.0, 0.0, 0.0, 0.0, p.backspin]
    errors = {"rtol": 1e-13, "atol": 1e-13 * min(1.0, p.ball_velocity)}
    solved = solution(slope, 0.0, 1e3, start, height, **errors)
    carry, _, u, h, _ = solved.y[:, -1]
    top = brentq(lambda t: solved.sol(t)[3], 0.0, solved.t[-1], xtol=1e-12)
    return carry, solved.sol(top)[1], solved.t[-1], math.atan2(-h, u)
