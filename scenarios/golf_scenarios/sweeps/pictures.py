"""What a sweep's first output looks like over what was swept."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from golf_scenarios.sweeps.axes import Grid
from golf_scenarios.sweeps.sensitivity import Sensitivity
from golf_scenarios.sweeps.study import Study

if TYPE_CHECKING:
    from fmpy.model_description import ScalarVariable
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: More points of a line, or along a side of a map, than these can't be seen.
_MOST_POINTS, _MOST_SIDE = 2000, 300

#: So few values are a line each: between them a map would show what nobody computed.
_FEW = 7

#: What varies by less (relative) is constant but for rounding.
_CONSTANT = 1e-12

#: Variables whose values are names, not amounts.
_NAMED = ("ball", "law")


def label(variable: ScalarVariable) -> str:
    """A variable with its unit, as it stands at an axis."""
    words = variable.name.replace("_", " ") if len(variable.name) > 1 else variable.name
    return words if variable.unit in (None, "", "1") else f"{words} ({variable.unit})"


def draw(
    study: Study,
    drawn: np.ndarray,
    variables: Mapping[str, ScalarVariable],
    sensitivity: Sensitivity | None,
) -> Figure | None:
    """A line, lines, a heat map, or a histogram beside sensitivities, whichever fits the study.

    Args:
        study: what was swept.
        drawn: its first output, shape (cases,); NaN where refused.
        variables: of the FMU, by name.
        sensitivity: how much each distribution matters.

    Returns:
        None where there is nothing to see: one case, or none that wasn't refused.
    """
    usable = drawn[np.isfinite(drawn)]
    if len(usable) < 2:
        return None
    name = study.outputs[0]
    if not study.varied_grid:
        return _monte_carlo(label(variables[name]), usable, study, sensitivity)
    grid = _Reduced(study, drawn)
    amounts = [one for one in study.varied_grid if one.name not in _NAMED]
    named = [one for one in study.varied_grid if one.name in _NAMED]
    labels = {one.name: label(variables[one.name]) for one in amounts}
    amounts.sort(key=lambda one: -len(one.values))
    if not amounts:
        return _bars(grid, named[0], label(variables[name]))
    few = [one for one in amounts[1:2] if len(one.values) <= _FEW]
    if named or few or len(amounts) == 1:
        return _lines(grid, amounts[0], (named or few)[:1], labels, label(variables[name]))
    return _map(grid, amounts[0], amounts[1], labels, label(variables[name]))


class _Reduced:
    """The output over the grid: median and range of the samples at each point."""

    def __init__(self, study: Study, drawn: np.ndarray) -> None:
        self.study = study
        self.sampled = study.number_of_samples > 1
        self._table = drawn.reshape(
            *(len(one.values) for one in study.grid), study.number_of_samples
        )

    def over(self, axes: list[Grid], most: int) -> tuple[list[np.ndarray], np.ndarray]:
        """Values of some axes, thinned out, and percentiles 5, 50 and 95 there, first dimension;
        the other axes stand at their first value.
        """
        pick: list[Any] = []
        values = {}
        for one in self.study.grid:
            if one in axes:
                number = min(most, len(one.values))
                places = np.linspace(0, len(one.values) - 1, number).astype(int)
                # In rising order, whatever order they were given in.
                if one.name not in _NAMED:
                    places = places[np.argsort(one.values[places], kind="stable")]
                values[one.name] = one.values[places]
                pick.append(places)
            else:
                pick.append(np.array([0]))
        table = self._table[np.ix_(*pick, np.arange(self._table.shape[-1]))]
        kept = [one for one in self.study.grid if one in axes]
        table = table.reshape(*(len(values[one.name]) for one in kept), -1)
        table = np.moveaxis(table, [kept.index(one) for one in axes], range(len(axes)))
        if not self.sampled:
            percentiles = np.stack([table[..., 0]] * 3)
        else:
            with warnings.catch_warnings():
                # A point where all is refused stays empty.
                warnings.simplefilter("ignore", RuntimeWarning)
                percentiles = np.nanpercentile(table, (5, 50, 95), axis=-1)
        return [values[one.name] for one in axes], percentiles


def _lines(
    grid: _Reduced, along: Grid, by: list[Grid], labels: dict[str, str], output: str
) -> Figure:
    from golf_scenarios.report import figures

    figure, axes = figures.new(_title(output, [along, *by], grid))
    (x, *names), levels = grid.over([along, *by], _MOST_POINTS)
    colours = (
        figures.BLUE, figures.VERMILION, figures.GREEN, figures.ORANGE, figures.PURPLE,
        figures.SKY, figures.BLACK,
    )  # fmt: skip
    levels = levels if by else levels[..., np.newaxis]
    marker = "o" if len(x) <= 12 else None
    for n in range(levels.shape[-1]):
        colour = colours[n % len(colours)]
        equals = "" if by and by[0].name in _NAMED else "= "
        text = f"{by[0].name} {equals}{_short(names[0][n])}" if by else None
        if text is None and grid.sampled:
            text = "median"
        # Lines that coincide are told apart by their dashes.
        style = ("-", "--", ":")[n % 3]
        axes.plot(x, levels[1][:, n], style, color=colour, label=text, marker=marker, ms=4)
        if grid.sampled:
            band = "5 to 95 % of the samples" if n == 0 else None
            axes.fill_between(x, levels[0][:, n], levels[2][:, n], color=colour, alpha=0.2, lw=0,
                              label=band)  # fmt: skip
    axes.set(xlabel=labels[along.name], ylabel=output)
    _scale(axes.set_xscale, x)
    if by or grid.sampled:
        figures.legend_above(axes, columns=3)
        lines = -(-len(axes.get_legend_handles_labels()[0]) // 3)
        axes.set_title(axes.get_title("left"), pad=10 + 16 * lines)
    return figure


def _bars(grid: _Reduced, named: Grid, output: str) -> Figure:
    from golf_scenarios.report import figures

    figure, axes = figures.new(_title(output, [named], grid))
    (names,), levels = grid.over([named], _MOST_SIDE)
    middle = levels[1]
    axes.errorbar(
        middle, np.arange(len(names)), xerr=[middle - levels[0], levels[2] - middle], fmt="o",
        color=figures.BLUE, capsize=4,
    )  # fmt: skip
    axes.set_yticks(range(len(names)), [f"{named.name} {_short(name)}" for name in names])
    axes.set(xlabel=output, ylim=(len(names) - 0.5, -0.5))
    return figure


def _map(grid: _Reduced, across: Grid, up: Grid, labels: dict[str, str], output: str) -> Figure:
    from golf_scenarios.report import figures

    # The last --set runs fastest: it goes up.
    order = [one for one in grid.study.grid if one in (across, up)]
    figure, axes = figures.new(_title(output, order, grid))
    (x, y), levels = grid.over(order, _MOST_SIDE)
    values = np.ma.masked_invalid(levels[1].T)
    image = axes.pcolormesh(x, y, values, shading="nearest", cmap="viridis", rasterized=True)
    figure.colorbar(image, ax=axes, label=output, pad=0.02)
    if values.count() > 3 and np.ptp(values.compressed()) > 0.0:
        lines = axes.contour(x, y, values, levels=8, colors="white", linewidths=0.9)
        axes.clabel(lines, fontsize=8, fmt=lambda level: f"{level:.6g}")
    axes.set(xlabel=labels[order[0].name], ylabel=labels[order[1].name])
    _scale(axes.set_xscale, x)
    _scale(axes.set_yscale, y)
    axes.grid(False)
    return figure


def _monte_carlo(
    output: str, usable: np.ndarray, study: Study, sensitivity: Sensitivity | None
) -> Figure:
    from golf_scenarios.report import figures

    title = f"{_capital(output.split(' (')[0])} of {len(usable):,} samples"
    if sensitivity is None:
        figure, axes = figures.new(title)
    else:
        figure, (axes, bars) = figures.new_pair(title)
        _sensitivities(bars, sensitivity)
    # Rare ones far out would leave the others no room.
    rare = 0.05 if len(usable) > 2000 else 0.0
    bins = int(np.clip(np.sqrt(len(usable)), 8, 80))
    low, high = np.percentile(usable, (rare, 100.0 - rare)).tolist()
    if high - low <= _CONSTANT * max(abs(low), abs(high)):
        margin = 1e-3 * max(abs(low), abs(high)) or 1.0
        low, high = low - margin, high + margin
    density, edges = np.histogram(usable, bins, range=(low, high), density=True)
    axes.stairs(density, edges, fill=True, color=figures.SKY)
    quantiles = np.percentile(usable, (5, 50, 95))
    digits = _digits(quantiles)
    for percent, value, style in zip((5, 50, 95), quantiles, ("--", "-", ":"), strict=True):
        axes.axvline(
            value, color=figures.BLACK, lw=1.4, ls=style, label=f"{percent} %: {value:.{digits}f}"
        )
    left_out = f" ({2.0 * rare:g} % lie outside)" if rare else ""
    axes.set(xlabel=output, ylabel=f"probability density{left_out}")
    axes.margins(y=0.06)
    figures.legend_above(axes, columns=3)
    return figure


def _sensitivities(axes: Axes, sensitivity: Sensitivity) -> None:
    from golf_scenarios.report import figures

    names = sorted(sensitivity.values, key=lambda name: abs(sensitivity.values[name]))
    values = [sensitivity.values[name] for name in names]
    axes.barh(names, values, color=figures.BLUE, height=0.6)
    for n, value in enumerate(values):
        axes.annotate(
            f"{value:.2f}", (value, n), xytext=(4 if value >= 0 else -4, 0),
            textcoords="offset points", va="center", ha="left" if value >= 0 else "right",
        )  # fmt: skip
    axes.axvline(0.0, color=figures.BLACK, lw=0.8)
    axes.set(xlabel=sensitivity.label)
    axes.margins(x=0.15)
    axes.grid(axis="y", visible=False)


def _title(output: str, over: list[Grid], grid: _Reduced) -> str:
    names = " and ".join(one.name.replace("_", " ") for one in over)
    title = f"{_capital(output.split(' (')[0])} over {names}"
    # What stands still.
    rest = [one for one in grid.study.varied_grid if one not in over]
    others = ", ".join(f"{one.name} = {_short(one.values[0])}" for one in rest)
    return f"{title} ({others})" if others else title


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def _digits(values: np.ndarray) -> int:
    """Enough decimals to tell quantiles apart."""
    width = float(np.ptp(values))
    if width <= _CONSTANT * float(np.abs(values).max()):
        width = 1e-3 * float(np.abs(values).max())
    return int(np.clip(2 - np.floor(np.log10(width)), 0, 9)) if width > 0.0 else 4


def _short(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def _scale(set_scale: Any, values: np.ndarray) -> None:
    """Logarithmic for values that are given so: positive, over a decade, in equal ratios."""
    if len(values) > 2 and values[0] > 0.0 and values[-1] > 5.0 * values[0]:
        ratios = values[1:] / values[:-1]
        if np.ptp(ratios) < 0.1 * (ratios.mean() - 1.0):
            set_scale("log")
