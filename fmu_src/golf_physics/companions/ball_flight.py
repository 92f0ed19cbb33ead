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

from math import atan2, cos, exp, inf, log, pi, sin, sqrt
from typing import ClassVar

from ..numerics.events import maxima
from ..numerics.runge_kutta import Solution, Values
from .companion import Companion

#: Errors of a step, relative to way and speed: so small since C_D and C_L have a kink at the limit.
_TOLERANCE = 1e-12

#: Of C_D and C_L: the ends of their parameters' names.
_TERMS = ("constant", "spin", "spin_squared", "reynolds")

#: Roughness length of the ground, m.
_ROUGHNESS = 0.03


class Flight:
    """A flight from the launch to the landing.

    Args:
        given: the values of BallFlight's variables at the launch, by name.

    Attributes:
        results: carry, apex (m), time of flight (s) and land angle (rad).

    Raises:
        ArithmeticError: the ball doesn't land.
    """

    def __init__(self, given: dict[str, float]) -> None:
        self.arguments = (given,)
        self.results = 0.0, 0.0, 0.0, 0.0
        self._launch = given["touch_time"] + given["contact_time"]
        self._gravity, self._limit = given["gravity"], given["spin_ratio_limit"]
        self._wind = given["wind_speed"] / log(1.0 + 10.0 / _ROUGHNESS)
        radius, spin = 0.5 * given["ball_diameter"], given["backspin"]
        self._decay, self._surface_speed = given["spin_decay"] / radius, radius * abs(spin)
        # k C_D and k C_L: constant, with S, with S^2, with v and v^-2.
        k = 0.5 * given["air_density"] * pi * radius * radius / given["m_ball"]
        upwards = k * ((spin > 0.0) - (spin < 0.0))
        self._drag = [k * given[f"drag_{term}"] for term in _TERMS]
        self._lift = [upwards * given[f"lift_{term}"] for term in _TERMS]
        reynolds = given["ball_diameter"] / given["kinematic_viscosity"] * 1e-5  # R / v
        self._drag[3] *= reynolds
        self._lift[3] /= reynolds**2
        speed, angle = given["ball_velocity"], given["launch_angle"]
        start = 0.0, 0.0, speed * cos(angle), speed * sin(angle), 0.0

        def allowed(motion: Values) -> Values:
            far, fast = _TOLERANCE * motion[4], _TOLERANCE * speed
            return far, far, fast, fast, far

        path = Solution(self._slopes, start, 0.01, allowed, lambda m: m[1], lambda m: m[3])
        self._path = path
        # On a level launch the ball leaves the ground if its lift exceeds its weight.
        if speed > 0.0 and (angle > 0.0 or (angle == 0.0 and self._slopes(start)[3] > 0.0)):
            path.covers(inf)
            if not path.has_ended:
                raise ArithmeticError("this ball doesn't land")
            tops = maxima(lambda t: path.at(t)[3], path.times)
            x, _, u, h, _ = path.values[-1]
            self.results = x, max(path.at(t)[1] for t in tops), path.end, atan2(-h, u)

    def _slopes(self, motion: Values) -> Values:
        """Of x, y, u, h and the way through the air s: the equations of the module's text.

        They leave w = w0 exp(-d s / r): integrated as w, a fast decay would be stiff.
        """
        _, y, u, h, way = motion
        p = u - self._wind * log((y + _ROUGHNESS) / _ROUGHNESS)
        v = sqrt(p * p + h * h)
        s = min(self._surface_speed * exp(-self._decay * way) / v, self._limit)
        d0, d1, d2, d3 = self._drag
        l0, l1, l2, l3 = self._lift
        drag = (d0 + s * (d1 + s * d2)) * v + d3 * v * v
        lift = (l0 + s * (l1 + s * l2)) * v + l3 / v
        return u, h, -(drag * p + lift * h), lift * p - drag * h - self._gravity, v

    def position(self, time: float) -> tuple[float, float, bool]:
        """Distance and height (m), and whether the ball has landed."""
        carry, _, duration, _ = self.results
        t = time - self._launch
        if t >= duration:
            return carry, 0.0, True
        x, y, *_ = self._path.at(max(t, 0.0))
        return x, y, False


class BallFlight(Companion):
    """The flight of the ball over time; see the module's text."""

    inside: ClassVar = ("_flight",)
    classes: ClassVar = (Flight,)
    _flight: Flight | None = None

    def _step(self, point: float, size: float) -> None:
        if self.separated and self._flight is None:
            self._flight = Flight(self.values())
            self.carry, self.apex, self.flight_time, self.land_angle = self._flight.results
        if self._flight:
            self.distance, self.height, self.landed = self._flight.position(point + size)
