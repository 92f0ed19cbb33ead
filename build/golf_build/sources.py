"""Where the sources of FMUs are, and those in C."""

import hashlib
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import golf_physics

from golf_build.archive import checksums
from golf_build.native_header import header

PHYSICS = Path(golf_physics.__file__).resolve().parent

#: What native_header makes.
_HEADER = "variables.h"


def fmu_source(name: str) -> Path:
    """A file or folder of fmu_src; inside this package where it is installed."""
    installed = Path(__file__).resolve().parent / "adapters" / name
    return installed if installed.exists() else PHYSICS.parent / name


def c_sources(
    token: str = "", fmi: int = 0, start: Mapping[str, float] | None = None
) -> dict[str, bytes]:
    """The C sources by name, with the same line ends everywhere; see `native_header.header`."""
    files = sorted(fmu_source("native").glob("*.[ch]"))
    sources = {file.name: file.read_bytes().replace(b"\r\n", b"\n") for file in files}
    return sources | {_HEADER: header(fmi, token, start or {}).encode()}


@cache
def digest() -> str:
    """Of the C sources; physics.wasm has that of its own.

    Lines about laws don't count: a law of one's own, which C doesn't have, changes them.
    """
    sources = c_sources()
    lines = sources[_HEADER].splitlines()
    sources[_HEADER] = b"\n".join(line for line in lines if b"law" not in line)
    return hashlib.sha256(checksums(sources)).hexdigest()[:16]
