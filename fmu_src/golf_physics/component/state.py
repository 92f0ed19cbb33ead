"""The state of an instance: recognized as this component's own, and serialized."""

import json
from binascii import crc32
from collections.abc import Sequence
from typing import Any

from ..impact import Approach, Contact, Flight, Results, Touch
from ..refusals import conflict
from ..values import Inputs, Motion, Parameters, Refusal
from ..variables import LARGEST, SETTABLE
from .segment import Segment
from .solved import SolvedImpact

#: First item of a serialized state; it changes with the layout.
_FORMAT = "golf-impact state 10"

#: Modes of an instance, in the order in which a host passes through them. Blocked: initialization
#: has ended on values that can't be used, so parameters may still be set.
INSTANTIATED, INITIALIZATION, BLOCKED, STEPPING, TERMINATED = range(5)

#: Kinds of items beside classes: a number that is finite or not, and a pair: an instant, s, or
#: any numbers.
_FINITE, _REAL, _INSTANT, _PAIR = "finite", "real", "instant", "pair"

#: No instance gets so far: 10⁹ steps of 1e100 s.
_LATEST = 1e109

#: What the arguments of each class are; several kinds in a tuple, None where there may be nothing.
_SHAPES: dict[Any, tuple] = {
    Inputs: (_FINITE,) * 4,
    Motion: (_FINITE,) * 6,
    Results: (_FINITE,) * 5,
    Parameters: (_FINITE,) * 10,
    Refusal: (str, str, object, str),
    Touch: (_PAIR, _FINITE, _FINITE),
    Approach: (Parameters, _FINITE, _INSTANT, _FINITE, _FINITE, _FINITE),
    Contact: (Parameters, Inputs, _INSTANT, Touch, Motion, Results),
    Flight: (Contact, _INSTANT, _FINITE, Motion, _FINITE, (Flight, None)),
    SolvedImpact: (
        Parameters, Inputs, _FINITE, tuple, bool, (Touch, None), bool, (Refusal, None),
        *(_REAL,) * 4, (_PAIR, None),
    ),
    Segment: ((Approach, Contact, Flight, SolvedImpact, None), Inputs, _PAIR, _REAL),
}  # fmt: skip
_CLASSES: dict[str, Any] = {kind.__name__: kind for kind in _SHAPES}

#: What a snapshot has: values, mode, refusals and those of the next step alone, start time, origin,
#: communication point, number of steps, segment.
_SNAPSHOT = tuple, int, dict, tuple, _REAL, _REAL, _REAL, _FINITE, Segment


def _fits(item: Any, kind: Any) -> bool:
    if isinstance(kind, tuple):
        return any(_fits(item, one) for one in kind)
    if kind is None:
        return item is None
    if kind in (_INSTANT, _PAIR):
        pair = isinstance(item, tuple) and len(item) == 2 and all(_fits(x, _REAL) for x in item)
        return pair and (kind == _PAIR or all(abs(x) < _LATEST for x in item))
    if kind in (_FINITE, _REAL):
        some_real = kind == _REAL and type(item) is float
        return some_real or (type(item) in (int, float) and abs(item) <= LARGEST)
    return isinstance(item, kind)


def _check(items: Sequence[Any], kinds: Sequence[Any]) -> None:
    """ValueError unless the items are of these kinds."""
    if len(items) != len(kinds) or not all(map(_fits, items, kinds)):
        raise ValueError("another content")


class Snapshot(tuple):
    """An instance; another version of this component in the process has a class of its own."""


def plain(value: Any) -> Any:
    """Values of these classes become lists: the name of the class, and its arguments."""
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    name = type(value).__name__
    if name in _CLASSES:
        return [name, *map(plain, getattr(value, "arguments", value))]
    return list(map(plain, value)) if isinstance(value, tuple) else value


def revived(item: Any) -> Any:
    """The value that became this, by `plain` and JSON."""
    if isinstance(item, dict):
        return {name: revived(value) for name, value in item.items()}
    if not isinstance(item, list):
        return item
    if item and isinstance(item[0], str) and item[0] in _CLASSES:
        name, *arguments = item
        kind, arguments = _CLASSES[name], [*map(revived, arguments)]
        _check(arguments, _SHAPES[kind])
        if kind is Contact:
            # Made at once: an impossible one could take for ever.
            parameters, inputs, _, _, motion, _ = arguments
            _check_case(parameters, inputs)
            if motion.compression < 0.0:
                raise ValueError("a contact without compression")
        return kind(*arguments)
    return tuple(map(revived, item))


def _check_case(parameters: Parameters, inputs: Inputs) -> None:
    """ValueError unless the physics accepts these values."""
    _check_bounds((*inputs, *parameters.arguments))
    if conflict(parameters, inputs) is not None:
        raise ValueError("values that are refused")


def _check_bounds(values: Sequence[Any]) -> None:
    _check(values, (_FINITE,) * len(SETTABLE))
    if not all(row.low <= x <= row.high for x, row in zip(values, SETTABLE.values())):
        raise ValueError("values that are refused")


def _check_values(snapshot: Sequence[Any]) -> None:
    """ValueError unless these values could be those of an instance."""
    _check(snapshot, _SNAPSHOT)
    values, mode, refused, once, *_, count, segment = snapshot
    _check_bounds(values)
    _check((*refused.values(), *once), (Refusal,) * (len(refused) + len(once)))
    right, impact = True, segment.impact
    if isinstance(impact, SolvedImpact):
        _check(impact.states, (_REAL,) * 4)
        _check_bounds((*impact.inputs, *impact.parameters.arguments))
    elif mode == STEPPING:
        _check((segment.begin, segment.size), (_INSTANT, _FINITE))
        _check_case(impact.parameters, segment.inputs)
        right = segment.size >= 0.0 <= count and count * segment.size < _LATEST
    if not (right and 0 <= mode <= TERMINATED):
        raise ValueError("another content")


def _with_checksum(body: bytes) -> bytes:
    """A JSON list without its end, ended by a checksum."""
    return body + f", {crc32(body)}]".encode()


def packed(snapshot: Any) -> bytes:
    """A snapshot as bytes: a JSON list that ends with a checksum."""
    if not isinstance(snapshot, Snapshot):
        return b""
    return _with_checksum(json.dumps([_FORMAT, *map(plain, snapshot)])[:-1].encode())


def unpacked(data: bytes) -> Snapshot | None:
    """The snapshot that became these bytes, or None if they are none of this component's."""
    body = data.rpartition(b", ")[0]
    if data != _with_checksum(body):
        return None
    try:
        form, *items = json.loads(body + b"]")
        if form != _FORMAT:
            return None
        snapshot = Snapshot(map(revived, items))
        _check_values(snapshot)
        return snapshot
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError):
        return None
