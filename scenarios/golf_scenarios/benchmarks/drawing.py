"""Figures of the benchmark."""

from __future__ import annotations

import math

from golf_scenarios.benchmarks.work_precision import FMU_ONCE, Series
from golf_scenarios.report import figures


def run_time_vs_error(series_by_law: dict[int, list[Series]]) -> bytes:
    """The work–precision figure as PNG: both laws side by side, one legend below."""
    figure, both = figures.new_pair("Run time against error: the document's baseline impact")
    figure.set_size_inches(11.0, 6.6)
    for axes, (law, methods) in zip(both, series_by_law.items(), strict=True):
        for series in methods:
            points = [
                (error, 1e6 * seconds)
                for error, seconds in zip(series.errors, series.seconds, strict=True)
                if math.isfinite(error)
            ]
            once = series.method == FMU_ONCE
            axes.plot(
                *zip(*points),
                **figures.LOOKS[series.method].points,
                lw=1.4,
                ms=15 if once else 5,
                zorder=5 if once else 3,
                label=series.method,
            )
        figures.run_time_axes(axes, "worst error of velocities, contact time, max force (relative)")
        words = "drag on each body" if law == 1 else "damper between the bodies"
        axes.set_title(f"law {law}: {words}", fontsize=10.5)
    low, high = zip(*(axes.get_ylim() for axes in both))
    for axes in both:
        axes.set_ylim(min(low), 3.0 * max(high))
    figures.legend_below(figure, both[0], columns=4)
    return figures.png(figure)
