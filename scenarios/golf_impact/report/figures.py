"""Styles and parts of figures. Imports matplotlib, so import it only to plot."""

import io
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path

# Figures are written to files: no display is needed, whatever backend the user has set.
os.environ["MPLBACKEND"] = "Agg"

import numpy as np

from golf_impact.quantities import NoValue, choose_prefix
from golf_impact.report.styles import BLACK, BLUE, GREEN, ORANGE, SKY, STYLES, VERMILION, Style  # noqa: F401
from golf_impact.stopping import held

# The very first import writes a cache of fonts, which must not be left half-written.
with held():
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.colors import LinearSegmentedColormap, to_hex
    from matplotlib.figure import Figure

plt.style.use(Path(__file__).with_suffix(".mplstyle"))

_stacked = False


def new(title: str, size: tuple[float, float] = (7.2, 4.4), case: str = "") -> tuple[Figure, Axes]:
    """A figure (size in inches) with one pair of axes; `case` is the second line of its title."""
    figure, axes = plt.subplots(figsize=size)
    axes.set_title(f"{title}\n{case}" if case else title)
    return figure, axes


@contextmanager
def stacking() -> Iterator[None]:
    """Within it, pairs of axes are one above the other, as narrow screens need them."""
    global _stacked
    _stacked = True
    try:
        yield
    finally:
        _stacked = False


def new_pair(title: str, case: str = "") -> tuple[Figure, tuple[Axes, Axes]]:
    """A figure with two pairs of axes side by side; `case` is the second line of its title."""
    if _stacked:
        figure, axes = plt.subplots(2, 1, figsize=(5.4, 8.8))
    else:
        figure, axes = plt.subplots(1, 2, figsize=(10.0, 4.6 if case else 4.4))
    words = f"{title}\n{case}" if case else title
    figure.suptitle(words, x=0.01, ha="left", fontweight="bold", wrap=True)
    return figure, (axes[0], axes[1])


def make_shades(number: int) -> list[Style]:
    """Styles for increasing values of a quantity, from light to dark."""
    if number == 1:
        return [STYLES["baseline"]]
    colours = [STYLES[name].colour for name in ("less", "baseline", "more")]
    ramp = LinearSegmentedColormap.from_list("", colours)
    ends = zip(range(number), cycle(("--", "-", "-.", ":")), cycle("vo^sD"))
    return [Style(to_hex(ramp(n / (number - 1))), *dashes_marker) for n, *dashes_marker in ends]


def plot_forces(
    title: str,
    case: str,
    curves: Iterable[tuple[str, str, Mapping[str, float], Mapping[str, np.ndarray]]],
) -> Figure:
    """Contact force over time; a curve is a style's name, a label, metrics and a trajectory."""
    figure, axes = new(title, case=case)
    for style, words, metrics, path in curves:
        peak, contact = int(np.argmax(path["force"])), metrics["contact_time"]
        time = contact.reason if isinstance(contact, NoValue) else f"{contact * 1e6:.0f} µs"
        label = f"{words}: {metrics['max_force'] / 1e3:.2f} kN, {time}"
        since_touch = (path["time"] - metrics["touch_time"]) * 1e6
        line = STYLES[style].points
        axes.plot(since_touch, path["force"] / 1e3, **line, markevery=[peak], ms=7, label=label)
    axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
    add_legend_above(axes)
    return figure


def set_run_time_axes(axes: Axes, error: str) -> None:
    """Logarithmic axes of a work–precision diagram; an error of 0 has a place at the left."""
    axes.set_xscale("symlog", linthresh=1e-17, linscale=1.0)
    axes.set_xticks([0.0, *(10.0**power for power in range(-16, 1, 2))])
    axes.set(yscale="log", xlabel=error, ylabel="run time of an impact (µs)")
    axes.set_xlim(-3e-18, max(1.0, axes.get_xlim()[1]))
    axes.axvline(2.2e-16, color=BLACK, lw=0.8, ls=":")
    axes.annotate(
        "resolution of a double",
        xy=(2.2e-16, 1.0), xycoords=("data", "axes fraction"),
        xytext=(4, -4), textcoords="offset points", va="top", fontsize=9,
    )  # fmt: skip


def name_axis(axis: Axis, words: str, unit: str | None) -> None:
    """Label an axis after its data (SI units) are plotted; its unit gets a prefix (MN/m)."""
    linear = axis.get_scale() == "linear"
    factor, unit = choose_prefix(unit, max(map(abs, axis.get_view_interval())) if linear else 1.0)
    axis.set_label_text(f"{words} ({unit})" if unit else words)
    if factor != 1.0:
        axis.set_major_formatter(lambda value, _: f"{value * factor:.10g}")


def add_legend_above(axes: Axes, columns: int = 4) -> None:
    """A legend between title and axes, with fewer `columns` if its labels are long."""
    labels = axes.get_legend_handles_labels()[1]
    letters = 0.11 * axes.bbox.width
    columns = max(1, min(columns, int(letters / (max(map(len, labels), default=0) + 5))))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2)
    axes.set_title(axes.get_title("left"), pad=8 + 16 * -(-len(labels) // columns))


def add_legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """One legend below all axes of a figure, with the labels of these axes."""
    handles, labels = axes.get_legend_handles_labels()
    columns = 1 if _stacked else columns
    figure.legend(handles, labels, loc="outside lower center", ncols=columns)


def label_rows(axes: Axes, names: Sequence[str], band: float) -> None:
    """Rows of deviations: names on the left, a line at 0 and a grey band of ± `band` around it."""
    axes.axvspan(-band, band, color=BLACK, alpha=0.1, lw=0)
    axes.axvline(0.0, color=BLACK, lw=1.0)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def mark(axes: Axes, x: float, y: float, text: str) -> None:
    """Mark a point, with a label above it."""
    axes.plot([x], [y], "o", color=BLACK, ms=5, zorder=5)
    axes.annotate(text, (x, y), xytext=(0, 7), textcoords="offset points", ha="center")


def to_png(figure: Figure) -> bytes:
    """Close a figure and return it as PNG."""
    image = io.BytesIO()
    figure.savefig(image)
    plt.close(figure)
    return image.getvalue()
