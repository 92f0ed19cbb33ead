"""Results on disk: files that belong together are written together, each of them whole.

Of two runs into one folder at once the last one's files stand; on Windows, where folders can't be
locked, the two may mix their files (each one whole).
"""

import json
import os
import tempfile
from collections.abc import Iterable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path

from golf_build.archive import plain, whole
from golf_impact.errors import UserError
from golf_impact.stopping import held


def prepare(folder: Path, *names: str) -> None:
    """Check that these files and others can be written into a folder, which may not exist yet.

    Raises:
        UserError: it can't be made, or not be written into.
    """
    path = folder
    try:
        # A link that leads nowhere exists, too.
        existing = next(f for f in (folder, *folder.absolute().parents) if os.path.lexists(f))
        tempfile.TemporaryFile(dir=existing).close()
        for path in (folder / name for name in names):
            plain(path)
    except OSError as error:
        where = f"into {folder}" if path is folder else path
        raise UserError(
            f"can't write {where}: {error.strerror}; choose another folder with --out"
        ) from error


def write_together(
    folder: Path, files: Mapping[str, bytes], stale: Iterable[str] = ()
) -> list[Path]:
    """Write files, content by name, into a folder, and remove stale ones: all or nothing.

    Raises:
        UserError: one of them can't be written; then all are as they were.
    """
    path = folder
    with held():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # They take their names when the block ends; until then other runs wait.
            with ExitStack() as stack:
                _lock(folder, stack)
                for path in (folder / name for name in files):
                    stream = stack.enter_context(whole(path))
                    stream.write(files[path.name])
                    # A disk that is full must say so before any file is in its place.
                    stream.flush()
            for path in (folder / name for name in stale):
                path.unlink(missing_ok=True)
        except OSError as error:
            raise UserError(f"can't write {path}: {error.strerror or error}") from error
    return [folder / name for name in files]


def _lock(folder: Path, stack: ExitStack) -> None:
    if os.name == "posix":
        import fcntl

        handle = os.open(folder, os.O_RDONLY)
        stack.callback(os.close, handle)
        with suppress(OSError):  # some file systems have no locks
            fcntl.flock(handle, fcntl.LOCK_EX)


def read_text(path: Path) -> str:
    """A text file (UTF-8, perhaps with a byte order mark) that a user names.

    Raises:
        UserError: it can't be read, or isn't UTF-8.
    """
    try:
        return path.read_text("utf-8-sig")
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise UserError(f"{path} is no text in UTF-8: save it as UTF-8") from error


def as_json(data: object) -> bytes:
    """JSON, indented, every double to its last digit; null for those that JSON doesn't have."""
    finite = json.loads(json.dumps(data), parse_constant=lambda name: None)
    return (json.dumps(finite, indent=1) + "\n").encode()
