"""The controls: a slider and a field for each input, both in units that people use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from html import escape
from typing import Any

from bokeh.layouts import column, row
from bokeh.models import Div, NumericInput, RadioButtonGroup, Select, Slider

from golf_impact.explore.cases import CONTACT
from golf_impact.explore.parts import STYLED, WIDE, aria
from golf_impact.facts.balls import BALLS

#: Units of speed, each with its m/s.
SPEEDS = {"m/s": Decimal(1), "mph": Decimal("0.44704"), "km/h": 1 / Decimal("3.6")}


@dataclass(frozen=True)
class Quantity:
    """An input or parameter as it is set here.

    What a slider offers is what golf needs; a field takes all that the FMU does. Without a step
    there is a field alone.
    """

    name: str  #: the FMU's
    label: str  #: in words
    unit: str = ""  #: in which it is shown; of a speed that which the user chose
    scale: Decimal = Decimal(1)  #: that unit in SI
    low: float = 0.0  #: of its slider, in that unit, as the next two
    high: float = 0.0
    step: float = 0.0

    def in_unit(self, unit: str) -> Quantity:
        """The same in another unit of speed, unless it is no speed."""
        if self.unit not in SPEEDS:
            return self
        scale = SPEEDS[unit]
        low, high = (round(limit / float(scale)) for limit in (self.low, self.high))
        return replace(self, unit=unit, scale=scale, low=low, high=high)

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
        self._change, self._speed, self._defaults = change, speed, defaults
        self._showing = False
        self.quantities = {one.name: one for one in QUANTITIES}
        self.sliders: dict[str, Slider] = {}
        self.fields: dict[str, NumericInput] = {}
        self.refusals: dict[str, Div] = {}
        wide = [self._row(one) for one in QUANTITIES if one.step]
        slim = [self._row(one) for one in QUANTITIES if not one.step]
        laws = ["Law 1, absolute", "Law 2, relative"]
        self.law = RadioButtonGroup(name="law", labels=laws, **aria("Contact law"), **WIDE)
        self._when(self.law, "active", lambda law: change({"law": law + 1}, "law"))
        balls = [("", "own values"), *((name, f"{name}: {b.title}") for name, b in BALLS.items())]
        self.ball = Select(name="ball", title="Ball", options=balls, **aria("Ball"), **WIDE)
        self._when(self.ball, "value", self._ball_chosen)
        self.source = Div(name="source", css_classes=["quiet"], **WIDE)
        speeds = {"options": list(SPEEDS), "value": "m/s", **aria("Unit of speeds")}
        self.unit = Select(name="unit", **speeds, width=75, **STYLED)
        self._when(self.unit, "value", self._unit_chosen)
        self.layout = column(
            *(self.ball, self.source, self.law, self._refusal("law"), *wide),
            *(row(*some, sizing_mode="stretch_width", spacing=6) for some in (slim[:2], slim[2:])),
            **{"name": "controls", "sizing_mode": "stretch_width", "spacing": 3},
        )

    def _row(self, one: Quantity) -> Any:
        name, words = one.name, aria(one.title)
        field = NumericInput(name=name, title=one.title, mode="float", margin=0, **words, **WIDE)
        field.css_classes = ["line"] if one.step else []
        self.fields[name] = field
        parts: list[Any] = [field]
        if one.step:
            ends = {"start": one.low, "end": one.high, "step": one.step, "value": one.low}
            bare: dict[str, Any] = {"title": None, "show_value": False, "margin": 0}
            self.sliders[name] = Slider(name=f"{name}_slider", **ends, **bare, **words, **WIDE)
            parts.append(self.sliders[name])
        for part in parts:
            self._when(part, "value", lambda shown: self._typed(name, shown))
        return column(*parts, self._refusal(name), sizing_mode="stretch_width", spacing=0)

    def _refusal(self, name: str) -> Div:
        options = {"name": f"{name}_refused", "visible": False, "css_classes": ["refused"]}
        refusal = Div(**options, html_attributes={"role": "alert"}, **WIDE)
        self.refusals[name] = refusal
        return refusal

    # From the user

    def _when(self, model: Any, attribute: str, work: Callable[[Any], None]) -> None:
        """Do this with a new value, unless it was set to show a case."""
        model.on_change(attribute, lambda attr, old, new: None if self._showing else work(new))

    def _typed(self, name: str, shown: float | None) -> None:
        if shown is not None:
            self._change({name: self.quantities[name].si(shown)}, name)

    def _ball_chosen(self, name: str) -> None:
        if name:
            contact = {name: self._defaults[name] for name in CONTACT}
            self._change({**contact, **BALLS[name].values}, "k")

    def _unit_chosen(self, unit: str) -> None:
        self._showing = True
        for one in QUANTITIES:
            self.quantities[one.name] = here = one.in_unit(unit)
            self.fields[one.name].update(title=here.title, **aria(here.title))
            if one.name in self.sliders and one.unit in SPEEDS:
                self.sliders[one.name].update(start=here.low, end=here.high)
        self._showing = False
        self._speed(unit)

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
        self.source.text = escape(BALLS[ball].source) if ball else ""
        self._showing = False
        self.refuse("", "")

    def refuse(self, name: str, message: str) -> None:
        """Say beside this control alone why the FMU refuses the case."""
        for other, refusal in self.refusals.items():
            refusal.visible = other == name
            refusal.text = escape(message) if other == name else ""
