"""The figure of a calibration: data and fit above, residuals below, each with its 95 % band."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from golf_impact.data.quantities import QUANTITIES, Quantity
from golf_impact.studies.calibrate.measurements import TARGETS

_LABELS = {
    "curve": ("time since touch (µs)", "contact force (N)", "fit − measured (N)"),
    "cor_speeds": ("approach speed (m/s)", "COR", "fit − measured"),
}
_DOTS: dict[str, Any] = {"color": "black", "marker": ".", "ms": 5, "ls": "", "alpha": 0.6}


def draw(fit: Any) -> Figure:
    """A column for each force, one for COR over speed, one for the scalars' residuals."""
    data = fit.data
    columns = [[name, f"{name} residuals"] for name in data.series]
    columns += [["targets", "targets"]] * bool(data.scalars.targets)
    figure, axes = plt.subplot_mosaic(
        [list(row) for row in zip(*columns)],
        figsize=(max(7.2, 5.4 * len(columns)), 5.6),
        height_ratios=(2.2, 1.0),
        layout="constrained",
    )
    figure.suptitle(f"Calibrated: {fit.title}", x=0.01, ha="left", fontweight="bold")
    for name, series in data.series.items():
        above, below = axes[name], axes[f"{name} residuals"]
        x, y, limits = series.x, series.y, (None, None)
        if name in data.curves:
            own = fit.curves[name]
            offset, drift = (own[of].value if of in own else 0.0 for of in ("offset", "drift"))
            y = y - offset - drift * (x - series.origin)
            x = 1e6 * (x - own["touch_time"].value)
            first, last = x[series.contact[[0, -1]]]
            limits = 1.3 * first - 0.3 * last, 1.3 * last - 0.3 * first
            title = f"{Path(series.name).name}, {series.impact['club_speed']:g} m/s"
            above.set_title(title, fontsize="medium")
        order = np.argsort(x)[:: len(x) // 4000 + 1]  # more than pixels are no more to see
        x, y, sigma = x[order], y[order], fit.sigma[name][order]
        residuals, band = fit.residuals[name][order] * sigma, fit.coverage * sigma
        above.plot(x, y, **_DOTS, label="measured")
        above.plot(x, y + residuals, color="tab:blue", label="fit")
        below.fill_between(x, -band, band, color="black", alpha=0.14, lw=0, label="95 %")
        below.plot(x, residuals, **_DOTS)
        below.axhline(0.0, color="black", lw=0.8)
        time, force, difference = _LABELS["curve" if name in data.curves else name]
        above.set(ylabel=force, xlim=limits)
        below.set(xlabel=time, ylabel=difference, xlim=limits)
        above.legend(loc="upper right", fontsize=9)
        below.legend(loc="upper right", fontsize=9)
    if names := data.scalars.targets:
        one = axes["targets"]
        labels = [QUANTITIES.get(TARGETS[name], Quantity(name)).plain for name in names]
        one.axvspan(-1.96, 1.96, color="black", alpha=0.1, lw=0)
        one.axvline(0.0, color="black", lw=1.0)
        one.plot(fit.residuals["targets"][: len(names)], labels, "o", ms=7)
        one.margins(y=0.3)
        one.invert_yaxis()
        one.set(xlabel="(fit − target) / σ; band: 95 %")
    return figure
