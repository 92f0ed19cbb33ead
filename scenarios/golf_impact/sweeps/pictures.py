"""What a sweep's first output looks like over what was swept. Imported only to draw."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from fmpy.model_description import ScalarVariable
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from golf_impact.facts.quantities import choose_prefix
from golf_impact.report import figures
from golf_impact.sweeps.axes import Grid
from golf_impact.sweeps.study import Study

#: More points of a line, or along a side of a map, than these can't be seen.
_MOST_POINTS, _MOST_SIDE = 2000, 300
#: So few values are a line each: between them a map would show what nobody computed.
_FEW = 7
#: Variables whose values are names, not amounts.
_NAMED = ("ball", "law")


def draw(
    study: Study,
    drawn: np.ndarray,
    variables: Mapping[str, ScalarVariable],
    indices: Mapping[str, float] | None,
) -> Figure | None:
    """A line, lines, a heat map, or a histogram beside Sobol indices, whichever fits the study.

    `drawn` is its first output, shape (cases,), NaN where refused. None where there is nothing to
    see: one case, or none that wasn't refused.
    """
    usable = drawn[np.isfinite(drawn)]
    if len(usable) < 2:
        return None
    units = {name: variable.unit for name, variable in variables.items()}
    if not study.varied_grid:
        return _histogram(usable, study.outputs[0], units, indices)
    # Over amounts, the one with most values first, with a line for each ball or law.
    along, *others = sorted(
        study.varied_grid, key=lambda one: (one.name in _NAMED, -len(one.values))
    )
    by = next((one for one in others if one.name in _NAMED), others[0] if others else None)
    if by is None or by.name in _NAMED or len(by.values) <= _FEW:
        return _lines(study, drawn, units, along, by)
    # The last --set runs fastest: it goes up.
    return _map(study, drawn, units, *sorted((along, by), key=study.grid.index))


def _lines(
    study: Study, drawn: np.ndarray, units: Mapping[str, Any], along: Grid, by: Grid | None
) -> Figure:
    over = [along] if by is None else [along, by]
    figure, axes = _new(study, units, over)
    (x, *groups), levels = _reduce(study, drawn, over, _MOST_POINTS)
    levels = levels.reshape(3, len(x), -1)
    named, many = along.name in _NAMED, study.number_of_samples > 1
    places = [_describe(along, value, units) for value in x] if named else x
    for n, shade in enumerate(figures.make_shades(levels.shape[-1])):
        low, middle, high = levels[..., n]
        text = _describe(by, groups[0][n], units) if by else "median" if many else ""
        # A ball or a law has the style of all figures.
        style = figures.STYLES.get(text, shade)
        line = style.points if named or len(x) <= 12 else style.line
        axes.plot(places, middle, **line | ({"ls": ""} if named else {}), label=text or None, ms=4)
        if many:
            # Labels that begin with _ are left out.
            band = "_" * n + "5 to 95 % of the samples"
            if named:
                axes.vlines(places, low, high, color=style.colour, label=band)
            else:
                axes.fill_between(x, low, high, color=style.colour, alpha=0.2, lw=0, label=band)
    if named:
        figure.autofmt_xdate(rotation=20)
    else:
        axes.set_xscale(_scale(along))
        _name(axes.xaxis, along.name, units)
    _name(axes.yaxis, study.outputs[0], units)
    if by or many:
        figures.add_legend_above(axes, columns=3)
    return figure


def _map(
    study: Study, drawn: np.ndarray, units: Mapping[str, Any], along: Grid, up: Grid
) -> Figure:
    figure, axes = _new(study, units, [along, up])
    (x, y), levels = _reduce(study, drawn, [along, up], _MOST_SIDE)
    values = np.ma.masked_invalid(levels[1].T)
    image = axes.pcolormesh(x, y, values, shading="nearest", cmap="viridis", rasterized=True)
    bar = figure.colorbar(image, ax=axes, pad=0.02)
    axes.set(xscale=_scale(along), yscale=_scale(up))
    _name(axes.xaxis, along.name, units)
    _name(axes.yaxis, up.name, units)
    _name(bar.ax.yaxis, study.outputs[0], units)
    if np.ptp(values) > 0.0:
        factor = choose_prefix(units[study.outputs[0]], float(np.abs(values).max()))[0]
        lines = axes.contour(x, y, values, levels=8, colors="white", linewidths=0.9)
        axes.clabel(lines, fontsize=8, fmt=lambda level: f"{level * factor:.6g}")
    axes.grid(False)
    return figure


def _histogram(
    usable: np.ndarray,
    output: str,
    units: Mapping[str, Any],
    indices: Mapping[str, float] | None,
) -> Figure:
    title = f"{_capital(output)} of {len(usable):,} samples"
    if indices is None:
        figure, axes = figures.new(title)
    else:
        figure, (axes, beside) = figures.new_pair(title)
        _bars(beside, indices)
    bins = int(np.clip(np.sqrt(len(usable)), 8, 80))
    low, high = usable.min(), usable.max()
    largest = max(abs(low), abs(high))
    if high - low < 1e-12 * largest:
        # Equal but for rounding: bins would be too narrow for doubles.
        low, high = low - 1e-3 * largest, high + 1e-3 * largest
    axes.hist(usable, bins, range=(low, high), color=figures.SKY)
    factor, unit = choose_prefix(units[output], largest)
    for percent, style in ((5, "--"), (50, "-"), (95, ":")):
        value = np.percentile(usable, percent)
        text = f"{percent} %: {value * factor:.6g} {unit}"
        axes.axvline(value, color=figures.BLACK, lw=1.4, ls=style, label=text)
    _name(axes.xaxis, output, units)
    axes.set_ylabel("samples")
    figures.add_legend_above(axes, columns=3)
    return figure


def _bars(axes: Axes, indices: Mapping[str, float]) -> None:
    names = sorted(indices, key=lambda name: indices[name])
    values = [indices[name] for name in names]
    bars = axes.barh([_words(name) for name in names], values, color=figures.BLUE, height=0.6)
    axes.bar_label(bars, fmt="{:.2f}", padding=4)
    axes.set(xlabel="first-order Sobol index")
    axes.margins(x=0.15)
    axes.grid(axis="y", visible=False)


def _reduce(
    study: Study, drawn: np.ndarray, over: Sequence[Grid], most: int
) -> tuple[list[np.ndarray], np.ndarray]:
    """Values of some axes in rising order, thinned out, and the output there.

    The output is percentiles 5, 50 and 95 of its samples, first dimension. The other axes stand at
    their first value.
    """
    table = drawn.reshape(*(len(one.values) for one in study.grid), study.number_of_samples)
    places = {one.name: np.array([0]) for one in study.grid}
    for one in over:
        order = np.arange(len(one.values))
        if one.name not in _NAMED:
            order = np.argsort(one.values, kind="stable")
        places[one.name] = order[:: -(-len(order) // most)]
    table = table[np.ix_(*places.values())]
    table = np.moveaxis(table, [study.grid.index(one) for one in over], range(len(over)))
    values = [one.values[places[one.name]] for one in over]
    table = table.reshape(*map(len, values), study.number_of_samples)
    if study.number_of_samples == 1:
        return values, np.stack([table[..., 0]] * 3)
    with warnings.catch_warnings():
        # A point where all is refused stays empty.
        warnings.simplefilter("ignore", RuntimeWarning)
        return values, np.nanpercentile(table, (5, 50, 95), axis=-1)


def _new(study: Study, units: Mapping[str, Any], over: Sequence[Grid]) -> tuple[Figure, Axes]:
    """A figure of the output over these axes, with the others' first values in its title."""
    title = f"{_capital(study.outputs[0])} over {' and '.join(_words(one.name) for one in over)}"
    rest = [one for one in study.varied_grid if one not in over]
    others = ", ".join(_describe(one, one.values[0], units) for one in rest)
    return figures.new(f"{title} ({others})" if others else title)


def _describe(one: Grid, value: Any, units: Mapping[str, Any]) -> str:
    """A variable and its value, with its unit."""
    if one.name in _NAMED:
        return str(value) if isinstance(value, str) else f"{one.name} {value}"
    factor, unit = choose_prefix(units[one.name], float(np.abs(one.values).max()))
    return f"{_words(one.name)} = {value * factor:g} {unit}".rstrip()


def _name(axis: Axis, name: str, units: Mapping[str, Any]) -> None:
    figures.name_axis(axis, _words(name), units[name])


def _scale(one: Grid) -> str:
    return "log" if one.text.startswith("log:") else "linear"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _capital(name: str) -> str:
    return _words(name[:1].upper() + name[1:])
