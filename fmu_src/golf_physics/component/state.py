"""The state of an instance: known as this component's own, and as bytes for another process."""

import json
from binascii import crc32
from typing import Any

from ..parameters import SETTABLE, conflict
from ..variables import VARIABLES

#: First item of a serialized state: another layout must have another one.
_FORMAT = "golf-impact state 5"

#: First item of every snapshot: those of another version of this component, loaded in the same
#: process, have another one.
OWN = object()


def is_own(snapshot: object) -> bool:
    """Whether this component made it."""
    return type(snapshot) is tuple and len(snapshot) > 0 and snapshot[0] is OWN


def _with_checksum(body: bytes) -> bytes:
    """A JSON list without its end, ended by a checksum."""
    return body + f", {crc32(body)}]".encode()


def packed(snapshot: tuple, kinds: dict[type, Any]) -> bytes:
    """A snapshot as bytes: a JSON list whose last item is a checksum.

    Args:
        snapshot: of an instance.
        kinds: the classes of impacts that its last item may be a snapshot of, by its type.
    """
    if not is_own(snapshot):
        return b""
    _, *plain, impact = snapshot
    if impact is not None:
        impact = kinds[type(impact)].restored(impact).packed()
    return _with_checksum(json.dumps([_FORMAT, *plain, impact])[:-1].encode())


def unpacked(data: bytes, kinds: dict[type, Any]) -> tuple | None:
    """The snapshot that became these bytes, or None if they are none of this component's."""
    try:
        # Looked at before anything else is: damaged bytes could stand for any numbers.
        body = data.rpartition(b", ")[0]
        if data != _with_checksum(body):
            return None
        form, values, *plain, impact = json.loads(body + b"]")
        if form != _FORMAT:
            return None
        allowed = zip(VARIABLES[:SETTABLE], values, strict=True)
        if not all(variable.low <= value <= variable.high for variable, value in allowed):
            return None
        if impact is not None:
            made = kinds[type(impact)].unpacked(impact)
            if conflict(made.parameters, made.in_force) is not None:
                return None
            impact = made.snapshot()
        mode, refused, once, *numbers = plain
        return (OWN, tuple(values), mode, refused, tuple(once), *numbers, impact)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return None
