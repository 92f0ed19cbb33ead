"""The pictures: curves over time, force over compression, energies, S and COR, the animation.

All of them draw the same columns (`impact.py`), so a case is shown by giving these new data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from bokeh.events import MouseMove
from bokeh.models import (
    ColumnDataSource,
    CustomJSTickFormatter,
    Div,
    Label,
    Range1d,
    Slider,
    Toggle,
)
from bokeh.plotting import figure

from golf_scenarios.explore.impact import Impact, nice
from golf_scenarios.explore.parts import STYLE, script

#: The colours of all figures (golf_scenarios.report.figures), without matplotlib.
BLUE, ORANGE, GREEN, SKY, VERMILION = "#0072B2", "#E69F00", "#009E73", "#56B4E9", "#D55E00"

#: Of the animation: width to height of what it shows, and its height in ball diameters.
ASPECT, DIAMETERS = 7.0, 1.35


class Pictures:
    """The figures of one page, by name in `figures`.

    Args:
        pins: curves of the pinned cases: columns as of the present case, lists of arrays.
    """

    def __init__(self, pins: ColumnDataSource) -> None:
        self.path = ColumnDataSource(name="path")
        self.pins = pins
        self.swept = ColumnDataSource(
            {"x": [], "smash_factor": [], "coefficient_of_restitution": []}, name="swept"
        )
        self.here = ColumnDataSource({"x": [], "y": []})
        self.time, self.force = Range1d(0, 1), Range1d(0, 1)
        # What the cursor shows is the browser's own business: it isn't sent to the server.
        self.cursor = ColumnDataSource(name="cursor", syncable=False)
        self.words = Div(name="words", syncable=False, stylesheets=[STYLE])
        self.scrub = Slider(
            name="scrub",
            **{"start": 0.0, "end": 1.0, "step": 0.001, "value": 0.42},
            title=None,
            html_attributes={"aria-label": "Time, from before touch to after separation"},
            show_value=False,
            syncable=False,
            stylesheets=[STYLE],
            sizing_mode="stretch_width",
        )
        self.play = Toggle(
            name="play", label="▶ Play", syncable=False, stylesheets=[STYLE], width=80
        )
        self.peak = _note(text_align="center", text_baseline="bottom", y_offset=3)
        self.area = _note(text_baseline="top")
        self.figures = {
            "force": self._force(),
            "loop": self._loop(),
            "energies": self._energies(),
            "velocities": self._bodies("velocity", "Velocities", "m/s", 1.0),
            "positions": self._bodies("position", "Positions", "mm", 1e-3),
            "sweep": self._sweep(),
            "animation": self._animation(),
        }
        move = script(
            "cursor", path=self.path, cursor=self.cursor, scrub=self.scrub, words=self.words
        )
        self.move = move
        self.scrub.js_on_change("value", move)
        self.path.js_on_change("data", move)
        self.play.js_on_change("active", script("play", scrub=self.scrub))

    # What they show

    def show(self, impact: Impact, speed: tuple[str, float], pinned_end: float) -> None:
        """Draw a case.

        Args:
            impact: the case.
            speed: unit of speeds, and its number in 1 m/s.
            pinned_end: the end of the longest pinned curve, s.
        """
        unit, factor = speed
        path, metrics = impact.path, impact.metrics
        shown = {f"{body}_shown": path[f"{body}_velocity"] * factor for body in ("club", "ball")}
        self.path.data = {**path, **shown}
        if not self.cursor.data:
            self.cursor.data = {name: array[:1] for name, array in self.path.data.items()}
        end = max(float(path["time"][-1]), pinned_end)
        self.time.update(start=-0.1 * end, end=end)
        self.figures["velocities"].yaxis.axis_label = f"velocity ({unit})"
        forces = [metrics["max_force"], *map(np.max, self.pins.data["force"])]
        squeezes = [metrics["max_compression"], *map(np.max, self.pins.data["compression"])]
        self.force.end = nice(1.12 * max(forces))
        self.figures["loop"].x_range.end = nice(1.05 * max(squeezes))
        for name, columns in (
            ("velocities", ("club_shown", "ball_shown")),
            ("positions", ("club_position", "ball_position")),
        ):
            pinned = [array for column in columns for array in self.pins.data[column]]
            _fit(self.figures[name].y_range, [*(self.path.data[c] for c in columns), *pinned])
        energy = metrics["kinetic_energy_initial"]
        self.figures["energies"].y_range.end = nice(1.02 * energy)
        self.peak.update(
            x=metrics["time_of_max_force"],
            y=metrics["max_force"],
            text=f"{metrics['max_force']:.0f} N" if impact.touched else "",
        )
        self.area.update(
            x=0.03 * self.figures["loop"].x_range.end,
            y=0.97 * self.force.end,
            text=_loop_words(impact),
        )
        height = DIAMETERS * impact.values["ball_diameter"]
        animation = self.figures["animation"]
        animation.y_range.update(start=-0.5 * height, end=0.5 * height)
        animation.x_range.update(start=-0.28 * ASPECT * height, end=0.72 * ASPECT * height)

    def show_sweep(self, swept: Mapping[str, Any], label: str, scale: float, here: float) -> None:
        """Draw S and COR over one variable.

        Args:
            swept: `impact.swept`'s.
            label: of the variable, with its unit.
            scale: that unit in SI.
            here: the present value, SI.
        """
        xs = swept["x"] / scale
        self.swept.data = {**swept, "x": xs}
        picture = self.figures["sweep"]
        picture.xaxis.axis_label = label
        picture.x_range.update(start=xs[0], end=xs[-1])
        x = here / scale
        if xs[0] <= x <= xs[-1]:
            names = ("smash_factor", "coefficient_of_restitution")
            ys = [np.interp(x, xs, swept[name]) for name in names]
            self.here.data = {"x": [x, x], "y": ys}
        else:
            self.here.data = {"x": [], "y": []}

    # How they look

    def _force(self) -> Any:
        picture = self._over_time("Contact force", "force (kN)", self.force, 1e3)
        picture.varea("time", 0, "force", source=self.path, fill_color=SKY, fill_alpha=0.35)
        self._pinned(picture, "time", "force")
        picture.line("time", "force", source=self.path, line_color=BLUE, line_width=2.5)
        picture.add_layout(self.peak)
        return self._with_cursor(picture, "force")

    def _loop(self) -> Any:
        ranges = Range1d(0, 1), self.force
        picture = _picture("Force over compression", "compression (mm)", "force (kN)", *ranges)
        _scale(picture.xaxis, 1e-3)
        _scale(picture.yaxis, 1e3)
        picture.patch(
            "compression", "force", source=self.path, color=SKY, fill_alpha=0.35, line_alpha=0
        )
        self._pinned(picture, "compression", "force")
        picture.line("compression", "force", source=self.path, line_color=BLUE, line_width=2.5)
        picture.add_layout(self.area)
        picture.scatter(
            "compression", "force", source=self.cursor, size=9, color=BLUE, line_color="white"
        )
        return self._hovered(picture, "compression", "force")

    def _energies(self) -> Any:
        picture = self._over_time("Where the energy is", "energy (J)", Range1d(0, 1))
        picture.varea_stack(
            ["ball_energy", "spring_energy", "club_energy", "lost_energy"],
            x="time",
            source=self.path,
            color=[BLUE, GREEN, ORANGE, VERMILION],
            fill_alpha=0.75,
            legend_label=["ball", "spring", "club", "lost"],
        )
        picture.legend[0].items.reverse()
        return self._with_cursor(_legend(picture, "center_left"))

    def _bodies(self, what: str, title: str, unit: str, scale: float) -> Any:
        picture = self._over_time(title, f"{what} ({unit})", Range1d(0, 1), scale)
        columns = {
            body: f"{body}_shown" if what == "velocity" else f"{body}_position"
            for body in ("club", "ball")
        }
        self._pinned(picture, "time", columns["club"], "dashed")
        self._pinned(picture, "time", columns["ball"])
        for body, colour, dash in (("club", ORANGE, "dashed"), ("ball", BLUE, "solid")):
            picture.line(
                "time",
                columns[body],
                source=self.path,
                line_color=colour,
                line_dash=dash,
                line_width=2.5,
                legend_label=body,
            )
        return self._with_cursor(_legend(picture, "top_left"), *columns.values())

    def _sweep(self) -> Any:
        picture = _picture("S and COR over", "club speed", "S, COR", Range1d(0, 1), Range1d(0, 2))
        for name, label, colour, dash in (
            ("smash_factor", "S", BLUE, "solid"),
            ("coefficient_of_restitution", "COR", GREEN, "dashed"),
        ):
            picture.line(
                "x",
                name,
                source=self.swept,
                line_color=colour,
                line_dash=dash,
                line_width=2.5,
                legend_label=label,
            )
        picture.scatter("x", "y", source=self.here, size=9, color=BLUE, line_color="white")
        return _legend(picture, "bottom_left")

    def _animation(self) -> Any:
        picture = figure(
            name="animation",
            x_range=Range1d(-1, 1),
            y_range=Range1d(-1, 1),
            **{"sizing_mode": "scale_width", "aspect_ratio": ASPECT, "min_border": 0},
            **{"tools": "", "toolbar_location": None, "outline_line_color": None},
            html_attributes={"role": "img", "aria-label": "Club and ball, to scale"},
        )
        picture.axis.visible = picture.grid.visible = False
        _plain(picture)
        picture.hspan(y=[0], line_color="#888888", line_alpha=0.4, line_dash="dotted")
        picture.hbar(
            y=0,
            height="club_height",
            left="club_back",
            right="club_position",
            source=self.cursor,
            color=ORANGE,
            border_radius={"top_left": 14, "bottom_left": 14, "top_right": 2, "bottom_right": 2},
        )
        picture.ellipse(
            x="ball_middle",
            y=0,
            width="ball_width",
            height="ball_height",
            source=self.cursor,
            fill_color=BLUE,
            fill_alpha=0.85,
            line_color=BLUE,
        )
        return picture

    def _over_time(self, title: str, label: str, y_range: Range1d, scale: float = 1.0) -> Any:
        picture = _picture(title, "time since touch (µs)", label, self.time, y_range)
        _scale(picture.xaxis, 1e-6)
        _scale(picture.yaxis, scale)
        return picture

    def _pinned(self, picture: Any, x: str, y: str, dash: str = "solid") -> None:
        picture.multi_line(
            x, y, source=self.pins, line_color="color", line_width=1.5, line_dash=dash
        )

    def _with_cursor(self, picture: Any, *columns: str) -> Any:
        picture.vspan(x="time", source=self.cursor, line_color="#888888", line_dash="dotted")
        for column in columns:
            colour = ORANGE if column.startswith("club") else BLUE
            picture.scatter(
                "time", column, source=self.cursor, size=9, color=colour, line_color="white"
            )
        return self._hovered(picture, "time", None)

    def _hovered(self, picture: Any, x: str, y: str | None) -> Any:
        models = {"path": self.path, "scrub": self.scrub, "play": self.play, "picture": picture}
        picture.js_on_event(MouseMove, script("hover", **models, x=x, y=y))
        return picture


def _picture(title: str, x_label: str, y_label: str, x_range: Range1d, y_range: Range1d) -> Any:
    picture = figure(
        title=title,
        x_axis_label=x_label,
        y_axis_label=y_label,
        x_range=x_range,
        y_range=y_range,
        tools="box_zoom,reset,save",
        toolbar_location="above",
        sizing_mode="stretch_both",
        **{"min_width": 150, "min_height": 120, "min_border": 2, "outline_line_color": None},
        html_attributes={"role": "img", "aria-label": f"{title}: {y_label} over {x_label}"},
    )
    picture.toolbar.autohide = True
    picture.toolbar.logo = None
    picture.title.text_font_size = "13px"
    picture.axis.axis_label_text_font_size = "11px"
    picture.axis.axis_label_text_font_style = "normal"
    picture.axis.axis_label_standoff = 2
    picture.axis.major_label_text_font_size = "11px"
    picture.axis.minor_tick_line_color = None
    picture.xaxis.ticker.desired_num_ticks = 5
    picture.yaxis.ticker.desired_num_ticks = 5
    _plain(picture)
    return picture


def _plain(picture: Any) -> None:
    """The page shines through; the colours of text, axes and grid are in page.html."""
    picture.background_fill_color = picture.border_fill_color = None


def _scale(axis: Any, unit: float) -> None:
    """Show SI numbers in a unit that has so many SI units."""
    if unit != 1.0:
        code = f"return String(Number((tick / {unit:g}).toPrecision(6)))"
        axis.formatter = CustomJSTickFormatter(code=code)


def _legend(picture: Any, place: str) -> Any:
    picture.legend.update(
        **{"location": place, "padding": 2, "margin": 4, "spacing": 0, "glyph_width": 18},
        **{"label_text_font_size": "11px", "background_fill_alpha": 0, "border_line_alpha": 0},
    )
    return picture


def _note(**place: Any) -> Label:
    return Label(x=0, y=0, text="", text_font_size="12px", **place)


def _loop_words(impact: Impact) -> str:
    metrics = impact.metrics
    lost = metrics["kinetic_energy_initial"] - metrics["kinetic_energy_final"]
    if not impact.touched:
        return "no contact"
    if impact.values["law"] == 2:
        return f"loop's area: {max(lost, 0.0):.2f} J,\nthe energy lost"
    return f"no loop: F = k d.\nThe drag takes {max(lost, 0.0):.2f} J"


def _fit(limits: Range1d, curves: Sequence[np.ndarray]) -> None:
    low, high = min(map(np.min, curves)), max(map(np.max, curves))
    limits.update(start=-nice(-1.05 * low) if low < 0.0 else 0.0, end=nice(1.05 * high))
