"""The controls: a slider and a field for each input, both in units that people use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from html import escape
from typing import Any

from bokeh.layouts import column, row
from bokeh.models import Div, NumericInput, RadioButtonGroup, Select, Slider

from golf_scenarios.explore.parts import STYLE
from golf_scenarios.facts.balls import BALLS

#: Units of speed, each with its m/s.
SPEEDS = {"m/s": Decimal(1), "mph": Decimal("0.44704"), "km/h": 1 / Decimal("3.6")}


@dataclass(frozen=True)
class Quantity:
    """An input or parameter as it is set here.

    Attributes:
        name: the FMU's.
        label: in words.
        unit: in which it is shown; that of `SPEEDS` that the user chose, if it is a speed.
        scale: that unit in SI.
        low, high, step: of its slider, in that unit; without one, there is a field alone. What a
            slider offers is what golf needs; a field takes all that the FMU does.
    """

    name: str
    label: str
    unit: str = ""
    scale: Decimal = Decimal(1)
    low: float = 0.0
    high: float = 0.0
    step: float = 0.0

    def in_unit(self, unit: str) -> Quantity:
        """The same in another unit of speed, unless it is no speed."""
        if self.unit not in SPEEDS:
            return self
        scale = SPEEDS[unit]
        low, high = (round(limit / float(scale)) for limit in (self.low, self.high))
        return Quantity(self.name, self.label, unit, scale, low, high, self.step)

    def si(self, shown: float) -> float:
        """A number of its unit in SI, by decimals: 45.93 g are 0.04593 kg to the last digit."""
        return float(Decimal(repr(float(shown))) * self.scale)

    def shown(self, value: float) -> float:
        """A value (SI) in its unit, with the digits that people read."""
        return float(f"{Decimal(repr(value)) / self.scale:.8g}")

    @property
    def title(self) -> str:
        """Label and unit."""
        return f"{self.label} ({self.unit})" if self.unit else self.label


_MILLI = Decimal("0.001")

QUANTITIES = (
    Quantity("k", "Stiffness k", "N/mm", Decimal(1000), 100, 3000, 10),
    Quantity("b", "Damping b", "N·s/m", Decimal(1), 0, 100, 0.5),
    Quantity("club_speed", "Club speed", "m/s", Decimal(1), 5, 80, 0.5),
    Quantity("exponent", "Exponent n", "", Decimal(1), 1, 3, 0.01),
    Quantity("m_club", "Club mass", "g", _MILLI, 100, 400, 1),
    Quantity("m_ball", "Ball mass", "g", _MILLI, 20, 80, 0.1),
    Quantity("ball_speed", "Ball speed before", "m/s", Decimal(1), -20, 20, 0.5),
    Quantity("restitution_at_rest", "COR at rest"),
    Quantity("restitution_slope", "its fall (s/m)"),
    Quantity("reference_compression", "d_r (mm)", "", _MILLI),
    Quantity("ball_diameter", "Ball Ø (mm)", "", _MILLI),
    Quantity("gap", "Gap (mm)", "", _MILLI),
)


class Controls:
    """The controls of one page.

    Args:
        change: called with new values (SI) by name, and the name of the control.
        speed: called with a unit of speed when the user chooses one.
        defaults: the FMU's start values.
    """

    def __init__(
        self,
        change: Callable[[Mapping[str, float], str], None],
        speed: Callable[[str], None],
        defaults: Mapping[str, float],
    ) -> None:
        self._change, self._defaults = change, defaults
        self._showing = False
        self.quantities = {one.name: one for one in QUANTITIES}
        self.sliders: dict[str, Slider] = {}
        self.fields: dict[str, NumericInput] = {}
        self.refusals: dict[str, Div] = {}
        rows = {one.name: self._row(one) for one in QUANTITIES}
        self.law = RadioButtonGroup(
            name="law",
            labels=["Law 1, absolute", "Law 2, relative"],
            stylesheets=[STYLE],
            sizing_mode="stretch_width",
            html_attributes={"aria-label": "Contact law"},
        )
        self.law.on_change("active", self._law_chosen)
        balls = [("", "own values"), *((name, f"{name}: {b.title}") for name, b in BALLS.items())]
        wide: dict[str, Any] = {"stylesheets": [STYLE], "sizing_mode": "stretch_width"}
        label = {"aria-label": "Ball"}
        self.ball = Select(name="ball", title="Ball", options=balls, html_attributes=label, **wide)
        self.ball.on_change("value", self._ball_chosen)
        self.source = Div(
            name="source", css_classes=["quiet"], stylesheets=[STYLE], sizing_mode="stretch_width"
        )
        self.unit = Select(
            name="unit",
            options=list(SPEEDS),
            value="m/s",
            stylesheets=[STYLE],
            width=75,
            html_attributes={"aria-label": "Unit of speeds"},
        )
        self.unit.on_change("value", lambda attr, old, new: self._unit_chosen(new, speed))
        refused = self.refusals["law"] = _refusal("law")
        slim = [rows[one.name] for one in QUANTITIES if not one.step]
        self.layout = column(
            self.ball,
            self.source,
            self.law,
            refused,
            *(rows[one.name] for one in QUANTITIES if one.step),
            row(*slim[:2], sizing_mode="stretch_width", spacing=6),
            row(*slim[2:], sizing_mode="stretch_width", spacing=6),
            name="controls",
            sizing_mode="stretch_width",
            spacing=3,
        )

    def _row(self, one: Quantity) -> Any:
        refusal = self.refusals[one.name] = _refusal(one.name)
        field = self.fields[one.name] = NumericInput(
            name=one.name,
            title=one.title,
            html_attributes={"aria-label": one.title},
            mode="float",
            css_classes=["line"] if one.step else [],
            stylesheets=[STYLE],
            sizing_mode="stretch_width",
            margin=0,
        )
        field.on_change("value", lambda attr, old, new: self._typed(one.name, new))
        parts: list[Any] = [field]
        if one.step:
            slider = self.sliders[one.name] = Slider(
                name=f"{one.name}_slider",
                **{"start": one.low, "end": one.high, "step": one.step, "value": one.low},
                **{"title": None, "show_value": False, "margin": 0},
                html_attributes={"aria-label": one.title},
                stylesheets=[STYLE],
                sizing_mode="stretch_width",
            )
            slider.on_change("value", lambda attr, old, new: self._typed(one.name, new))
            parts.append(slider)
        return column(*parts, refusal, sizing_mode="stretch_width", spacing=0)

    # From the user

    def _typed(self, name: str, shown: float | None) -> None:
        if not self._showing and shown is not None:
            self._change({name: self.quantities[name].si(shown)}, name)

    def _law_chosen(self, attr: str, old: Any, new: int) -> None:
        if not self._showing:
            self._change({"law": new + 1}, "law")

    def _ball_chosen(self, attr: str, old: str, new: str) -> None:
        if not self._showing and new:
            from golf_scenarios.explore.cases import CONTACT

            contact = {name: self._defaults[name] for name in CONTACT}
            self._change({**contact, **BALLS[new].values}, "k")

    def _unit_chosen(self, unit: str, speed: Callable[[str], None]) -> None:
        for one in QUANTITIES:
            self.quantities[one.name] = here = one.in_unit(unit)
            self.fields[one.name].title = here.title
            self.fields[one.name].html_attributes = {"aria-label": here.title}
            if one.name in self.sliders and one.unit in SPEEDS:
                self._showing = True
                self.sliders[one.name].update(start=here.low, end=here.high)
                self._showing = False
        speed(unit)

    # To the user

    def show(self, values: Mapping[str, float], ball: str) -> None:
        """Show a case that the FMU has taken; nothing is refused any more."""
        self._showing = True
        for name, field in self.fields.items():
            field.value = shown = self.quantities[name].shown(values[name])
            if name in self.sliders:
                slider = self.sliders[name]
                slider.value = min(max(shown, slider.start), slider.end)
        self.law.active = int(values["law"]) - 1
        self.ball.value = ball
        self.source.text = f"{escape(BALLS[ball].source)}" if ball else ""
        self._showing = False
        self.refuse("", "")

    def refuse(self, name: str, message: str) -> None:
        """Say beside this control alone why the FMU refuses the case."""
        for other, refusal in self.refusals.items():
            refusal.visible = other == name
            refusal.text = escape(message) if other == name else ""


def _refusal(name: str) -> Div:
    return Div(
        name=f"{name}_refused",
        visible=False,
        css_classes=["refused"],
        stylesheets=[STYLE],
        html_attributes={"role": "alert"},
        sizing_mode="stretch_width",
    )
