"""The figure of a calibration: force over time with the targets on it, and the residuals."""

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from golf_scenarios.calibration.contact_law import ContactLaw
from golf_scenarios.calibration.fitting import Fit
from golf_scenarios.calibration.targets import TARGETS, Target
from golf_scenarios.report import figures

_COLOURS = (figures.ORANGE, figures.GREEN, figures.PURPLE, figures.SKY)
_STYLES = ("--", "-.", ":", (0, (5, 1, 1, 1)))
_MARKS = ("s", "^", "D", "v")


def draw(
    found: Fit, compared: Sequence[tuple[ContactLaw, Fit | str]], targets: Mapping[str, Target]
) -> Figure:
    """The fit in front, the laws compared behind it."""
    figure, (force, off) = figures.new_pair(f"Calibrated: {found.law.title}")
    others = [other for _, other in compared if isinstance(other, Fit) and other is not found]
    for other, colour, style in zip(others, _COLOURS, _STYLES):
        _curve(force, other, colour, style, 1.4)
    _curve(force, found, figures.BLUE, "-", 2.6)
    _targets(force, targets)
    force.set(xlabel="time since touch (µs)", ylabel="contact force (kN)", ylim=(0, None))
    handles, labels = force.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    names = list(targets)
    for other, colour, mark in zip(others, _COLOURS, _MARKS):
        _residuals(off, other, names, colour, mark)
    _residuals(off, found, names, figures.BLUE, "o")
    off.axvspan(-1.0, 1.0, color=figures.BLACK, alpha=0.08, lw=0)
    off.axvline(0.0, color=figures.BLACK, lw=1.0)
    off.set_yticks(range(len(names)), [TARGETS[name][1] for name in names])
    off.set(xlabel="(model − target) / σ", ylim=(len(names) - 0.5, -0.5))
    widest = max(abs(r) for fit in (found, *others) for r in fit.residuals.values())
    off.set_xlim(-1.15 * max(widest, 1.5), 1.15 * max(widest, 1.5))
    return figure


def _curve(axes, fit: Fit, colour: str, style, width: float) -> None:
    time, force = fit.path
    micro = [1e6 * t for t in time]
    kilo = [1e-3 * f for f in force]
    axes.plot(micro, kilo, color=colour, ls=style, lw=width, label=fit.law.title)


def _residuals(axes, fit: Fit, names: Sequence[str], colour: str, mark: str) -> None:
    residuals = [fit.residuals[name] for name in names]
    face = colour if mark == "o" else "none"
    axes.plot(residuals, range(len(names)), mark, color=colour, mfc=face, ms=7, mew=1.5)


def _targets(axes, targets: Mapping[str, Target]) -> None:
    """Time and size of the largest force as a point or a band, the contact's end as a band."""
    grey = {"color": figures.BLACK, "alpha": 0.16, "lw": 0}
    force, peak, end = (
        targets.get(name) for name in ("max_force", "time_of_max_force", "contact_time")
    )
    if force and peak:
        axes.errorbar(
            1e6 * peak.value,
            1e-3 * force.value,
            1e-3 * force.sigma,
            1e6 * peak.sigma,
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
