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

#: What cases are drawn from: a range of values, or several of them.
DRAWN = {
    "Swing": {
        "arm_length": (0.45, 0.75), "arm_first_moment": (0.8, 1.6), "arm_inertia": (0.35, 0.6),
        "club_length": (0.9, 1.2), "club_mass": (0.28, 0.4), "club_first_moment": (0.2, 0.3),
        "club_inertia": (0.33, 0.45), "max_shoulder_torque": (80.0, 150.0),
        "max_wrist_torque": (0.0, 30.0), "torque_rise_time": (0.005, 0.05),
        "arm_start": (1.8, 2.6), "wrist_start": (1.4, 2.2), "release_angle": [1.0, 1.5, 2.0, 3.0],
        "gravity": [0.0, 1.6, 9.8], "plane_angle": (0.5, 1.5), "backswing_time": (0.5, 1.0),
        "spin_loft": (-0.1, 0.4),
    },
    "Launch": {
        "dynamic_loft": (-0.3, 1.1), "attack_angle": (-0.15, 0.1),
        "friction": [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 1.0, 1e3],
        "tangential_stiffness_ratio": (0.2, 3.0), "m_club": (0.15, 0.35), "m_ball": (0.04, 0.05),
        "ball_diameter": (0.04, 0.045), "strike_height": (-0.025, 0.025),
        "centre_depth": [0.0, 0.02, 0.05], "head_inertia": [1e9, 2.7e-4, 5e-4],
        "ball_velocity": (20.0, 80.0), "club_velocity": (-10.0, 15.0), "smash_factor": (1.1, 1.5),
        "coefficient_of_restitution": (0.02, 0.98),
    },
    "BallFlight": {
        "drag_constant": (0.1, 0.3), "drag_spin": (0.0, 1.0), "drag_spin_squared": (-0.8, 0.8),
        "drag_reynolds": (-0.02, 0.02), "lift_constant": (0.0, 0.1), "lift_spin": (0.0, 1.2),
        "lift_spin_squared": (-1.1, 0.5), "lift_reynolds": (-0.01, 0.01),
        "spin_ratio_limit": [0.0, 0.1, 0.2, 0.75, 2.0], "spin_decay": [0.0, 2e-5, 1e-4, 1e-2],
        "m_ball": (0.04, 0.05), "ball_diameter": (0.04, 0.045), "air_density": [0.0, 1.0, 1.225],
        "kinematic_viscosity": (1e-5, 2e-5), "gravity": (1.6, 20.0), "wind_speed": (-12.0, 12.0),
        "ball_velocity": (5.0, 90.0), "launch_angle": (0.02, 1.5), "backspin": (-300.0, 1200.0),
        "touch_time": (-0.5, 0.5), "contact_time": (0.0, 0.5),
    },
}  # fmt: skip


def drawn(name, seed):
    """Values of parameters and inputs of a companion."""
    random = np.random.default_rng(seed)
    return {
        one: float(random.choice(of) if isinstance(of, list) else random.uniform(*of))
        for one, of in DRAWN[name].items()
    }


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


def swing(slave, instants, since=math.inf, force=0.0, normal=0.0):
    """A swing by Newton's law in the plane. Vectors are complex: towards the target, and up.

    Args:
        instants: s from the top, the last of which is the end.
        since: when a force on the head begins, s from the top.
        force: against `normal`, N.
        normal: of the face, rad above the ground.

    Returns:
        Angles of arms and club (rad) and speed of the head (m/s) at the instants; when the arms
        point straight down (s), speed (m/s) and direction (rad) of the head then, and its effective
        mass along the normal of the face (kg); None if they don't.
    """
    p, ball = real_values(slave), None
    found = [[-p.arm_start, -p.arm_start - p.wrist_start, 0.0] for t in instants if t <= 0.0]
    weight, centre = p.gravity * math.sin(p.plane_angle), p.club_first_moment / p.club_mass
    inertias = np.diag([p.arm_inertia, p.club_inertia - p.club_first_moment * centre])

    def masses(turned):
        of_centre = turned * (p.arm_length, centre)
        return inertias + p.club_mass * np.outer(of_centre.conj(), of_centre).real

    def torque(most, t, on, off):
        grown, faded = max(min(t, off) - on, 0.0), max(t - off, 0.0)
        return (
            -most * math.expm1(-grown / p.torque_rise_time) * math.exp(-faded / p.torque_rise_time)
        )

    def slope(t, motion, ends, force):
        rates, turned = motion[2:], np.exp(1j * motion[:2])
        of_centre, of_head = (turned * (p.arm_length, r) for r in (centre, p.club_length))
        wrist = torque(p.max_wrist_torque, t, ends[0], ends[1])
        shoulder = torque(p.max_shoulder_torque, t, 0.0, ends[1])
        pull = -1j * p.club_mass * (weight + of_centre @ rates**2)
        turning = (of_centre.conj() * pull - of_head.conj() * force * np.exp(1j * normal)).real
        turning += shoulder - wrist - p.arm_first_moment * weight * turned[0].imag, wrist
        mass, is_held = masses(turned), math.isinf(ends[0])
        bends = [turning.sum() / mass.sum()] * 2 if is_held else np.linalg.solve(mass, turning)
        return [*rates, *bends]

    def left(t, motion, *_):
        return goals[stage] - motion[0]

    # The wrist is released, the arms are at the ball, and as far behind it.
    goals, ends = (-p.release_angle, 0.0, p.arm_start), [math.inf] * 3
    stage = 1 if p.release_angle >= p.arm_start else 0
    ends[:stage] = [0.0] * stage
    begin, motion = 0.0, [-p.arm_start, -p.arm_start - p.wrist_start, 0.0, 0.0]
    while begin < instants[-1]:
        acting, end = (0.0, min(since, instants[-1])) if begin < since else (force, instants[-1])
        solved = solution(slope, begin, end, motion, left, ends, acting)
        last = solved.t[-1]
        for a, c, u, w in map(solved.sol, (t for t in instants if begin < t <= last)):
            found.append([a, c, abs(p.arm_length * u + p.club_length * w * np.exp(1j * (c - a)))])
        begin, motion = last, solved.y[:, -1]
        if solved.status == 1:
            ends[stage], stage = begin, stage + 1
        if stage == 2 and ball is None:
            ends_of, turned = np.array([p.arm_length, p.club_length]), np.exp(1j * motion[:2])
            velocity = ends_of * motion[2:] @ turned
            along = (ends_of * turned * np.exp(-1j * (np.angle(velocity) + p.spin_loft))).real
            mass = 1.0 / (along @ np.linalg.solve(masses(turned), along))
            ball = begin, abs(velocity), np.angle(velocity), mass
        if stage == 3:
            found += [[*motion[:2], 0.0]] * sum(t > begin for t in instants)
            break
    return np.array(found), ball


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
    """Carry, apex, time of flight and land angle of BallFlight's values, and its path over time."""
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
    near = solved.y[1].argmax()
    around = solved.t[max(near - 1, 0)], solved.t[near + 1]
    top = brentq(lambda t: solved.sol(t)[3], *around, xtol=1e-12)
    return (carry, solved.sol(top)[1], solved.t[-1], math.atan2(-h, u)), solved.sol
