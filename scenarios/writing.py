"""Results on disk: written aside and renamed, so that a file is always a whole one."""

import base64
import csv
import io
import json
import os
import tempfile
from pathlib import Path

from scenarios.errors import UserError
from scenarios.outcome import Outcome


def prepare(folder: Path) -> Path:
    """Make the output folder, and make sure now that it can be written into.

    Raises:
        UserError: it can't.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise UserError(
            f"can't write into {folder} ({error.strerror}): choose another folder with --out"
        ) from error
    return folder


def write(path: Path, data: bytes) -> None:
    """Write a file as a whole.

    Raises:
        UserError: it can't be written.
    """
    try:
        handle, aside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    except OSError as error:
        raise UserError(f"can't write {path}: {error.strerror}") from error
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(aside, 0o666 & ~_umask())
        os.replace(aside, path)
    except OSError as error:
        raise UserError(f"can't write {path}: {error.strerror}") from error
    finally:
        if os.path.exists(aside):
            os.unlink(aside)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def write_json(path: Path, data: object) -> None:
    """JSON, indented, every double to its last digit."""
    write(path, (json.dumps(data, indent=1) + "\n").encode())


def write_outcomes(
    folder: Path, outcomes: dict[str, Outcome], guid: str, version: str, with_figures: bool
) -> list[Path]:
    """Write results.json, trajectories as CSV, figures as PNG, and report.html.

    Returns:
        The files written.

    Raises:
        UserError: one of them can't be written.
    """
    written = []
    results = folder / "results.json"
    write_json(results, {name: outcome.cases for name, outcome in outcomes.items()})
    written.append(results)
    figures: dict[str, list[dict[str, str]]] = {}
    for name, outcome in outcomes.items():
        for file, columns in outcome.trajectories.items():
            text = io.StringIO()
            rows = csv.writer(text, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
            written.append(folder / f"{file}.csv")
            write(written[-1], text.getvalue().encode())
        if not with_figures:
            continue
        for file, draw in outcome.figures.items():
            from scenarios import figures as drawing

            image = io.BytesIO()
            drawing.save(draw(), image)
            written.append(folder / f"{file}.png")
            write(written[-1], image.getvalue())
            data = base64.b64encode(image.getvalue()).decode()
            figures.setdefault(name, []).append({"alt": file.replace("_", " "), "data": data})
    written.append(folder / "report.html")
    write(written[-1], _report(outcomes, figures, guid, version))
    return written


def _report(
    outcomes: dict[str, Outcome], figures: dict[str, list[dict[str, str]]], guid: str, version: str
) -> bytes:
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
