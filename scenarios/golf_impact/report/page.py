"""Writes the results of scenarios as files, and renders the page report.html."""

import base64
import csv
import io
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from golf_build import VERSION
from golf_build.packaging import render
from golf_impact import document
from golf_impact.files import as_json, write_together
from golf_impact.report.outcome import Table, summarize_checks
from golf_impact.report.report import Report


def write_reports(
    folder: Path,
    reports: Mapping[str, Report],
    guid: str,
    with_figures: bool,
    prefix: str = "",
    tick: Callable[[], object] = lambda: None,
) -> None:
    """Write results.json, trajectories as CSV, figures as PNG, and report.html.

    Without figures, those that an earlier run wrote for the same reports are removed. `prefix` is
    of the names results.json and report.html; `tick` is called after each figure.

    Raises:
        UserError: a file can't be written; then all are as they were.
    """
    results = {name: report.cases for name, report in reports.items()}
    files = {f"{prefix}results.json": as_json(results)}
    for report in reports.values():
        for file, columns in report.trajectories.items():
            text = io.StringIO()
            rows = csv.writer(text, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
            files[f"{file}.csv"] = text.getvalue().encode()
    images: dict[str, dict[str, bytes]] = {name: {} for name in reports}
    stacked: dict[str, bytes] = {}
    stale = [f"{file}.png" for report in reports.values() for file in report.figures]
    if with_figures and stale:
        from golf_impact.report import figures

        for name, report in reports.items():
            for file, draw in report.figures.items():
                files[f"{file}.png"] = images[name][file] = image = figures.to_png(draw(figures))
                if _size(image)["wide"]:
                    with figures.stacking():
                        stacked[file] = figures.to_png(draw(figures))
                tick()
    source = f"golf-impact {VERSION}, FMU {guid}"
    files[f"{prefix}report.html"] = render_page(reports, images, source, stacked)
    write_together(folder, files, stale=() if with_figures else stale)


def render_page(
    reports: Mapping[str, Report],
    images: Mapping[str, Mapping[str, bytes]],
    source: str,
    stacked: Mapping[str, bytes] = MappingProxyType({}),
) -> bytes:
    """Render report.html, one self-contained file.

    Images are PNG by scenario and name; `source` is what computed the numbers, in words;
    `stacked` are those for narrow screens, by name.
    """
    shown = {
        name: [_figure(reports[name], *item, stacked) for item in of_report.items()]
        for name, of_report in images.items()
    }
    return render(
        Path(__file__).with_name("report.html.jinja"),
        reports=reports,
        figures=shown,
        source=source,
        readings=document_tables(),
        checks=[check for report in reports.values() for check in report.checks],
        deviations=[text for report in reports.values() for text in report.deviations],
        summarize=summarize_checks,
    )


def _size(image: bytes) -> dict[str, int]:
    """Width and height of a PNG, whose first chunk holds them; whether it has two pairs of axes."""
    width, height = struct.unpack(">II", image[16:24])
    return {"width": width, "height": height, "wide": width > 1.8 * height}


def _figure(
    report: Report, file: str, image: bytes, stacked: Mapping[str, bytes]
) -> dict[str, str | int]:
    caption = report.captions.get(file, "")
    return {
        "data": base64.b64encode(image).decode(),
        "stacked": base64.b64encode(stacked.get(file, b"")).decode(),
        "caption": caption,
        "alt": caption or file.replace("_", " "),
        **_size(image),
    }


def document_tables() -> list[Table]:
    """What the document says, its parameters, and the numbers not reproduced (`document`)."""
    readings = (
        [row["printed"], row["problem"], row["reading"], f"{row['file']}: {row['symbol']}"]
        for row in document.READINGS
    )
    parameters = ([f"{name} ({unit})", *values] for name, unit, *values in document.PARAMETERS)
    tables = zip(document.TABLES, (readings, parameters, document.NOT_REPRODUCED.values()))
    return [Table(**head, rows=[*map(list, rows)]) for head, rows in tables]
