"""The results of scenarios on disk: results.json, figures, trajectories, report.html."""

import base64
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from golf_build.templates import render
from golf_impact.data import document
from golf_impact.data.balls import BALLS
from golf_impact.data.errors import UserError
from golf_impact.data.files import as_json, write
from golf_impact.data.quantities import QUANTITIES, describe
from golf_impact.data.units import si_value

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Results in large type, at the beginning of a report.
_LARGE = (
    "smash_factor", "coefficient_of_restitution", "energy_efficiency", "ball_velocity",
    "contact_time", "max_force",
)  # fmt: skip

#: Not in names of files, of any system.
NO_NAME = '/\\:*?"<>|'


@dataclass
class Result:
    """What a scenario returns.

    Attributes:
        title: in one line.
        cases: results of each case by its name, by the FMU's outputs (SI units).
        tables: title, columns and rows of texts of each.
        figures: by the name of their PNG file.
        claims: whether each sentence holds; the exit code is 1 if one doesn't.
        words: what follows from the results, in a few sentences.
        trajectories: structured arrays of `simulate` by the name of their CSV file.
    """

    title: str
    cases: dict[str, dict[str, float]] = field(default_factory=dict)
    tables: list[tuple[str, Sequence[str], Sequence[Sequence[str]]]] = field(default_factory=list)
    figures: dict[str, "Figure"] = field(default_factory=dict)
    claims: dict[str, Any] = field(default_factory=dict)
    words: str = ""
    trajectories: dict[str, Any] = field(default_factory=dict)

    @property
    def failed(self) -> list[str]:
        """The claims that don't hold."""
        return [claim for claim, holds in self.claims.items() if not holds]

    def faults(self) -> Iterator[str]:
        """What can't be written, and how to mend it: it may come from a script of the user's."""
        for n, table in enumerate(self.tables):
            if len(table) != 3:
                yield f"tables[{n}] has {len(table)} parts: write (title, columns, rows)"
                continue
            _, columns, rows = table
            for row in rows:
                if len(row) != len(columns) or not all(isinstance(cell, str) for cell in row):
                    why = "a row has a text for each column, of a number f'{x:.4g}'"
                    yield f"tables[{n}] has a row {row!r}: {why}"
        for name, case in self.cases.items():
            if not isinstance(name, str) or not isinstance(case, Mapping):
                yield f"cases[{name!r}] = {case!r}: a name of text, and results by name, are needed"
        for name, figure in self.figures.items():
            if not hasattr(figure, "savefig"):
                yield f"figures[{name!r}] = {figure!r} is not a figure of Matplotlib"
        for claim, holds in self.claims.items():
            if str(holds) not in ("True", "False"):
                yield f"claims[{claim!r}] = {holds!r} is not True or False"
        for name in (*self.figures, *self.trajectories):
            if not isinstance(name, str) or not name or {*name} & {*NO_NAME}:
                yield f"{name!r} can't be the name of a file: leave out {' '.join(NO_NAME)}"


@contextmanager
def plotting() -> Iterator[None]:
    """Figures of this block have the project's style, and need no display."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    with plt.style.context(Path(__file__).with_name("figures.mplstyle")):
        yield


def write_results(
    folder: Path,
    results: Mapping[str, Result],
    impact: Any,
    figures: bool = True,
    prefix: str = "",
) -> Path:
    """Write the results of scenarios by name, from an open `Impact`.

    `prefix` begins the names of all files. Of several scenarios the report begins with a drive.
    Returns the path of the report. UserError: a file can't be written, or would be written twice.
    """
    names = [name for one in results.values() for name in (*one.figures, *one.trajectories)]
    if len({*names}) < len(names):
        twice = max(names, key=names.count)
        raise UserError(f"two figures or trajectories are named {twice}: rename one")
    opening = {"": _drive(impact)} if len(results) > 1 else {}
    images: dict[str, dict[str, list[str]]] = {}
    for name, result in (opening | {**results}).items():
        images[name] = {}
        for title, figure in result.figures.items() if figures else ():
            wide, narrow = _image(figure), narrow_png(figure)
            images[name][title] = [base64.b64encode(one).decode() for one in (wide, narrow)]
            write(folder / f"{prefix}{title}.png", wide)
        for title, rows in result.trajectories.items():
            write(folder / f"{prefix}{title}.csv", _csv(rows))
    cases = {name: result.cases for name, result in results.items()}
    write(folder / f"{prefix}results.json", as_json(cases))
    first = next(iter((opening or results).values()))
    template = Path(__file__).with_name("report.html.jinja")
    report = render(
        template,
        results=results,
        opening=opening.get(""),
        images=images,
        source=f"{impact.description.modelName}.fmu, GUID {impact.description.guid}",
        minus=_with_minus,
        large=_tiles(first),
        readings=document.tables() if opening else [],
        failed=[claim for result in results.values() for claim in result.failed],
        claims=sum(len(result.claims) for result in results.values()),
    )
    return write(folder / f"{prefix}report.html", report)


def _drive(impact: Any) -> Result:
    """A drive as on the PGA Tour, by the ball that was fitted to it, beside the document's."""
    ball, speed = BALLS["tour"], "113 mph"
    source = ball.source.partition(":")[0]
    cases: dict[str, dict[str, float]] = {
        f"A drive at {speed} ({source})": {**ball.values, "club_speed": si_value(speed, "m/s")},
        "The document's impact at 35 m/s": {},
    }
    result, curves = Result("A drive as measured, and the document's impact"), {}
    for case, values in cases.items():
        result.cases[f"{case}: {describe(values)}"] = impact(**values)
        label = f"{case.partition(' (')[0]}: {describe(values)}"
        curves[label] = impact.trajectory(**values)
    title = "A real drive: more force than the document's impact, shorter contact"
    result.figures["drive_force"] = plot_forces(curves, title)
    return result


def _tiles(result: Result) -> dict[str, list[tuple[str, str]]]:
    """The main results of its first cases, in large type."""
    return {
        case: [
            (about.name, f"{about.format_value(values[name])} {about.unit}".strip())
            for name, about in ((name, QUANTITIES[name]) for name in _LARGE)
        ]
        for case, values in [*result.cases.items()][:4]
        if {*_LARGE} <= values.keys()
    }


def plot_forces(curves: Mapping[str, Mapping[str, Any]], title: str) -> "Figure":
    """Contact force over time, of trajectories by label."""
    with plotting():
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots()
        for label, path in curves.items():
            axes.plot(path["time"] * 1e6, path["force"] / 1e3, label=label)
        axes.set(title=title, xlabel="time (µs)", ylabel="contact force (kN)")
        highest = max(path["force"].max() for path in curves.values())
        # A margin above the curves for their labels.
        axes.set_ylim(0.0, (1.1 + 0.1 * len(curves)) * highest / 1e3 or None)
        axes.legend()
    return figure


def png(figure: "Figure") -> bytes:
    """A figure as a PNG image; it is closed."""
    import matplotlib.pyplot as plt

    image = _image(figure)
    plt.close(figure)
    return image


def _image(figure: "Figure") -> bytes:
    image = io.BytesIO()
    figure.savefig(image, format="png")
    return image.getvalue()


def narrow_png(figure: "Figure") -> bytes:
    """A figure as a PNG image for narrow screens; it is closed.

    A row of panels becomes a column, and legends are below them.
    """
    panels = [(one, spec) for one in figure.axes if (spec := one.get_subplotspec())]
    grids = {spec.get_gridspec() for _, spec in panels}
    rows, columns = next(iter(grids)).get_geometry() if len(grids) == 1 else (1, 1)
    if rows == 1:
        column = figure.add_gridspec(columns, 1)
        for one, spec in panels:
            one.set_subplotspec(column[spec.colspan.start : spec.colspan.stop])
            one.tick_params(labelleft=True)  # of shared axes, too
    height = 3.2 * max(rows, columns)  # inches
    with plotting():
        for one in figure.axes:
            for place in ("left", "center", "right"):
                one.set_title(_wrap(one.get_title(place)), loc=place)
            if legend := one.get_legend():
                legend.set_loc("upper left")
                legend.set_bbox_to_anchor((0.0, -0.2), one.transAxes)
                for text in legend.get_texts():
                    text.set_text(_wrap(text.get_text()))
                    height += 0.2 * len(text.get_text().splitlines())
    for legend in [*figure.legends]:
        legend.remove()
        handles: Any = legend.legend_handles
        labels = [text.get_text() for text in legend.get_texts()]
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        height += 0.1 * len(labels)
    if title := figure.get_suptitle():
        figure.suptitle(_wrap(title))
    # Text of 10.5 points has 10 pixels on a screen of 390 pixels.
    figure.set_size_inches(5.2, height)
    figure.draw_without_rendering()  # the layout needs two passes
    return png(figure)


def _wrap(text: str) -> str:
    """Lines for a narrow figure; k = 1 MN/m stays in one of them."""
    return fill(text.replace(" = ", "\u00a0=\u00a0"), 46)


def _with_minus(text: object) -> str:
    """A text in which the sign of a number is a minus sign."""
    return re.sub(r"(?<![\w.)\]-])-(?=\.?\d)|(?<=\de)-(?=\d)", "−", str(text))


def _csv(rows: Any) -> str:
    lines = [",".join(rows.dtype.names), *(",".join(map(repr, row)) for row in rows.tolist())]
    return "\n".join(lines) + "\n"
