"""Mach-O: universal files, and the ad-hoc signatures that macOS wants of libraries.

Structures: Apple's headers mach-o/fat.h, mach-o/loader.h and cs_blobs.h.
"""

import hashlib
import struct
from collections.abc import Iterator

_FAT_MAGIC, _ALIGNMENT = 0xCAFEBABE, 14
_SEGMENT, _CODE_SIGNATURE = 0x19, 0x1D
_SUPER_BLOB, _CODE_DIRECTORY, _VERSION, _AD_HOC = 0xFADE0CC0, 0xFADE0C02, 0x20400, 2
_PAGE, _SHA256 = 4096, 2

#: Of a code directory up to its identifier.
_DIRECTORY = ">9I4BI3I4Q"


def universal(images: list[bytes]) -> bytes:
    """One library of those for several machines, x86_64 first."""
    if len(images) == 1:
        return images[0]
    head, body = struct.pack(">2I", _FAT_MAGIC, len(images)), b""
    for image in images:
        body += bytes(-len(body) % (1 << _ALIGNMENT))
        offset = (1 << _ALIGNMENT) + len(body)
        head += struct.pack(">2I", *struct.unpack_from("<2I", image, 4))
        head += struct.pack(">3I", offset, len(image), _ALIGNMENT)
        body += image
    return head.ljust(1 << _ALIGNMENT, b"\0") + body


def _commands(image: bytes) -> Iterator[tuple[int, int]]:
    """Load commands of a 64-bit library: kind and offset."""
    (count,), offset = struct.unpack_from("<I", image, 16), 32
    for _ in range(count):
        kind, size = struct.unpack_from("<2I", image, offset)
        yield kind, offset
        offset += size


def signed(image: bytes, identifier: str) -> bytes:
    """A library with an ad-hoc signature, as it is if it has one."""
    commands = list(_commands(image))
    if any(kind == _CODE_SIGNATURE for kind, _ in commands):
        return image
    limit = len(image) + -len(image) % 16
    data = bytearray(image.ljust(limit, b"\0"))
    name = identifier.encode() + b"\0"
    pages = -(-limit // _PAGE)
    directory = struct.calcsize(_DIRECTORY) + len(name) + 32 * pages
    size = 20 + directory
    count, total = struct.unpack_from("<2I", data, 16)
    if any(data[32 + total : 48 + total]):
        raise ValueError("the library has no room for the load command of a signature")
    struct.pack_into("<4I", data, 32 + total, _CODE_SIGNATURE, 16, limit, size)
    struct.pack_into("<2I", data, 16, count + 1, total + 16)
    # The signature is the end of the last segment.
    segments = [offset for kind, offset in commands if kind == _SEGMENT]
    text, linkedit = segments[0], segments[-1]
    (start,) = struct.unpack_from("<Q", data, linkedit + 40)
    length = limit + size - start
    struct.pack_into("<Q", data, linkedit + 32, length + -length % (1 << _ALIGNMENT))
    struct.pack_into("<Q", data, linkedit + 48, length)
    (text_size,) = struct.unpack_from("<Q", data, text + 48)
    first = struct.calcsize(_DIRECTORY)
    blob = struct.pack(">5I", _SUPER_BLOB, size, 1, 0, 20)
    blob += struct.pack(
        _DIRECTORY, _CODE_DIRECTORY, directory, _VERSION, _AD_HOC, first + len(name), first, 0,
        pages, limit, 32, _SHA256, 0, 12, 0, 0, 0, 0, 0, 0, text_size, 0,
    )  # fmt: skip
    hashes = (hashlib.sha256(data[n : n + _PAGE]).digest() for n in range(0, limit, _PAGE))
    return bytes(data) + blob + name + b"".join(hashes)
