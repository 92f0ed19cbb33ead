"""The figure of a calibration: force over time with the targets on it, and the residuals."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from golf_impact.calibration.contact_law import ContactLaw
from golf_impact.calibration.fitting import Fit
from golf_impact.calibration.targets import TARGETS, Target
from golf_impact.report import figures


def _look(law: ContactLaw) -> figures.Style:
    power = "Tsuji" if law.exponent == 1.5 else "power law"
    return figures.STYLES[f"law {law.law}" if law.exponent == 1.0 else power]


def draw(
    best: Fit, compared: Sequence[tuple[ContactLaw, Fit | str]], targets: Mapping[str, Target]
) -> Figure:
    """The fit in front, the laws compared behind it."""
    figure, (force, off) = figures.new_pair(f"Calibrated: {best.law.title}")
    others = [other for _, other in compared if isinstance(other, Fit) and other is not best]
    for fit in (*others, best):
        time, newton = fit.path["time"], fit.path["force"]
        look = _look(fit.law)
        style: dict[str, Any] = {
            "mfc": look.colour if fit is best else "white",
            "ms": 7,
            "mew": 1.5,
        }
        line = {**look.points, **style, "lw": 2.6 if fit is best else 1.4, "label": fit.law.title}
        force.plot(1e6 * time, 1e-3 * newton, **line, markevery=[int(newton.argmax())])
        residuals = [fit.residuals[name] for name in targets]
        off.plot(residuals, range(len(targets)), look.marker, color=look.colour, **style)
    _targets(force, targets)
    force.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
    figures.add_legend_below(figure, force, columns=4)
    figures.label_rows(off, [TARGETS[name][1] for name in targets], band=1.0)
    widest = max(1.5, *(abs(r) for fit in (best, *others) for r in fit.residuals.values()))
    off.set(xlabel="(model − target) / σ; band: ± 1 σ", xlim=(-1.15 * widest, 1.15 * widest))
    return figure


def _targets(axes: Axes, targets: Mapping[str, Target]) -> None:
    """Time and size of the largest force as a point or a band, the contact's end as a band."""
    black: dict[str, Any] = {"color": figures.BLACK}
    band, point = {**black, "alpha": 0.16, "lw": 0}, {**black, "zorder": 6}
    force, peak, end = (
        (factor * targets[name].value, factor * targets[name].sigma) if name in targets else None
        for name, factor in (("max_force", 1e-3), ("time_of_max_force", 1e6), ("contact_time", 1e6))
    )
    if force and peak:
        point |= {"ms": 4, "capsize": 3}
        axes.errorbar(peak[0], force[0], force[1], peak[1], "o", label="target ± σ", **point)
    elif force:
        axes.axhspan(force[0] - force[1], force[0] + force[1], label="target max force ± σ", **band)
    elif peak:
        label = "target time of max force ± σ"
        axes.axvspan(peak[0] - peak[1], peak[0] + peak[1], label=label, **band)
    if end:
        point |= {"ms": 14, "mew": 2, "capsize": 4, "clip_on": False}
        axes.errorbar(end[0], 0.0, None, end[1], "|", label="target contact time ± σ", **point)
