"""The figure of a calibration: force over time with the targets on it, and the residuals."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from golf_scenarios.calibration.contact_law import ContactLaw
from golf_scenarios.calibration.fitting import Fit
from golf_scenarios.calibration.targets import TARGETS, Target
from golf_scenarios.report import figures


def _look(law: ContactLaw) -> figures.Look:
    if law.exponent == 1.0:
        return figures.LOOKS[f"law {law.law}"]
    return figures.LOOKS["Tsuji" if law.exponent == 1.5 else "power law"]


def draw(
    best: Fit, compared: Sequence[tuple[ContactLaw, Fit | str]], targets: Mapping[str, Target]
) -> Figure:
    """The fit in front, the laws compared behind it."""
    figure, (force, off) = figures.new_pair(f"Calibrated: {best.law.title}")
    others = [other for _, other in compared if isinstance(other, Fit) and other is not best]
    names = list(targets)
    for fit in (*others, best):
        look = _look(fit.law)
        style: dict[str, Any] = {
            "mfc": look.colour if fit is best else "white",
            "ms": 7,
            "mew": 1.5,
        }
        time, newton = (np.array(values) for values in fit.path)
        force.plot(
            1e6 * time,
            1e-3 * newton,
            **look.points,
            **style,
            markevery=[int(newton.argmax())],
            lw=2.6 if fit is best else 1.4,
            label=fit.law.title,
        )
        residuals = [fit.residuals[name] for name in names]
        off.plot(residuals, range(len(names)), look.marker, color=look.colour, **style)
    _targets(force, targets)
    force.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
    figures.legend_below(figure, force, columns=4)
    figures.rows(off, [TARGETS[name][1] for name in names], band=1.0)
    widest = max(1.5, *(abs(r) for fit in (best, *others) for r in fit.residuals.values()))
    off.set(xlabel="(model − target) / σ; band: ± 1 σ", xlim=(-1.15 * widest, 1.15 * widest))
    return figure


def _targets(axes: Axes, targets: Mapping[str, Target]) -> None:
    """Time and size of the largest force as a point or a band, the contact's end as a band."""
    grey: dict[str, Any] = {"color": figures.BLACK, "alpha": 0.16, "lw": 0}
    force, peak, end = (
        targets.get(name) for name in ("max_force", "time_of_max_force", "contact_time")
    )
    if force and peak:
        axes.errorbar(
            *(1e6 * peak.value, 1e-3 * force.value, 1e-3 * force.sigma, 1e6 * peak.sigma),
            "o",
            color=figures.BLACK,
            ms=4,
            capsize=3,
            zorder=6,
            label="target ± σ",
        )
    elif force:
        axes.axhspan(
            1e-3 * (force.value - force.sigma),
            1e-3 * (force.value + force.sigma),
            label="target max force ± σ",
            **grey,
        )
    elif peak:
        axes.axvspan(
            1e6 * (peak.value - peak.sigma),
            1e6 * (peak.value + peak.sigma),
            label="target time of max force ± σ",
            **grey,
        )
    if end:
        axes.errorbar(
            1e6 * end.value,
            0.0,
            xerr=1e6 * end.sigma,
            fmt="|",
            color=figures.BLACK,
            ms=14,
            mew=2,
            capsize=4,
            zorder=6,
            clip_on=False,
            label="target contact time ± σ",
        )
