"""The flight of a golf ball.

A point mass under gravity, drag and the lift of its backspin w (Magnus), in a wind W along its way:

    u' = -k v (C_D p + C_L h),    h' = -g - k v (C_D h - C_L p),    w' = -d v w / r
    p = u - W(y),    v = sqrt(p*p + h*h),    k = rho A / (2 m),    r = its radius

With S = r w / v and R = 2 r v / nu / 100,000

    C_D = a + b S + c S^2 + d R,        C_L = a + b S + c S^2 + d / R^2

The start values are those that Ferguson, McNally and McPhee identified from carry and apex of 1,040
shots of all clubs with a tour ball (Predicting the flight of a golf ball, ISEA 2022,
doi:10.5703/1288284317493), d = 0; S is held at 0.75, the largest of them. A ball without spin has
no lift; topspin, a negative backspin, has the lift of backspin downwards. The spin's decay is that
of Smits and Smith, Science and Golf II (1994) 340.

W = wind_speed ln(1 + y/z) / ln(1 + 10 m/z), the logarithmic law of a neutral boundary layer (R. B.
Stull, An Introduction to Boundary Layer Meteorology, 1988), with z = 0.03 m, the roughness length
of open grass (WMO-No. 8, Davenport's classes): no wind on the ground, `wind_speed` 10 m above it.

The ball is launched when `separated` becomes true, with `ball_velocity`, `launch_angle` and
`backspin`, from the instant of separation, touch_time + contact_time: not from the communication
point after it. Nothing that acts on the ball later is unknown then, so the whole flight is solved
at once (numerics/runge_kutta.py), landing included, and the host's steps have no influence.
`carry`, `apex` and `land_angle` are those of the whole flight from the launch on.
"""

from bisect import bisect_right
from math import atan2, cos, exp, isfinite, log, pi, sin, sqrt
from typing import ClassVar, NamedTuple

from ..numerics.events import first_fall, maxima
from ..numerics.runge_kutta import Step, Values, next_step
from .companion import Companion

#: A flight of more steps is refused; a golf ball's has some 100.
_MOST_STEPS = 4000

#: Errors of a step, relative to way and speed: so small since C_D and C_L have a kink at the limit.
_TOLERANCE = 1e-12

#: Of the first step, s.
_FIRST = 0.01

#: Of C_D and C_L: the ends of their parameters' names.
_TERMS = ("constant", "spin", "spin_squared", "reynolds")

#: Roughness length of the ground, m.
_ROUGHNESS = 0.03


class Air(NamedTuple):
    """What acts on a ball, SI units."""

    drag: tuple[float, float, float, float]  #: k times C_D: constant, with S, with S^2, with v
    lift: tuple[float, float, float, float]  #: k times C_L: constant, with S, with S^2, with v^-2
    decay: float  #: of the spin, 1/m
    gravity: float
    limit: float  #: of S
    wind: float  #: its slope over ln(1 + y/z), m/s
    surface_speed: float  #: radius times backspin at launch, not negative, m/s

    def slopes(self, t: float, motion: Values) -> Values:
        """Of x, y, u, h and the way through the air s: the equations of the module's text.

        They leave w = w0 exp(-d s / r): integrated as w, a fast decay would be stiff.
        """
        _, y, u, h, way = motion
        p = u - self.wind * log((y + _ROUGHNESS) / _ROUGHNESS)
        v = sqrt(p * p + h * h)
        s = min(self.surface_speed * exp(-self.decay * way) / v, self.limit)
        d0, d1, d2, d3 = self.drag
        l0, l1, l2, l3 = self.lift
        drag = (d0 + s * (d1 + s * d2)) * v + d3 * v * v
        lift = (l0 + s * (l1 + s * l2)) * v + l3 / v
        return u, h, -(drag * p + lift * h), lift * p - drag * h - self.gravity, v


class Flight:
    """A flight from launch to landing.

    Args:
        launch: when the ball is launched, s.
        speed: at launch, m/s.
        angle: of the launch, rad.
        air: what acts on the ball.

    Attributes:
        carry: distance from launch to landing, m.
        apex: greatest height, m.
        duration: s from launch to landing.
        land_angle: below the horizontal at landing, rad.

    Raises:
        ArithmeticError: the ball doesn't land, or the flight leaves the range of a double.
    """

    def __init__(self, launch: float, speed: float, angle: float, air: Air) -> None:
        self.arguments = launch, speed, angle, air
        self.carry = self.apex = self.duration = self.land_angle = 0.0
        self._steps: list[Step] = []
        motion: Values = (0.0, 0.0, speed * cos(angle), speed * sin(angle), 0.0)
        # On a level launch the ball leaves the ground if its lift exceeds its weight.
        level = motion[3] == 0.0 and speed != 0.0
        if not (motion[3] > 0.0 or (level and air.slopes(0.0, motion)[3] > 0.0)):
            return

        def allowed(motion: Values) -> Values:
            far, fast = _TOLERANCE * motion[4], _TOLERANCE * abs(speed)
            return far, far, fast, fast, far

        t, size = 0.0, _FIRST
        while not self.duration:
            if len(self._steps) == _MOST_STEPS:
                raise OverflowError("this ball doesn't land")
            step, size = next_step(air.slopes, t, size, motion, allowed)
            height, climb = step.quantity(1), step.quantity(3)
            landing = first_fall(height, climb, (t, step.end))
            if landing is not None:
                self.duration, step = landing, step.until(landing)
            t, motion = step.end, step.after
            self.apex = max(self.apex, *map(height, maxima(climb, (step.begin, t))), 0.0)
            self._steps.append(step)
        if not all(map(isfinite, motion)):
            raise OverflowError("it leaves the range of a double")
        self.carry, _, u, h, _ = motion
        self.land_angle = atan2(-h, u)

    def position(self, time: float) -> tuple[float, float, bool]:
        """Distance and height (m), and whether the ball has landed."""
        t = time - self.arguments[0]
        if t >= self.duration:
            return self.carry, 0.0, True
        if t <= 0.0:
            return 0.0, 0.0, False
        x, y, *_ = self._steps[bisect_right(self._steps, t, key=lambda step: step.end)].at(t)
        return x, y, False


class BallFlight(Companion):
    """The flight of the ball over time; see the module's text."""

    inside: ClassVar = ("_flight",)
    classes: ClassVar = (Flight, Air)
    _flight: Flight | None = None

    def _step(self, point: float, size: float) -> None:
        if self.separated and self._flight is None:
            self._flight = self._launched()
            self.carry, self.apex = self._flight.carry, self._flight.apex
            self.flight_time, self.land_angle = self._flight.duration, self._flight.land_angle
        if self._flight:
            place = self._flight.position(point + size)
            self.distance, self.height, self.landed = place

    def _launched(self) -> Flight:
        radius = 0.5 * self.ball_diameter
        k = 0.5 * self.air_density * pi * radius * radius / self.m_ball
        reynolds = self.ball_diameter / self.kinematic_viscosity * 1e-5  # R / v
        # Topspin has the lift of backspin downwards.
        upwards = k * ((self.backspin > 0.0) - (self.backspin < 0.0))
        drag = [k * getattr(self, f"drag_{term}") for term in _TERMS]
        lift = [upwards * getattr(self, f"lift_{term}") for term in _TERMS]
        drag[3] *= reynolds
        lift[3] /= reynolds**2
        wind = self.wind_speed / log(1.0 + 10.0 / _ROUGHNESS)
        decay = self.spin_decay / radius
        surface_speed = radius * abs(self.backspin)
        limit = self.spin_ratio_limit
        air = Air(tuple(drag), tuple(lift), decay, self.gravity, limit, wind, surface_speed)
        launch = self.touch_time + self.contact_time
        return Flight(launch, self.ball_velocity, self.launch_angle, air)
