"""The figure of a calibration: data and fit above, residuals below, each with its 95 % band."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from golf_impact.data.quantities import QUANTITIES
from golf_impact.studies.calibrate.measurements import TARGETS

_LABELS = {
    "curve": ("time since touch (µs)", "contact force (N)", "fit − measured (N)"),
    "cor_speeds": ("approach speed (m/s)", "COR", "fit − measured"),
}
_DOTS: dict[str, Any] = {"color": "black", "marker": ".", "ms": 5, "ls": "", "alpha": 0.6}

#: More points than pixels are no more to see.
_POINTS = 4000


def draw(fit: Any) -> Figure:
    """A column for the force, one for COR over speed, one for the scalars' residuals."""
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
        x, y, sigma, limits = series.x, series.y, fit.sigma[name], (None, None)
        if name in data.curves:
            own = fit.curves[name]
            offset, drift = (own[of].value if of in own else 0.0 for of in ("offset", "drift"))
            y = y - offset - drift * (x - series.origin)
            x = 1e6 * (x - own["touch"].value)
            first, last = x[series.contact[[0, -1]]]
            limits = 1.3 * first - 0.3 * last, 1.3 * last - 0.3 * first
            if len(data.curves) > 1:
                above.set_title(f"{Path(series.name).name}, {series.impact['club_speed']:g} m/s")
        order = np.argsort(x)[:: len(x) // _POINTS + 1]
        x, y, sigma = x[order], y[order], sigma[order]
        residuals = fit.residuals[name][order] * sigma
        above.plot(x, y, **_DOTS, label="measured")
        above.plot(x, y + residuals, color="tab:blue", label="fit")
        band = fit.coverage * sigma
        below.fill_between(x, -band, band, color="black", alpha=0.14, lw=0, label="95 %")
        below.plot(x, residuals, **_DOTS)
        below.axhline(0.0, color="black", lw=0.8)
        time, force, difference = _LABELS["curve" if name in data.curves else name]
        above.set(ylabel=force, xlim=limits)
        below.set(xlabel=time, ylabel=difference, xlim=limits)
        for one in (above, below):
            one.legend(loc="upper right", fontsize=9)
    if names := data.scalars.targets:
        one, outputs = axes["targets"], [QUANTITIES.get(TARGETS[name]) for name in names]
        one.axvspan(-1.96, 1.96, color="black", alpha=0.1, lw=0)
        one.axvline(0.0, color="black", lw=1.0)
        one.plot(fit.residuals["targets"][: len(names)], range(len(names)), "o", ms=7)
        labels = [known.plain if known else name for name, known in zip(names, outputs)]
        one.set_yticks(range(len(names)), labels)
        one.set_ylim(len(names) - 0.5, -0.5)
        one.set(xlabel="(fit − target) / σ; band: 95 %")
    return figure
