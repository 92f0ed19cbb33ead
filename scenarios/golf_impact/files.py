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
    """UserError unless these files and others can be written into a folder, which may not exist."""
    path = folder
    try:
        # A broken link exists, too.
        existing = next(f for f in (folder, *folder.absolute().parents) if os.path.lexists(f))
        tempfile.TemporaryFile(dir=existing).close()
        for path in (folder / name for name in names):
            plain(path)
    except OSError as error:
        why = f"{error.strerror}; choose another folder"
        raise UserError(f"can't write {path}: {why}") from error


def write_together(
    folder: Path, files: Mapping[str, bytes], stale: Iterable[str] = ()
) -> list[Path]:
    """Write files, content by name, into a folder, and remove stale ones: all or nothing.

    UserError: one of them can't be written; then all are as they were.
    """
    path = folder
    with held():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # They take their names when the block ends; until then other runs wait.
            with ExitStack() as stack:
                if os.name == "posix":
                    import fcntl

                    handle = os.open(folder, os.O_RDONLY)
                    stack.callback(os.close, handle)
                    with suppress(OSError):  # some file systems have no locks
                        fcntl.flock(handle, fcntl.LOCK_EX)
                for path in (folder / name for name in files):
                    stream = stack.enter_context(whole(path))
                    stream.write(files[path.name])
                    # A full disk must be detected before any file is in its place.
                    stream.flush()
            for path in (folder / name for name in stale):
                path.unlink(missing_ok=True)
        except OSError as error:
            raise UserError(f"can't write {path}: {error.strerror or error}") from error
    return [folder / name for name in files]


def as_json(data: object) -> bytes:
    """JSON, indented, every double to its last digit; null for those that JSON doesn't have."""
    finite = json.loads(json.dumps(data), parse_constant=lambda name: None)
    return (json.dumps(finite, indent=1) + "\n").encode()


def write(path: Path, data: bytes | str) -> Path:
    """Write a file beside its place, flush it and rename it there; its folder is made.

    UserError: it can't be written; then what was there is as it was.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as stream:
            stream.write(data.encode() if isinstance(data, str) else data)
            stream.flush()
    except OSError as error:
        raise UserError(f"can't write {path}: {error.strerror or error}") from error
    return path
