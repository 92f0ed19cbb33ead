"""The figure of a calibration: data and fit above, residuals below, each with its 95 % band."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from golf_impact.calibration.measurements import TARGETS
from golf_impact.quantities import QUANTITIES
from golf_impact.report import figures

_LABELS = {
    "curve": ("time since touch (µs)", "contact force (N)", "fit − measured (N)"),
    "cor_speeds": ("approach speed (m/s)", "COR", "fit − measured"),
}
_DOTS: dict[str, Any] = {"color": figures.BLACK, "marker": ".", "ms": 5, "ls": "", "alpha": 0.6}


def draw(calibration: Any) -> Figure:
    """A column for the force, one for COR over speed, one for the scalars' residuals."""
    data, fit = calibration.data, calibration.fit
    columns = [[name, f"{name} residuals"] for name in data.series]
    columns += [["targets", "targets"]] * bool(data.targets)
    figure, axes = figures.plt.subplot_mosaic(
        [list(row) for row in zip(*columns)],
        figsize=(max(7.2, 5.4 * len(columns)), 5.6),
        height_ratios=(2.2, 1.0),
    )
    figure.suptitle(f"Calibrated: {fit.title}", x=0.01, ha="left", fontweight="bold")
    for name, series in data.series.items():
        above, below = axes[name], axes[f"{name} residuals"]
        order, x, sigma = np.argsort(series.x), series.x, fit.sigma[data.groups[name]]
        # More points than pixels are no more to see.
        order = order[:: len(order) // 4000 + 1]
        if name in fit.touches:
            x = 1e6 * (series.x - fit.touches[name].value)
            first, last = x[series.contact[[0, -1]]]
            margin = 0.3 * (last - first)
            for one in (above, below):
                one.set_xlim(first - margin, last + margin)
        residuals, half = calibration.residuals[name] * sigma, fit.coverage * sigma[order]
        above.plot(x[order], series.y[order], **_DOTS, label="measured")
        above.plot(x[order], (series.y + residuals)[order], color=figures.BLUE, label="fit")
        band = {"color": figures.BLACK, "alpha": 0.14, "lw": 0, "label": "95 %"}
        below.fill_between(x[order], -half, half, **band)
        below.plot(x[order], residuals[order], **_DOTS)
        below.axhline(0.0, color=figures.BLACK, lw=0.8)
        if calibration.apart and series.impact:
            above.set_title(f"{Path(series.name).name}, {series.impact['club_speed']:g} m/s")
        above.set(ylabel=_LABELS[name.split()[0]][1])
        below.set(xlabel=_LABELS[name.split()[0]][0], ylabel=_LABELS[name.split()[0]][2])
        for one in (above, below):
            one.legend(loc="upper right", fontsize=9)
    if data.targets:
        residuals = calibration.residuals["targets"]
        axes["targets"].plot(residuals, range(len(residuals)), "o", ms=7)
        names = [QUANTITIES[TARGETS[name]].plain for name in data.targets]
        figures.label_rows(axes["targets"], names, band=1.96)
        axes["targets"].set(xlabel="(fit − target) / σ; band: 95 %")
    return figure
