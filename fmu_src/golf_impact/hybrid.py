"""A component whose motion the host may also find itself: what FMI 3.0 has beside stepping.

Nobody tells an instance which of the two it is for. The first call that only Model Exchange knows
decides; from then on the host's time and states count, and steps are refused.
"""

import json
from binascii import crc32
from collections.abc import Callable
from math import inf, nan, nextafter
from typing import Any

from .component import BLOCKED, STEPPING, Component
from .impact import Impact
from .parameters import INPUTS, conflict
from .solved import (
    SolvedImpact,
    SolvedSnapshot,
    acceleration,
    separation_indicator,
    touch_indicator,
)
from .variables import ALL_REFERENCES

#: How to read what FMI 2.0 doesn't have, by value reference.
_MORE: dict[int, Any] = {
    ALL_REFERENCES[name]: result
    for name, result in {
        "time": lambda impact, state, at: at.time(),
        "club_acceleration": lambda impact, state, at: acceleration(impact, state, 0),
        "ball_acceleration": lambda impact, state, at: acceleration(impact, state, 1),
        "touch_indicator": lambda impact, state, at: touch_indicator(impact, state),
        "separation_indicator": lambda impact, state, at: separation_indicator(impact, state),
    }.items()
}

#: First item of a serialized state in Model Exchange.
_FORMAT = "golf-impact solved state 1"


class HybridComponent(Component):
    """An instance for co-simulation with event mode, or for Model Exchange.

    Args:
        report: called with a message whenever something is refused.
    """

    __slots__ = ("_solved",)

    def __init__(self, report: Callable[[str], None]) -> None:
        super().__init__(report)
        #: The impact as the host's solver finds it; None while the phases do.
        self._solved: SolvedImpact | None = None
        # The host's time at the start isn't told: it is that of the first step.
        self._point = nan
        self._anchored = False

    def time(self) -> float:
        """The host's time, s."""
        if self._count:
            self._fold_clock()
        return self.origin + (self.clock + self.carry)

    def _move_origin(self, point: float) -> None:
        if not self.last_step:
            self.start_time = point
        super()._move_origin(point)

    def _problem(self, point: float, size: float) -> str | None:
        if self._solved is not None:
            return "a step is refused: this instance is used for Model Exchange"
        return super()._problem(point, size)

    def _functions(self, references: list[int], type_: str) -> tuple:
        known = super()._functions(references, type_)
        if type_ != "Real":
            return known
        return tuple(
            (reference, _MORE[reference]) if reference in _MORE else function
            for reference, function in zip(references, known)
        )

    def set_values(self, references: list[int], values: list, type_: str = "Real") -> None:
        """Set inputs and parameters; what is refused keeps its value. See `Component`."""
        super().set_values(references, values, type_)
        solved = self._solved
        if solved is not None:
            inputs: Any = tuple(self._values[:INPUTS])
            if inputs != solved.in_force:
                solved.hold(inputs)
            self._now = None

    # Event mode

    def update(self) -> tuple[bool, bool, float | None]:
        """Whatever happens at this instant.

        Returns:
            Whether the host must stop, since values were refused; whether a continuous state has
            jumped; and, while stepping, the host's time (s) of the next touch or separation, if
            one is due under the present inputs.
        """
        problem = self._begin() if self._mode == BLOCKED else None
        if problem is None and self._mode != STEPPING:
            self._refuse_once("an event before initialization or after the end is refused")
            return False, False, None
        solved = self._solved
        if problem is None and self._refused and (solved is not None or not self.last_step):
            problem = "; ".join(self._refused.values())
        jumped = False
        if problem is None and solved is not None:
            self._now = None
            jumped = solved.update(self.clock)
            problem = _refusal(solved)
        if problem is not None:
            self._report(f"the simulation must stop: {problem}")
            return True, jumped, None
        return False, jumped, self._next_event() if solved is None else None

    def _next_event(self) -> float | None:
        impact = self._impact
        if not self.last_step or impact is None:
            return None
        self._fold_clock()
        ahead = Impact.restored(impact.snapshot())
        inputs: Any = tuple(self._values[:INPUTS])
        try:
            if inputs != ahead.in_force:
                ahead.hold(self.clock, self.carry, inputs)
            when = self.origin + ahead.next_event(self.clock, self.carry)
        except (ArithmeticError, ValueError):
            return None
        # A step that ends there must have passed it, whatever its rounding.
        return nextafter(max(when, self._point), inf) if when < inf else None

    # Model Exchange

    def _solving(self) -> SolvedImpact:
        """The impact to solve; before the end of initialization, one of the present values."""
        if self._solved is not None:
            return self._solved
        solved = SolvedImpact(*self._split())
        solved.update(self.clock)
        if self._mode == STEPPING:
            self._solved = solved
            self._impact = solved  # type: ignore[assignment]  # results look at either
            self._now = None
            self._until = self.last_step = nan
            problem = _refusal(solved)
            if problem is not None:
                self._report(problem)
        return solved

    def set_time(self, time: float) -> None:
        """The host's time, s; the first one told before any state is that of the start."""
        solved = self._solving()
        if not solved.started:
            solved.started = True
            self.start_time = time
            solved.start_at(time)
        self.clock = time
        self._now = None

    def states(self) -> list[float]:
        """The continuous states: positions (m) and velocities (m/s), each of club and ball."""
        return self._solving().states

    def set_states(self, states: list[float]) -> None:
        """Where the host's solver is; the list is kept."""
        solved = self._solving()
        solved.started = True
        solved.states = states
        self._now = None

    def derivatives(self) -> list[float]:
        """Of the states; NaN while values are refused, so that no solver goes on with others."""
        solved = self._solving()
        if self._refused or self._mode == BLOCKED or solved.out_of_reach:
            return [nan] * 4
        return solved.derivatives()

    def indicators(self) -> list[float]:
        """Of touch and separation: above 0 until it happens."""
        return self._solving().indicators()

    # State

    def restore(self, snapshot: tuple | None) -> None:
        """Go back to a snapshot: the instance is then exactly as it was."""
        if snapshot is None or not _is_solved(snapshot):
            super().restore(snapshot)
            self._solved = None
            return
        super().restore((*snapshot[:-1], None))
        self._solved = SolvedImpact.restored(snapshot[-1])
        self._impact = self._solved  # type: ignore[assignment]

    @staticmethod
    def packed(snapshot: tuple) -> bytes:
        """A snapshot as bytes, for another process."""
        if not _is_solved(snapshot):
            return Component.packed(snapshot)
        plain = Component.packed((*snapshot[:-1], None)).decode()
        solved = json.dumps(snapshot[-1])
        return json.dumps([_FORMAT, plain, solved, crc32(solved.encode())]).encode()

    @staticmethod
    def unpacked(data: bytes) -> tuple | None:
        """The snapshot that became these bytes, or None if they are none of this component's."""
        try:
            form, plain, solved, checksum = json.loads(data)
        except (TypeError, ValueError):
            form = None
        if form != _FORMAT:
            return Component.unpacked(data)
        try:
            if crc32(solved.encode()) != checksum:
                return None
            made = SolvedImpact.restored(json.loads(solved))
            snapshot = Component.unpacked(plain.encode())
            if snapshot is None or conflict(made.parameters, made.in_force) is not None:
                return None
        except (ArithmeticError, AttributeError, TypeError, ValueError):
            return None
        return (*snapshot[:-1], made.snapshot())


def _refusal(solved: SolvedImpact) -> str | None:
    if not solved.out_of_reach or solved.touch is None:
        return None
    return (
        f"club_speed = {solved.touch[3]!r} m/s is refused at touch: the coefficient of restitution "
        "that follows from it must be above 0 and at most 1"
    )


def _is_solved(snapshot: tuple) -> bool:
    return isinstance(snapshot, tuple) and any(isinstance(p, SolvedSnapshot) for p in snapshot)
