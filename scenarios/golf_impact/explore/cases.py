"""The case that is shown: as a link, as a command, and the cases that are one click away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import urlencode

from golf_impact.errors import UserError
from golf_impact.facts import document
from golf_impact.facts.balls import BALLS
from golf_impact.facts.measured import ROH_LEE_FIGURES
from golf_impact.facts.quantities import format_options, format_shortest, format_value

#: What a ball is made of; the masses and speeds are not part of it.
CONTACT = (
    *("law", "k", "b", "exponent", "reference_compression"),
    *("restitution_at_rest", "restitution_slope"),
)


def query(values: Mapping[str, float]) -> str:
    """What the address has behind the question mark."""
    return urlencode({name: format_shortest(value) for name, value in values.items()})


def command(values: Mapping[str, float]) -> str:
    """The line that runs this case."""
    # A run without --set would be one of all scenarios.
    return f"golf-impact run {format_options(values or {'law': 1})}"


def from_query(arguments: Mapping[str, Sequence[bytes]]) -> dict[str, float]:
    """Inputs and parameters of an address, by name.

    Raises:
        UserError: a value is no number.
    """
    values = {}
    for name, texts in arguments.items():
        text = texts[-1].decode("utf-8", "replace")
        try:
            values[name] = float(text)
        except ValueError:
            raise UserError(f"{name} = {text!r} in the address is no number") from None
    return values


@dataclass(frozen=True)
class Example:
    """A case that is one click away."""

    name: str  #: on its button
    values: Mapping[str, float]  #: inputs and parameters that aren't the FMU's start values
    printed: Mapping[str, str]  #: what is published of it, by metric, as it is shown
    source: str = "document"  #: where
    beside: Mapping[str, float] | None = None  #: a case that is pinned to be compared with

    @property
    def look(self) -> str:
        """What to look for, in one sentence."""
        return _LOOK[self.name]


def _document(
    name: str, values: Mapping[str, float], printed: Mapping[str, document.Printed]
) -> Example:
    return Example(name, values, {metric: number.text for metric, number in printed.items()})


_ROH_LEE = {metric: format_value(metric, value) for metric, value in ROH_LEE_FIGURES.items()}

EXAMPLES = (
    _document("Baseline", {}, document.BASELINE),
    _document("Elastic", {"b": 0.0}, document.ELASTIC),
    _document("50 m/s", {"club_speed": 50.0}, document.CLUB_SPEED[50.0]),
    _document("Soft", {"k": 0.5e6}, document.COMPRESSION[0.5e6]),
    _document("Stiff", {"k": 2e6}, document.COMPRESSION[2e6]),
    _document("Old ball", {"k": 0.5e6, "b": 12.0}, document.OLD_BALL[0.5e6, 12.0]),
    Example("Roh & Lee", BALLS["roh-lee"].values, _ROH_LEE, "Roh & Lee"),
    Example("Law 1 | law 2", {"law": 2}, {}, beside={"law": 1}),
)

_LOOK = {
    "Baseline": "The document's impact: the ball leaves faster than the club came, after 0.6 ms.",
    "Elastic": "Without damping nothing is lost: COR and E are 1, and force and compression rise "
    "and fall on one line.",
    "50 m/s": "Faster: forces and speeds grow in proportion; S, COR and contact time stay.",
    "Soft": "Half the stiffness: a longer contact and less force; the drag acts longer, so S "
    "falls.",
    "Stiff": "Twice the stiffness: a shorter contact and more force; less is lost.",
    "Old ball": "Softer and more damped at once: S, COR and E all fall.",
    "Roh & Lee": "A finite-element ball: stiffer as it is squeezed (n = 1.62), with a COR of 0.74; "
    "a wide loop.",
    "Law 1 | law 2": "The same k and b: law 1 (pinned) drags both bodies and loses momentum; law 2 "
    "keeps it and draws a loop.",
}


def example_of(values: Mapping[str, float], defaults: Mapping[str, float]) -> Example | None:
    """The example that these values are."""
    return next((one for one in EXAMPLES if values == {**defaults, **one.values}), None)


def ball_of(values: Mapping[str, float], defaults: Mapping[str, float]) -> str:
    """The name of the ball that these values have, or ""."""
    for ball in BALLS.values():
        if all(values[name] == ball.values.get(name, defaults[name]) for name in CONTACT):
            return ball.name
    return ""
