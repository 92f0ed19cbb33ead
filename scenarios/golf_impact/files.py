"""Results on disk: each file is written beside and renamed into place: it is whole or as before."""

import json
import os
import tempfile
from pathlib import Path
from typing import Any

from golf_build.archive import plain, whole
from golf_impact.errors import UserError


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
            why = f"{existing} is no folder; choose another one"
        raise UserError(f"can't write {path}: {why}") from error


def write(path: Path, data: bytes | str) -> Path:
    """Write a file (text as UTF-8), making its folder if necessary.

    Raises:
        UserError: it can't be written; then it is as it was.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as stream:
            stream.write(data.encode() if isinstance(data, str) else data)
    except OSError as error:
        raise UserError(f"can't write {path}: {error.strerror or error}") from error
    return path


def as_json(data: Any) -> str:
    """JSON, indented, every double with all its digits; null for NaN and infinities."""
    finite = json.loads(json.dumps(data), parse_constant=lambda name: None)
    return json.dumps(finite, indent=1, ensure_ascii=False) + "\n"
