"""Shared libraries of Linux as bytes: 64 bit, little endian (System V ABI, chapters 4 and 5)."""

import re
from collections.abc import Iterator, Mapping
from struct import pack_into, unpack_from

_LOAD, _DYNAMIC = 1, 2
_NEEDED, _STRTAB = 1, 5


def machine(data: bytes) -> str:
    """The system and processor that it is for, as the module platform names them."""
    number = int.from_bytes(data[18:20], "little")
    return f"Linux { {62: 'x86_64', 183: 'aarch64'}.get(number, number) }"


def glibc(data: bytes) -> tuple[int, ...]:
    """The oldest glibc that has all that it needs, as (2, 17)."""
    versions = re.findall(rb"\0GLIBC_([\d.]+)(?=\0)", data)
    return max((tuple(map(int, text.split(b"."))) for text in versions), default=(0,))


def needed(data: bytes) -> list[str]:
    """The names of the libraries that this one links."""
    segments = [*_segments(data)]
    ((_, _, at, _, _, size),) = (segment for segment in segments if segment[0] == _DYNAMIC)
    entries = [unpack_from("<QQ", data, at + n) for n in range(0, size, 16)]
    (table,) = (value for tag, value in entries if tag == _STRTAB)
    # From the address to the place in the file.
    loads = (segment for segment in segments if segment[0] == _LOAD)
    start = next(table - s[3] + s[2] for s in loads if s[3] <= table < s[3] + s[5])
    places = (start + value for tag, value in entries if tag == _NEEDED)
    return [data[place : data.index(b"\0", place)].decode() for place in places]


def _segments(data: bytes) -> Iterator[tuple[int, ...]]:
    """Type, flags, offset in the file, two addresses, size in the file of each."""
    (table,), (size, count) = unpack_from("<Q", data, 32), unpack_from("<HH", data, 54)
    return (unpack_from("<IIQQQQ", data, table + n * size) for n in range(count))


def strip(data: bytes) -> bytes:
    """Remove sections (debugging information, names that only a compiler's linker reads)."""
    ends = (segment[2] + segment[5] for segment in _segments(data) if segment[0] == _LOAD)
    head = bytearray(data[: max(ends)])
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
