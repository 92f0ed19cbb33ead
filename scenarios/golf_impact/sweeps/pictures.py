"""Figures of a sweep's first output, and its Sobol indices; imported only to draw."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from golf_impact.quantities import choose_prefix
from golf_impact.report import figures
from golf_impact.sweeps.study import Grid, Study

#: More points of a line, or along a side of a map, are invisible.
_MOST_POINTS, _MOST_SIDE = 2000, 300
#: Up to so many values, each is a line: a map would interpolate between them.
_FEW = 7
#: Variables whose values are names, not amounts.
_NAMED = ("ball", "law")
#: Points of the design for Sobol indices: each takes an impact for every variable and two more.
_POINTS = 1024


def draw(
    study: Study,
    drawn: np.ndarray,
    units: Mapping[str, str | None],
    indices: Mapping[str, float] | None,
) -> Figure | None:
    """A line, lines, a heat map, or a histogram beside Sobol indices, whichever fits the study.

    `drawn` is its first output, shape (cases,), NaN where refused; `units` those of all variables.
    None if there are fewer than two values.
    """
    if np.isfinite(drawn).sum() < 2:
        return None
    picture = _Picture(study, drawn, units)
    if not study.varied_grid:
        return picture.histogram(indices)
    # Over amounts, the one with most values first, with a line for each ball or law.
    grids = sorted(study.varied_grid, key=lambda grid: (grid.name in _NAMED, -len(grid.values)))
    along, *others = grids
    by = next((grid for grid in others if grid.name in _NAMED), others[0] if others else None)
    if by is None or by.name in _NAMED or len(by.values) <= _FEW:
        return picture.lines(along, by)
    # The last --set varies fastest: it is the vertical axis.
    return picture.map(*sorted((along, by), key=study.grid.index))


class _Picture:
    def __init__(self, study: Study, drawn: np.ndarray, units: Mapping[str, Any]) -> None:
        self.study, self.drawn, self.units = study, drawn, units
        self.output = study.outputs[0]

    def lines(self, along: Grid, by: Grid | None) -> Figure:
        over = [along] if by is None else [along, by]
        figure, axes = self._new(over)
        (x, *groups), levels = self._reduce(over, _MOST_POINTS)
        levels = levels.reshape(3, len(x), -1)
        named, many = along.name in _NAMED, self.study.number_of_samples > 1
        places = [self._describe(along, value) for value in x] if named else x
        for n, shade in enumerate(figures.make_shades(levels.shape[-1])):
            low, middle, high = levels[..., n]
            text = self._describe(by, groups[0][n]) if by else "median" if many else ""
            # A ball or a law has the style of all figures.
            style = figures.STYLES.get(text, shade)
            line = style.points if named or len(x) <= 12 else style.line
            axes.plot(places, middle, **line | ({"ls": ""} if named else {}), label=text, ms=4)
            if many:
                # Labels that begin with _ aren't shown.
                band = "_" * n + "5 to 95 % of the samples"
                if named:
                    axes.vlines(places, low, high, color=style.colour, label=band)
                else:
                    axes.fill_between(x, low, high, color=style.colour, alpha=0.2, lw=0, label=band)
        if named:
            figure.autofmt_xdate(rotation=20)
        else:
            axes.set_xscale(_scale(along))
            self._name(axes.xaxis, along.name)
        self._name(axes.yaxis, self.output)
        if by or many:
            figures.add_legend_above(axes, columns=3)
        return figure

    def map(self, along: Grid, up: Grid) -> Figure:
        figure, axes = self._new([along, up])
        (x, y), levels = self._reduce([along, up], _MOST_SIDE)
        values = np.ma.masked_invalid(levels[1].T)
        image = axes.pcolormesh(x, y, values, shading="nearest", cmap="viridis", rasterized=True)
        colours = figure.colorbar(image, ax=axes, pad=0.02)
        axes.set(xscale=_scale(along), yscale=_scale(up))
        self._name(axes.xaxis, along.name)
        self._name(axes.yaxis, up.name)
        self._name(colours.ax.yaxis, self.output)
        if np.ptp(values) > 0.0:
            factor = choose_prefix(self.units[self.output], float(np.abs(values).max()))[0]
            lines = axes.contour(x, y, values, levels=8, colors="white", linewidths=0.9)
            axes.clabel(lines, fontsize=8, fmt=lambda level: f"{level * factor:.6g}")
        axes.grid(False)
        return figure

    def histogram(self, indices: Mapping[str, float] | None) -> Figure:
        usable = self.drawn[np.isfinite(self.drawn)]
        title = f"{_words(self.output).capitalize()} of {len(usable):,} samples"
        if indices is None:
            figure, axes = figures.new(title)
        else:
            figure, (axes, beside) = figures.new_pair(title)
            names = sorted(indices, key=lambda name: indices[name])
            shares = [indices[name] for name in names]
            bars = beside.barh([*map(_words, names)], shares, color=figures.BLUE, height=0.6)
            beside.bar_label(bars, fmt="{:.2f}", padding=4)
            beside.set(xlabel="first-order Sobol index")
            beside.margins(x=0.15)
            beside.grid(axis="y", visible=False)
        bins = int(np.clip(np.sqrt(len(usable)), 8, 80))
        low, high = usable.min(), usable.max()
        largest = max(abs(low), abs(high))
        if high - low < 1e-12 * largest:
            # Equal but for rounding: bins would be too narrow for doubles.
            low, high = low - 1e-3 * largest, high + 1e-3 * largest
        axes.hist(usable, bins, range=(low, high), color=figures.SKY)
        factor, unit = choose_prefix(self.units[self.output], largest)
        for percent, style in ((5, "--"), (50, "-"), (95, ":")):
            value = np.percentile(usable, percent)
            text = f"{percent} %: {value * factor:.6g} {unit}"
            axes.axvline(value, color=figures.BLACK, lw=1.4, ls=style, label=text)
        self._name(axes.xaxis, self.output)
        axes.set_ylabel("samples")
        figures.add_legend_above(axes, columns=3)
        return figure

    def _reduce(self, over: Sequence[Grid], most: int) -> tuple[list[np.ndarray], np.ndarray]:
        """Values of some axes in rising order, thinned out, and the output there.

        The output is percentiles 5, 50 and 95 of its samples, first dimension. The other axes stand
        at their first value.
        """
        orders = []
        for axis in over:
            order = np.arange(len(axis.values))
            if axis.name not in _NAMED:
                order = np.argsort(axis.values, kind="stable")
            orders.append(order[:: -(-len(order) // most)])
        *places, samples = np.ix_(*orders, np.arange(self.study.number_of_samples))
        at = {axis.name: place for axis, place in zip(over, places)}
        index = (*(at.get(axis.name, 0) for axis in self.study.grid), samples)
        table = self.drawn.reshape(self.study.shape)[index]
        values = [axis.values[order] for axis, order in zip(over, orders)]
        if self.study.number_of_samples == 1:
            return values, np.stack([table[..., 0]] * 3)
        with warnings.catch_warnings():
            # A point where all is refused stays empty.
            warnings.simplefilter("ignore", RuntimeWarning)
            return values, np.nanpercentile(table, (5, 50, 95), axis=-1)

    def _new(self, over: Sequence[Grid]) -> tuple[Figure, Axes]:
        """A figure of the output over these axes, with the others' first values in its title."""
        names = " and ".join(_words(axis.name) for axis in over)
        title = f"{_words(self.output).capitalize()} over {names}"
        rest = [axis for axis in self.study.varied_grid if axis not in over]
        others = ", ".join(self._describe(axis, axis.values[0]) for axis in rest)
        return figures.new(f"{title} ({others})" if others else title)

    def _describe(self, grid: Grid, value: Any) -> str:
        """A variable and its value, with its unit."""
        if grid.name in _NAMED:
            return str(value) if isinstance(value, str) else f"{grid.name} {value}"
        factor, unit = choose_prefix(self.units[grid.name], float(np.abs(grid.values).max()))
        return f"{_words(grid.name)} = {value * factor:g} {unit}".rstrip()

    def _name(self, axis: Axis, name: str) -> None:
        figures.name_axis(axis, _words(name), self.units[name])


def _scale(grid: Grid) -> str:
    return "log" if grid.text.startswith("log:") else "linear"


def _words(name: str) -> str:
    return name.replace("_", " ")


def sobol_indices(
    study: Study, drawn: np.ndarray, outputs_of: Callable[[dict[str, np.ndarray]], np.ndarray]
) -> dict[str, float] | None:
    """First-order Sobol indices of an output by variable (Saltelli 2010).

    They are the shares of the output's variance that each variable explains separately, from a
    design with impacts of its own.

    Args:
        study: two independent distributions or more, with no grid beside them.
        drawn: the output in all cases of the study, shape (cases,), NaN where refused.
        outputs_of: the output, shape (n,), from columns of all swept variables.

    Returns:
        None where no design is possible: another study, a refused case, or an output
        that is the same in all cases.
    """
    axes = study.distributions
    # But for rounding: S under law 1 is the same at any speed.
    varies = np.ptp(drawn) > 1e-12 * np.abs(drawn).max()  # not if one is NaN
    if len(axes) < 2 or study.varied_grid or not varies:
        return None
    from scipy import stats

    def outputs_at(points: np.ndarray) -> np.ndarray:
        columns = {axis.name: values for axis, values in zip(axes, points)}
        columns |= {axis.name: np.repeat(axis.values, points.shape[1]) for axis in study.grid}
        outputs = outputs_of({name: columns[name] for name in study.names})
        if not np.isfinite(outputs).all():
            raise FloatingPointError
        return outputs

    try:
        indices = stats.sobol_indices(
            func=outputs_at,
            n=_POINTS,
            dists=[axis.of_scipy() for axis in axes],
            random_state=np.random.default_rng(study.seed),
        )
    except FloatingPointError:
        return None
    return {axis.name: index for axis, index in zip(axes, indices.first_order.tolist())}
