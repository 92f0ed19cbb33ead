"""Contact phases: their interface, and what all of them share."""

from collections.abc import Callable, Iterable
from operator import itemgetter

from ..values import Motion, State

#: Of a value, relative.
ROUNDING = 4e-15


class ContactPhase:
    """Contact under constant k and b, from its initial state until the contact force is zero.

    Times are s since the start of the phase, at most `duration`. Quantities by name: the contact
    force ("force", N), the compression ("d", m), the closing speed ("w", m/s). A phase is a value:
    methods return the same results in any order of calls.
    """

    __slots__ = ("_maxima", "duration", "rate")

    duration: float  #: s until contact ends, or at least so long; inf if it never does
    rate: float  #: the fastest rate of change, 1/s
    _maxima: dict[str, list[tuple[float, float]]]  #: found on demand: value and time

    def extend(self) -> bool:
        """Evaluate the phase further, if its end isn't known yet; whether `duration` has grown."""
        return False

    def state(self, t: float) -> State:
        raise NotImplementedError

    def value(self, name: str, t: float) -> float:
        """A quantity; the closing speed to full relative accuracy."""
        raise NotImplementedError

    def closing(self, t: float) -> float:
        """The closing speed, as `value`: every change of k or b in contact needs it."""
        return self.value("w", t)

    def impulse(self, begin: float, width: float) -> float:
        """Impulse of the contact force over [begin, begin + width], N.s."""
        raise NotImplementedError

    def find_maxima(self, name: str) -> Iterable[float]:
        """When a quantity has a maximum inside the phase."""
        raise NotImplementedError

    def dense_output(self) -> tuple[Callable[[float], State], float]:
        """A function from scaled time to the state, and the time scale in 1/s."""
        return self.state, 1.0

    def end_velocities(self) -> tuple[float, float]:
        """Velocities of club and ball when contact ends, m/s."""
        return self.end()[2:4]

    def end(self) -> Motion:
        """The bodies when contact ends."""
        _, _, x_ball, v_club, v_ball, d = self.state(self.duration)
        d = max(0.0, d)
        return Motion(x_ball + d, x_ball, v_club, v_ball, d, self.value("w", self.duration))

    def totals(self, t: float) -> tuple[tuple[float, float], float, float]:
        """Until t: the largest force (N) and its time, the largest compression (m), the impulse."""
        return self.largest("force", t), self.largest("d", t)[0], self.impulse(0.0, t)

    def largest(self, name: str, t: float) -> tuple[float, float]:
        """The largest value of a quantity on [0, t], and its time."""
        maxima = getattr(self, "_maxima", None)
        if maxima is None:
            maxima = self._maxima = {}
        if name not in maxima:
            maxima[name] = [(self.value(name, when), when) for when in self.find_maxima(name)]
        largest, when = self.value(name, 0.0), 0.0
        passed = [point for point in maxima[name] if point[1] <= t]
        if passed:
            top = max(passed, key=itemgetter(0))
            # A maximum just after the start is as large as the start to the last digits.
            if top[0] >= largest - ROUNDING * abs(largest):
                largest, when = top
        now = self.value(name, t)
        # Just after a maximum, rounding must not move its time.
        return (now, t) if now > largest + ROUNDING * abs(largest) else (largest, when)
