"""The state of an instance: recognized as this component's own, and serialized."""

import json
from binascii import crc32
from typing import Any

from ..impact import Approach, Contact, Flight, Results, Touch
from ..values import Inputs, Motion, Parameters, Refusal
from .segment import Segment
from .solved import SolvedImpact

#: First item of a serialized state; it changes with the layout.
_FORMAT = "golf-impact state 10"

_CLASSES: dict[str, Any] = {
    kind.__name__: kind
    for kind in (
        Approach, Contact, Flight, Inputs, Motion, Parameters, Refusal, Results,
        Segment, SolvedImpact, Touch,
    )
}  # fmt: skip


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
        return _CLASSES[name](*map(revived, arguments))
    return tuple(map(revived, item))


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
        return Snapshot(map(revived, items)) if form == _FORMAT else None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return None
