"""Equal communication steps under one impact, and what the fast read computes once for them."""

from collections.abc import Callable
from math import ceil, inf
from operator import attrgetter
from typing import Any

from ..impact import RESOLUTION, Contact, added
from ..laws.contact import State

#: Next to touch and separation (relative) force and compression may be all rounding error.
_CLOSE = 1e-12

#: The dense output of a contact; the number of steps before the contact began, the scaled time
#: there and that of a step; between which of its times the dense output is the state.
_Reader = tuple[Callable[[float], State], float, float, float, float, float]

NO_READER: _Reader = list, 0.0, 0.0, 0.0, inf, -inf  # type: ignore[assignment]


class Segment:
    """Communication steps of one size (s; 0 before the first one, NaN in Model Exchange) from one
    instant on, without a change of inputs. `impact` is that at the instant or before. A value.
    """

    __slots__ = ("high", "impact", "low", "reader", "size")

    arguments = property(attrgetter("impact", "high", "low", "size"))

    def __init__(self, impact: Any, high: float, low: float, size: float) -> None:
        self.impact, self.high, self.low, self.size = impact, high, low, size
        #: Found on demand, and a function of the values above alone.
        self.reader: _Reader = NO_READER

    def instant(self, count: float) -> tuple[float, float]:
        """The instant after so many steps, s."""
        if not count:
            return self.high, self.low
        size = self.size
        if count == 1.0:
            return added(self.high, self.low, size)
        # Two factors of at most 26 bits have an exact product.
        high = 134217729.0 * size
        high -= high - size
        return added(*added(self.high, self.low, count * high), count * (size - high))

    def state(self, count: float) -> tuple[State, Any]:
        """The state after so many steps, where `reader` isn't valid, and the impact there.

        Raises ArithmeticError or ValueError if the contact leaves the range of a double.
        """
        high, low = self.instant(count)
        impact = self.impact.at(high, low)
        if not isinstance(impact, Contact):
            return impact.state(high, low), impact
        motion, scale = impact.phase.dense_output()
        offset, first = (self.high - impact.high) + (self.low - impact.low), 0.0
        if offset < 0.0 and self.size:
            # Steps before the phase began would only cost digits.
            first = float(ceil(-offset / self.size - 1e-9))
            begin, begin_low = self.instant(first)
            offset = (begin - impact.high) + (begin_low - impact.low)
        # Next to an event the exact instant decides, and the state is clamped.
        since = scale * max(_CLOSE / impact.phase.rate, RESOLUTION * impact.high)
        until = scale * impact.duration * (1.0 - _CLOSE)
        offset, pace = scale * offset, scale * self.size
        self.reader = motion, first, offset, pace, since, until
        state = motion(offset + (count - first) * pace)
        return impact.clamped(state, impact.elapsed(high, low)), impact


#: No steps, and no impact yet.
NO_SEGMENT = Segment(None, 0.0, 0.0, 0.0)
