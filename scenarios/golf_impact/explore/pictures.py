"""The figures, empty: `page.js` fills their columns with what `evaluator.py` computes."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from bokeh import models
from bokeh.plotting import figure
from bokeh.themes import Theme

from golf_impact.explore.evaluator import SWEPT_METRICS

#: Okabe & Ito's colours, which common colour vision deficiencies keep distinct.
BLUE, ORANGE, GREEN, SKY, VERMILION = "#0072B2", "#E69F00", "#009E73", "#56B4E9", "#D55E00"

_CLEAR = ("background_fill_color", "border_fill_color", "outline_line_color")

#: Colours and fonts of text, axes and grid are CSS variables in page.css.
THEME = Theme(
    json={
        "attrs": {
            "Plot": {"toolbar_location": None, **dict.fromkeys(_CLEAR)},
            "Axis": {"axis_label_standoff": 2, "minor_tick_line_color": None},
            "ContinuousTicker": {"desired_num_ticks": 5},
            "Label": {"text_font_size": "11px", "text_baseline": "top"},
        }
    }
)

#: Units in which SI numbers are shown along axes, each with its SI units.
_UNITS = {"µs": 1e-6, "mm": 1e-3, "kN": 1e3}

_GREY: dict[str, Any] = {"line_color": "#888888", "line_dash": "dotted"}

#: What changes with data is on a canvas of its own: axes, grids and legends aren't painted again.
_CHANGES: dict[str, Any] = {"level": "overlay"}


class _Line(NamedTuple):
    column: str
    name: str = ""  #: in the legend
    colour: str = BLUE
    dash: str = "solid"


class Pictures:
    """The figures of the page, by name in `figures`.

    Sources: `path` (the present case), `flight_path`, `pinned` (a row a pin), `cursor` (one row of
    the path), `swept`, `here` (the present case among the swept ones).

    Args:
        result: what `Evaluator` computes of a case: its columns and ranges have the names of the
            sources' columns and of the ranges here.
    """

    def __init__(self, result: Mapping[str, Any]) -> None:
        path, flight = tuple(result["path"]), tuple(result["flight"])
        columns = {"path": path, "flight_path": flight, "pinned": ("color", *path, *flight)}
        columns |= {"cursor": path, "swept": ("x", *SWEPT_METRICS), "here": ("x",)}
        self.sources = {
            name: models.ColumnDataSource({column: [] for column in names}, name=name)
            for name, names in columns.items()
        }
        self.ranges = {n: models.Range1d(0, 1, name=f"{n}_range") for n in result["ranges"]}
        force = self._over_time("Contact force", "force (kN)")
        loop = self._picture("Force over compression", "compression (mm)", "force (kN)")
        self.figures = {
            "animation": self._animation(),
            "force": self._force(force, "time", "peak", text_align="center"),
            "loop": self._force(loop, "compression", "area", x_offset=4),
            "energies": self._energies(),
            "momenta": self._bodies("Momentum", "momentum (N·s)", "momentum", "total"),
            "velocities": self._bodies("Velocities", "velocity (m/s)", "shown"),
            "positions": self._bodies("Positions", "position (mm)", "position"),
            "sweep": self._sweep(),
            "flight": self._picture("Flight", "distance (m)", "height (m)"),
        }
        self._add_curves("flight_path", "distance", [_Line("height")], self.figures["flight"])
        for name, picture in self.figures.items():
            picture.name = name
            # In front of the curves.
            picture.renderers.sort(key=lambda one: one.data_source is self.sources["cursor"])

    def _animation(self) -> Any:
        # In ball diameters.
        picture = figure(x_range=(-2.65, 6.8), y_range=(-0.675, 0.675), tools="")
        picture.toolbar_location = None
        picture.html_attributes = {"aria-label": "Club and ball, to scale", "role": "img"}
        picture.sizing_mode, picture.min_border = "stretch_both", 0
        picture.axis.visible = picture.grid.visible = False
        picture.hspan(y=[0], line_alpha=0.4, **_GREY)
        club: dict[str, Any] = {"left": "club_back", "right": "club_face"}
        club |= {"height": 1.2, "color": ORANGE, "border_radius": (14, 2, 2, 14)}
        picture.hbar(y=0, source=self.sources["cursor"], **club, **_CHANGES)
        ball: dict[str, Any] = {"x": "ball_middle", "width": "ball_width", "height": "ball_height"}
        ball |= {"fill_color": BLUE, "fill_alpha": 0.85, "line_color": BLUE}
        picture.ellipse(y=0, source=self.sources["cursor"], **ball, **_CHANGES)
        return picture

    def _force(self, picture: Any, x: str, label: str, **style: Any) -> Any:
        """Force over a column of the path, filled, with a label."""
        filled = {"color": SKY, "fill_alpha": 0.35, "line_alpha": 0}
        picture.patch(x, "force", source=self.sources["path"], **filled, **_CHANGES)
        self._add_curves("path", x, [_Line("force")], picture)
        picture.add_layout(models.Label(name=label, x=0, y=0, text="", **style, **_CHANGES))
        return picture

    def _energies(self) -> Any:
        picture = self._over_time("Where the energy is", "energy (J)")
        colours = {"ball": BLUE, "spring": GREEN, "club": ORANGE, "lost": VERMILION}
        columns, path = [f"{name}_energy" for name in colours], self.sources["path"]
        picture.varea_stack(
            columns, x="time", source=path, color=[*colours.values()], alpha=0.75, **_CHANGES
        )
        lines = [_Line("", name, colour) for name, colour in reversed(colours.items())]
        _add_legend(picture, lines, line_width=11)
        return picture

    def _bodies(self, title: str, label: str, what: str, *others: str) -> Any:
        picture = self._over_time(title, label)
        lines = [_Line(f"club_{what}", "club", ORANGE, "dashed"), _Line(f"ball_{what}", "ball")]
        lines += [_Line(f"{other}_{what}", other, GREEN, "dotdash") for other in others]
        self._add_curves("path", "time", lines, picture)
        return picture

    def _sweep(self) -> Any:
        picture = self._picture("S and COR over", "", "S, COR")
        smash, restitution = SWEPT_METRICS
        lines = [_Line(smash, "S"), _Line(restitution, "COR", GREEN, "dashed")]
        self._add_curves("swept", "x", lines, picture)
        picture.vspan(x="x", source=self.sources["here"], **_GREY, **_CHANGES)
        # The page has the title, with the choice of the variable in it.
        picture.title.visible = False
        return picture

    def _over_time(self, title: str, y_label: str) -> Any:
        picture = self._picture(title, "time since touch (µs)", y_label)
        picture.vspan(x="time", source=self.sources["cursor"], **_GREY, **_CHANGES)
        return picture

    def _add_curves(self, source: str, x: str, lines: Sequence[_Line], picture: Any) -> None:
        """Columns of a source over another one, with those of the pins, and the cursor on them."""
        if source != "swept":
            for y, _, _, dash in lines:
                style = {"line_color": "color", "line_width": 1.5, "line_dash": dash}
                picture.multi_line(x, y, source=self.sources["pinned"], **style, **_CHANGES)
        for y, _, colour, dash in lines:
            style = {"line_color": colour, "line_width": 2.5, "line_dash": dash}
            picture.line(x, y, source=self.sources[source], **style, **_CHANGES)
            if source == "path":
                dot: dict[str, Any] = {"size": 9, "color": colour, "line_color": "white"}
                picture.scatter(x, y, source=self.sources["cursor"], **dot, **_CHANGES)
        if len(lines) > 1:
            _add_legend(picture, lines)

    def _picture(self, title: str, *labels: str) -> Any:
        """A picture with these labels of its axes, the first word of which names the range."""
        names = (label.partition(" ")[0] for label in labels)
        ends = [self.ranges.get(name, models.Range1d(0, 2.4)) for name in names]
        # Without tools: a finger that is swiped over a picture scrolls the page.
        picture = figure(title=title, x_range=ends[0], y_range=ends[1], tools="")
        picture.sizing_mode, picture.min_border = "stretch_both", 2
        # Wide enough for most labels: the frames of a column are aligned, and keep their place.
        picture.min_border_left = 48
        about = f"{title}: {labels[1]} over {labels[0]}"
        picture.html_attributes = {"aria-label": about, "role": "img"}
        for axis, label in zip((picture.xaxis, picture.yaxis), labels):
            axis.axis_label = label
            if unit := _UNITS.get(label.rpartition("(")[2].removesuffix(")")):
                code = f"return String(Number((tick / {unit:g}).toPrecision(6)))"
                axis.formatter = models.CustomJSTickFormatter(code=code)
        return picture


def _add_legend(picture: Any, lines: Sequence[_Line], line_width: float = 2.5) -> None:
    """Name, colour and dash of each line, in a row above the data.

    Drawn by glyphs: Bokeh's Legend is an HTML element whose size the browser computes at every
    paint, which takes a third of a slider's step.
    """
    picture.extra_x_ranges = {"legend": models.Range1d(0, 1)}
    picture.extra_y_ranges = {"legend": models.Range1d(0, 1)}
    place = {"x_range_name": "legend", "y_range_name": "legend"}
    x = [0.02 + 0.25 * n for n in range(len(lines))]
    _, texts, colours, dashes = (list(column) for column in zip(*lines))
    line = {"line_color": colours, "line_dash": dashes, "line_width": line_width}
    picture.segment(x0=x, y0=0.93, x1=[start + 0.07 for start in x], y1=0.93, **line, **place)
    text = {"text_color": "#7a828c", "text_font_size": "11px", "text_baseline": "middle"}
    picture.text(x=[start + 0.085 for start in x], y=0.93, text=texts, **text, **place)
