"""The state of an instance, and the same as bytes."""

from typing import Any, NamedTuple

from .. import codec
from ..impact import Approach, Contact, Flight, Impact, Results, Touch
from ..values import Inputs, Instant, Motion, Parameters, Refusal

#: It changes with the layout of a state.
_VERSION = "golf-impact state 14"


class Snapshot(NamedTuple):
    """An instance; another version of this component in the process has a class of its own."""

    values: tuple[float, ...]
    mode: int
    refused: dict[str, Refusal]
    illegal: tuple[Refusal, ...]
    start_time: float
    origin: float
    point: float
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


def packed(snapshot: Any) -> bytes:
    """A snapshot as bytes."""
    if not isinstance(snapshot, Snapshot):
        return b""
    return codec.packed(_VERSION, snapshot._replace(computed=None))


def unpacked(data: bytes) -> Any:
    """The snapshot that became these bytes; None if they are of another version or damaged."""
    return codec.unpacked(_VERSION, data, CLASSES)
