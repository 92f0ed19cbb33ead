"""Writes the results of scenarios as files, and renders the page report.html."""

import base64
import csv
import io
import struct
from collections.abc import Callable, Mapping
from pathlib import Path

from golf_build import VERSION
from golf_build.packaging import rendered
from golf_impact.facts import document
from golf_impact.files import as_json, write_together
from golf_impact.report import reading
from golf_impact.report.outcome import KINDS, Outcome, summarize_checks


def write_outcomes(
    folder: Path,
    outcomes: Mapping[str, Outcome],
    guid: str,
    with_figures: bool,
    prefix: str = "",
    tick: Callable[[], object] = lambda: None,
) -> Path:
    """Write results.json, trajectories as CSV, figures as PNG, and report.html; the latter's path.

    Without figures, those that an earlier run wrote for the same outcomes are removed. `prefix` is
    of the names results.json and report.html; `tick` is called after each figure.

    Raises:
        UserError: a file can't be written; then all are as they were.
    """
    results = {name: outcome.cases for name, outcome in outcomes.items()}
    files = {f"{prefix}results.json": as_json(results)}
    images: dict[str, dict[str, bytes]] = {}
    for name, outcome in outcomes.items():
        for file, columns in outcome.trajectories.items():
            text = io.StringIO()
            rows = csv.writer(text, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
            files[f"{file}.csv"] = text.getvalue().encode()
        if with_figures and outcome.figures:
            from golf_impact.report import figures

            images[name] = {}
            for file, draw in outcome.figures.items():
                images[name][file] = figures.to_png(draw(figures))
                tick()
            files |= {f"{file}.png": image for file, image in images[name].items()}
    files[f"{prefix}report.html"] = render_page(outcomes, images, guid)
    known = [f"{file}.png" for outcome in outcomes.values() for file in outcome.figures]
    write_together(folder, files, stale=() if with_figures else known)
    return folder / f"{prefix}report.html"


def render_page(
    outcomes: Mapping[str, Outcome], images: Mapping[str, Mapping[str, bytes]], guid: str
) -> bytes:
    """Render report.html, one self-contained file; images are PNG by scenario and name."""
    shown = {
        name: [_figure(outcomes[name], *item) for item in of_outcome.items()]
        for name, of_outcome in images.items()
    }
    return rendered(
        Path(__file__).with_name("report.html.jinja"),
        outcomes=outcomes,
        figures=shown,
        guid=guid,
        version=VERSION,
        document=document,
        readings=reading.tables() if len(outcomes) > 1 else [],
        checks=[check for outcome in outcomes.values() for check in outcome.checks],
        deviations=[one for outcome in outcomes.values() for one in outcome.deviations],
        kinds=KINDS,
        summarize=summarize_checks,
    )


def _figure(outcome: Outcome, file: str, image: bytes) -> dict[str, str | int]:
    # The first chunk of a PNG holds its size.
    width, height = struct.unpack(">II", image[16:24])
    size = {"width": width, "height": height}
    caption = outcome.captions.get(file, "")
    words = {"caption": caption, "alt": caption or file.replace("_", " ")}
    return {"data": base64.b64encode(image).decode(), **size, **words}
