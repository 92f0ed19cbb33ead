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

_BAND: dict[str, Any] = {"color": figures.BLACK, "alpha": 0.14, "lw": 0}
_DOTS: dict[str, Any] = {"color": figures.BLACK, "marker": ".", "ms": 5, "ls": "", "alpha": 0.6}


def draw(calibration: Calibration) -> Figure:
    """A column for the force, one for COR over speed, one for the scalars' residuals."""
    data, columns = calibration.data, []
    if data.sized:
        columns.append(("force", "curve" if data.curve else "force"))
    if data.cor_speeds:
        columns.append(("COR", "cor_speeds"))
    if data.targets:
        columns.append(("targets", "targets"))
    size = (max(7.2, 5.4 * len(columns)), 5.6)
    figure, axes = figures.plt.subplot_mosaic(
        [list(row) for row in zip(*columns)], figsize=size, height_ratios=(2.2, 1.0)
    )
    figure.suptitle(f"Calibrated: {calibration.fit.title}", x=0.01, ha="left", fontweight="bold")
    if data.cor_speeds:
        _draw_series(calibration, "cor_speeds", axes["COR"], axes["cor_speeds"])
        axes["COR"].set(ylabel="COR")
        axes["cor_speeds"].set(xlabel="approach speed (m/s)", ylabel="fit − measured")
    if data.targets:
        _draw_targets(calibration, axes["targets"])
    if data.sized:
        _draw_laws(calibration, axes["force"])
        axes["force"].set(xlabel="time since touch (µs)", ylabel="contact force (N)")
    if data.curve:
        _draw_series(calibration, "curve", axes["force"], axes["curve"])
        axes["force"].set(xlabel="")
        axes["curve"].set(xlabel="time since touch (µs)", ylabel="fit − measured (N)")
        assert calibration.fit.touch
        inside = 1e6 * (data.curve.x[contact_rows(data.curve.y)] - calibration.fit.touch.value)
        margin = 0.3 * np.ptp(inside)
        for one in (axes["force"], axes["curve"]):
            one.set_xlim(inside[0] - margin, inside[-1] + margin)
    if data.sized:
        figures.legend_below(figure, axes["force"], columns=3 if len(columns) == 1 else 4)
    return figure


def _laws(calibration: Calibration) -> list[tuple[Any, bool, figures.Look]]:
    """The laws compared, and the fit in front of them: whether it is this one, and its look."""
    best, laws = calibration.fit, []
    for one in (*(one for one in calibration.fits if one is not best), best):
        n, power = one.law.exponent, "Tsuji" if one.law.exponent == 1.5 else "power law"
        look = figures.LOOKS[f"law {one.law.law}" if n == 1.0 else power]
        laws.append((one, one is best, look))
    return laws


def _draw_laws(calibration: Calibration, axes: Axes) -> None:
    touch = calibration.fit.touch
    for one, best, look in _laws(calibration):
        path = calibration.paths[one.title]
        # By the curve's clock, from the touch of the fit in front.
        shift = one.touch.value - touch.value if one.touch and touch else 0.0
        line = {**look.line, "lw": 2.4 if best else 1.2, "alpha": 1.0 if best else 0.8}
        axes.plot(1e6 * (path["time"] + shift), path["force"], **line, label=one.title)


def _draw_series(calibration: Calibration, name: str, above: Axes, below: Axes) -> None:
    """Measured values and the fit's 95 % band; residuals in the band of a new measurement."""
    fit, series, rows = (
        calibration.fit,
        calibration.data.series[name],
        calibration.data.groups[name],
    )
    order = np.argsort(series.x)
    x = 1e6 * (series.x - fit.touch.value) if fit.touch and name == "curve" else series.x
    residuals = fit.residuals[rows] * fit.sigma[rows]
    model, errors = series.y + residuals, fit.coverage * np.nan_to_num(fit.model_errors[rows])
    half = np.hypot(errors, fit.coverage * fit.sigma[rows])
    above.plot(x, series.y, **_DOTS, zorder=0, label="measured")
    low, high = (model - errors)[order], (model + errors)[order]
    above.fill_between(x[order], low, high, color=figures.BLUE, alpha=0.3, label="fit, 95 %")
    below.fill_between(x[order], -half[order], half[order], **_BAND, label="95 %")
    below.plot(x, residuals, **_DOTS)
    below.axhline(0.0, color=figures.BLACK, lw=0.8)
    below.legend(loc="upper right", fontsize=9)


def _draw_targets(calibration: Calibration, axes: Axes) -> None:
    targets, widest = calibration.data.targets, 2.5
    for one, best, look in _laws(calibration):
        residuals = one.residuals[: len(targets)]
        widest = max(widest, float(np.abs(residuals).max()))
        marker: dict[str, Any] = {"mfc": look.colour if best else "white", "ms": 7, "mew": 1.5}
        axes.plot(residuals, range(len(targets)), look.marker, color=look.colour, **marker)
    figures.rows(axes, [TARGETS[name][1] for name in targets], band=1.96)
    axes.set(xlabel="(fit − target) / σ; band: 95 %", xlim=(-1.15 * widest, 1.15 * widest))
