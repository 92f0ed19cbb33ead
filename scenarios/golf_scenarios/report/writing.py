"""Results on disk: written aside and renamed, so that a file is always a whole one.

What belongs together is renamed together, under a lock on its folder: of two runs into one folder
the last one's files stand, all of them.
"""

import base64
import csv
import io
import json
import os
import secrets
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from golf_scenarios.errors import UserError
from golf_scenarios.report.outcome import Outcome
from golf_scenarios.stopping import held

try:
    import fcntl
except ImportError:  # Windows, where two runs at once may mix their files (each one whole)
    fcntl = None  # type: ignore[assignment]


def prepare(folder: Path) -> Path:
    """Make sure now that files can be written into a folder later; it isn't made yet.

    Raises:
        UserError: it can't be made, or not be written into.
    """
    try:
        for existing in (folder, *folder.absolute().parents):
            with suppress(FileNotFoundError), tempfile.TemporaryFile(dir=existing):
                return folder
    except NotADirectoryError:
        file = next(path for path in (folder, *folder.absolute().parents) if path.exists())
        raise UserError(
            f"can't write into {folder}: {file} is a file; choose another folder with --out"
        ) from None
    except OSError as error:
        raise UserError(
            f"can't write into {folder} ({error.strerror}): choose another folder with --out"
        ) from error
    return folder


def write(path: Path, data: bytes) -> None:
    """Write a file as a whole; its folder is made if need be.

    Raises:
        UserError: it can't be written.
    """
    write_together(path.parent, {path.name: data})


def write_together(
    folder: Path, files: Mapping[str, bytes], stale: Iterable[str] = ()
) -> list[Path]:
    """Write files into a folder, all of them or none, and nobody else's between them.

    Args:
        folder: made if need be.
        files: content by name.
        stale: names of files that are no longer true, which are removed.

    Returns:
        The files written.

    Raises:
        UserError: one of them can't be written; then all are as they were.
    """
    # A link stays one.
    written = {folder / name: Path(os.path.realpath(folder / name)) for name in files}
    asides: dict[Path, Path] = {}
    path = folder
    with held():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with _alone(folder):
                for path, final in written.items():
                    if final.is_dir():
                        raise UserError(f"can't write {path}: it is a folder")
                    # Short: the name itself may be as long as a name can be.
                    asides[final] = final.with_name(f".{secrets.token_hex(6)}.part")
                    asides[final].write_bytes(files[path.name])
                for final, aside in asides.items():
                    os.replace(aside, final)
                for path in (folder / name for name in stale):
                    path.unlink(missing_ok=True)
        except OSError as error:
            raise UserError(f"can't write {path}: {error.strerror or error}") from error
        finally:
            for aside in asides.values():
                aside.unlink(missing_ok=True)
    return list(written)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Wait until no other process of ours puts files into this folder."""
    if fcntl is None:
        yield
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        # A file system without locks gets none.
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def as_json(data: object) -> bytes:
    """JSON, indented, every double to its last digit."""
    return (json.dumps(data, indent=1) + "\n").encode()


def write_json(path: Path, data: object) -> None:
    """The same as a file."""
    write(path, as_json(data))


def write_outcomes(
    folder: Path, outcomes: dict[str, Outcome], guid: str, version: str, with_figures: bool
) -> list[Path]:
    """Write results.json, trajectories as CSV, figures as PNG, and report.html.

    Without figures, those that an earlier run left of the same outcomes are removed.

    Returns:
        The files written.

    Raises:
        UserError: one of them can't be written.
    """
    files = {"results.json": as_json({name: one.cases for name, one in outcomes.items()})}
    pictures: dict[str, list[dict[str, str]]] = {}
    stale = []
    for name, outcome in outcomes.items():
        for file, columns in outcome.trajectories.items():
            text = io.StringIO()
            rows = csv.writer(text, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
            files[f"{file}.csv"] = text.getvalue().encode()
        if not with_figures:
            stale += [f"{file}.png" for file in outcome.figures]
            continue
        for file, draw in outcome.figures.items():
            from golf_scenarios.report import figures as drawing

            image = io.BytesIO()
            drawing.save(draw(), image)
            files[f"{file}.png"] = image.getvalue()
            data = base64.b64encode(image.getvalue()).decode()
            pictures.setdefault(name, []).append({"alt": file.replace("_", " "), "data": data})
    files["report.html"] = report(outcomes, pictures, guid, version)
    return write_together(folder, files, stale)


def report(
    outcomes: dict[str, Outcome], figures: dict[str, list[dict[str, str]]], guid: str, version: str
) -> bytes:
    """The page report.html; `figures`: by outcome, each with `alt` and `data` (PNG as base64)."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    checks = [check for outcome in outcomes.values() for check in outcome.checks]
    page = environment.get_template("report.html.jinja").render(
        outcomes=outcomes,
        figures=figures,
        guid=guid,
        version=version,
        passed=sum(check.passed for check in checks),
        total=len(checks),
    )
    return page.encode()
