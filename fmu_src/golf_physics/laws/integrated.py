"""A contact phase from the force and the drag alone, integrated numerically.

On each of its panels the accelerations are Chebyshev series, found by Picard iteration at the
Chebyshev nodes (Clenshaw & Norton, Comput. J. 6, 88–92, 1963); their integrals are the motion, and
so the dense output. A panel is halved until its series has converged: panels become short where the
force has a kink, as a power of the compression has at touch and at the end of contact.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import pairwise
from math import inf, isfinite
from operator import mul

from ..numerics import chebyshev
from ..numerics.chebyshev import NODES, ORDER, Series, evaluate, integrate, interpolate
from ..numerics.gauss import integral
from ..values import Motion, State
from .contact import ContactPhase

#: Of the first panel, s, before it is halved where the contact is too stiff for it.
_FIRST_WIDTH = 1e-4

#: Iterations on a panel before it is halved.
_ITERATIONS = 30

#: What a panel may leave out of the closing speed, and an iteration still change (relative).
_TOLERANCE, _CHANGE = 1e-14, 1e-15

#: Panels; a contact with more is taken for one without an end.
_MOST_PANELS = 1500

#: A panel so short (relative to the time since the start) isn't halved: the force jumps there.
_SHORTEST = 1e-15

#: Mean forces over shorter times (relative to the panel) are integrals of the force: the difference
#: of two impulses loses digits.
_SHORT = 1e-2


def _from_start() -> Iterator[list[float]]:
    """The columns of the matrix from values at the nodes to integrals from -1 to the nodes."""
    for i in range(ORDER):
        series = integrate(interpolate([float(i == j) for j in range(ORDER)]), 0.0, 1.0)
        yield [evaluate(series, z) for z in NODES]


_INTEGRALS = list(zip(*_from_start()))


class _Panel:
    """An interval of a contact, and the series on it: compression d (m), closing speed w (m/s),
    v_ball (m/s) and x_ball (m), the impulse since the start of the phase (N.s), and the slope of
    the force, of which the sign alone is used.
    """

    def __init__(self, begin: float, width: float, **series: Series) -> None:
        self.begin, self.half, self.end = begin, 0.5 * width, begin + width
        self.series = series

    def at(self, name: str, t: float) -> float:
        """A quantity, t s after the start of the phase."""
        return evaluate(self.series[name], (t - self.begin) / self.half - 1.0)

    def times(self) -> list[float]:
        """The border on the left, the nodes in order and the border on the right, s."""
        nodes = [self.begin + self.half * (1.0 + z) for z in reversed(NODES)]
        return [self.begin, *nodes, self.end]


def _bisect(low: float, high: float, f: Callable[[float], float]) -> float:
    """The first double after `low` at which a function isn't above 0; it isn't at `high`."""
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if f(middle) > 0.0 else (low, middle)
    return high


class IntegratedContact(ContactPhase):
    """A contact phase under any force (N) of compression (m) and closing speed (m/s).

    drag on each body is in N.s/m, masses are in kg, the force on the club head in N. Panels are
    added as far as the phase is evaluated. Raises ArithmeticError if the force isn't a finite
    number.
    """

    has_pieces = True
    #: Unbounded: the force may have a kink at touch.
    rate = inf

    def __init__(
        self, force: Callable[[float, float], float], drag: float, m_club: float, m_ball: float,
        start: Motion, club_force: float = 0.0,
    ) -> None:  # fmt: skip
        self._law, self._drag, self._m_club, self._m_ball = force, drag, m_club, m_ball
        self._club_force = club_force
        self._panels: list[_Panel] = []
        x_club, _, _, v_ball, d, w = start
        self._motion = {"d": d, "w": w, "v_ball": v_ball, "x_ball": x_club - d, "impulse": 0.0}
        self._speed, self._width, self._end = abs(w), _FIRST_WIDTH, inf
        self.duration = 0.0
        self.extend()

    def extend(self) -> bool:
        """By a panel: a contact under inputs that change at every step needs one or two."""
        if self._end < inf or self.duration == inf:
            return False
        while (panel := self._panel(self.duration, self._width, self._motion)) is None:
            self._width *= 0.5
        self._panels.append(panel)
        self._end = self._end_on(panel)
        self.duration = min(self._end, panel.end)
        if len(self._panels) == _MOST_PANELS and self._end == inf:
            self.duration = inf
        self._motion = {name: evaluate(panel.series[name], 1.0) for name in self._motion}
        self._width, self._maxima = 2.0 * self._width, {}
        return True

    def _force(self, compression: float, closing: float) -> float:
        force = self._law(compression, closing)
        if not isinstance(force, (float, int)) or not isfinite(force):
            raise ArithmeticError(
                f"the force at a compression of {compression!r} m and a closing speed of "
                f"{closing!r} m/s is {force!r}; it must be a finite number"
            )
        return force

    def _slopes(self, forces: Series, w: Series, v_ball: Series) -> tuple[Series, Series]:
        """The rates of change of the closing speed and of the ball's velocity, m/s²."""
        drag, m_club, m_ball = self._drag, self._m_club, self._m_ball
        ball = [(force - drag * v) / m_ball for force, v in zip(forces, v_ball)]
        pull = self._club_force
        club = [(pull - force - drag * (v + w)) / m_club for force, v, w in zip(forces, v_ball, w)]
        return [a - b for a, b in zip(club, ball)], ball

    def _panel(self, t: float, width: float, motion: dict[str, float]) -> _Panel | None:
        """The panel from this motion on, or None if its series doesn't converge."""
        d, w, v_ball, x_ball, impulse = motion.values()
        half = 0.5 * width
        shortest = width <= _SHORTEST * t

        def integrals(slopes: Iterable[float], start: float) -> list[float]:
            return [start + half * sum(map(mul, row, slopes)) for row in _INTEGRALS]

        forces, speeds, v_balls = [self._force(d, w)] * ORDER, [w] * ORDER, [v_ball] * ORDER
        before = inf
        for _ in range(_ITERATIONS):
            closing, pull = self._slopes(forces, speeds, v_balls)
            changed = integrals(closing, w)
            error = max(abs(new - old) for new, old in zip(changed, speeds))
            speeds, v_balls = changed, integrals(pull, v_ball)
            try:
                forces = list(map(self._force, integrals(speeds, d), speeds))
            except OverflowError:
                return None
            self._speed = max(self._speed, abs(speeds[0]))
            if error >= before:
                break
            before = error
        closing, pull = map(interpolate, self._slopes(forces, speeds, v_balls))
        left_out = (abs(closing[0]) + abs(closing[1])) * width
        if not shortest and (left_out > _TOLERANCE * self._speed or error > _CHANGE * self._speed):
            return None
        force = interpolate(forces)
        w_series, v_series = integrate(closing, w, half), integrate(pull, v_ball, half)
        return _Panel(
            t, width, w=w_series, v_ball=v_series, d=integrate(w_series, d, half),
            x_ball=integrate(v_series, x_ball, half), impulse=integrate(force, impulse, half),
            slope=chebyshev.differentiate(force),
        )  # fmt: skip

    def _end_on(self, panel: _Panel) -> float:
        """When force or compression falls to 0 on a panel, s; inf if neither does."""

        def left(t: float) -> float:
            d, w = panel.at("d", t), panel.at("w", t)
            # A force that grows from 0 at touch isn't one that has fallen to 0.
            return 1.0 if w >= 0.0 else min(d, self._force(d, w))

        for low, high in pairwise(panel.times()):
            if left(high) <= 0.0:
                return _bisect(low, high, left)
        return inf

    def _panel_at(self, t: float) -> _Panel:
        while t > self.duration and self.extend():
            pass
        return next((panel for panel in self._panels if t < panel.end), self._panels[-1])

    def _at(self, t: float, *names: str) -> list[float]:
        panel = self._panel_at(t)
        if self.duration == inf and t > panel.end:
            raise ArithmeticError(
                f"this contact hasn't ended after {len(self._panels)} panels of integration, "
                f"{panel.end!r} s, and isn't known beyond"
            )
        return [panel.at(name, t) for name in names]

    def state(self, t: float) -> State:
        d, w, v_ball, x_ball = self._at(t, "d", "w", "v_ball", "x_ball")
        return [self._force(d, w), x_ball + d, x_ball, v_ball + w, v_ball, d]

    def value(self, name: str, t: float) -> float:
        return self._force(*self._at(t, "d", "w")) if name == "force" else self._at(t, name)[0]

    def impulse(self, begin: float, width: float) -> float:
        if width < 2.0 * _SHORT * self._panel_at(begin + width).half:
            return integral(partial(self.value, "force"), begin + width, width)
        return self._at(begin + width, "impulse")[0] - self._at(begin, "impulse")[0]

    def find_maxima(self, name: str) -> Iterator[float]:
        slope = partial(self.value, "w" if name == "d" else "slope")
        times = [min(t, self.duration) for panel in self._panels for t in panel.times()]
        for low, high in pairwise(times):
            if slope(low) > 0.0 >= slope(high):
                yield _bisect(low, high, slope)
