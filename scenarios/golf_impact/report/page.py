"""The results of scenarios as files, and the page report.html."""

import base64
import csv
import io
import struct
from collections.abc import Mapping
from pathlib import Path

from golf_build import VERSION
from golf_build.packaging import rendered
from golf_impact.files import as_json, write_together
from golf_impact.report.outcome import KINDS, Outcome, summarize_checks


def write_outcomes(
    folder: Path, outcomes: dict[str, Outcome], guid: str, with_figures: bool
) -> list[Path]:
    """Write results.json, trajectories as CSV, figures as PNG, and report.html.

    Without figures, those that an earlier run left of the same outcomes are removed.

    Returns:
        The files written.

    Raises:
        UserError: one of them can't be written.
    """
    files = {"results.json": as_json({name: one.cases for name, one in outcomes.items()})}
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

            images[name] = {
                file: figures.png(draw(figures)) for file, draw in outcome.figures.items()
            }
            files |= {f"{file}.png": image for file, image in images[name].items()}
    files["report.html"] = page(outcomes, images, guid)
    known = [f"{file}.png" for outcome in outcomes.values() for file in outcome.figures]
    return write_together(folder, files, stale=() if with_figures else known)


def page(
    outcomes: Mapping[str, Outcome], images: Mapping[str, Mapping[str, bytes]], guid: str
) -> bytes:
    """The page report.html, one file that asks for nothing else; images are PNG by file name."""
    checks = [check for outcome in outcomes.values() for check in outcome.checks]
    shown = {
        name: [_figure(outcomes[name], *one) for one in of_one.items()]
        for name, of_one in images.items()
    }
    return rendered(
        Path(__file__).with_name("report.html.jinja"),
        **{"outcomes": outcomes, "figures": shown, "guid": guid, "version": VERSION},
        **{"summarize": summarize_checks, "checks": checks, "kinds": KINDS},
    )


def _figure(outcome: Outcome, file: str, image: bytes) -> dict[str, str | int]:
    # A PNG has its size in the first of its chunks.
    width, height = struct.unpack(">II", image[16:24])
    size = {"width": width, "height": height}
    caption = outcome.captions.get(file, "")
    words = {"caption": caption, "alt": caption or file.replace("_", " ")}
    return {"data": base64.b64encode(image).decode(), **size, **words}
