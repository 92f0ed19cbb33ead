"""A companion FMU: how fast the club head is, for a system with ClubBallImpact.

The club starts at the ball. It is taken back at a steady speed until it is `gap` away; then its
speed rises smoothly to the peak, which it holds. A host that holds this output over each of its
steps moves the club by step * speed, so the rise starts at a communication point, and the gap is
the rise time at peak speed: with a constant step, however long, touch falls after the peak (the
sum of step * speed over the rise stays below peak_speed * rise_time).

Self-contained: pythonfmu, the standard library's math, and golf_impact's host/at_exit.py.
"""

from collections.abc import Callable
from math import cos, isfinite, pi

from golf_impact.host.at_exit import release_at_exit
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

#: Name, unit, start, description. All must be above 0.
PARAMETERS = (
    ("peak_speed", "m/s", 35.0, "Club head speed at the peak, which is then held"),
    ("rise_time", "s", 0.01, "How long the speed takes to rise to the peak"),
    ("takeaway_speed", "m/s", 10.0, "How fast the club is taken back before"),
)

#: Name, unit, description.
OUTPUTS = (
    ("club_speed", "m/s", "Club head speed; negative while the club is taken back"),
    ("gap", "m", "How far from the ball the rise starts: peak_speed * rise_time"),
)

UNITS = {"m": {"m": 1}, "s": {"s": 1}, "m/s": {"m": 1, "s": -1}}

DESCRIPTION = "Club head speed over a swing: taken back, then up to a peak that is held"


class PrescribedSwing(Fmi2Slave):
    """Club head speed over time; see the module's text."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        release_at_exit(self.resources, "linux64/PrescribedSwing.so")
        self.modelName = "PrescribedSwing"
        self._time = 0.0
        #: When the rise started, s; None before.
        self._rise_start: float | None = None
        self._start_time = 0.0
        for name, _, start, text in PARAMETERS:
            setattr(self, name, start)
            self.register_variable(
                Real(
                    name,
                    causality=Fmi2Causality.parameter,
                    variability=Fmi2Variability.fixed,
                    description=text,
                    setter=self._setter(name),
                )
            )
        for name, _, text in OUTPUTS:
            self.register_variable(Real(name, causality=Fmi2Causality.output, description=text))

    def _setter(self, name: str) -> Callable[[float], None]:
        def assign(value: float) -> None:
            if value > 0.0 and isfinite(value):
                setattr(self, name, value)
            else:
                self.log(f"{name} = {value!r} is refused: it must be > 0", Fmi2Status.error)

        return assign

    @property
    def gap(self) -> float:
        """How far from the ball the rise starts, m."""
        return self.peak_speed * self.rise_time

    @property
    def club_speed(self) -> float:
        """Club head speed now, m/s."""
        if self._rise_start is None:
            return -self.takeaway_speed
        since = self._time - self._rise_start
        if since >= self.rise_time:
            return self.peak_speed
        share = 0.5 * (1.0 - cos(pi * since / self.rise_time))
        return share * self.peak_speed - (1.0 - share) * self.takeaway_speed

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        self._time = self._start_time = start_time

    def do_step(self, current_time: float, step_size: float) -> bool:
        if not (step_size > 0.0 and isfinite(current_time + step_size)):
            self.log(f"step size = {step_size!r} s is refused: it must be > 0", Fmi2Status.error)
            return False
        self._time = current_time + step_size
        back = self.takeaway_speed * (self._time - self._start_time)
        # A step more than needed: some hosts pass an output on only one step later.
        if self._rise_start is None and back >= self.gap + self.takeaway_speed * step_size:
            self._rise_start = self._time
        return True

    def _get_fmu_state(self) -> dict:
        inside = ("_time", "_rise_start", "_start_time", *(p[0] for p in PARAMETERS))
        return {name: getattr(self, name) for name in inside}

    def _set_fmu_state(self, state: dict) -> None:
        for name, value in state.items():
            setattr(self, name, value)
