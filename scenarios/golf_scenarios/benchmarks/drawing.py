"""Figures of the benchmark."""

from __future__ import annotations

import math

from golf_scenarios.benchmarks.work_precision import DOCUMENT, FMU_ONCE, FMU_STEPPED, Series
from golf_scenarios.report import figures

#: Colour, marker and line of each method: families share a colour, so that no two look alike.
_STYLES = {
    DOCUMENT: (figures.VERMILION, "s", "-"),
    "explicit Euler, Python": (figures.VERMILION, "o", ":"),
    "semi-implicit Euler": (figures.ORANGE, "o", "-"),
    "Störmer–Verlet": (figures.GREEN, "^", "-"),
    "Runge–Kutta 4": (figures.GREEN, "D", "--"),
    "SciPy RK45": (figures.SKY, "v", "-"),
    "SciPy DOP853": (figures.SKY, "P", "--"),
    "SciPy LSODA": (figures.PURPLE, "<", "-"),
    "SciPy Radau": (figures.PURPLE, ">", "--"),
    FMU_STEPPED: (figures.BLUE, ".", "-"),
    FMU_ONCE: (figures.BLACK, "*", ""),
}

#: Errors below a double's resolution are shown there.
_LEAST_ERROR = 5e-17


def run_time_vs_error(series_by_law: dict[int, list[Series]]) -> bytes:
    """The work–precision figure as PNG: both laws side by side, one legend below."""
    figure, both = figures.new_pair("Run time against error: the document's baseline impact")
    figure.set_size_inches(11.0, 7.0)
    for axes, (law, methods) in zip(both, series_by_law.items(), strict=True):
        for series in methods:
            colour, marker, line = _STYLES[series.method]
            points = [
                (max(error, _LEAST_ERROR), 1e6 * seconds)
                for error, seconds in zip(series.errors, series.seconds, strict=True)
                if math.isfinite(error)
            ]
            errors, micro = zip(*points)
            axes.plot(
                errors,
                micro,
                color=colour,
                marker=marker,
                ls=line or "none",
                lw=1.4,
                ms=15 if marker == "*" else 5,
                zorder=5 if marker == "*" else 3,
                label=series.method if law == 1 else None,
            )
        name = "law 1: drag on each body" if law == 1 else "law 2: damper between the bodies"
        axes.set(
            xscale="log",
            yscale="log",
            title=name,
            xlabel="worst error of velocities, contact time, max force (relative)",
            ylabel="wall time per impact (µs)",
        )
        axes.axvline(2.2e-16, color=figures.BLACK, lw=0.8, ls=":")
        axes.annotate(
            "resolution of a double",
            (2.2e-16, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(4, -4),
            textcoords="offset points",
            va="top",
            fontsize=8.5,
        )
    low = min(axes.get_ylim()[0] for axes in both)
    high = max(axes.get_ylim()[1] for axes in both)
    for axes in both:
        axes.set_ylim(low, 3.0 * high)
    figure.legend(loc="outside lower center", ncols=4)
    return figures.png(figure)
