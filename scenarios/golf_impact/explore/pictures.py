"""The figures, empty: `page.js` fills their columns with what `evaluator.py` computes."""

from collections.abc import Iterable, Sequence
from typing import Any

from bokeh import models
from bokeh.plotting import figure
from bokeh.themes import Theme

from golf_impact.explore.evaluator import SWEPT_METRICS
from golf_impact.report.styles import BLUE, GREEN, ORANGE, SKY, VERMILION

#: Styles; the colours of text, axes and grid are CSS variables in page.css.
THEME = Theme(
    json={
        "attrs": {
            "Plot": dict.fromkeys(
                ("background_fill_color", "border_fill_color", "outline_line_color")
            ),
            "Toolbar": {"autohide": True, "logo": None},
            "Axis": {
                "axis_label_text_font_size": "11px",
                "axis_label_text_font_style": "normal",
                "axis_label_standoff": 2,
                "minor_tick_line_color": None,
            },
            "ContinuousTicker": {"desired_num_ticks": 5},
            "Label": {"text_font_size": "12px"},
        }
    }
)

#: Units in which SI numbers are shown along axes, each with its SI units.
_UNITS = {"µs": 1e-6, "mm": 1e-3, "kN": 1e3}

_DOT: dict[str, Any] = {"size": 9, "line_color": "white"}

#: Glyphs that move with the cursor are on a canvas of their own: the rest isn't painted again.
_CURSOR: dict[str, Any] = {"level": "overlay"}


class Pictures:
    """The figures of the page, by name in `figures`.

    Sources: `path` (the present case), `pinned` (a row a pin), `cursor` (one row of the path),
    `swept`, `here`. Ranges have the names that `Evaluator` gives them, by which `page.js` finds
    them.

    Args:
        columns: names of the path's columns.
    """

    def __init__(self, columns: Iterable[str]) -> None:
        columns = tuple(columns)
        named = {"path": columns, "cursor": columns, "pinned": ("color", *columns)}
        named["flight"] = ("distance", "height")
        named["pinned"] += named["flight"]
        named |= {"swept": ("x", *SWEPT_METRICS), "here": ("x", "y")}
        self.sources = {
            name: models.ColumnDataSource(
                {column: [] for column in columns},
                name=f"{name}_path" if name == "flight" else name,
            )
            for name, columns in named.items()
        }
        names = (
            *("time", "force", "compression", "energy", "velocity", "position"),
            *("width", "height", "distance", "altitude"),
        )
        self.ranges = {name: models.Range1d(0, 1, name=f"{name}_range") for name in names}
        self.figures = {
            "animation": self._animation(),
            "force": self._force(),
            "loop": self._loop(),
            "energies": self._energies(),
            "velocities": self._bodies("Velocities", "velocity", "velocity (m/s)", "shown"),
            "positions": self._bodies("Positions", "position", "position (mm)", "position"),
            "sweep": self._sweep(),
            "flight": self._flight(),
        }
        for name, picture in self.figures.items():
            picture.name = name

    def _force(self) -> Any:
        picture = self._over_time("Contact force", "force", "force (kN)")
        path = self.sources["path"]
        picture.varea("time", 0, "force", source=path, fill_color=SKY, fill_alpha=0.35)
        self._pinned(picture, "time", "force")
        _line(picture, path, "time", "force", BLUE)
        middle = {"text_align": "center", "text_baseline": "bottom", "y_offset": 3}
        picture.add_layout(models.Label(name="peak", x=0, y=0, text="", **middle))
        return self._with_cursor(picture)

    def _loop(self) -> Any:
        columns = "compression", "force"
        labels = "compression (mm)", "force (kN)"
        picture = self._picture("Force over compression", columns, labels)
        path = self.sources["path"]
        picture.patch(*columns, source=path, color=SKY, fill_alpha=0.35, line_alpha=0)
        self._pinned(picture, *columns)
        _line(picture, path, *columns, BLUE)
        area = {"text_baseline": "top", "x_offset": 6, "y_offset": -4}
        picture.add_layout(models.Label(name="area", x=0, y=0, text="", **area))
        picture.scatter(*columns, source=self.sources["cursor"], color=BLUE, **_DOT, **_CURSOR)
        return picture

    def _energies(self) -> Any:
        picture = self._over_time("Where the energy is", "energy", "energy (J)")
        colours = {"ball": BLUE, "spring": GREEN, "club": ORANGE, "lost": VERMILION}
        columns = [f"{name}_energy" for name in colours]
        style = {"color": list(colours.values()), "fill_alpha": 0.75}
        picture.varea_stack(columns, x="time", source=self.sources["path"], **style)
        # The stack fills at least two thirds of the height: the text is dark in both themes.
        entries = [(name, colour, "solid") for name, colour in reversed(colours.items())]
        _add_legend(picture, entries, top=0.66, line_width=11, text_color="#1c2430")
        return self._with_cursor(picture)

    def _bodies(self, title: str, range_: str, label: str, what: str) -> Any:
        picture = self._over_time(title, range_, label)
        club, ball, path = f"club_{what}", f"ball_{what}", self.sources["path"]
        self._pinned(picture, "time", club, "dashed")
        self._pinned(picture, "time", ball)
        _line(picture, path, "time", club, ORANGE, "dashed")
        _line(picture, path, "time", ball, BLUE)
        _add_legend(picture, [("club", ORANGE, "dashed"), ("ball", BLUE, "solid")])
        return self._with_cursor(picture, club, ball)

    def _sweep(self) -> Any:
        picture = self._picture("S and COR over", ("", ""), ("club speed", "S, COR"))
        picture.y_range = models.Range1d(0, 2)
        smash, restitution = SWEPT_METRICS
        swept = self.sources["swept"]
        _line(picture, swept, "x", smash, BLUE)
        _line(picture, swept, "x", restitution, GREEN, "dashed")
        picture.scatter("x", "y", source=self.sources["here"], color=BLUE, **_DOT)
        _add_legend(picture, [("S", BLUE, "solid"), ("COR", GREEN, "dashed")], top=0.24)
        # The page has the title, with the choice of the variable in it.
        picture.title.visible = False
        return picture

    def _flight(self) -> Any:
        columns = "distance", "height"
        labels = "distance (m)", "height (m)"
        picture = self._picture("Flight", ("distance", "altitude"), labels)
        self._pinned(picture, *columns)
        _line(picture, self.sources["flight"], *columns, BLUE)
        return picture

    def _animation(self) -> Any:
        picture = figure(
            **{"x_range": self.ranges["width"], "y_range": self.ranges["height"]},
            **{"sizing_mode": "stretch_both", "match_aspect": False, "min_border": 0},
            **{"tools": "", "toolbar_location": None},
            html_attributes={"aria-label": "Club and ball, to scale", "role": "img"},
        )
        picture.axis.visible = picture.grid.visible = False
        picture.hspan(y=[0], line_color="#888888", line_alpha=0.4, line_dash="dotted")
        club: dict[str, Any] = {"left": "club_back", "right": "club_position"}
        back, face = {"top_left": 14, "bottom_left": 14}, {"top_right": 2, "bottom_right": 2}
        club |= {"height": "club_height", "color": ORANGE, "border_radius": {**back, **face}}
        picture.hbar(y=0, source=self.sources["cursor"], **club, **_CURSOR)
        ball: dict[str, Any] = {"x": "ball_middle", "width": "ball_width", "height": "ball_height"}
        ball |= {"fill_color": BLUE, "fill_alpha": 0.85, "line_color": BLUE}
        picture.ellipse(y=0, source=self.sources["cursor"], **ball, **_CURSOR)
        return picture

    def _over_time(self, title: str, range_: str, label: str) -> Any:
        return self._picture(title, ("time", range_), ("time since touch (µs)", label))

    def _pinned(self, picture: Any, x: str, y: str, dash: str = "solid") -> None:
        style = {"line_color": "color", "line_width": 1.5, "line_dash": dash}
        picture.multi_line(x, y, source=self.sources["pinned"], **style)

    def _with_cursor(self, picture: Any, *columns: str) -> Any:
        cursor = self.sources["cursor"]
        picture.vspan(x="time", source=cursor, line_color="#888888", line_dash="dotted", **_CURSOR)
        for column in columns:
            colour = ORANGE if column.startswith("club") else BLUE
            picture.scatter("time", column, source=cursor, color=colour, **_DOT, **_CURSOR)
        return picture

    def _picture(self, title: str, ranges: tuple[str, str], labels: tuple[str, str]) -> Any:
        """A picture with these ranges, or with new ones where they have no name."""
        x_range, y_range = (self.ranges.get(name) or models.Range1d(0, 1) for name in ranges)
        picture = figure(
            **{"title": title, "x_range": x_range, "y_range": y_range},
            **{"x_axis_label": labels[0], "y_axis_label": labels[1]},
            # A finger that is swiped over a picture scrolls the page: nothing is active on drag.
            **{"tools": "box_zoom,reset,save", "active_drag": None, "toolbar_location": "above"},
            **{"sizing_mode": "stretch_both", "min_width": 150, "min_height": 120, "min_border": 2},
            html_attributes={"aria-label": f"{title}: {labels[1]} over {labels[0]}", "role": "img"},
        )
        for axes, label in ((picture.xaxis, labels[0]), (picture.yaxis, labels[1])):
            if unit := _UNITS.get(label.rpartition("(")[2].removesuffix(")")):
                code = f"return String(Number((tick / {unit:g}).toPrecision(6)))"
                axes.formatter = models.CustomJSTickFormatter(code=code)
        return picture


def _line(picture: Any, data: Any, x: str, y: str, colour: str, dash: str = "solid") -> None:
    picture.line(x, y, source=data, line_color=colour, line_dash=dash, line_width=2.5)


def _add_legend(
    picture: Any,
    entries: Sequence[tuple[str, str, str]],
    top: float = 0.9,
    line_width: float = 2.5,
    text_color: str = "#7a828c",
) -> None:
    """Name, colour and dash of each line, from `top` (of the height) downwards.

    Drawn by glyphs: Bokeh's Legend is an HTML element whose size the browser computes at every
    paint, which takes a third of a slider's step.
    """
    picture.extra_x_ranges = {"legend": models.Range1d(0, 1)}
    picture.extra_y_ranges = {"legend": models.Range1d(0, 1)}
    place = {"x_range_name": "legend", "y_range_name": "legend"}
    y = [top - 0.14 * n for n in range(len(entries))]
    texts, colours, dashes = (list(column) for column in zip(*entries))
    line = {"line_color": colours, "line_dash": dashes, "line_width": line_width}
    picture.segment(x0=0.03, y0=y, x1=0.11, y1=y, **line, **place)
    text = {"text_color": text_color, "text_font_size": "11px", "text_baseline": "middle"}
    picture.text(x=0.13, y=y, text=texts, **text, **place)
