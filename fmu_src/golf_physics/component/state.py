"""The state of an instance: recognized as this component's own, and serialized."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from .. import codec
from ..codec import check, finite, fits, real
from ..impact import Approach, Contact, Flight, Results, Touch
from ..refusals import conflict
from ..values import Inputs, Motion, Parameters, Refusal
from ..variables import SETTABLE
from .segment import Segment
from .solved import SolvedImpact

#: First item of a serialized state; it changes with the layout.
_FORMAT = "golf-impact state 10"

#: Modes of an instance, in the order in which a host passes through them. Blocked: initialization
#: has ended on values that can't be used, so parameters may still be set.
INSTANTIATED, INITIALIZATION, BLOCKED, STEPPING, TERMINATED = range(5)

#: No instance gets so far: 10⁹ steps of 1e100 s.
_LATEST = 1e109


def _instant(item: Any) -> bool:
    """Whether an item is an instant, s."""
    return fits(item, [real, real]) and all(abs(x) < _LATEST for x in item)


def _contact(parameters: Parameters, inputs: Inputs, *others: Any) -> Contact:
    """A contact that is possible; else its phase could take for ever."""
    _check_case(parameters, inputs)
    *_, motion, _ = others
    if motion.compression < 0.0:
        raise ValueError("a contact without compression")
    return Contact(parameters, inputs, *others)


_KINDS: dict[type, tuple] = {
    Inputs: (finite,) * 4,
    Motion: (finite,) * 6,
    Results: (finite,) * 5,
    Parameters: (finite,) * 10,
    Refusal: (str, str, object, str),
    Touch: ([real, real], finite, finite),
    Approach: (Parameters, finite, _instant, finite, finite, finite),
    Contact: (Parameters, Inputs, _instant, Touch, Motion, Results),
    Flight: (Contact, _instant, finite, Motion, finite, (Flight, None)),
    SolvedImpact: (
        Parameters, Inputs, finite, tuple, bool, (Touch, None), bool, (Refusal, None),
        *(real,) * 4, ([real, real], None),
    ),
    Segment: ((Approach, Contact, Flight, SolvedImpact, None), Inputs, [real, real], real),
}  # fmt: skip
#: What makes the objects in a state, and the kinds of its arguments, by class.
SHAPES: dict[str, tuple[Callable, tuple]] = {
    kind.__name__: (_contact if kind is Contact else kind, kinds) for kind, kinds in _KINDS.items()
}

#: What a snapshot has: values, mode, refusals and those of the next step alone, start time, origin,
#: communication point, number of steps, segment.
_SNAPSHOT = tuple, int, dict, tuple, real, real, real, finite, Segment


class Snapshot(tuple):
    """An instance; another version of this component in the process has a class of its own."""


def _check_case(parameters: Parameters, inputs: Inputs) -> None:
    """ValueError unless the physics accepts these values."""
    _check_bounds((*inputs, *parameters.arguments))
    if conflict(parameters, inputs) is not None:
        raise ValueError("values that are refused")


def _check_bounds(values: Sequence[Any]) -> None:
    check(values, (finite,) * len(SETTABLE))
    if not all(row.low <= x <= row.high for x, row in zip(values, SETTABLE.values())):
        raise ValueError("values that are refused")


def _check_values(snapshot: Sequence[Any]) -> None:
    """ValueError unless these values could be those of an instance."""
    check(snapshot, _SNAPSHOT)
    values, mode, refused, once, *_, count, segment = snapshot
    _check_bounds(values)
    check((*refused.values(), *once), (Refusal,) * (len(refused) + len(once)))
    right, impact = True, segment.impact
    if isinstance(impact, SolvedImpact):
        check(impact.states, (real,) * 4)
        _check_bounds((*impact.inputs, *impact.parameters.arguments))
    elif mode == STEPPING:
        check((segment.begin, segment.size), (_instant, finite))
        _check_case(impact.parameters, segment.inputs)
        right = segment.size >= 0.0 <= count and count * segment.size < _LATEST
    if not (right and 0 <= mode <= TERMINATED):
        raise ValueError("another content")


def packed(snapshot: Any) -> bytes:
    """A snapshot as bytes."""
    return codec.packed([_FORMAT, *snapshot]) if isinstance(snapshot, Snapshot) else b""


def _made(items: list) -> Snapshot | None:
    if items[0] != _FORMAT:
        return None
    snapshot = Snapshot(codec.revived(item, SHAPES) for item in items[1:])
    _check_values(snapshot)
    return snapshot


#: The snapshot that became some bytes, or None if they are none of this component's.
unpacked = partial(codec.unpacked, made=_made)
