"""The read-outs: what came of the impact, what each number means, and what is published of it."""

from __future__ import annotations

from html import escape

from golf_scenarios.explore.cases import Example
from golf_scenarios.explore.impact import Impact


def rows(impact: Impact, unit: str, factor: float) -> list[tuple[str, str, str, str]]:
    """Metric, label, value and meaning, in the order in which they are shown.

    Args:
        impact: the case.
        unit: of speeds.
        factor: that unit's number in 1 m/s.
    """
    m = impact.metrics
    return [
        ("smash_factor", "S", f"{m['smash_factor']:.4f}", "smash factor: ball / club speed"),
        (
            "coefficient_of_restitution",
            "COR",
            f"{m['coefficient_of_restitution']:.4f}",
            "speed apart / speed together",
        ),
        (
            "energy_efficiency",
            "E",
            f"{m['energy_efficiency']:.2%}",
            f"energy: ball {m['ball_energy_share']:.1%}, club {m['club_energy_share']:.1%}",
        ),
        ("ball_velocity", "Ball", f"{m['ball_velocity'] * factor:.2f} {unit}", "speed afterwards"),
        ("club_velocity", "Club", f"{m['club_velocity'] * factor:.2f} {unit}", "speed afterwards"),
        ("contact_time", "Contact", f"{1e6 * m['contact_time']:.1f} µs", "touch to separation"),
        (
            "max_force",
            "Peak force",
            f"{m['max_force']:.0f} N",
            f"{1e6 * m['time_of_max_force']:.1f} µs after touch",
        ),
        (
            "compression_over_diameter",
            "Squeeze",
            f"{m['compression_over_diameter']:.2%}",
            f"of the diameter: {1e3 * m['max_compression']:.2f} mm",
        ),
        (
            "contact_displacement_over_diameter",
            "Way",
            f"{m['contact_displacement_over_diameter']:.3f} Ø",
            "of the ball while in contact",
        ),
        (
            "momentum_final",
            "Momentum",
            f"{m['momentum_kept']:.2%}",
            f"kept: {m['momentum_final']:.3f} of {m['momentum_initial']:.3f} N·s",
        ),
    ]


#: Units of the published numbers, where it isn't clear.
_UNITS = {
    **{"ball_velocity": " m/s", "club_velocity": " m/s", "contact_time": " µs", "max_force": " N"},
    **{"energy_efficiency": " %", "momentum_final": " N·s"},
}


def table(impact: Impact, example: Example | None, unit: str, factor: float) -> str:
    """The read-outs as HTML, with what is published beside them."""
    lines = []
    for metric, label, value, meaning in rows(impact, unit, factor):
        printed = ""
        if example and metric in example.printed:
            text = f"{example.printed[metric]}{_UNITS.get(metric, '')}"
            printed = f"<small>{escape(example.source)}: {escape(text)}</small>"
        lines.append(
            f'<tr data-metric="{metric}"><th scope="row">{label}<small>{escape(meaning)}</small>'
            f"</th><td>{escape(value)}{printed}</td></tr>"
        )
    return f'<table class="results">{"".join(lines)}</table>'


def state(impact: Impact) -> str:
    """What there is to say where no ordinary impact comes about, or ""."""
    if not impact.touched:
        return "The club never touches the ball: it must be faster than the ball is."
    if not impact.separated:
        return "Club and ball never part: the drag stops them in contact (an answer of law 1)."
    return ""
