"""Where the project's files are, and the sources in C."""

import hashlib
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import golf_physics

from golf_build.archive import checksums
from golf_build.native_header import header

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

#: The folder of this package.
HERE = Path(__file__).resolve().parent

#: The root of a checkout; None where golf_build is installed.
CHECKOUT = HERE.parents[1] if (HERE.parent / "build_fmu.py").is_file() else None

PHYSICS = Path(golf_physics.__file__).resolve().parent

#: What native_header makes.
_HEADER = "variables.h"


def toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file (UTF-8, byte order mark or not)."""
    tables: dict[str, Any] = tomllib.loads(path.read_text("utf-8-sig"))
    return tables


def fmu_source(name: str) -> Path:
    """A file or folder of fmu_src; but for golf_physics, inside this package if installed."""
    of_physics = name.startswith(PHYSICS.name)
    return (PHYSICS.parent if CHECKOUT or of_physics else HERE / "adapters") / name


def project_license() -> bytes:
    """The licence of the project; inside this package where it is installed."""
    return ((CHECKOUT or HERE) / "LICENSE").read_bytes()


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
