"""The figure of a calibration: data and fit above, residuals below, each with its 95 % band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from golf_impact.calibration.measurements import TARGETS
from golf_impact.facts.quantities import QUANTITIES
from golf_impact.report import figures

if TYPE_CHECKING:
    from golf_impact.calibration.calibration import Calibration

_LABELS = {
    "curve": ("time since touch (µs)", "contact force (N)", "fit − measured (N)"),
    "cor_speeds": ("approach speed (m/s)", "COR", "fit − measured"),
}
_DOTS: dict[str, Any] = {"color": figures.BLACK, "marker": ".", "ms": 5, "ls": "", "alpha": 0.6}


def draw(calibration: Calibration) -> Figure:
    """A column for the force, one for COR over speed, one for the scalars' residuals."""
    data = calibration.data
    columns = [[name, f"{name} residuals"] for name in data.series]
    columns += [["targets", "targets"]] * bool(data.targets)
    figure, axes = figures.plt.subplot_mosaic(
        [list(row) for row in zip(*columns)],
        figsize=(max(7.2, 5.4 * len(columns)), 5.6),
        height_ratios=(2.2, 1.0),
    )
    figure.suptitle(f"Calibrated: {calibration.fit.title}", x=0.01, ha="left", fontweight="bold")
    for name in data.series:
        _draw_series(calibration, name, axes[name], axes[f"{name} residuals"])
    if data.targets:
        _draw_targets(calibration, axes["targets"])
    return figure


def _draw_series(calibration: Calibration, name: str, above: Axes, below: Axes) -> None:
    """Measured values and the fit; residuals in the 95 % band of a measurement."""
    fit, series = calibration.fit, calibration.data.series[name]
    order, x = np.argsort(series.x), series.x
    if fit.touch and name == "curve":
        x = 1e6 * (series.x - fit.touch.value)
        inside = x[series.contact]
        margin = 0.3 * np.ptp(inside)
        for axes in (above, below):
            axes.set_xlim(inside[0] - margin, inside[-1] + margin)
    sigma = fit.sigma[calibration.data.groups[name]]
    residuals = calibration.residuals[name] * sigma
    half = fit.coverage * sigma[order]
    above.plot(x, series.y, **_DOTS, label="measured")
    above.plot(x[order], (series.y + residuals)[order], color=figures.BLUE, label="fit")
    below.fill_between(x[order], -half, half, color=figures.BLACK, alpha=0.14, lw=0, label="95 %")
    below.plot(x, residuals, **_DOTS)
    below.axhline(0.0, color=figures.BLACK, lw=0.8)
    above.set(ylabel=_LABELS[name][1])
    below.set(xlabel=_LABELS[name][0], ylabel=_LABELS[name][2])
    for axes in (above, below):
        axes.legend(loc="upper right", fontsize=9)


def _draw_targets(calibration: Calibration, axes: Axes) -> None:
    """Residuals of the scalars."""
    residuals = calibration.residuals["targets"]
    axes.plot(residuals, range(len(residuals)), "o", ms=7)
    names = [QUANTITIES[TARGETS[name]].plain for name in calibration.data.targets]
    figures.label_rows(axes, names, band=1.96)
    axes.set(xlabel="(fit − target) / σ; band: 95 %")
