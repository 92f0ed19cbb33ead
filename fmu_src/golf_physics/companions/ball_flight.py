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
at once by its Taylor series, piece by piece: the landing is a root of a polynomial, and the host's
steps have no influence. `carry`, `apex` and `land_angle` are those of the whole flight from the
launch on.
"""

from functools import partial
from math import atan2, cos, inf, isfinite, log, pi, sin, sqrt
from typing import ClassVar, NamedTuple

from .companion import Companion
from .taylor import (
    ORDER,
    Series,
    empty,
    falls,
    first_zero,
    power,
    product,
    quotient,
    reach,
    slope,
    value,
)

#: A flight of more pieces is refused.
_PIECES = 1000

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
    wind: float = 0.0  #: its slope over ln(1 + y/z), m/s

    def held(self) -> "Air":
        """The same with S held at its limit."""
        s = self.limit
        drag, lift = ((a + s * (b + s * c), 0.0, 0.0, d) for a, b, c, d in (self.drag, self.lift))
        return self._replace(drag=drag, lift=lift)


def _series(air: Air, state: list[float]) -> list[Series]:
    """The series of x, y, u, h (m, m/s), of the surface speed a = r w and of v (m/s) in time."""
    x, y, u, h, a = ([one] for one in state)
    # p: through the air. The latter two: k C_D v, k C_L v.
    p, above, shear, squares, aa, drag, lift = u, [y[0] + _ROUGHNESS], *empty(5)
    if air.wind:
        p = [u[0] - air.wind * log(above[0] / _ROUGHNESS)]
    v = [sqrt(p[0] * p[0] + h[0] * h[0])]
    inverse = [1.0 / v[0]]
    d0, d1, d2, d3 = air.drag
    l0, l1, l2, l3 = air.lift if a[0] else (0.0,) * 4
    for n in range(ORDER):
        m = n + 1
        squares.append(product(p, p, n) + product(h, h, n))
        if n:
            v.append(power(squares, 0.5, v, n))
            inverse.append(power(squares, -0.5, inverse, n))
        aa.append(product(a, a, n))
        turning = product(aa, inverse, n)
        drag.append(d0 * v[n] + d1 * a[n] + d2 * turning + d3 * squares[n])
        lift.append(l0 * v[n] + l1 * a[n] + l2 * turning + l3 * inverse[n])
        x.append(u[n] / m)
        y.append(h[n] / m)
        fall = air.gravity if n == 0 else 0.0
        change = -(product(drag, p, n) + product(lift, h, n)) / m
        rise = (product(lift, p, n) - product(drag, h, n) - fall) / m
        if air.wind:
            # The wind's slope in time over `air.wind`: h / (y + z).
            shear.append(quotient(h, above, shear, n))
            above.append(y[m])
            p.append(change - air.wind * shear[n] / m)
        u.append(change)
        h.append(rise)
        a.append(-air.decay * product(v, a, n) / m)
    return [x, y, u, h, a, v]


class Flight:
    """A flight from launch to landing.

    Args:
        launch: when the ball is launched, s.
        speed: at launch, m/s.
        angle: of the launch, rad.
        surface_speed: radius times backspin at launch, not negative, m/s.
        air: what acts on the ball.

    Attributes:
        carry: distance from launch to landing, m.
        apex: greatest height, m.
        duration: s from launch to landing.
        land_angle: below the horizontal at landing, rad.

    Raises:
        OverflowError: the ball doesn't land, or the flight leaves the range of a double.
    """

    def __init__(
        self, launch: float, speed: float, angle: float, surface_speed: float, air: Air
    ) -> None:
        self.arguments = launch, speed, angle, surface_speed, air
        self.carry = self.apex = self.duration = self.land_angle = 0.0
        #: Start (s since launch) and coefficients of x and y of each piece.
        self._pieces: list[tuple[float, Series, Series]] = []
        state = [0.0, 0.0, speed * cos(angle), speed * sin(angle), surface_speed]
        start, held = 0.0, air.held()
        beyond, crossed = surface_speed > air.limit * abs(speed), False
        # On a level launch the ball leaves the ground if its lift exceeds its weight.
        level = state[3] == 0.0 and speed != 0.0
        if not (state[3] > 0.0 or (level and _series(held if beyond else air, state)[3][1] > 0.0)):
            return
        while True:
            if len(self._pieces) == _PIECES:
                raise OverflowError("this ball doesn't land")
            series = _series(held if beyond else air, state)
            xs, ys, us, hs, surface, speeds = series
            step = reach((us, hs), max(abs(us[0]), abs(hs[0])))
            if step == inf:
                # A vacuum's series are whole: as far as the landing, and beyond.
                step = 2.0 * (hs[0] + sqrt(hs[0] ** 2 + 2.0 * air.gravity * ys[0])) / air.gravity
            # Positive until S crosses its limit.
            margin = [(a - air.limit * v) * (1 if beyond else -1) for a, v in zip(surface, speeds)]
            if crossed:
                margin[0] = 0.0
            crossing = first_zero(partial(value, margin), partial(value, slope(margin)), step)
            crossed = crossing is not None
            if crossing is not None:
                step, beyond = crossing, not beyond
            self._pieces.append((start, xs, ys))
            # The height at launch is 0 and not a landing: height / t, or height / t^2, is 0 there
            # later.
            heights = ys if start else ys[1:] if hs[0] else ys[2:]
            landing = next(falls(heights, step), None)
            tops = [t for t in falls(hs, step) if landing is None or t < landing]
            self.apex = max(self.apex, *(value(ys, t) for t in tops), 0.0)
            if landing is not None:
                self.carry, self.duration = value(xs, landing), start + landing
                self.land_angle = atan2(-value(hs, landing), value(us, landing))
                return
            state = [value(one, step) for one in series[:5]]
            start += step
            if not all(map(isfinite, state)):
                raise OverflowError("it leaves the range of a double")

    def position(self, time: float) -> tuple[float, float, bool]:
        """Distance and height (m), and whether the ball has landed."""
        t = time - self.arguments[0]
        if t >= self.duration:
            return self.carry, 0.0, True
        if t <= 0.0:
            return 0.0, 0.0, False
        start, xs, ys = next(piece for piece in reversed(self._pieces) if piece[0] <= t)
        return value(xs, t - start), value(ys, t - start), False


class BallFlight(Companion):
    """The flight of the ball over time; see the module's text."""

    inside: ClassVar = {"_flight": Flight | None}
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
        upwards = -k if self.backspin < 0.0 else k
        drag = [k * getattr(self, f"drag_{term}") for term in _TERMS]
        lift = [upwards * getattr(self, f"lift_{term}") for term in _TERMS]
        drag[3] *= reynolds
        lift[3] /= reynolds**2
        wind = self.wind_speed / log(1.0 + 10.0 / _ROUGHNESS)
        decay = self.spin_decay / radius
        air = Air(tuple(drag), tuple(lift), decay, self.gravity, self.spin_ratio_limit, wind)
        launch = self.touch_time + self.contact_time
        surface_speed = radius * abs(self.backspin)
        return Flight(launch, self.ball_velocity, self.launch_angle, surface_speed, air)
