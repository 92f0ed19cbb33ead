"""Files that are read and written: a written one is whole, or as it was before."""

import json
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from golf_build.archive import plain, whole
from golf_build.sources import toml
from golf_impact.data.errors import UserError

#: A line of a TOML file with a number and a unit: k = 800 N/mm.
_UNQUOTED = re.compile(
    r"""^[ \t]*([\w-]+)[ \t]*=[ \t]*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\d.eE_])"""
    r"""[ \t]*[^\W\d_][^\s"'#=]*)[ \t]*(?:#.*)?$""",
    re.MULTILINE,
)


def read_toml(path: Path | str) -> dict[str, Any]:
    """The tables of a TOML file (UTF-8, byte order mark or not); UserError if it is none."""
    try:
        return toml(Path(path))
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path} is not a TOML file: {error}{_quotes_hint(path)}") from error


def _quotes_hint(path: Path | str) -> str:
    """How to write the first value with a unit that isn't in quotes; empty if there is none."""
    text = Path(path).read_text("utf-8-sig", errors="replace")
    found = _UNQUOTED.search(text)
    return f'; a value with its unit needs quotes: {found[1]} = "{found[2]}"' if found else ""


def check(path: Path) -> None:
    """Check that a file can be written, before long work begins; nothing is made yet.

    Raises:
        UserError: its folder can't be made, or something else has its name.
    """
    folders = path.absolute().parents
    try:
        # A broken link exists, too.
        existing = next(folder for folder in folders if os.path.lexists(folder))
        tempfile.TemporaryFile(dir=existing).close()
        plain(path)
    except OSError as error:
        why = f"{error.strerror}; choose another place"
        if isinstance(error, FileExistsError | NotADirectoryError):
            why = f"{existing} is not a folder; choose another one"
        raise UserError(f"can't write {path}: {why}") from error


@contextmanager
def opened(path: Path) -> Iterator[IO[bytes]]:
    """A stream of a file, which gets its name when it is complete, in a folder made if necessary.

    Raises:
        UserError: it can't be written; then it is as it was.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as stream:
            yield stream
    except OSError as error:
        raise UserError(f"can't write {path}: {error.strerror or error}") from error


def write(path: Path, data: bytes | str) -> Path:
    """Write a file (text as UTF-8); see `opened`."""
    with opened(path) as stream:
        stream.write(data.encode() if isinstance(data, str) else data)
    return path


def as_json(data: Any) -> str:
    """JSON, indented, every double with all its digits; null for NaN and infinities."""
    finite = json.loads(json.dumps(data), parse_constant=lambda name: None)
    return json.dumps(finite, indent=1, ensure_ascii=False) + "\n"
