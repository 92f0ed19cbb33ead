"""The pictures: curves over time, force over compression, energies, S and COR, the animation.

All of them draw the same columns (`impact.py`), so a case is shown by giving these new data.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from bokeh import models
from bokeh.events import MouseMove
from bokeh.plotting import figure

from golf_impact.explore.impact import SWEPT_METRICS, Impact, nice
from golf_impact.explore.parts import STYLED, WIDE, aria, script
from golf_impact.report.styles import BLUE, GREEN, ORANGE, SKY, VERMILION

#: Of the animation: width to height of what it shows, and its height in ball diameters.
ASPECT, DIAMETERS = 7.0, 1.35

#: Units in which SI numbers are shown along axes, each with its SI units.
_UNITS = {"µs": 1e-6, "mm": 1e-3, "kN": 1e3}

_DOT: dict[str, Any] = {"size": 9, "line_color": "white"}


class Pictures:
    """The figures of one page, by name in `figures`.

    Args:
        pins: curves of the pinned cases: columns as of the present case, lists of arrays.
    """

    def __init__(self, pins: models.ColumnDataSource) -> None:
        self.path, self.pins = models.ColumnDataSource(name="path"), pins
        self.swept = models.ColumnDataSource(
            {name: [] for name in ("x", *SWEPT_METRICS)}, name="swept"
        )
        self.here = models.ColumnDataSource({"x": [], "y": []})
        self.time, self.force = models.Range1d(0, 1), models.Range1d(0, 1)
        # What the cursor shows is the browser's own business: it isn't sent to the server.
        self.cursor = models.ColumnDataSource(name="cursor", syncable=False)
        self.words = models.Div(name="words", syncable=False, **STYLED)
        self.scrub = models.Slider(
            **{"name": "scrub", "start": 0.0, "end": 1.0, "step": 0.001, "value": 0.42},
            **{"title": None, "show_value": False, "syncable": False, **WIDE},
            **aria("Time, from before touch to after separation"),
        )
        self.play = models.Toggle(name="play", label="▶ Play", syncable=False, width=80, **STYLED)
        middle: dict[str, Any] = {"text_align": "center", "text_baseline": "bottom"}
        self.peak = models.Label(x=0, y=0, text="", y_offset=3, **middle)
        self.area = models.Label(x=0, y=0, text="", text_baseline="top")
        self.figures = {
            "force": self._force(),
            "loop": self._loop(),
            "energies": self._energies(),
            "velocities": self._bodies("Velocities", "velocity (m/s)", "shown"),
            "positions": self._bodies("Positions", "position (mm)", "position"),
            "sweep": self._sweep(),
            "animation": self._animation(),
        }
        for name, picture in self.figures.items():
            picture.name = name
        shown = {"path": self.path, "cursor": self.cursor, "words": self.words}
        self.move = script("cursor", scrub=self.scrub, **shown)
        self.scrub.js_on_change("value", self.move)
        self.path.js_on_change("data", self.move)
        self.play.js_on_change("active", script("play", scrub=self.scrub))

    # What they show

    def show(self, impact: Impact, speed: tuple[str, float], pinned_end: float) -> None:
        """Draw a case, with room for pinned curves to this end (s).

        Speeds are shown in a unit, given with its number in 1 m/s.
        """
        unit, factor = speed
        path, metrics, figures = impact.path, impact.metrics, self.figures
        shown = {f"{body}_shown": path[f"{body}_velocity"] * factor for body in ("club", "ball")}
        self.path.data = {**path, **shown}
        if not self.cursor.data:
            self.cursor.data = {name: array[:1] for name, array in self.path.data.items()}
        end = max(float(path["time"][-1]), pinned_end)
        self.time.update(start=-0.1 * end, end=end)
        figures["velocities"].yaxis.axis_label = f"velocity ({unit})"
        most = metrics["max_force"]
        forces = [most, *map(np.max, self.pins.data["force"])]
        self.force.end = nice(1.12 * max(forces))
        squeezes = [metrics["max_compression"], *map(np.max, self.pins.data["compression"])]
        figures["loop"].x_range.end = nice(1.05 * max(squeezes))
        for name, what in (("velocities", "shown"), ("positions", "position")):
            columns = f"club_{what}", f"ball_{what}"
            pinned = [array for column in columns for array in self.pins.data[column]]
            curves = [*(self.path.data[column] for column in columns), *pinned]
            low, high = min(map(np.min, curves)), max(map(np.max, curves))
            low = -nice(-1.05 * low) if low < 0.0 else 0.0
            figures[name].y_range.update(start=low, end=nice(1.05 * high))
        figures["energies"].y_range.end = nice(1.02 * metrics["kinetic_energy_initial"])
        words = f"{most:.0f} N" if impact.touched else ""
        self.peak.update(x=metrics["time_of_max_force"], y=most, text=words)
        x, y = 0.03 * figures["loop"].x_range.end, 0.97 * self.force.end
        self.area.update(x=x, y=y, text=_loop_words(impact))
        height = DIAMETERS * impact.values["ball_diameter"]
        width = ASPECT * height
        figures["animation"].y_range.update(start=-0.5 * height, end=0.5 * height)
        figures["animation"].x_range.update(start=-0.28 * width, end=0.72 * width)

    def show_sweep(self, swept: Mapping[str, Any], label: str, scale: float, here: float) -> None:
        """Draw `impact.swept`'s S and COR over one variable, and its present value (SI).

        The variable is shown in a unit that has so many SI units; the label names it.
        """
        x, xs = here / scale, swept["x"] / scale
        self.swept.data = {**swept, "x": xs}
        picture = self.figures["sweep"]
        picture.xaxis.axis_label = label
        picture.x_range.update(start=xs[0], end=xs[-1])
        points = [(x, np.interp(x, xs, swept[name])) for name in SWEPT_METRICS]
        if not xs[0] <= x <= xs[-1]:
            points = []
        self.here.data = {"x": [x for x, _ in points], "y": [y for _, y in points]}

    # How they look

    def _force(self) -> Any:
        picture = self._over_time("Contact force", "force (kN)", y_range=self.force)
        picture.varea("time", 0, "force", source=self.path, fill_color=SKY, fill_alpha=0.35)
        self._pinned(picture, "time", "force")
        _line(picture, self.path, "time", "force", BLUE)
        picture.add_layout(self.peak)
        return self._with_cursor(picture, "force")

    def _loop(self) -> Any:
        columns = "compression", "force"
        labels = "compression (mm)", "force (kN)"
        picture = _picture("Force over compression", *labels, y_range=self.force)
        picture.patch(*columns, source=self.path, color=SKY, fill_alpha=0.35, line_alpha=0)
        self._pinned(picture, *columns)
        _line(picture, self.path, *columns, BLUE)
        picture.add_layout(self.area)
        picture.scatter(*columns, source=self.cursor, color=BLUE, **_DOT)
        return self._hovered(picture, *columns)

    def _energies(self) -> Any:
        picture = self._over_time("Where the energy is", "energy (J)")
        colours = {"ball": BLUE, "spring": GREEN, "club": ORANGE, "lost": VERMILION}
        columns, names = [f"{name}_energy" for name in colours], list(colours)
        look = {"color": list(colours.values()), "fill_alpha": 0.75, "legend_label": names}
        picture.varea_stack(columns, x="time", source=self.path, **look)
        picture.legend[0].items.reverse()
        picture.legend.location = "center_left"
        return self._with_cursor(picture)

    def _bodies(self, title: str, label: str, what: str) -> Any:
        picture = self._over_time(title, label)
        club, ball = f"club_{what}", f"ball_{what}"
        self._pinned(picture, "time", club, "dashed")
        self._pinned(picture, "time", ball)
        _line(picture, self.path, "time", club, ORANGE, "dashed", legend_label="club")
        _line(picture, self.path, "time", ball, BLUE, legend_label="ball")
        picture.legend.location = "top_left"
        return self._with_cursor(picture, club, ball)

    def _sweep(self) -> Any:
        both = models.Range1d(0, 2)
        picture = _picture("S and COR over", "club speed", "S, COR", y_range=both)
        smash, restitution = SWEPT_METRICS
        _line(picture, self.swept, "x", smash, BLUE, legend_label="S")
        _line(picture, self.swept, "x", restitution, GREEN, "dashed", legend_label="COR")
        picture.scatter("x", "y", source=self.here, color=BLUE, **_DOT)
        picture.legend.location = "bottom_left"
        return picture

    def _animation(self) -> Any:
        picture = figure(
            **{"x_range": models.Range1d(-1, 1), "y_range": models.Range1d(-1, 1)},
            **{"sizing_mode": "scale_width", "aspect_ratio": ASPECT, "min_border": 0},
            **{"tools": "", "toolbar_location": None},
            **aria("Club and ball, to scale", role="img"),
        )
        picture.axis.visible = picture.grid.visible = False
        picture.hspan(y=[0], line_color="#888888", line_alpha=0.4, line_dash="dotted")
        club: dict[str, Any] = {"left": "club_back", "right": "club_position"}
        back, face = {"top_left": 14, "bottom_left": 14}, {"top_right": 2, "bottom_right": 2}
        club |= {"height": "club_height", "color": ORANGE, "border_radius": {**back, **face}}
        picture.hbar(y=0, source=self.cursor, **club)
        ball: dict[str, Any] = {"x": "ball_middle", "width": "ball_width", "height": "ball_height"}
        ball |= {"fill_color": BLUE, "fill_alpha": 0.85, "line_color": BLUE}
        picture.ellipse(y=0, source=self.cursor, **ball)
        return picture

    def _over_time(self, title: str, label: str, **y_range: Any) -> Any:
        return _picture(title, "time since touch (µs)", label, x_range=self.time, **y_range)

    def _pinned(self, picture: Any, x: str, y: str, dash: str = "solid") -> None:
        look = {"line_color": "color", "line_width": 1.5, "line_dash": dash}
        picture.multi_line(x, y, source=self.pins, **look)

    def _with_cursor(self, picture: Any, *columns: str) -> Any:
        picture.vspan(x="time", source=self.cursor, line_color="#888888", line_dash="dotted")
        for column in columns:
            colour = ORANGE if column.startswith("club") else BLUE
            picture.scatter("time", column, source=self.cursor, color=colour, **_DOT)
        return self._hovered(picture, "time", None)

    def _hovered(self, picture: Any, x: str, y: str | None) -> Any:
        used = {"path": self.path, "scrub": self.scrub, "play": self.play, "picture": picture}
        picture.js_on_event(MouseMove, script("hover", **used, x=x, y=y))
        return picture


def _picture(title: str, x_label: str, y_label: str, **ranges: models.Range1d) -> Any:
    """A picture whose ranges are from 0 to 1 where none is given."""
    picture = figure(
        **{"title": title, "x_axis_label": x_label, "y_axis_label": y_label},
        **{"x_range": models.Range1d(0, 1), "y_range": models.Range1d(0, 1), **ranges},
        sizing_mode="stretch_both",
        **{"tools": "box_zoom,reset,save", "toolbar_location": "above"},
        **{"min_width": 150, "min_height": 120, "min_border": 2},
        **aria(f"{title}: {y_label} over {x_label}", role="img"),
    )
    for axes, label in ((picture.xaxis, x_label), (picture.yaxis, y_label)):
        if unit := _UNITS.get(label.rpartition("(")[2].removesuffix(")")):
            code = f"return String(Number((tick / {unit:g}).toPrecision(6)))"
            axes.formatter = models.CustomJSTickFormatter(code=code)
    return picture


def _line(
    picture: Any, data: Any, x: str, y: str, colour: str, dash: str = "solid", **label: str
) -> None:
    look = {"line_color": colour, "line_dash": dash, "line_width": 2.5, **label}
    picture.line(x, y, source=data, **look)


def _loop_words(impact: Impact) -> str:
    metrics = impact.metrics
    lost = max(metrics["kinetic_energy_initial"] - metrics["kinetic_energy_final"], 0.0)
    if not impact.touched:
        return "no contact"
    if impact.values["law"] == 2:
        return f"loop's area: {lost:.2f} J,\nthe energy lost"
    return f"no loop: F = k d.\nThe drag takes {lost:.2f} J"
