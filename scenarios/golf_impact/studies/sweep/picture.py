"""The picture of a sweep: an output against the swept variables, and Sobol indices."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps, rcParams
from matplotlib import pyplot as plt

from golf_impact.data.quantities import QUANTITIES, START, Quantity, format_unit
from golf_impact.data.units import unit_of
from golf_impact.report.results import plotting, png
from golf_impact.studies.sweep.sweep import CONTACT, Design, varies

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Variables whose values are names. The most lines of amounts, and cases.
_NAMED, _LINES, _CASES = ("ball", "law"), 7, 100_000


def picture(design: Design, indices: Mapping[str, Any]) -> bytes:
    """A PNG image; empty if there are fewer than two values."""
    with plotting():
        figure, axes = plt.subplots(1, 2 if indices else 1, squeeze=False)
        figure.set_figwidth(axes.size * figure.get_figwidth())
        shown = draw(design, axes[0, 0])
        if indices:
            draw_indices(indices, axes[0, 1])
        return png(figure) if shown else b""


def draw(design: Design, axes: Axes) -> bool:
    """Plot the first output that varies; returns whether there are two values at least.

    A histogram of samples, or lines against the longest axis of the grid: medians of samples, with
    a band of 5 to 95 %. Each line is of a value of the next axis, or of each ball or law; further
    axes stand at their first value. What is shown, 100,000 cases at most, is computed once more.
    """
    grid = design.grid
    long = sorted((n for n, x in grid.items() if len(x) > 1), key=lambda name: -len(grid[name]))
    # Along amounts rather than names, of which each is a line.
    amounts, named = ([name for name in long if (name in _NAMED) == one] for one in (False, True))
    along, of, *_ = *amounts[:1], *named, *amounts[1:], "", ""
    most = {along: 50 if design.distributions else 1000, of: _CASES if named else _LINES}
    places: dict[str, Any] = {}
    for name, x in grid.items():
        number = min(len(x), most.get(name, 1))
        places[name] = np.linspace(0, len(x) - 1, number).round().astype(int)
    if amounts:
        places[along] = np.argsort(grid[along])[places[along]]
    samples = min(design.shape[-1], max(1, _CASES // prod(map(len, places.values()))))
    cases = np.ravel_multi_index(np.ix_(*places.values(), range(samples)), design.shape)
    found = design.run(design.columns(cases.ravel()))
    table = {name: np.where(found.refused, np.nan, found[name]) for name in design.outputs}
    drawn = next((name for name, x in table.items() if varies(x)), design.outputs[0])
    output = _quantity(drawn)
    values = table[drawn].reshape(cases.shape) * output.factor
    if np.isfinite(values).sum() < 2:
        return False
    if not along:
        _draw_samples(values[np.isfinite(values)], axes)
        _label(axes, f"{samples:,} samples", design, (), output.plain, "samples")
        return True
    lines = np.moveaxis(values, [*grid].index(along), -2).reshape(-1, len(places[along]), samples)
    labels = [_in_words(of, x) for x in grid[of][places[of]]] if of else [""]
    x = grid[along][places[along]]
    _draw_lines(x if amounts else x.astype(str), lines, labels, axes)
    title = f"{output.name} over {_quantity(along).name}"
    _label(axes, title, design, (along, of), _quantity(along).plain, output.plain)
    return True


def _draw_samples(values: np.ndarray, axes: Axes) -> None:
    # Bins of values that are equal but for rounding would be too narrow for doubles.
    margin = 0.0 if varies(values) else 1e-4 * np.abs(values).max()
    ends = values.min() - margin, values.max() + margin
    axes.hist(values, bins=min(60, round(len(values) ** 0.5)), range=ends)


def _draw_lines(x: np.ndarray, lines: np.ndarray, labels: Sequence[str], axes: Axes) -> None:
    """Lines, of shape (lines, points, samples)."""
    # More than the style has would look alike.
    if len(lines) > len(rcParams["axes.prop_cycle"]):
        axes.set_prop_cycle(color=colormaps["viridis"](np.linspace(0.0, 0.9, len(lines))))
    for label, samples in zip(labels, lines):
        with warnings.catch_warnings():
            # A point where all is refused stays empty.
            warnings.simplefilter("ignore", RuntimeWarning)
            low, middle, high = np.nanpercentile(samples, (5, 50, 95), axis=-1)
        (line,) = axes.plot(x, middle, marker="o" if len(x) <= _LINES else "", label=label)
        if samples.shape[-1] > 1:
            axes.fill_between(x, low, high, color=line.get_color(), alpha=0.2)
    if len(labels) > 1:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    if x.dtype == float and len(x) > 2 and x[0] > 0.0:
        steps = np.diff(np.log(x))
        axes.set_xscale("log" if np.allclose(steps, steps[0]) else "linear")


def _label(axes: Axes, title: str, design: Design, shown: tuple[str, ...], *labels: str) -> None:
    """Title, with what is fixed in it: other axes of the grid, law, k and b; labels of x and y."""
    fixed = {name: x[0] for name, x in design.grid.items() if name not in shown}
    if not design.balls:
        fixed |= {name: START[name] for name in CONTACT if name not in design.axes}
    words = ", ".join(_in_words(name, value) for name, value in fixed.items())
    axes.set(title=f"{title}\n{words}".strip(), xlabel=labels[0], ylabel=labels[1])


def draw_indices(indices: Mapping[str, Any], axes: Axes) -> None:
    """Bars of total Sobol indices with their 95 % intervals: a group for each output."""
    shares = indices["total"]
    variables = [*next(iter(shares.values()))]
    width = 0.8 / len(variables)
    for n, name in enumerate(variables):
        value, low, high = np.array([row[name] for row in shares.values()]).T
        places = np.arange(len(shares)) + (n + 0.5) * width - 0.4
        axes.bar(places, value, width, yerr=[value - low, high - value], label=_quantity(name).name)
    labels = [_quantity(output).name for output in shares]
    axes.set_xticks(range(len(shares)), labels, rotation=45, ha="right")
    axes.set(title="Share of each variable", ylabel="total Sobol index")
    axes.legend()


def _quantity(name: str) -> Quantity:
    """As in tables, or in SI units."""
    words = Quantity(name.replace("_", " "), unit=format_unit(unit_of(name)))
    return QUANTITIES.get(name, words)


def _in_words(name: str, value: Any) -> str:
    """A variable's value: a number in four digits, a name as it is."""
    one = _quantity(name)
    if name in _NAMED:
        return f"{one.name} {int(value) if name == 'law' else value}"
    return f"{one.name} = {value:.4g} {one.unit}".rstrip()
