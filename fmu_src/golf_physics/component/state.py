"""The state of an instance: recognized as this component's own, and serialized."""

import json
from binascii import crc32
from collections.abc import Callable
from operator import attrgetter
from typing import Any

from .segment import NO_SEGMENT, Segment

#: First item of a serialized state; it changes with the layout.
_FORMAT = "golf-impact state 7"

#: First item of every snapshot; another version of this component in the process has another one.
OWN = object()


def is_own(snapshot: object) -> bool:
    """Whether this component made it."""
    return type(snapshot) is tuple and snapshot[:1] == (OWN,)


def _with_checksum(body: bytes) -> bytes:
    """A JSON list without its end, ended by a checksum."""
    return body + f", {crc32(body)}]".encode()


def packed(snapshot: Any) -> bytes:
    """A snapshot as bytes: a JSON list that ends with a checksum."""
    if not is_own(snapshot):
        return b""
    _, *plain, segment = snapshot
    items = [_FORMAT, *plain, None if segment is NO_SEGMENT else segment.packed()]
    return _with_checksum(json.dumps(items, default=attrgetter("values"))[:-1].encode())


def unpacked(data: bytes, revive: Callable[[list], Segment] = Segment.unpacked) -> tuple | None:
    """The snapshot that became these bytes, or None if they are none of this component's."""
    try:
        body = data.rpartition(b", ")[0]
        if data != _with_checksum(body):
            return None
        form, values, mode, refused, once, *numbers, steps = json.loads(body + b"]")
        if form != _FORMAT:
            return None
        segment = NO_SEGMENT if steps is None else revive(steps)
        return OWN, tuple(values), mode, refused, tuple(once), *numbers, segment
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return None
