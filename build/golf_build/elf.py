"""Shared libraries of Linux as bytes: what they need, without what nobody needs, under new names.

Only what the standalone FMU asks for: 64 bit, little endian (System V ABI, chapters 4 and 5; the
symbol versions: Linux Standard Base 5.0, section 10.7).
"""

import struct
from collections.abc import Iterator, Mapping

_LOAD, _DYNAMIC = 1, 2
_NEEDED, _STRTAB, _SONAME, _RPATH, _DEBUG, _RUNPATH = 1, 5, 14, 15, 21, 29
_SYMTAB, _VERSYM, _VERNEED, _VERNEEDNUM = 6, 0x6FFFFFF0, 0x6FFFFFFE, 0x6FFFFFFF


def _segments(data: bytes) -> Iterator[tuple[int, int, int, int]]:
    """Type, offset in the file, address, size in the file."""
    start, size, count = (*struct.unpack_from("<Q", data, 32), *struct.unpack_from("<HH", data, 54))
    for n in range(count):
        kind, _, offset, address, _, length = struct.unpack_from("<IIQQQQ", data, start + n * size)
        yield kind, offset, address, length


def _dynamic(data: bytes) -> list[tuple[int, int]]:
    (begin, size) = next((o, s) for kind, o, _, s in _segments(data) if kind == _DYNAMIC)
    return list(struct.iter_unpack("<qQ", data[begin : begin + size]))


def _offset(data: bytes, address: int) -> int:
    for kind, offset, start, size in _segments(data):
        if kind == _LOAD and start <= address < start + size:
            return address - start + offset
    raise ValueError(f"address {address:#x} is in no segment")


def _text(data: bytes, at: int) -> str:
    return data[at : data.index(b"\0", at)].decode()


def needed(data: bytes) -> list[str]:
    """The libraries that it needs."""
    entries = _dynamic(data)
    table = _offset(data, dict(entries)[_STRTAB])
    return [_text(data, table + value) for tag, value in entries if tag == _NEEDED]


def soname(data: bytes) -> str:
    """Its own name."""
    entries = dict(_dynamic(data))
    return _text(data, _offset(data, entries[_STRTAB]) + entries[_SONAME])


def _versions(data: bytes) -> Iterator[tuple[int, str, int]]:
    """The versions of symbols that it needs: offset of the entry, name, number in the library."""
    entries = dict(_dynamic(data))
    if _VERNEED not in entries:
        return
    table, at = _offset(data, entries[_STRTAB]), _offset(data, entries[_VERNEED])
    for _ in range(entries[_VERNEEDNUM]):
        _, count, _, first, following = struct.unpack_from("<HHIII", data, at)
        one = at + first
        for _ in range(count):
            _, _, number, name, then = struct.unpack_from("<IHHII", data, one)
            yield one, _text(data, table + name), number
            one += then
        at += following


def glibc(data: bytes) -> tuple[int, ...]:
    """The oldest glibc that has all that it needs, as (2, 17)."""
    numbers: list[tuple[int, ...]] = [(0,)]
    for _, name, _ in _versions(data):
        system, _, number = name.partition("_")
        if system == "GLIBC" and number[0].isdigit():
            numbers.append(tuple(map(int, number.split("."))))
    return max(numbers)


def older(data: bytes, symbol: str, version: str, instead: str) -> bytes:
    """With an older version of one symbol; as it is, if others have that version too.

    Args:
        data: of the library.
        symbol: its name.
        version: which it asks for ("GLIBC_2.35").
        instead: a version of the same symbol that other symbols of the library ask for.
    """
    entries = dict(_dynamic(data))
    if not {_VERNEED, _VERSYM, _SYMTAB, _STRTAB} <= entries.keys():
        return data
    symbols, table = _offset(data, entries[_SYMTAB]), _offset(data, entries[_STRTAB])
    found = {name: (at, number) for at, name, number in _versions(data)}
    if version not in found or instead not in found:
        return data
    versym = _offset(data, entries[_VERSYM])
    # Linkers put the strings behind the symbols; where not, the names don't come out right.
    users = [
        _text(data, table + struct.unpack_from("<I", data, symbols + 24 * n)[0])
        for n in range((table - symbols) // 24)
        if struct.unpack_from("<H", data, versym + 2 * n)[0] & 0x7FFF == found[version][1]
    ]
    if users != [symbol]:
        return data
    changed = bytearray(data)
    at, source = found[version][0], found[instead][0]
    # The hash of the name, and where the name is.
    changed[at : at + 4] = data[source : source + 4]
    changed[at + 8 : at + 12] = data[source + 8 : source + 12]
    return bytes(changed)


def stripped(data: bytes) -> bytes:
    """Without sections (debugging information, names that only a compiler's linker reads)."""
    end = max(offset + size for kind, offset, _, size in _segments(data) if kind == _LOAD)
    # Offset, size, number of the section headers and which one has their names.
    head = bytearray(data[: max(end, 64)])
    struct.pack_into("<Q", head, 40, 0)
    struct.pack_into("<HHH", head, 58, 0, 0, 0)
    return bytes(head)


def unplaced(data: bytes) -> bytes:
    """Without folders of this machine in which it would look for libraries."""
    changed = bytearray(data)
    entries = _dynamic(data)
    table = _offset(data, dict(entries)[_STRTAB])
    (start,) = (offset for kind, offset, _, _ in _segments(data) if kind == _DYNAMIC)
    for n, (tag, value) in enumerate(entries):
        if tag in (_RPATH, _RUNPATH):
            length = len(_text(data, table + value).encode())
            changed[table + value : table + value + length] = bytes(length)
            # A tag that means nothing in a library.
            struct.pack_into("<q", changed, start + 16 * n, _DEBUG)
    return bytes(changed)


def renamed(data: bytes, names: Mapping[str, str]) -> bytes:
    """With libraries, itself too, under new names; a name keeps its length."""
    for old, new in names.items():
        assert len(old) == len(new), (old, new)
        data = data.replace(f"\0{old}\0".encode(), f"\0{new}\0".encode())
    return data
