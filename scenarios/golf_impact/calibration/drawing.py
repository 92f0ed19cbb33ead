"""The figure of a calibration: data and fit above, residuals below, each with its 95 % band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from golf_impact.calibration.fit import Fit
from golf_impact.calibration.measurements import TARGETS
from golf_impact.calibration.model import ContactLaw
from golf_impact.calibration.pulse import contact_rows
from golf_impact.report import figures

if TYPE_CHECKING:
    from golf_impact.calibration.calibration import Calibration

_BAND: dict[str, Any] = {"color": figures.BLACK, "alpha": 0.14, "lw": 0}
_DOTS: dict[str, Any] = {"color": figures.BLACK, "marker": ".", "ms": 4, "ls": "", "alpha": 0.6}


def _style(law: ContactLaw) -> figures.Look:
    power = "Tsuji" if law.exponent == 1.5 else "power law"
    return figures.LOOKS[f"law {law.law}" if law.exponent == 1.0 else power]


def draw(calibration: Calibration) -> Figure:
    """A column for the force, one for COR over speed, one for the scalars' residuals."""
    data = calibration.data
    columns = []
    if data.sized:
        columns.append(("force", "force off" if data.curve is not None else "force"))
    if data.cor_speeds is not None:
        columns.append(("cor", "cor off"))
    if data.targets:
        columns.append(("targets", "targets"))
    size = (max(7.2, 5.4 * len(columns)), 5.6)
    figure, axes = figures.plt.subplot_mosaic(
        [list(row) for row in zip(*columns)], figsize=size, height_ratios=(2.2, 1.0)
    )
    title = f"Calibrated: {calibration.fit.title}"
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    if "force" in axes:
        _draw_forces(calibration, axes["force"])
    if data.curve is not None:
        _draw_curve(calibration, axes["force"], axes["force off"])
    if data.cor_speeds is not None:
        _draw_line(calibration, axes["cor"], axes["cor off"])
    if data.targets:
        _draw_scalars(calibration, axes["targets"])
    if "force" in axes:
        figures.legend_below(figure, axes["force"], columns=3 if len(columns) == 1 else 4)
    return figure


def _fits(calibration: Calibration) -> list[Fit]:
    """The laws compared, and the fit in front of them."""
    return [*(one for one in calibration.fits if one is not calibration.fit), calibration.fit]


def _draw_forces(calibration: Calibration, axes: Axes) -> None:
    shift = calibration.data.curve is not None
    for one in _fits(calibration):
        best, look = one is calibration.fit, _style(one.law)
        path = calibration.paths[one.title]
        # By the curve's clock, from the touch of the fit in front.
        time = path["time"] + (one.touch[0] - calibration.fit.touch[0] if shift else 0.0)
        line = {**look.line, "lw": 2.4 if best else 1.2, "alpha": 1.0 if best else 0.8}
        axes.plot(1e6 * time, 1e-3 * path["force"], **line, label=one.title)
    _draw_targets(calibration, axes)
    axes.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))


def _draw_curve(calibration: Calibration, above: Axes, below: Axes) -> None:
    fit, curve = calibration.fit, calibration.data.curve
    assert curve is not None
    rows = calibration.data.groups["curve"]
    time = 1e6 * (curve.x - fit.touch[0])
    above.plot(time, 1e-3 * curve.y, **_DOTS, zorder=0, label="measured")
    above.set_ylim(-0.05 * 1e-3 * curve.y.max(), None)
    half = fit.coverage * np.hypot(fit.sigma[rows], np.nan_to_num(fit.model_errors[rows]))
    below.fill_between(time, -half, half, **_BAND, label="95 %")
    below.plot(time, fit.model[rows] - curve.y, **_DOTS)
    inside = contact_rows(curve.y)
    lasting = time[inside[-1]] - time[inside[0]]
    left, right = time[inside[0]] - 0.3 * lasting, time[inside[-1]] + 0.3 * lasting
    for axes in (above, below):
        axes.set_xlim(max(left, time[0]), min(right, time[-1]))
    _finish_residuals(below, "time since touch (µs)", "fit − measured (N)")
    above.set_xlabel("")


def _draw_line(calibration: Calibration, above: Axes, below: Axes) -> None:
    fit, speeds = calibration.fit, calibration.data.cor_speeds
    assert speeds is not None
    rows = calibration.data.groups["cor_speeds"]
    order = np.argsort(speeds.x)
    x, sigma = speeds.x[order], fit.sigma[rows][order]
    model, errors = fit.model[rows][order], np.nan_to_num(fit.model_errors[rows][order])
    color = figures.BLUE
    above.errorbar(speeds.x, speeds.y, fit.sigma[rows], **{**_DOTS, "capsize": 2})
    above.fill_between(
        x, model - fit.coverage * errors, model + fit.coverage * errors, color=color, alpha=0.2
    )
    above.plot(x, model, color=color, label="COR line, 95 % band")
    above.set(ylabel="COR")
    above.legend(loc="upper right")
    half = fit.coverage * np.hypot(sigma, errors)
    below.fill_between(x, -half, half, **_BAND, label="95 %")
    below.plot(speeds.x, fit.model[rows] - speeds.y, **{**_DOTS, "ms": 6})
    _finish_residuals(below, "approach speed (m/s)", "fit − measured")


def _finish_residuals(axes: Axes, x: str, y: str) -> None:
    axes.axhline(0.0, color=figures.BLACK, lw=0.8)
    axes.set(xlabel=x, ylabel=y)
    axes.legend(loc="upper right", fontsize=9)


def _draw_scalars(calibration: Calibration, axes: Axes) -> None:
    names = list(calibration.data.targets)
    widest = 2.5
    for one in _fits(calibration):
        best, look = one is calibration.fit, _style(one.law)
        face = look.colour if best else "white"
        residuals = one.residuals[: len(names)]
        widest = max(widest, float(np.abs(residuals).max()))
        marker: dict[str, Any] = {"color": look.colour, "mfc": face, "ms": 7, "mew": 1.5}
        axes.plot(residuals, range(len(names)), look.marker, **marker)
    figures.rows(axes, [TARGETS[name][1] for name in names], band=1.96)
    axes.set(xlabel="(fit − target) / σ; band: 95 %", xlim=(-1.15 * widest, 1.15 * widest))


def _draw_targets(calibration: Calibration, axes: Axes) -> None:
    """Time and size of the largest force as a point or a band, the contact's end as a mark."""
    targets = calibration.data.targets
    point: dict[str, Any] = {"color": figures.BLACK, "zorder": 6}
    force, peak, end = (
        (factor * targets[name].value, factor * targets[name].sigma) if name in targets else None
        for name, factor in (("max_force", 1e-3), ("time_of_max_force", 1e6), ("contact_time", 1e6))
    )
    if force and peak:
        style = {**point, "ms": 4, "capsize": 3}
        axes.errorbar(peak[0], force[0], force[1], peak[1], "o", label="target ± σ", **style)
    elif force:
        label = "target max force ± σ"
        axes.axhspan(force[0] - force[1], force[0] + force[1], label=label, **_BAND)
    elif peak:
        label = "target time of max force ± σ"
        axes.axvspan(peak[0] - peak[1], peak[0] + peak[1], label=label, **_BAND)
    if end:
        style = {**point, "ms": 14, "mew": 2, "capsize": 4, "clip_on": False}
        axes.errorbar(end[0], 0.0, None, end[1], "|", label="target contact time ± σ", **style)
