"""States as bytes: a JSON list of a version, a value and a checksum.

A value is None, a bool, number or string, a tuple or dictionary of values, a named tuple, or an
object that has the `arguments` of its constructor.
"""

import json
from binascii import crc32
from collections.abc import Iterable
from typing import Any


def _plain(value: Any) -> Any:
    if type(value) is dict:
        return {name: _plain(item) for name, item in value.items()}
    arguments = getattr(value, "arguments", value)
    if not isinstance(arguments, tuple):
        return value
    items = [*map(_plain, arguments)]
    return items if type(value) is tuple else [type(value).__name__, *items]


def packed(version: str, value: Any) -> bytes:
    """A value as bytes; those of another version are refused, so it changes with their layout."""
    body = json.dumps([version, _plain(value)])[:-1].encode()
    return body + f", {crc32(body)}]".encode()


def unpacked(version: str, data: bytes, classes: Iterable[type]) -> Any:
    """The value that became these bytes; None if they are damaged or of another version.

    Objects are made by these classes alone. Bytes with a right checksum aren't checked further.
    """
    known = {class_.__name__: class_ for class_ in classes}

    def made(item: Any) -> Any:
        if isinstance(item, dict):
            return {name: made(value) for name, value in item.items()}
        class_ = known.get(str(item[0])) if isinstance(item, list) and item else None
        if class_ is None:
            return tuple(map(made, item)) if isinstance(item, list) else item
        return class_(*map(made, item[1:]))

    body = data.rpartition(b", ")[0]
    try:
        intact = data == body + f", {crc32(body)}]".encode()
        found, item = json.loads(body + b"]") if intact else (None, None)
        return made(item) if found == version else None
    except (ArithmeticError, LookupError, RecursionError, TypeError, ValueError):
        return None
