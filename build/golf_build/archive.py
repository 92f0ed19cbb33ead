"""Reproducible archives, and atomic replacement of files."""

import errno
import hashlib
import io
import os
import secrets
import stat
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

#: The list of an FMU's files with their SHA-256 digests.
SUMS = "documentation/SHA256SUMS"

_FIRST = ("modelDescription.xml", "SystemStructure.ssd")


def unpack(archive: Path | BinaryIO) -> dict[str, bytes]:
    """Read the files of an archive, by name."""
    with zipfile.ZipFile(archive) as opened:
        return {info.filename: opened.read(info) for info in opened.infolist()}


def checksums(files: dict[str, bytes]) -> bytes:
    """The SHA-256 digests of files, in the format of `sha256sum -c`."""
    lines = (f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files))
    return "".join(lines).encode()


def pack(files: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Make an archive with the same order, times and attributes on every machine."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", method) as archive:
        for name in sorted(files, key=lambda name: (name not in _FIRST, name)):
            info = zipfile.ZipInfo(name)  # of 1980
            info.compress_type = method
            info.create_system = 3
            info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(info, files[name])
    return data.getvalue()


def write_archive(path: Path, files: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> Path:
    """Write files as an archive; makes its folder if necessary. OSError: it can't be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole(path) as stream:
        stream.write(pack(files, method))
    return path.resolve()


@contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    """Open a file that gets its name at the end of the block, or is removed after an exception.

    A link remains: its target is replaced. OSError: it can't be written, or isn't a regular file.
    """
    final = plain(path)
    # Short, since the name itself may have the maximum length.
    aside = final.with_name(f".{secrets.token_hex(6)}.part")
    try:
        with open(aside, "xb") as stream:
            yield stream
        os.replace(aside, final)
    finally:
        aside.unlink(missing_ok=True)


def plain(path: Path) -> Path:
    """The path of a file to be written, with links resolved; OSError unless it is a regular one."""
    final = Path(os.path.realpath(path))
    with suppress(FileNotFoundError):
        mode = os.stat(final).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "it is a device or a pipe, no plain file", str(path))
    return final


@contextmanager
def scratch(files: dict[str, bytes]) -> Iterator[Path]:
    """Make a temporary folder with these files, for a `with` block."""
    with tempfile.TemporaryDirectory(prefix="golf-impact-build-") as folder:
        for name, data in files.items():
            file = Path(folder, name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(data)
        yield Path(folder)
