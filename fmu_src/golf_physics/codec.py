"""States of instances as bytes: a JSON list that ends with a checksum, checked item by item."""

import json
from binascii import crc32
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isfinite
from typing import Any


def real(item: Any) -> bool:
    """Whether an item is a number, finite or not."""
    return type(item) is float or finite(item)


def finite(item: Any) -> bool:
    """Whether an item is a finite number; OverflowError: it leaves the range of a double."""
    return type(item) in (int, float) and isfinite(item)


def check(items: Sequence[Any], kinds: Sequence[Any]) -> None:
    """ValueError unless the items are of these kinds.

    A kind is a class, a function that says whether an item fits, None, a list with the kinds of a
    tuple's items, or a tuple of kinds to choose from.
    """
    if len(items) != len(kinds) or not all(map(fits, items, kinds)):
        raise ValueError("another content")


def fits(item: Any, kind: Any) -> bool:
    """Whether an item is of a kind; see `check`."""
    if isinstance(kind, tuple):
        return any(fits(item, one) for one in kind)
    if isinstance(kind, list):
        alike = isinstance(item, tuple) and len(item) == len(kind)
        return alike and all(map(fits, item, kind))
    if kind is None:
        return item is None
    return isinstance(item, kind) if isinstance(kind, type) else kind(item)


def plain(value: Any) -> Any:
    """A value for JSON: of an object the name of its class and its arguments, as a list.

    These are the items of a named tuple; others have them as `arguments`.
    """
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    arguments = getattr(value, "arguments", value)
    if arguments is not value or hasattr(value, "_fields"):
        return [type(value).__name__, *map(plain, arguments)]
    return [*map(plain, value)] if isinstance(value, tuple) else value


def revived(item: Any, shapes: Mapping[str, tuple[Callable, Sequence[Any]]]) -> Any:
    """The value that became this, by `plain` and JSON; ValueError: it has another content.

    `shapes` has what makes an object of a class, by its name, and the kinds of the arguments.
    """
    if isinstance(item, dict):
        return {name: revived(value, shapes) for name, value in item.items()}
    if not isinstance(item, list):
        return item
    values = tuple(revived(value, shapes) for value in item)
    if not (values and isinstance(values[0], str) and values[0] in shapes):
        return values
    make, kinds = shapes[values[0]]
    check(values[1:], kinds)
    return make(*values[1:])


def _with_checksum(body: bytes) -> bytes:
    """A JSON list from all but its end."""
    return body + f", {crc32(body)}]".encode()


def packed(items: Iterable[Any]) -> bytes:
    """Values as bytes."""
    return _with_checksum(json.dumps([*map(plain, items)])[:-1].encode())


def unpacked(data: bytes, made: Callable[[list], Any]) -> Any:
    """What is made of the list that became these bytes; None: they are damaged, or it refuses."""
    body = data.rpartition(b", ")[0]
    if data != _with_checksum(body):
        return None
    try:
        return made(json.loads(body + b"]"))
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError):
        return None
