"""How figures look. Imported only to draw: matplotlib comes with it."""

import io
import os
from collections.abc import Sequence

# Figures are written to files: no screen is looked for, whatever the user's own backend is.
os.environ["MPLBACKEND"] = "Agg"

from golf_scenarios.stopping import held

# The first import of all writes a list of fonts; half of it would hold up every later one.
with held():
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Okabe & Ito's colours: distinct under every common colour vision deficiency.
BLUE, ORANGE, GREEN, SKY, VERMILION, PURPLE, BLACK = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#56B4E9",
    "#D55E00",
    "#CC79A7",
    "#000000",
)

plt.rcParams.update(
    {
        "axes.grid": True,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlelocation": "left",
        "axes.titleweight": "bold",
        "figure.constrained_layout.use": True,
        "figure.dpi": 130,
        "font.size": 10.5,
        "grid.alpha": 0.35,
        "grid.linewidth": 0.6,
        "legend.frameon": False,
        "lines.linewidth": 2.0,
    }
)


def new(title: str, size: tuple[float, float] = (7.2, 4.4)) -> tuple[Figure, Axes]:
    """A figure with one pair of axes."""
    figure, axes = plt.subplots(figsize=size)
    axes.set_title(title, pad=26)
    return figure, axes


def new_pair(title: str) -> tuple[Figure, tuple[Axes, Axes]]:
    """A figure with two pairs of axes side by side."""
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 4.4))
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    return figure, (axes[0], axes[1])


def legend_above(axes: Axes, columns: int = 4) -> None:
    """A legend between title and axes, where it can't cover the data."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2)


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """One legend below all axes, of what these show."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns)


def rows(axes: Axes, names: Sequence[str], band: float) -> None:
    """Names down the side, a line at 0 and a grey band beside it, for values that are off."""
    axes.axvspan(-band, band, color=BLACK, alpha=0.1, lw=0)
    axes.axvline(0.0, color=BLACK, lw=1.0)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def mark(axes: Axes, x: float, y: float, text: str) -> None:
    """A point with a label above it."""
    axes.plot([x], [y], "o", color=BLACK, ms=5, zorder=5)
    axes.annotate(text, (x, y), xytext=(0, 7), textcoords="offset points", ha="center")


def png(figure: Figure) -> bytes:
    """A figure as PNG; it is forgotten then."""
    image = io.BytesIO()
    figure.savefig(image)
    plt.close(figure)
    return image.getvalue()
