"""The page of one session: controls, pictures, read-outs and pins around one FMU instance."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from bokeh.document import Document
from bokeh.layouts import row
from bokeh.models import Button, Div, Select, TextInput, Toggle

from golf_impact.errors import UserError
from golf_impact.explore import cases, readouts
from golf_impact.explore.controls import SPEEDS, Controls
from golf_impact.explore.impact import Impact, explored, swept
from golf_impact.explore.parts import LAYOUT, STYLED, THEME, WIDE, aria, script
from golf_impact.explore.pictures import Pictures
from golf_impact.explore.pins import Pins
from golf_impact.fmu.impact_fmu import ImpactFmu

HINT = (
    "Move a slider, or type any number that the FMU allows. Point at a curve, or press Play, to "
    "see one instant in all pictures."
)

#: ms that events have to arrive before the newest of them is run: a slider sends one each 16 ms.
_GATHER = 8

#: Variables over which S and COR are shown.
_SWEPT = ("club_speed", "k", "b", "m_club")


class Page:
    """One tab's page.

    A wish is the case that the user wants to see; the impact is the last one that the FMU has run.
    They differ while events arrive, and where the FMU refuses the wish.

    Args:
        document: what Bokeh shows in the tab.
        fmu: an instance of its own, in use.
        values: inputs and parameters that aren't the FMU's start values.
    """

    def __init__(self, document: Document, fmu: ImpactFmu, values: Mapping[str, float]) -> None:
        self.document, self.fmu = document, fmu
        self.defaults = {
            name: float(one.start)
            for name, one in fmu.variables.items()
            if one.causality in ("input", "parameter")
        }
        self.impact: Impact
        self.wish = dict(self.defaults)
        self._control, self._waiting = "law", False
        self.controls = Controls(self.want, self._in_unit, self.defaults)
        self.pins = Pins(self.pin, lambda values: self.want(values, "law"))
        self.pictures = Pictures(self.pins.source)
        self.readouts = Div(name="readouts", **WIDE)
        self.look = Div(name="look", sizing_mode="stretch_width")
        self.link = TextInput(name="link", visible=False)
        self.link.js_on_change("value", script("link"))
        self.command = TextInput(name="command", title="The same as a command", **WIDE)
        options = [(name, self.controls.quantities[name].label) for name in _SWEPT]
        words = aria("S and COR over")
        self.over = Select(name="over", options=options, value=_SWEPT[0], **words, **STYLED)
        self.over.on_change("value", lambda attr, old, new: self.sweep())
        self.update()
        unknown = [name for name in values if name not in self.defaults]
        if unknown:
            known = ", ".join(self.defaults)
            said = f"There is no input or parameter {unknown[0]}: choose from {known}."
            self.look.text = escape(said)
        elif values:
            self.wish.update(values)
            self.update()
        self.sweep()
        self._lay_out()

    def _lay_out(self) -> None:
        pictures, pins, figures = self.pictures, self.pins, self.pictures.figures
        files = {"": "Download …", "path.csv": "Curves (CSV)", "pins.csv": "Pinned cases (CSV)"}
        for name, one in figures.items():
            if name != "animation":
                for kind in ("png", "svg"):
                    files[f"{name}.{kind}"] = f"{one.title.text} ({kind.upper()})"
        choice = {"value": "", "options": list(files.items()), "syncable": False}
        downloads = Select(name="download", width=130, **choice, **aria("Download"), **STYLED)
        models = {"path": pictures.path, "pins": pins.source, "figures": figures}
        downloads.js_on_change("value", script("download", **models))
        copy = Button(name="copy", label="Copy command", **STYLED)
        copy.js_on_click(script("copy", command=self.command))
        dark = Toggle(name="dark", label="Dark", syncable=False, **STYLED)
        dark.js_on_change("active", script("dark", figures=figures))
        self.document.js_on_event("document_ready", script("ready", dark=dark), pictures.move)
        self.document.title = "Golf impact"
        self.document.template, self.document.theme = LAYOUT, THEME
        actions = (pins.button, self.controls.unit, copy, downloads, dark)
        # Bokeh looks through all models once, not once a root.
        with self.document.models.freeze():
            for root in (
                row(*map(self._example, cases.EXAMPLES), name="examples", spacing=4),
                row(*actions, name="actions", spacing=4),
                *(self.look, self.controls.layout, self.readouts, pins.layout, self.link),
                *(self.command, self.over, pictures.play, pictures.scrub, pictures.words),
                *figures.values(),
            ):
                self.document.add_root(root)

    def _example(self, example: cases.Example) -> Button:
        def clicked() -> None:
            if example.beside is not None and not self.pins.full:
                self.wish = {**self.defaults, **example.beside}
                self.update()
                self.pin(example.name.partition(" | ")[0])
            self.want({**self.defaults, **example.values}, "law")

        button = Button(label=example.name, **STYLED)
        button.on_click(clicked)
        return button

    # What the user wants

    def want(self, values: Mapping[str, float], control: str) -> None:
        """Wish for other values (SI); the FMU runs when the events that wait have come in.

        However many come meanwhile, the newest wish is run once: none is queued.
        """
        self.wish.update(values)
        self._control = control
        if not self._waiting:
            self._waiting = True
            self.document.add_timeout_callback(self._run_newest, _GATHER)

    def _run_newest(self) -> None:
        self._waiting = False
        self.update()
        # S and COR over a variable can wait until no slider moves.
        self.document.add_timeout_callback(self._sweep_if_idle, 2 * _GATHER)

    def _sweep_if_idle(self) -> None:
        if not self._waiting:
            self.sweep()

    def pin(self, name: str = "") -> None:
        """Pin the present case."""
        self.pins.add(self.impact, dict(self.pictures.path.data), name)
        self._draw()

    def update(self) -> None:
        """Run the wish and show it; if the FMU refuses it, say why and leave the pictures."""
        try:
            self.impact = explored(self.fmu, self.wish)
        except UserError as error:
            # A message begins with the variable that it is about.
            about = str(error).partition(" ")[0]
            name = about if about in self.controls.refusals else self._control
            self.controls.refuse(name, str(error))
            return
        values = self.impact.values
        self.controls.show(values, cases.ball_of(values, self.defaults))
        self.link.value = cases.query(self.impact.changed)
        self.command.value = cases.command(self.impact.changed)
        self._draw()

    def _draw(self) -> None:
        self.pictures.show(self.impact, self._speed, self.pins.end)
        example = cases.example_of(self.impact.values, self.defaults)
        self.look.text = escape(example.look) if example else HINT
        words = readouts.table(self.impact, example, *self._speed)
        state = readouts.state(self.impact)
        self.readouts.text = f'{words}<p class="state">{state}</p>' if state else words

    @property
    def _speed(self) -> tuple[str, float]:
        unit = self.controls.unit.value
        return unit, 1.0 / float(SPEEDS[unit])

    def _in_unit(self, unit: str) -> None:
        self.pins.in_unit(self._speed[1])
        self.controls.show(self.impact.values, self.controls.ball.value)
        self._draw()
        self.sweep()

    def sweep(self) -> None:
        """Show S and COR over the variable that the user chose."""
        one = self.controls.quantities[self.over.value]
        values, scale = self.impact.values, float(one.scale)
        over = swept(self.fmu, values, one.name, one.low * scale, one.high * scale)
        self.pictures.show_sweep(over, one.title, scale, values[one.name])


def show(document: Document, fmu: ImpactFmu, arguments: Mapping[str, Any]) -> Page:
    """A page with the case of an address."""
    try:
        return Page(document, fmu, cases.from_query(arguments))
    except UserError as error:
        page = Page(document, fmu, {})
        page.look.text = escape(str(error))
        return page
