"""A contact phase from the force and the drag alone, integrated numerically.

The phase is divided into panels. On a panel the acceleration is a Chebyshev series, found by Picard
iteration at the Chebyshev nodes (Clenshaw & Norton, Comput. J. 6, 88–92, 1963); its integrals are
the motion, so dense output comes with the solution. A panel is halved until its series has
converged, so panels become short where the force has a kink, as a power of the compression has at
touch and at the end of contact.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterator
from math import inf, isfinite
from operator import mul
from typing import NamedTuple

from ..numerics.chebyshev import (
    NODES,
    ORDER,
    Series,
    differentiate,
    evaluate,
    integrate,
    interpolate,
)
from ..numerics.gauss import integral
from .contact import ContactPhase, EndState, InitialState, State, largest_until

#: Iterations on a panel before it is halved.
_ITERATIONS = 30

#: What a panel may leave out of the closing speed, relative to the largest one.
_TOLERANCE = 1e-14

#: Panels; a contact with more is taken for one without an end.
_MOST_PANELS = 1500

#: A panel so short (relative to the time since the start) isn't halved any more: the force jumps.
_SHORTEST = 1e-15

#: Mean forces over shorter times (relative to the panel) are integrals of the force: the difference
#: of two impulses loses digits.
_SHORT = 1e-2


def _integrals(times: int) -> list[list[float]]:
    """The matrix from values at the nodes to their repeated integrals from -1 to the nodes."""
    columns = []
    for i in range(ORDER):
        series = interpolate([float(i == j) for j in range(ORDER)])
        for _ in range(times):
            series = integrate(series, 0.0, 1.0)
        columns.append([evaluate(series, z) for z in NODES])
    return [list(row) for row in zip(*columns)]


_ONCE, _TWICE = _integrals(1), _integrals(2)


class _Panel(NamedTuple):
    """An interval of a contact and the motion on it.

    Attributes:
        begin, width: s since the start of the phase.
        force, d, w, v_ball, x_ball, impulse: contact force (N), compression (m), closing speed,
            velocity of the ball (m/s), its position (m), impulse of the force since the start of
            the phase (N.s).
    """

    begin: float
    width: float
    force: Series
    d: Series
    w: Series
    v_ball: Series
    x_ball: Series
    impulse: Series

    def scaled(self, t: float) -> float:
        """The time since the start of the phase (s) on [-1, 1]."""
        return 2.0 * (t - self.begin) / self.width - 1.0


#: Compression, closing speed, velocity and position of the ball, impulse.
_Motion = tuple[float, float, float, float, float]


class IntegratedContact(ContactPhase):
    """A contact phase under any force; see `ContactPhase`.

    Args:
        force: contact force (N) from compression (m) and closing speed (m/s); it continues smoothly
            below 0.
        drag: on each body, N.s/m.
        m_club, m_ball: kg.
        start: the initial state.

    Raises:
        ArithmeticError: the force isn't a finite number.
    """

    def __init__(
        self, force: Callable[[float, float], float], drag: float, m_club: float, m_ball: float,
        start: InitialState,
    ) -> None:  # fmt: skip
        self._law, self._drag, self._start = force, drag, start
        self._m_club, self._m_ball = m_club, m_ball
        self._mu = m_club * (m_ball / (m_club + m_ball))
        #: The fastest rate of change in the phase, 1/s: the force may have a kink at touch.
        self.rate = inf
        self._panels: list[_Panel] = []
        #: s from the start of the phase until contact ends; inf if it never does.
        self.duration = inf
        self._maxima: dict[str, list[tuple[float, float]]] = {}
        self._integrate()
        self._begins = [panel.begin for panel in self._panels]

    # Integration

    def _force(self, compression: float, closing: float) -> float:
        force = self._law(compression, closing)
        if not isinstance(force, (float, int)) or not isfinite(force):
            raise ArithmeticError(
                f"the force at a compression of {compression!r} m and a closing speed of "
                f"{closing!r} m/s is {force!r}; it must be a finite number"
            )
        return force

    def _integrate(self) -> None:
        x_club, d, _, v_ball, w = self._start
        motion = d, w, v_ball, x_club - d, 0.0
        t, width = 0.0, self._first_width(d, w)
        self._speed = abs(w)
        while len(self._panels) < _MOST_PANELS:
            panel = self._panel(t, width, motion)
            if panel is None:
                width *= 0.5
                continue
            self._panels.append(panel)
            end = self._end_on(panel)
            if end is not None:
                self.duration = end
                return
            t += width
            motion = tuple(evaluate(series, 1.0) for series in panel[3:])  # type: ignore[assignment]
            width *= 2.0

    def _first_width(self, d: float, w: float) -> float:
        """A time (s) over which the closing speed changes by a quarter or so."""
        width = 1e-4

        def too_long(width: float) -> bool:
            try:
                change = abs(self._law(d + abs(w) * width, w)) * width / self._mu
            except OverflowError:
                return True
            return not change <= 0.25 * (abs(w) + d / width)

        while not too_long(width) and width < 1e100:
            width *= 2.0
        while too_long(width) and width > 1e-200:
            width *= 0.5
        return width

    def _panel(self, t: float, width: float, motion: _Motion) -> _Panel | None:
        """The panel from this motion on, or None if its series doesn't converge."""
        d, w, v_ball, x_ball, impulse = motion
        half = 0.5 * width
        square = half * half
        steps = [half * (1.0 + z) for z in NODES]
        forces = [self._force(d, w)] * ORDER
        compressions, speeds, v_balls = [d] * ORDER, [w] * ORDER, [v_ball] * ORDER
        shortest = width <= _SHORTEST * t
        before = inf
        try:
            for _ in range(_ITERATIONS):
                slopes = self._accelerations(forces, speeds, v_balls)
                changed = [w + half * sum(map(mul, row, slopes)) for row in _ONCE]
                error = max(abs(new - old) for new, old in zip(changed, speeds))
                speeds = changed
                compressions = [
                    d + w * step + square * sum(map(mul, row, slopes))
                    for row, step in zip(_TWICE, steps)
                ]
                if self._drag:
                    pulls = [(f - self._drag * v) / self._m_ball for f, v in zip(forces, v_balls)]
                    v_balls = [v_ball + half * sum(map(mul, row, pulls)) for row in _ONCE]
                forces = [self._force(*pair) for pair in zip(compressions, speeds)]
                self._speed = max(self._speed, abs(speeds[0]))
                small = error <= 1e-15 * self._speed
                if small and not error < 0.5 * before:
                    break
                if not error < before and not small and not shortest:
                    return None
                before = error
            else:
                if not shortest:
                    return None
        except OverflowError:
            return None
        series = interpolate(self._accelerations(forces, speeds, v_balls))
        if (abs(series[0]) + abs(series[1])) * width > _TOLERANCE * self._speed and not shortest:
            return None
        force = interpolate(forces)
        w_series = integrate(series, w, half)
        pull = interpolate([(f - self._drag * v) / self._m_ball for f, v in zip(forces, v_balls)])
        v_series = integrate(pull, v_ball, half)
        return _Panel(
            t, width, force, integrate(w_series, d, half), w_series, v_series,
            integrate(v_series, x_ball, half), integrate(force, impulse, half),
        )  # fmt: skip

    def _accelerations(
        self, forces: list[float], speeds: list[float], v_balls: list[float]
    ) -> list[float]:
        """The rates of change of the closing speed, m/s²."""
        if not self._drag:
            return [-force / self._mu for force in forces]
        club, ball, mu = self._drag / self._m_club, self._drag / self._m_ball, self._mu
        return [
            -force / mu - club * (w + v) + ball * v for force, w, v in zip(forces, speeds, v_balls)
        ]

    def _end_on(self, panel: _Panel) -> float | None:
        """When force or compression falls to 0 on a panel, s; None if neither does."""

        def over(z: float) -> bool:
            d, w = evaluate(panel.d, z), evaluate(panel.w, z)
            # A force that grows from 0 at touch isn't one that has fallen to 0.
            return w < 0.0 and (d <= 0.0 or self._force(d, w) <= 0.0)

        low = -1.0
        for high in (*reversed(NODES), 1.0):
            if over(high):
                break
            low = high
        else:
            return None
        while low < (middle := 0.5 * (low + high)) < high:
            low, high = (low, middle) if over(middle) else (middle, high)
        return panel.begin + 0.5 * panel.width * (1.0 + high)

    # The solution

    def _panel_at(self, t: float) -> _Panel:
        panel = self._panels[max(0, bisect_right(self._begins, t) - 1)]
        if self.duration == inf and t > panel.begin + panel.width:
            raise ArithmeticError(
                f"this contact hasn't ended after {len(self._panels)} panels of integration, "
                f"{panel.begin + panel.width!r} s, and isn't known beyond"
            )
        return panel

    def _at(self, name: str, t: float) -> float:
        panel = self._panel_at(t)
        return evaluate(getattr(panel, name), panel.scaled(t))

    def dense_output(self) -> tuple[Callable[[float], State], float]:
        return self._state, 1.0

    def _state(self, t: float) -> State:
        panel = self._panel_at(t)
        z = panel.scaled(t)
        d, w, v_ball, x_ball = (evaluate(series, z) for series in panel[3:7])
        return [self._force(d, w), x_ball + d, x_ball, v_ball + w, v_ball, d]

    def end(self) -> EndState:
        _, _, x_ball, v_club, v_ball, d = self._state(self.duration)
        return x_ball, v_club, v_ball, max(0.0, d), self.closing(self.duration)

    def compression(self, t: float) -> float:
        return self._at("d", t)

    def closing(self, t: float) -> float:
        return self._at("w", t)

    def impulse(self, begin: float, width: float) -> float:
        if width < _SHORT * self._panel_at(begin).width:
            return integral(lambda t: self._state(t)[0], begin + width, width)
        return self._at("impulse", begin + width) - self._at("impulse", begin)

    def peak_force(self, t: float) -> tuple[float, float]:
        return self._largest("force", lambda t: self._state(t)[0], t)

    def peak_compression(self, t: float) -> float:
        return self._largest("d", self.compression, t)[0]

    def _largest(self, name: str, value: Callable[[float], float], t: float) -> tuple[float, float]:
        maxima = self._maxima.get(name)
        if maxima is None:
            maxima = self._maxima[name] = [(when, value(when)) for when in self._find_maxima(name)]
        return largest_until(t, value, maxima)

    def _find_maxima(self, name: str) -> Iterator[float]:
        """When a quantity stops rising, s."""
        rising = False
        for panel in self._panels:
            slope = differentiate(getattr(panel, name))
            low = -1.0
            for z in (-1.0, *reversed(NODES), 1.0):
                if panel.begin + 0.5 * panel.width * (1.0 + z) > self.duration:
                    break
                rises = evaluate(slope, z) > 0.0
                if rising and not rises:
                    high = z
                    while low < (middle := 0.5 * (low + high)) < high:
                        if evaluate(slope, middle) > 0.0:
                            low = middle
                        else:
                            high = middle
                    yield panel.begin + 0.5 * panel.width * (1.0 + high)
                rising, low = rises, z
