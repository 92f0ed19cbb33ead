"""A companion FMU: the flight of a ball that ClubBallImpact has hit.

A point mass under gravity and quadratic drag, without spin:

    u' = -c v u,    w' = -g - c v w,    v = sqrt(u*u + w*w),    c = rho A C_D / (2 m)

It is launched when `separated` becomes true, with the impact's ball velocity at the angle `loft`,
from the instant of separation, touch_time + contact_time: not from the communication point that
happened to see it. Nothing acts on the ball afterwards that isn't known then, so the whole flight
is solved at once by its Taylor series, step after step as long as the series converges; where it
is at a communication point is a value of a polynomial, and the landing is a root of one. The host's
steps don't matter. `carry` and `apex` tell at launch what the flight will come to.

Self-contained: pythonfmu, the standard library's math, and golf_impact's host/at_exit.py.
"""

from collections.abc import Callable
from math import cos, exp, inf, isfinite, pi, sin, sqrt

from golf_impact.host.at_exit import release_at_exit
from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

#: Name, unit, start, least and greatest allowed value, description.
PARAMETERS = (
    ("loft", "rad", 0.6, 0.0, 1.5, "Angle of the launch above the ground"),
    ("m_ball", "kg", 0.04593, 1e-6, 1e3, "Mass of the ball"),
    ("ball_diameter", "m", 0.04267, 1e-6, 1e3, "Diameter of the ball"),
    ("drag_coefficient", "1", 0.25, 0.0, 1e3, "Drag coefficient C_D; 0 is a flight in a vacuum"),
    ("air_density", "kg/m3", 1.225, 0.0, 1e3, "Density of the air"),
    ("gravity", "m/s2", 9.80665, 1e-6, 1e3, "Gravitational acceleration"),
)

#: Name, unit (None: Boolean), description. Real inputs must be finite.
INPUTS = (
    ("separated", None, "The contact has ended: launches the ball"),
    ("ball_velocity", "m/s", "Speed of the ball at launch"),
    ("touch_time", "s", "When club and ball touched"),
    ("contact_time", "s", "How long they were in contact"),
)

#: Name, unit (None: Boolean), description.
OUTPUTS = (
    ("carry", "m", "How far from the launch the ball lands; 0 before it is launched"),
    ("apex", "m", "Greatest height of the flight; 0 before it is launched"),
    ("flight_time", "s", "Time from launch to landing; 0 before it is launched"),
    ("distance", "m", "How far the ball has flown, along the ground"),
    ("height", "m", "Height of the ball above the ground"),
    ("landed", None, "The ball has landed"),
)

UNITS = {
    "1": {},
    "m": {"m": 1},
    "s": {"s": 1},
    "kg": {"kg": 1},
    "rad": {"rad": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "kg/m3": {"kg": 1, "m": -3},
}

DESCRIPTION = "Flight of a golf ball: gravity and quadratic drag, from launch to landing"

_ORDER = 24


def _series(x: float, y: float, u: float, w: float, c: float, g: float) -> list[list[float]]:
    """Taylor coefficients of x, y, u, w (m, m/s) in time (s): the recurrences of the equations."""
    xs, ys, us, ws = [x], [y], [u], [w]
    squares = [u * u + w * w]
    speeds = [sqrt(squares[0])]
    for n in range(_ORDER):
        drag_u = sum(speeds[i] * us[n - i] for i in range(n + 1))
        drag_w = sum(speeds[i] * ws[n - i] for i in range(n + 1))
        m = n + 1
        xs.append(us[n] / m)
        ys.append(ws[n] / m)
        us.append(-c * drag_u / m)
        ws.append((-c * drag_w - (g if n == 0 else 0.0)) / m)
        square = sum(us[i] * us[m - i] + ws[i] * ws[m - i] for i in range(m + 1))
        squares.append(square)
        inner = sum(speeds[i] * speeds[m - i] for i in range(1, m))
        speeds.append((square - inner) / (2.0 * speeds[0]))
    return [xs, ys, us, ws]


def _value(coefficients: list[float], t: float) -> float:
    total = 0.0
    for coefficient in reversed(coefficients):
        total = total * t + coefficient
    return total


def _root(coefficients: list[float], high: float) -> float:
    """Where a polynomial that is positive at 0 and not at `high` becomes 0: by bisection."""
    low = 0.0
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return high
        if _value(coefficients, middle) > 0.0:
            low = middle
        else:
            high = middle


def _reach(us: list[float], ws: list[float]) -> float:
    """How far the series are good to a double, s (Jorba and Zou 2005, section 3.2)."""
    scale = max(abs(us[0]), abs(ws[0]))
    reach = inf
    for order in (_ORDER - 1, _ORDER):
        last = max(abs(us[order]), abs(ws[order]))
        if last > 0.0:
            reach = min(reach, (scale / last) ** (1.0 / order))
    return reach * exp(-2.0)


class Flight:
    """A flight from launch to landing.

    Args:
        speed: at launch, m/s.
        loft: angle of the launch, rad.
        c: rho A C_D / (2 m), 1/m.
        g: gravitational acceleration, m/s2.

    Attributes:
        carry: distance from launch to landing, m.
        apex: greatest height, m.
        duration: s from launch to landing.
    """

    def __init__(self, speed: float, loft: float, c: float, g: float) -> None:
        self.carry = self.apex = self.duration = 0.0
        #: Start (s since launch) and coefficients of x and y of each piece.
        self._pieces: list[tuple[float, list[float], list[float]]] = []
        x, y, u, w = 0.0, 0.0, speed * cos(loft), speed * sin(loft)
        start = 0.0
        while w > 0.0 or y > 0.0:
            xs, ys, us, ws = _series(x, y, u, w, c, g)
            step = _reach(us, ws)
            if step == inf:
                # A vacuum's series are whole: as far as the landing, and beyond.
                step = 2.0 * (w + sqrt(w * w + 2.0 * g * y)) / g
            self._pieces.append((start, xs, ys))
            if w > 0.0 and _value(ws, step) <= 0.0:
                self.apex = _value(ys, _root(ws, step))
            # The height at launch is 0 and not a landing: height / t is 0 there later.
            heights = ys if start else ys[1:]
            if _value(heights, step) <= 0.0:
                last = _root(heights, step)
                self.carry, self.duration = _value(xs, last), start + last
                return
            x, y, u, w = (_value(series, step) for series in (xs, ys, us, ws))
            start += step

    def position(self, t: float) -> tuple[float, float]:
        """Distance and height (m) at t seconds after launch."""
        if t >= self.duration:
            return self.carry, 0.0
        if t <= 0.0:
            return 0.0, 0.0
        start, xs, ys = next(piece for piece in reversed(self._pieces) if piece[0] <= t)
        return _value(xs, t - start), _value(ys, t - start)


class BallFlight(Fmi2Slave):
    """The flight of the ball over time; see the module's text."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        release_at_exit(self.resources, "linux64/BallFlight.so")
        self.modelName = "BallFlight"
        self._time = 0.0
        #: Launch time (s) and arguments of the flight; None before launch.
        self._launch: tuple[float, float, float, float, float] | None = None
        self._flight: Flight | None = None
        for name, _, start, low, high, text in PARAMETERS:
            setattr(self, name, start)
            self.register_variable(
                Real(
                    name,
                    causality=Fmi2Causality.parameter,
                    variability=Fmi2Variability.fixed,
                    description=text,
                    setter=self._setter(name, low, high),
                )
            )
        for name, unit, text in INPUTS:
            setattr(self, name, False if unit is None else 0.0)
            if unit is None:
                variable = Boolean(
                    name,
                    causality=Fmi2Causality.input,
                    variability=Fmi2Variability.discrete,
                    description=text,
                )
            else:
                setter = self._setter(name, -1e6, 1e6)
                variable = Real(
                    name, causality=Fmi2Causality.input, description=text, setter=setter
                )
            self.register_variable(variable)
        for name, unit, text in OUTPUTS:
            if unit is None:
                variable = Boolean(
                    name,
                    causality=Fmi2Causality.output,
                    variability=Fmi2Variability.discrete,
                    initial=Fmi2Initial.calculated,
                    description=text,
                )
            else:
                variable = Real(name, causality=Fmi2Causality.output, description=text)
            self.register_variable(variable)

    def _setter(self, name: str, low: float, high: float) -> Callable[[float], None]:
        def assign(value: float) -> None:
            if low <= value <= high:
                setattr(self, name, value)
            else:
                message = f"{name} = {value!r} is refused: it must be {low:g} to {high:g}"
                self.log(message, Fmi2Status.error)

        return assign

    # Outputs

    @property
    def carry(self) -> float:
        """Distance from launch to landing, m; 0 before launch."""
        return self._flight.carry if self._flight else 0.0

    @property
    def apex(self) -> float:
        """Greatest height of the flight, m; 0 before launch."""
        return self._flight.apex if self._flight else 0.0

    @property
    def flight_time(self) -> float:
        """From launch to landing, s; 0 before launch."""
        return self._flight.duration if self._flight else 0.0

    @property
    def distance(self) -> float:
        """How far the ball has flown, m."""
        return self._flight.position(self._since_launch)[0] if self._flight else 0.0

    @property
    def height(self) -> float:
        """Height of the ball, m."""
        return self._flight.position(self._since_launch)[1] if self._flight else 0.0

    @property
    def landed(self) -> bool:
        """Whether the ball has landed."""
        return self._flight is not None and self._since_launch >= self._flight.duration

    @property
    def _since_launch(self) -> float:
        return self._time - self._launch[0] if self._launch else 0.0

    # Steps

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        self._time = start_time

    def do_step(self, current_time: float, step_size: float) -> bool:
        if not (step_size > 0.0 and isfinite(current_time + step_size)):
            self.log(f"step size = {step_size!r} s is refused: it must be > 0", Fmi2Status.error)
            return False
        if self.separated and self._launch is None:
            area = 0.25 * pi * self.ball_diameter**2
            c = 0.5 * self.air_density * area * self.drag_coefficient / self.m_ball
            launch = (self.touch_time + self.contact_time, self.ball_velocity, self.loft)
            self._fly((*launch, c, self.gravity))
        self._time = current_time + step_size
        return True

    def _fly(self, launch: tuple[float, float, float, float, float] | None) -> None:
        self._launch = launch
        self._flight = Flight(*launch[1:]) if launch is not None else None

    # State

    def _get_fmu_state(self) -> dict:
        inside = ("_time", "_launch", *(row[0] for row in (*PARAMETERS, *INPUTS)))
        return {name: getattr(self, name) for name in inside}

    def _set_fmu_state(self, state: dict) -> None:
        for name, value in state.items():
            setattr(self, name, value)
        # A list, if the state comes from another process.
        launch = self._launch
        self._fly((launch[0], launch[1], launch[2], launch[3], launch[4]) if launch else None)
