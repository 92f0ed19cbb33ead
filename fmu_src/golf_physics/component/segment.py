"""Equal communication steps under one impact, and what the fast read computes once for them."""

from collections.abc import Callable
from math import ceil, inf
from operator import attrgetter
from typing import Any

from ..impact import RESOLUTION, Contact
from ..values import START, Inputs, Instant, State, added

#: Next to touch and separation (relative) force and compression may be all rounding error.
_CLOSE = 1e-12

#: The dense output of a contact; the number of steps before the contact began, the scaled time
#: there and that of a step; between which of its times the dense output is the state. A tuple,
#: since every step that is read takes it apart.
_Reader = tuple[Callable[[float], State], float, float, float, float, float]

NO_READER: _Reader = list, 0.0, 0.0, 0.0, inf, -inf  # type: ignore[assignment]


class Segment:
    """Communication steps of one size (s; 0 before the first one, NaN in Model Exchange) from one
    instant on, under the same inputs. `impact` is that at the instant or before. A value.
    """

    __slots__ = (
        "_count", "_instant", "_phase", "_phases", "begin", "impact", "inputs", "reader", "size",
    )  # fmt: skip

    arguments = property(attrgetter("impact", "inputs", "begin", "size"))

    def __init__(self, impact: Any, inputs: Inputs, begin: Instant, size: float) -> None:
        self.impact, self.inputs = impact, inputs
        self.begin, self.size = begin, size
        # What follows is found on demand, and a function of the values above alone.
        self.reader: _Reader = NO_READER
        #: The impact from its phases on, as far as they have been evaluated.
        self._phases = [impact]
        #: The last number of steps, the instant after them, and the place of its phase or before.
        self._count, self._instant, self._phase = 0.0, begin, 0

    def instant(self, count: float) -> Instant:
        """The instant after so many steps."""
        if count != self._count:
            if count < self._count:
                # After a restored state.
                self._phase = 0
            self._count = count
            self._instant = added(self.begin, self.size) if count == 1.0 else self._after(count)
        return self._instant

    def _after(self, count: float) -> Instant:
        # Two factors of at most 26 bits have an exact product.
        size = self.size
        high = 134217729.0 * size
        high -= high - size
        return added(added(self.begin, count * high), count * (size - high))

    def present(self, count: float) -> Any:
        """The impact after so many steps, from its phase on that holds this instant.

        Raises ArithmeticError or ValueError if the contact leaves the range of a double.
        """
        high, low = self._instant if count == self._count else self.instant(count)
        phases, n = self._phases, self._phase
        impact = phases[n]
        while True:
            begin, begin_low = impact.begin
            # Not of NaN, in Model Exchange.
            if not (high - begin) + (low - begin_low) >= impact.duration:
                self._phase = n
                return impact
            if n + 1 < len(phases):
                n += 1
                impact = phases[n]
                continue
            following = impact.following(self.inputs)
            if following is not impact:
                n += 1
                phases.append(following)
                impact = following

    def resized(self, begin: Instant, size: float) -> "Segment":
        """The same impact and inputs by steps of another size from a later instant on."""
        segment = Segment(self.impact, self.inputs, begin, size)
        segment._phases, segment._phase = self._phases, self._phase
        return segment

    def changed(self, inputs: Inputs, count: float) -> Any:
        """The impact that other inputs after so many steps lead to.

        A touch at this very instant hasn't been passed yet, so it is still undecided. Raises
        ArithmeticError or ValueError if the contact that follows leaves the range of a double.
        """
        impact = self.impact
        if impact.touch is None:
            instant = self._instant if count == self._count else self.instant(count)
            if impact.is_undecided(instant):
                club_speed = inputs[2]
                same = club_speed == self.inputs[2]
                return impact if same else impact.with_speed(club_speed, instant)
        return self.present(count).changed(inputs, self._instant)

    def with_inputs(self, inputs: Inputs) -> "Segment":
        """The same steps, where these inputs have no effect any more."""
        segment = self.resized(self.begin, self.size)
        segment.inputs = inputs
        segment.reader = self.reader
        return segment

    def state(self, count: float) -> State:
        """The state after so many steps, where `reader` isn't valid; raises as `present`."""
        impact = self.present(count)
        instant = self._instant
        if type(impact) is not Contact:
            return impact.state(instant)
        dense, scale = impact.phase.dense_output()
        begin, begin_low = impact.begin
        offset, first = (self.begin[0] - begin) + (self.begin[1] - begin_low), 0.0
        if offset < 0.0 and self.size:
            # Steps before the phase began would only cost digits.
            first = float(ceil(-offset / self.size - 1e-9))
            high, low = self._after(first)
            offset = (high - begin) + (low - begin_low)
        # Next to an event the exact instant decides, and the state is clamped.
        since, resolution = _CLOSE / impact.phase.rate, RESOLUTION * begin
        since = scale * (since if since > resolution else resolution)
        until = scale * impact.duration * (1.0 - _CLOSE)
        offset, pace = scale * offset, scale * self.size
        self.reader = dense, first, offset, pace, since, until
        state = dense(offset + (count - first) * pace)
        t = (instant[0] - begin) + (instant[1] - begin_low)
        if t <= resolution or state[0] < 0.0 or state[5] < 0.0:
            impact.clamp(state, t if t > resolution else 0.0)
        return state


#: No steps, and no impact yet.
NO_SEGMENT = Segment(None, Inputs(0.0, 0.0, 0.0, 0.0), START, 0.0)
