"""The state of an instance: recognized as this component's own, and serialized."""

import json
from binascii import crc32
from collections.abc import Callable
from operator import attrgetter
from typing import Any

from ..impact import unpacked as unpacked_impact
from .segment import NO_SEGMENT, Segment

#: First item of a serialized state; it changes with the layout.
_FORMAT = "golf-impact state 7"

#: First item of every snapshot; another version of this component in the process has another one.
OWN = object()

#: Items of a snapshot, before what a subclass adds; the last one is the segment.
LENGTH = 10


def is_own(snapshot: object) -> bool:
    """Whether this component made it."""
    return type(snapshot) is tuple and len(snapshot) >= LENGTH and snapshot[0] is OWN


def _with_checksum(body: bytes) -> bytes:
    """A JSON list without its end, ended by a checksum."""
    return body + f", {crc32(body)}]".encode()


def packed(snapshot: Any) -> bytes:
    """A snapshot as bytes: a JSON list that ends with a checksum."""
    if not is_own(snapshot):
        return b""
    _, *plain, segment = snapshot[:LENGTH]
    steps = None
    if segment is not NO_SEGMENT:
        steps = [segment.impact.packed(), segment.high, segment.low, segment.size]
    items = [_FORMAT, *plain, steps, snapshot[LENGTH:]]
    return _with_checksum(json.dumps(items, default=attrgetter("values"))[:-1].encode())


def unpacked(data: bytes, revive: Callable[[list], tuple] = tuple) -> tuple | None:
    """The snapshot that became these bytes, or None if they are none of this component's.

    `revive` makes what a subclass adds from what JSON makes of it.
    """
    try:
        body = data.rpartition(b", ")[0]
        if data != _with_checksum(body):
            return None
        form, values, mode, refused, once, *numbers, steps, more = json.loads(body + b"]")
        if form != _FORMAT:
            return None
        segment = NO_SEGMENT if steps is None else Segment(unpacked_impact(steps[0]), *steps[1:])
        own = OWN, tuple(values), mode, refused, tuple(once), *numbers, segment
        return *own, *revive(more)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return None
