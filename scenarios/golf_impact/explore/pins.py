"""Pinned cases: each keeps its curves in a colour of its own, and its row in a table."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bokeh import models
from bokeh.layouts import column, row

from golf_impact.explore.cases import query
from golf_impact.explore.impact import Impact
from golf_impact.explore.parts import STYLED, WIDE, aria

#: One a pin: none is the present case's.
COLOURS = (
    *("#CC79A7", "#009E73", "#D55E00", "#999933"),
    *("#882255", "#888888", "#44AA99", "#DDCC77"),
)

#: Curves that a pin keeps.
CURVES = (
    *("time", "force", "compression", "club_position", "ball_position"),
    *("club_velocity", "ball_velocity", "club_shown", "ball_shown"),
)

#: What its row has: metric, title, format.
COLUMNS = (
    ("smash_factor", "S", "0.0000"),
    ("coefficient_of_restitution", "COR", "0.0000"),
    ("energy_efficiency", "E", "0.00 %"),
    ("ball_after", "ball (m/s)", "0.000"),
    ("club_after", "club (m/s)", "0.000"),
    ("contact_us", "contact (µs)", "0.00"),
    ("max_force", "peak force (N)", "0.0"),
    ("compression_over_diameter", "squeeze / Ø", "0.00 %"),
    ("momentum_kept", "momentum kept", "0.00 %"),
)


class Pins:
    """The pinned cases of one page.

    Args:
        pin: called when the user wants the present case pinned, with a name or "".
        reopen: called with the values of a pinned case that is to be the present one.
    """

    def __init__(
        self, pin: Callable[[str], None], reopen: Callable[[dict[str, float]], None]
    ) -> None:
        names = ("name", "color", "query", *(metric for metric, _, _ in COLUMNS), *CURVES)
        self.source = models.ColumnDataSource({name: [] for name in names}, name="pinned")
        self._values: list[dict[str, float]] = []
        self._open = reopen
        swatch = models.HTMLTemplateFormatter(template='<b style="color:<%= value %>">━━</b>')
        columns = [
            models.TableColumn(field="color", title="", formatter=swatch, width=40, sortable=False),
            models.TableColumn(field="name", title="case", width=190, sortable=False),
        ]
        for field, title, form in COLUMNS:
            right = models.NumberFormatter(format=form, text_align="right")
            options = {"field": field, "title": title, "formatter": right, "width": 100}
            columns.append(models.TableColumn(**options, sortable=False))
        self.table = models.DataTable(
            **{"source": self.source, "columns": columns, "index_position": None},
            **{"height": 90, "row_height": 26, "reorderable": False},
            **aria("Pinned cases", role="region"),
            **WIDE,
        )
        words = {"placeholder": "name of the pin", **aria("Name of the pin")}
        self.name = models.TextInput(name="pin_name", width=190, **words, **STYLED)
        self.button = _button("Pin", lambda: pin(self.name.value.strip()))
        clicks = {"Rename": self._rename, "Reopen": self._reopen, "Remove": self._remove}
        self.layout = column(
            row(self.name, *(_button(*one) for one in clicks.items()), spacing=6),
            self.table,
            **{"name": "pins", "sizing_mode": "stretch_width", "spacing": 4},
        )

    @property
    def end(self) -> float:
        """The end of the longest curve, s; 0 without any."""
        return max((float(time[-1]) for time in self.source.data["time"]), default=0.0)

    @property
    def full(self) -> bool:
        """Whether there are as many as there are colours."""
        return len(self._values) == len(COLOURS)

    def add(self, impact: Impact, curves: dict[str, Any], name: str) -> None:
        """Keep a case: its metrics, its curves (`Pictures.path.data`), its values.

        Without a name it is called by its values that aren't start values.
        """
        if self.full:
            return
        given = query(impact.changed)
        one = {
            **impact.metrics,
            "name": name or given.replace("&", ", ") or "start values",
            "color": next(one for one in COLOURS if one not in self.source.data["color"]),
            "query": given,
            "contact_us": 1e6 * impact.metrics["contact_time"],
            # The curves have these names.
            **{f"{body}_after": impact.metrics[f"{body}_velocity"] for body in ("ball", "club")},
            **{curve: curves[curve] for curve in CURVES},
        }
        self._values.append(impact.values)
        self.source.data = {key: [*old, one[key]] for key, old in self.source.data.items()}
        self.name.value = ""
        self._resize()

    def in_unit(self, factor: float) -> None:
        """Show the speeds in another unit, of which 1 m/s has so many."""
        data = dict(self.source.data)
        for body in ("club", "ball"):
            data[f"{body}_shown"] = [array * factor for array in data[f"{body}_velocity"]]
        self.source.data = data

    def _chosen(self) -> int:
        """The row that is selected, or the last one; -1 is the last one's place in lists."""
        return next(iter(self.source.selected.indices), -1)

    def _rename(self) -> None:
        name = self.name.value.strip()
        if self._values and name:
            names = list(self.source.data["name"])
            names[self._chosen()] = name
            self.source.data = {**self.source.data, "name": names}
            self.name.value = ""

    def _reopen(self) -> None:
        if self._values:
            self._open(self._values[self._chosen()])

    def _remove(self) -> None:
        if self._values:
            gone = self._chosen() % len(self._values)
            del self._values[gone]
            self.source.selected.indices = []
            data = self.source.data.items()
            self.source.data = {key: [*old[:gone], *old[gone + 1 :]] for key, old in data}
            self._resize()

    def _resize(self) -> None:
        self.button.disabled = self.full
        self.table.height = 64 + 26 * max(1, len(self._values))


def _button(label: str, click: Callable[[], None]) -> models.Button:
    button = models.Button(name=label.lower(), label=label, **STYLED)
    button.on_click(click)
    return button
