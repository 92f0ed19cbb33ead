"""The read-outs: what came of the impact, what each number means, and what is published of it."""

from __future__ import annotations

from html import escape

from golf_impact.explore.cases import Example
from golf_impact.explore.impact import Impact

#: Metric, label, value and meaning; all numbers are in the units that are shown.
_ROWS = (
    ("smash_factor", "S", "{:.4f}", "smash factor: ball / club speed"),
    ("coefficient_of_restitution", "COR", "{:.4f}", "speed apart / speed together"),
    (
        *("energy_efficiency", "E", "{:.2%}"),
        "energy: ball {ball_energy_share:.1%}, club {club_energy_share:.1%}",
    ),
    ("ball_velocity", "Ball", "{:.2f} {speed}", "speed afterwards"),
    ("club_velocity", "Club", "{:.2f} {speed}", "speed afterwards"),
    ("contact_time", "Contact", "{:.1f} µs", "touch to separation"),
    ("max_force", "Peak force", "{:.0f} N", "{time_of_max_force:.1f} µs after touch"),
    ("compression_over_diameter", "Squeeze", "{:.2%}", "of the diameter: {max_compression:.2f} mm"),
    ("contact_displacement_over_diameter", "Way", "{:.3f} Ø", "of the ball while in contact"),
    (
        *("momentum_final", "Momentum", "{momentum_kept:.2%}"),
        "kept: {momentum_final:.3f} of {momentum_initial:.3f} N·s",
    ),
)

#: Units of the published numbers, where it isn't clear.
_UNITS = {
    **{"ball_velocity": " m/s", "club_velocity": " m/s", "contact_time": " µs", "max_force": " N"},
    **{"energy_efficiency": " %", "momentum_final": " N·s"},
}


def table(impact: Impact, example: Example | None, unit: str, factor: float) -> str:
    """The read-outs as HTML, with what is published of the example that the case may be.

    Speeds are shown in a unit of which 1 m/s has so many.
    """
    scales = {"ball_velocity": factor, "club_velocity": factor, "max_compression": 1e3}
    scales |= {"contact_time": 1e6, "time_of_max_force": 1e6}
    m = impact.metrics | {name: impact.metrics[name] * scale for name, scale in scales.items()}
    lines = []
    for metric, label, value, meaning in _ROWS:
        printed = ""
        if example and metric in example.printed:
            text = f"{example.printed[metric]}{_UNITS.get(metric, '')}"
            printed = f"<small>{escape(example.source)}: {escape(text)}</small>"
        lines.append(
            f'<tr data-metric="{metric}"><th scope="row">{label}'
            f"<small>{escape(meaning.format_map(m))}</small></th>"
            f"<td>{escape(value.format(m[metric], speed=unit, **m))}{printed}</td></tr>"
        )
    return f'<table class="results">{"".join(lines)}</table>'


def state(impact: Impact) -> str:
    """What there is to say where no ordinary impact comes about, or ""."""
    if not impact.touched:
        return "The club never touches the ball: it must be faster than the ball is."
    if not impact.separated:
        return "Club and ball never part: the drag stops them in contact (an answer of law 1)."
    return ""
