"""Shared libraries of Linux as bytes: 64 bit, little endian (System V ABI, chapters 4 and 5)."""

import re
from collections.abc import Mapping
from struct import pack_into, unpack_from

_LOAD = 1


def glibc(data: bytes) -> tuple[int, ...]:
    """The oldest glibc that has all that it needs, as (2, 17)."""
    versions = re.findall(rb"\0GLIBC_([\d.]+)(?=\0)", data)
    return max((tuple(map(int, text.split(b"."))) for text in versions), default=(0,))


def strip(data: bytes) -> bytes:
    """Remove sections (debugging information, names that only a compiler's linker reads)."""
    (table,), (size, count) = unpack_from("<Q", data, 32), unpack_from("<HH", data, 54)
    # Type, flags, offset in the file, two addresses, size in the file.
    headers = (unpack_from("<IIQQQQ", data, table + n * size) for n in range(count))
    head = bytearray(data[: max(header[2] + header[5] for header in headers if header[0] == _LOAD)])
    # Offset, size, number of the section headers and which of them has their names.
    pack_into("<Q", head, 40, 0)
    pack_into("<HHH", head, 58, 0, 0, 0)
    return bytes(head)


def rename(data: bytes, names: Mapping[str, str]) -> bytes:
    """Rename libraries, this one too; a name keeps its length."""
    for old, new in names.items():
        assert len(old) == len(new), (old, new)
        data = data.replace(f"\0{old}\0".encode(), f"\0{new}\0".encode())
    return data
