"""The picture of a sweep: its first output over the swept variables."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from golf_impact.quantities import format_unit
from golf_impact.sweeps import Design
from golf_impact.units import unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: More points of a line, or along a side of a map, are invisible; up to so many
#: values of a second variable are lines; variables whose values are names.
_MOST_POINTS, _MOST_SIDE, _FEW, _NAMED = 2000, 200, 7, ("ball", "law")


def draw(design: Design, drawn: np.ndarray, axes: Axes) -> None:
    """Plot the first output: a histogram of samples, or over the longest axes lines or a map.

    Of samples at a point of the grid the median is plotted, on lines with a band of 5 to 95 %. Axes
    that aren't plotted stand at their first value.
    """
    output = _label(design.outputs[0])
    grid = {name: values for name, values in design.grid.items() if len(values) > 1}
    if not grid:
        usable = drawn[np.isfinite(drawn)]
        # Bins of values that are equal but for rounding would be too narrow for doubles.
        margin = 1e-4 * np.abs(usable).max()
        axes.hist(usable, bins=60, range=(usable.min() - margin, usable.max() + margin))
        axes.set(title=f"{design.cases:,} samples", xlabel=output, ylabel="samples")
        return
    # Along amounts rather than names, of which each is a line.
    along, *others = sorted(grid, key=lambda name: (name in _NAMED, -len(grid[name])))
    by = next((name for name in others if name in _NAMED), others[0] if others else "")
    lines = by in _NAMED or len(grid.get(by, ())) <= _FEW
    most = _MOST_POINTS if lines else _MOST_SIDE
    places = {}
    for name in filter(None, (along, by)):
        rising = np.arange(len(grid[name])) if name in _NAMED else np.argsort(grid[name])
        places[name] = rising[:: -(-len(rising) // most)]
    order = [[*design.grid].index(name) for name in places]
    table: Any = np.moveaxis(drawn.reshape(design.shape), order, range(len(order)))
    while table.ndim > len(order) + 1:
        table = table[..., 0, :]
    for dimension, indices in enumerate(places.values()):
        table = table.take(indices, dimension)
    # Of shape (along, by, samples).
    table = table.reshape(len(places[along]), -1, design.shape[-1])
    x = grid[along][places[along]]
    if lines:
        labels = [f"{_words(by)} {value}" for value in grid[by][places[by]]] if by else [""]
        _draw_lines(axes, x.astype(str) if along in _NAMED else x, table, labels)
        axes.set(ylabel=output)
    else:
        image = axes.pcolormesh(
            x, grid[by][places[by]], _quantiles(table, 50)[0].T, rasterized=True
        )
        axes.figure.colorbar(image, label=output)
        axes.set(ylabel=_label(by))
        _set_scale(axes.set_yscale, grid[by])
    fixed = [f"{_words(name)} {axis[0]}" for name, axis in grid.items() if name not in places]
    title = f"{_words(design.outputs[0])} over {_words(along)}"
    axes.set(title=title + (f" ({', '.join(fixed)})" if fixed else ""), xlabel=_label(along))
    _set_scale(axes.set_xscale, grid[along])


def _draw_lines(axes: Axes, x: np.ndarray, table: np.ndarray, labels: list[str]) -> None:
    low, middle, high = _quantiles(table, 5, 50, 95)
    marker = "o" if len(x) <= _FEW else ""
    for n, label in enumerate(labels):
        (line,) = axes.plot(x, middle[:, n], marker=marker, label=label)
        if table.shape[-1] > 1:
            axes.fill_between(x, low[:, n], high[:, n], color=line.get_color(), alpha=0.2)
    if any(labels):
        axes.legend()


def _quantiles(table: np.ndarray, *percent: float) -> np.ndarray:
    """Of the samples, the last dimension, without those that have no value."""
    if table.shape[-1] == 1:
        return np.stack([table[..., 0]] * len(percent))
    with warnings.catch_warnings():
        # A point where all is refused stays empty.
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.nanpercentile(table, percent, axis=-1)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _label(name: str) -> str:
    unit = format_unit(unit_of(name))
    return _words(name) + (f" ({unit})" if unit else "")


def _set_scale(set_scale: Callable[[str], object], values: np.ndarray) -> None:
    """A logarithmic scale for values at equal ratios."""
    if len(values) > 2 and values.dtype == float and values.min() > 0.0:
        steps = np.diff(np.log(values))
        if np.allclose(steps, steps[0]):
            set_scale("log")
