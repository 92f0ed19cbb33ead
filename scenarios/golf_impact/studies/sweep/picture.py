"""The picture of a sweep: an output against the swept variables."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps, rcParams

from golf_build import BY_NAME, UNITS
from golf_impact.data.quantities import QUANTITIES, START, Quantity, format_shortest, format_unit
from golf_impact.studies.sweep.sweep import CONTACT, Design, varies

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Variables whose values are names; the most lines, and the most points of one.
_NAMED, _LINES, _POINTS = ("ball", "law"), 7, 2000


def draw(design: Design, drawn: np.ndarray, axes: Axes) -> None:
    """Plot `design.drawn`: a histogram of samples, or lines against the longest axis of the grid.

    Each line is of a value of the next axis, at most seven of them, or of each ball or law; further
    axes stand at their first value. Of samples the lines are medians, with a band of 5 to 95 %.
    """
    output = _quantity(design.drawn)
    drawn = drawn * output.factor
    if design.cases == design.shape[-1]:
        usable = drawn[np.isfinite(drawn)]
        # Bins of values that are equal but for rounding would be too narrow for doubles.
        margin = 0.0 if varies(usable) else 1e-4 * np.abs(usable).max()
        bins = min(60, round(len(usable) ** 0.5))
        axes.hist(usable, bins=bins, range=(usable.min() - margin, usable.max() + margin))
        title = _titled(f"{design.cases:,} samples", design, {})
        axes.set(title=title, xlabel=output.plain, ylabel="samples")
        return
    grid = {name: values for name, values in design.grid.items() if len(values) > 1}
    # Along amounts rather than names, of which each is a line.
    along, *others = sorted(grid, key=lambda name: (name in _NAMED, -len(grid[name])))
    others.sort(key=lambda name: name not in _NAMED)
    # Of shape (along, others, samples).
    table = drawn.reshape(*map(len, grid.values()), -1)
    table = np.moveaxis(table, [[*grid].index(name) for name in (along, *others)], range(len(grid)))
    while table.ndim > 3:
        table = table[:, :, 0]
    table = table.reshape(len(table), -1, design.shape[-1])
    x = grid[along]
    rising = np.arange(len(x)) if along in _NAMED else np.argsort(x)
    rising = rising[:: -(-len(x) // _POINTS)]
    x = x[rising].astype(str) if along in _NAMED else x[rising] * _quantity(along).factor
    number = table.shape[1]
    # A name isn't between two others.
    most = number if {*others[:1]} & {*_NAMED} else min(number, _LINES)
    places = np.linspace(0, number - 1, most).round().astype(int)
    # More lines than the style has would look alike.
    colors = colormaps["viridis"](np.linspace(0.0, 0.9, most))
    for n, color in zip(places, colors):
        low, middle, high = _percentiles(table[rising, n])
        label = _in_words(others[0], grid[others[0]][n]) if others else None
        marker = "o" if len(x) <= _LINES else ""
        (line,) = axes.plot(x, middle, marker=marker, label=label)
        if most > len(rcParams["axes.prop_cycle"]):
            line.set_color(color)
        if table.shape[-1] > 1:
            axes.fill_between(x, low, high, color=line.get_color(), alpha=0.2)
    if others:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    title = f"{output.name} over {_quantity(along).name}"
    title = _titled(title, design, {name: grid[name][0] for name in others[1:]})
    axes.set(title=title, xlabel=_quantity(along).plain, ylabel=output.plain)
    if len(x) > 2 and x.dtype == float and x[0] > 0.0:
        steps = np.diff(np.log(x))
        axes.set_xscale("log" if np.allclose(steps, steps[0]) else "linear")


def _titled(title: str, design: Design, first: Mapping[str, Any]) -> str:
    """A title with what is fixed: axes at their `first` value, those of one value, law, k and b."""
    fixed = {**first, **{name: x[0] for name, x in design.grid.items() if len(x) == 1}}
    if "ball" not in design.axes:
        fixed |= {name: START[name] for name in CONTACT if name not in design.axes}
    words = ", ".join(_in_words(name, value) for name, value in fixed.items())
    return f"{title}\n{words}" if words else title


def draw_indices(indices: Mapping[str, Any], axes: Axes) -> None:
    """Bars of total Sobol indices with their 95 % intervals: a group for each output."""
    shares = indices["total"]
    variables = [*next(iter(shares.values()))]
    width = 0.8 / len(variables)
    for n, name in enumerate(variables):
        value, low, high = np.array([row[name] for row in shares.values()]).T
        places = np.arange(len(shares)) + (n + 0.5) * width - 0.4
        error = [value - low, high - value]
        axes.bar(places, value, width, yerr=error, label=_quantity(name).name)
    labels = [_quantity(output).name for output in shares]
    axes.set_xticks(range(len(shares)), labels, rotation=45, ha="right")
    axes.set(title="Share of each variable", ylabel="total Sobol index")
    axes.legend()


def _percentiles(samples: np.ndarray) -> Any:
    """5, 50 and 95 % of samples, the last dimension, without those that have no value."""
    if samples.shape[-1] == 1:
        return np.stack([samples[..., 0]] * 3)
    with warnings.catch_warnings():
        # A point where all is refused stays empty.
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.nanpercentile(samples, (5, 50, 95), axis=-1)


def _quantity(name: str) -> Quantity:
    """As in tables, or in the display unit; but speeds in m/s, as everywhere."""
    row, words = BY_NAME.get(name), name.replace("_", " ")
    if name in QUANTITIES or row is None:
        return QUANTITIES.get(name, Quantity(words))
    if row.display is None or row.unit == "m/s":
        return Quantity(words, unit=format_unit(row.unit))
    factor = UNITS[row.unit].display[row.display]
    return Quantity(words, unit=format_unit(row.display), factor=factor)


def _in_words(name: str, value: Any) -> str:
    """A variable's value: a number in four digits, a name as it is."""
    one = _quantity(name)
    if name in _NAMED:
        return f"{one.name} {int(value) if name == 'law' else value}"
    digits = format_shortest(float(f"{value * one.factor:.4g}"))
    return f"{one.name} = {digits} {one.unit}".rstrip()
