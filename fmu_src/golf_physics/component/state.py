"""The state of an instance, and the same as bytes."""

from typing import Any, NamedTuple

from .. import codec
from ..codec import Real
from ..impact import Approach, Contact, Flight, Impact, Results, Touch
from ..modes import INSTANTIATED, STEPPING, TERMINATED
from ..refusals import conflict
from ..values import Inputs, Instant, Motion, Parameters, Refusal
from ..variables import SETTABLE

#: It changes with the layout of a state.
_VERSION = "golf-impact state 12"

#: No instance gets so far, s: 10⁹ steps of 1e100 s.
_LATEST = 1e109


class Snapshot(NamedTuple):
    """An instance; another version of this component in the process has a class of its own."""

    values: tuple[float, ...]
    mode: int
    refused: dict[str, Refusal]
    illegal: tuple[Refusal, ...]
    start_time: float
    origin: float
    point: Real
    #: The impact at the start of a run of equal steps or before; their inputs, size and number.
    impact: Impact | None
    inputs: Inputs | None
    begin: Instant
    size: float
    steps: float
    #: The impact from a later phase on, and its dense output: computed from the others on demand.
    computed: None = None


CLASSES = (
    Snapshot, Inputs, Motion, Parameters, Refusal, Results, Touch, Approach, Contact, Flight,
)  # fmt: skip


def _in_bounds(*values: float) -> bool:
    return all(row.low <= value <= row.high for row, value in zip(SETTABLE.values(), values))


def _check(class_: type, arguments: Any) -> None:
    """ValueError where no instance has an object of these arguments: it might take for ever."""
    right = True
    if class_ is Contact:
        parameters, inputs, *_, motion, _ = arguments
        right = _in_bounds(*inputs, *parameters)
        right = right and conflict(parameters, inputs) is None and motion.compression >= 0.0
    elif class_ is Snapshot:
        state = Snapshot(*arguments)
        impact, inputs = state.impact, state.inputs
        right = len(state.values) == len(SETTABLE) and _in_bounds(*state.values)
        right &= INSTANTIATED <= state.mode <= TERMINATED and abs(state.begin[0]) < _LATEST
        right &= min(state.size, state.steps) >= 0.0 and state.size * state.steps < _LATEST
        if impact is None or inputs is None:
            right &= impact is None and inputs is None and state.mode != STEPPING
        else:
            right &= _in_bounds(*inputs, *impact.parameters)
            right = right and conflict(impact.parameters, inputs) is None
    if not right:
        raise ValueError(f"no {class_.__name__} of an instance")


def packed(snapshot: Any) -> bytes:
    """A snapshot as bytes."""
    if not isinstance(snapshot, Snapshot):
        return b""
    return codec.packed(_VERSION, snapshot._replace(computed=None))


def unpacked(data: bytes) -> Snapshot | None:
    """The snapshot that became these bytes, or None if they are none of this component's."""
    snapshot = codec.unpacked(_VERSION, data, CLASSES, _check)
    return snapshot if isinstance(snapshot, Snapshot) else None
