"""Shared libraries of Linux as bytes: what they need, without what nobody needs, under new names.

Only what the standalone FMU asks for: 64 bit, little endian (System V ABI, chapters 4 and 5; the
symbol versions: Linux Standard Base 5.0, section 10.7).
"""

from collections.abc import Iterator, Mapping
from struct import iter_unpack, pack_into, unpack_from

_LOAD, _DYNAMIC = 1, 2
_NEEDED, _STRTAB, _RPATH, _DEBUG, _RUNPATH = 1, 5, 15, 21, 29
_SYMTAB, _VERSYM, _VERNEED, _VERNEEDNUM = 6, 0x6FFFFFF0, 0x6FFFFFFE, 0x6FFFFFFF


class _Library:
    """What the dynamic linker reads.

    `end` and `start` (of the dynamic section) are offsets in the file, `entries` tags and values of
    that section, `value` the last one by tag.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data
        (table,), (size, count) = unpack_from("<Q", data, 32), unpack_from("<HH", data, 54)
        # Type, flags, offset in the file, address, another one, size in the file.
        headers = [unpack_from("<IIQQQQ", data, table + n * size) for n in range(count)]
        self._loads = [(offset, at, n) for kind, _, offset, at, _, n in headers if kind == _LOAD]
        self.end = max(offset + size for offset, _, size in self._loads)
        ((self.start, size),) = ((head[2], head[5]) for head in headers if head[0] == _DYNAMIC)
        self.entries = list(iter_unpack("<qQ", data[self.start : self.start + size]))
        self.value = dict(self.entries)

    def place(self, tag: int) -> int:
        """Where a table is in the file."""
        address = self.value[tag]
        return next(address - at + off for off, at, n in self._loads if at <= address < at + n)

    def text(self, offset: int) -> str:
        """One of its strings."""
        begin = self.place(_STRTAB) + offset
        return self.data[begin : self.data.index(b"\0", begin)].decode()

    def versions(self) -> Iterator[tuple[int, str, int]]:
        """The versions of symbols that it needs: offset of the entry, name, number."""
        at = self.place(_VERNEED) if _VERNEED in self.value else 0
        for _ in range(self.value.get(_VERNEEDNUM, 0)):
            _, count, _, first, following = unpack_from("<HHIII", self.data, at)
            one = at + first
            for _ in range(count):
                _, _, number, name, then = unpack_from("<IHHII", self.data, one)
                yield one, self.text(name), number
                one += then
            at += following


def needed(data: bytes) -> list[str]:
    """The libraries that it needs."""
    library = _Library(data)
    return [library.text(value) for tag, value in library.entries if tag == _NEEDED]


def glibc(data: bytes) -> tuple[int, ...]:
    """The oldest glibc that has all that it needs, as (2, 17)."""
    names = (name.partition("_") for _, name, _ in _Library(data).versions())
    numbers = (number for system, _, number in names if system == "GLIBC" and number[0].isdigit())
    return max((tuple(map(int, number.split("."))) for number in numbers), default=(0,))


def older(data: bytes, symbol: str, version: str, instead: str) -> bytes:
    """A library with an older version of one symbol; unchanged if others have that version, too.

    `instead` is a version of the symbol that other symbols of the library need.
    """
    library = _Library(data)
    asked = {name: (at, number) for at, name, number in library.versions()}
    if version not in asked or instead not in asked:
        return data
    (at, number), (source, _) = asked[version], asked[instead]
    symbols, versym = library.place(_SYMTAB), library.place(_VERSYM)
    # Linkers put the strings behind the symbols; where not, the names don't come out right.
    users = [
        library.text(unpack_from("<I", data, symbols + 24 * n)[0])
        for n in range((library.place(_STRTAB) - symbols) // 24)
        if unpack_from("<H", data, versym + 2 * n)[0] & 0x7FFF == number
    ]
    if users != [symbol]:
        return data
    changed = bytearray(data)
    # The hash of the name, and where the name is.
    changed[at : at + 4] = data[source : source + 4]
    changed[at + 8 : at + 12] = data[source + 8 : source + 12]
    return bytes(changed)


def stripped(data: bytes) -> bytes:
    """Without sections (debugging information, names that only a compiler's linker reads)."""
    # Offset, size, number of the section headers and which one has their names.
    head = bytearray(data[: max(_Library(data).end, 64)])
    pack_into("<Q", head, 40, 0)
    pack_into("<HHH", head, 58, 0, 0, 0)
    return bytes(head)


def unplaced(data: bytes) -> bytes:
    """Without folders of this machine in which it would look for libraries."""
    library, changed = _Library(data), bytearray(data)
    for n, (tag, value) in enumerate(library.entries):
        if tag in (_RPATH, _RUNPATH):
            begin, length = library.place(_STRTAB) + value, len(library.text(value).encode())
            changed[begin : begin + length] = bytes(length)
            # A tag that means nothing in a library.
            pack_into("<q", changed, library.start + 16 * n, _DEBUG)
    return bytes(changed)


def renamed(data: bytes, names: Mapping[str, str]) -> bytes:
    """With libraries, itself too, under new names; a name keeps its length."""
    for old, new in names.items():
        assert len(old) == len(new), (old, new)
        data = data.replace(f"\0{old}\0".encode(), f"\0{new}\0".encode())
    return data
