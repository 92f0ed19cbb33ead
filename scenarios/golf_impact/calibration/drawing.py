"""The figure of a calibration: data and fit above, residuals below, each with its 95 % band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from golf_impact.calibration.measurements import TARGETS
from golf_impact.calibration.pulse import contact_rows
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
    columns = [(name, f"{name} off") for name in data.series]
    columns += [("targets", "targets")] * bool(data.targets)
    figure, axes = figures.plt.subplot_mosaic(
        [list(row) for row in zip(*columns)],
        figsize=(max(7.2, 5.4 * len(columns)), 5.6),
        height_ratios=(2.2, 1.0),
    )
    figure.suptitle(f"Calibrated: {calibration.fit.title}", x=0.01, ha="left", fontweight="bold")
    for name in data.series:
        _draw_series(calibration, name, axes[name], axes[f"{name} off"])
    if data.targets:
        _draw_targets(calibration, axes["targets"])
    return figure


def _draw_series(calibration: Calibration, name: str, above: Axes, below: Axes) -> None:
    """Measured values and the fit's 95 % band; residuals in the band of a new measurement."""
    fit, series, rows = (
        calibration.fit,
        calibration.data.series[name],
        calibration.data.groups[name],
    )
    order, x = np.argsort(series.x), series.x
    if fit.touch and name == "curve":
        x = 1e6 * (series.x - fit.touch.value)
        inside = x[contact_rows(series.y)]
        margin = 0.3 * np.ptp(inside)
        for axes in (above, below):
            axes.set_xlim(inside[0] - margin, inside[-1] + margin)
    residuals = fit.residuals[rows] * fit.sigma[rows]
    model, errors = series.y + residuals, fit.coverage * np.nan_to_num(fit.model_errors[rows])
    half = np.hypot(errors, fit.coverage * fit.sigma[rows])[order]
    low, high = (model - errors)[order], (model + errors)[order]
    above.plot(x, series.y, **_DOTS, label="measured")
    above.plot(x[order], model[order], color=figures.BLUE, label="fit")
    above.fill_between(x[order], low, high, color=figures.BLUE, alpha=0.3, label="fit, 95 %")
    below.fill_between(x[order], -half, half, color=figures.BLACK, alpha=0.14, lw=0, label="95 %")
    below.plot(x, residuals, **_DOTS)
    below.axhline(0.0, color=figures.BLACK, lw=0.8)
    above.set(ylabel=_LABELS[name][1])
    below.set(xlabel=_LABELS[name][0], ylabel=_LABELS[name][2])
    for axes in (above, below):
        axes.legend(loc="upper right", fontsize=9)


def _draw_targets(calibration: Calibration, axes: Axes) -> None:
    """Residuals of the scalars for each law, those of the fit filled."""
    targets, best, widest = calibration.data.targets, calibration.fit, 2.5
    for one in (*(one for one in calibration.fits if one is not best), best):
        n, power = one.law.exponent, "Tsuji" if one.law.exponent == 1.5 else "power law"
        look = figures.STYLES[f"law {one.law.law}" if n == 1.0 else power]
        residuals = one.residuals[: len(targets)]
        widest = max(widest, float(np.abs(residuals).max()))
        marker: dict[str, Any] = {"mfc": look.colour if one is best else "white", "ms": 7}
        label = one.law.title
        axes.plot(
            residuals, range(len(targets)), look.marker, color=look.colour, label=label, **marker
        )
    figures.label_rows(axes, [TARGETS[name][1] for name in targets], band=1.96)
    axes.set(xlabel="(fit − target) / σ; band: 95 %", xlim=(-1.15 * widest, 1.15 * widest))
    axes.legend(loc="upper right", fontsize=9)
