"""What a sweep's first output looks like over what was swept. Imported only to draw."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from fmpy.model_description import ScalarVariable
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from golf_impact.facts.quantities import choose_prefix
from golf_impact.report import figures
from golf_impact.sweeps.axes import Grid
from golf_impact.sweeps.sensitivity import Sensitivity
from golf_impact.sweeps.study import Study

#: More points of a line, or along a side of a map, than these can't be seen.
_MOST_POINTS, _MOST_SIDE = 2000, 300
#: So few values are a line each: between them a map would show what nobody computed.
_FEW = 7
#: Contours need so many values along each side: between fewer they would show what nobody computed.
_FOR_CONTOURS = 20
#: So many columns leave room for the numbers of a map's cells.
_FOR_NUMBERS = 12
#: What varies by less (relative) is constant but for rounding.
_CONSTANT = 1e-12
#: Variables whose values are names, not amounts.
_NAMED = ("ball", "law")


def draw(
    study: Study,
    drawn: np.ndarray,
    variables: Mapping[str, ScalarVariable],
    sensitivity: Sensitivity | None,
) -> Figure | None:
    """A line, lines, a heat map, or a histogram beside sensitivities, whichever fits the study.

    `drawn` is its first output, shape (cases,), NaN where refused. None where there is nothing to
    see: one case, or none that wasn't refused.
    """
    usable = drawn[np.isfinite(drawn)]
    if len(usable) < 2:
        return None
    units = {name: variable.unit for name, variable in variables.items()}
    if not study.varied_grid:
        return _monte_carlo(usable, study.outputs[0], units, sensitivity)
    grid = _Reduced(study, drawn, units)
    amounts = [one for one in study.varied_grid if one.name not in _NAMED]
    named = [one for one in study.varied_grid if one.name in _NAMED]
    amounts.sort(key=lambda one: -len(one.values))
    if not amounts:
        return _points(grid, named[0])
    few = [one for one in amounts[1:2] if len(one.values) <= _FEW]
    if named or few or len(amounts) == 1:
        return _lines(grid, amounts[0], (named or few)[:1])
    return _map(grid, amounts[:2])


class _Reduced:
    """The output over the grid: median and range of the samples at each point."""

    def __init__(self, study: Study, drawn: np.ndarray, units: Mapping[str, str | None]) -> None:
        self.study, self.units = study, units
        self.output = study.outputs[0]
        self.sample = study.number_of_samples > 1
        self._table = drawn.reshape(*(len(one.values) for one in study.grid), -1)

    def over(self, axes: list[Grid], most: int) -> tuple[list[np.ndarray], np.ndarray]:
        """Values of some axes, thinned out, and percentiles 5, 50 and 95 there, first dimension;
        the other axes stand at their first value.
        """
        grid = self.study.grid
        places = {one.name: np.array([0]) for one in grid}
        for one in axes:
            number = len(one.values)
            chosen = np.linspace(0, number - 1, min(most, number)).astype(int)
            # In rising order, whatever order they were given in.
            if one.name not in _NAMED:
                chosen = chosen[np.argsort(one.values[chosen], kind="stable")]
            places[one.name] = chosen
        values = [one.values[places[one.name]] for one in axes]
        table = self._table[np.ix_(*places.values())]
        table = np.moveaxis(table, [grid.index(one) for one in axes], range(len(axes)))
        table = table.reshape(*map(len, values), -1)
        if not self.sample:
            return values, np.stack([table[..., 0]] * 3)
        with warnings.catch_warnings():
            # A point where all is refused stays empty.
            warnings.simplefilter("ignore", RuntimeWarning)
            return values, np.nanpercentile(table, (5, 50, 95), axis=-1)

    def new(self, over: list[Grid]) -> tuple[Figure, Axes]:
        """A figure of the output over these, and what stands still, in its title."""
        along = " and ".join(_words(one.name) for one in over)
        rest = [one for one in self.study.varied_grid if one not in over]
        others = ", ".join(self.equal(one, one.values[0]) for one in rest)
        title = f"{_capital(self.output)} over {along}"
        return figures.new(f"{title} ({others})" if others else title)

    def name(self, axis: Axis, name: str) -> None:
        """Name an axis with a variable and its unit."""
        figures.name_axis(axis, _words(name), self.units[name])

    def equal(self, one: Grid, value: Any) -> str:
        """A variable and its value, with its unit."""
        if one.name in _NAMED:
            return str(value) if isinstance(value, str) else f"{one.name} {value}"
        factor, unit = choose_prefix(self.units[one.name], float(np.abs(one.values).max()))
        return f"{_words(one.name)} = {value * factor:g} {unit}".rstrip()

    def look(self, one: Grid, value: Any) -> figures.Style:
        """Of a ball or a law, as in all figures; of a law that the FMU refuses, any."""
        return figures.STYLES.get(self.equal(one, value), figures.STYLES["baseline"])


def _lines(grid: _Reduced, along: Grid, by: list[Grid]) -> Figure:
    figure, axes = grid.new([along, *by])
    (x, *names), levels = grid.over([along, *by], _MOST_POINTS)
    levels = levels if by else levels[..., np.newaxis]
    looks = figures.make_shades(levels.shape[-1])
    # What coincides, as far as a picture can show, is one line with all its names.
    same: dict[int, list[int]] = {}
    for n in range(len(looks)):
        this = levels[..., n]
        equal = (m for m in same if np.allclose(levels[..., m], this, 1e-6, 0.0, equal_nan=True))
        same.setdefault(next(equal, n), []).append(n)
    for n, others in same.items():
        low, middle, high = levels[..., n]
        text, look = "median" if grid.sample else None, looks[n]
        if by:
            text = ", ".join(grid.equal(by[0], names[0][m]) for m in others)
            text += " (the same)" if len(others) > 1 else ""
            if by[0].name in _NAMED:
                look = grid.look(by[0], names[0][n])
        axes.plot(x, middle, **(look.points if len(x) <= 12 else look.line), label=text, ms=4)
        if grid.sample:
            band = "5 to 95 % of the samples" if n == 0 else None
            axes.fill_between(x, low, high, color=look.colour, alpha=0.2, lw=0, label=band)
    _scale(axes.set_xscale, x)
    grid.name(axes.xaxis, along.name)
    grid.name(axes.yaxis, grid.output)
    if by or grid.sample:
        figures.add_legend_above(axes, columns=3)
    return figure


def _points(grid: _Reduced, named: Grid) -> Figure:
    figure, axes = grid.new([named])
    (names,), (low, middle, high) = grid.over([named], _MOST_SIDE)
    for n, name in enumerate(names):
        look = grid.look(named, name)
        if grid.sample:
            axes.plot([low[n], high[n]], [n, n], color=look.colour, lw=1.4)
        axes.plot(middle[n], n, look.marker, color=look.colour, ms=8)
    axes.set_yticks(range(len(names)), [grid.equal(named, name) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    grid.name(axes.xaxis, grid.output)
    return figure


def _map(grid: _Reduced, over: list[Grid]) -> Figure:
    # The last --set runs fastest: it goes up.
    order = sorted(over, key=grid.study.grid.index)
    figure, axes = grid.new(order)
    (x, y), levels = grid.over(order, _MOST_SIDE)
    values = np.ma.masked_invalid(levels[1].T)
    image = axes.pcolormesh(x, y, values, shading="nearest", cmap="viridis", rasterized=True)
    bar = figure.colorbar(image, ax=axes, pad=0.02)
    _scale(axes.set_xscale, x)
    _scale(axes.set_yscale, y)
    grid.name(axes.xaxis, order[0].name)
    grid.name(axes.yaxis, order[1].name)
    grid.name(bar.ax.yaxis, grid.output)
    usable = values.compressed()
    factor = choose_prefix(grid.units[grid.output], float(np.abs(usable).max()))[0]
    if min(values.shape) >= _FOR_CONTOURS and len(usable) > 3 and np.ptp(usable) > 0.0:
        lines = axes.contour(x, y, values, levels=8, colors="white", linewidths=0.9)
        axes.clabel(lines, fontsize=8, fmt=lambda level: f"{level * factor:.6g}")
    elif len(x) <= _FOR_NUMBERS:
        middle, digits = 0.5 * (usable.min() + usable.max()), _digits(usable * factor)
        for row, column in zip(*np.nonzero(~np.ma.getmaskarray(values))):
            value = values[row, column]
            axes.text(x[column], y[row], f"{value * factor:.{digits}f}", ha="center", va="center",
                      fontsize=7, color="white" if value < middle else "black")  # fmt: skip
    axes.grid(False)
    return figure


def _monte_carlo(
    usable: np.ndarray,
    output: str,
    units: Mapping[str, str | None],
    sensitivity: Sensitivity | None,
) -> Figure:
    title = f"{_capital(output)} of {len(usable):,} samples"
    # Rare ones far out would leave the others no room.
    rare = 0.05 if len(usable) > 2000 else 0.0
    if rare:
        title += f" ({2.0 * rare:g} % lie outside)"
    if sensitivity is None:
        figure, axes = figures.new(title)
    else:
        figure, (axes, beside) = figures.new_pair(title)
        _sensitivities(beside, sensitivity)
    factor, unit = choose_prefix(units[output], float(np.abs(usable).max()))
    usable = usable * factor
    bins = int(np.clip(np.sqrt(len(usable)), 8, 80))
    low, high = np.percentile(usable, (rare, 100.0 - rare)).tolist()
    largest = max(abs(low), abs(high))
    if high - low <= _CONSTANT * largest:
        margin = 1e-3 * largest or 1.0
        low, high = low - margin, high + margin
    density, edges = np.histogram(usable, bins, range=(low, high), density=True)
    axes.stairs(density, edges, fill=True, color=figures.SKY)
    quantiles = np.percentile(usable, (5, 50, 95))
    digits = _digits(quantiles)
    for percent, value, style in zip((5, 50, 95), quantiles, ("--", "-", ":")):
        text = f"{percent} %: {value:.{digits}f} {unit}"
        axes.axvline(value, color=figures.BLACK, lw=1.4, ls=style, label=text)
    axes.set_xlabel(f"{_words(output)} ({unit})" if unit else _words(output))
    axes.set_ylabel(f"probability density (per {unit})" if unit else "probability density")
    axes.margins(y=0.06)
    figures.add_legend_above(axes, columns=3)
    return figure


def _sensitivities(axes: Axes, sensitivity: Sensitivity) -> None:
    names = sorted(sensitivity.values, key=lambda name: abs(sensitivity.values[name]))
    values = [sensitivity.values[name] for name in names]
    bars = axes.barh([_words(name) for name in names], values, color=figures.BLUE, height=0.6)
    axes.bar_label(bars, fmt="{:.2f}", padding=4)
    axes.axvline(0.0, color=figures.BLACK, lw=0.8)
    axes.set(xlabel=sensitivity.label)
    axes.margins(x=0.15)
    axes.grid(axis="y", visible=False)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _capital(name: str) -> str:
    return _words(name[:1].upper() + name[1:])


def _digits(values: np.ndarray) -> int:
    """Enough decimals to tell quantiles apart."""
    width, largest = float(np.ptp(values)), float(np.abs(values).max())
    if width <= _CONSTANT * largest:
        width = 1e-3 * largest
    return int(np.clip(2 - np.floor(np.log10(width)), 0, 9)) if width > 0.0 else 4


def _scale(set_scale: Any, values: np.ndarray) -> None:
    """Logarithmic for values that are given so: positive, over a decade, in equal ratios."""
    if len(values) > 2 and values[0] > 0.0 and values[-1] > 5.0 * values[0]:
        ratios = values[1:] / values[:-1]
        if np.ptp(ratios) < 0.1 * (ratios.mean() - 1.0):
            set_scale("log")
