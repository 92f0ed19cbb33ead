"""What the page offers: quantities with their sliders, balls, and the cases one click away."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from golf_impact.errors import UserError
from golf_impact.explore.answers import Answers
from golf_impact.facts import document
from golf_impact.facts.balls import BALLS
from golf_impact.facts.measured import MPH, ROH_LEE_FIGURES
from golf_impact.facts.quantities import shown
from golf_impact.fmu.impact_fmu import ImpactFmu

#: The case that an address without parameters opens with: a ball that has been measured.
OPENING = "penner"

#: Units of speed, each with its m/s.
SPEEDS = {"m/s": 1.0, "mph": MPH, "km/h": 1.0 / 3.6}

#: What a ball is made of; the masses and speeds are not part of it.
CONTACT = (
    *("law", "k", "b", "exponent", "reference_compression"),
    *("restitution_at_rest", "restitution_slope"),
)


@dataclass(frozen=True)
class Quantity:
    """An input or parameter as it is set here.

    A slider covers what golf needs; a field takes every value that the FMU does. Without a step
    there is a field alone.
    """

    name: str  #: the FMU's
    label: str  #: in words
    unit: str = ""  #: in which it is shown; of a speed that which the user chose
    scale: float = 1.0  #: that unit in SI
    low: float = 0.0  #: of its slider, in that unit, as the next two
    high: float = 0.0
    step: float = 0.0


QUANTITIES = (
    Quantity("k", "Stiffness k", "N/mm", 1e3, 100, 3000, 10),
    Quantity("b", "Damping b", "N·s/m", 1.0, 0, 100, 0.5),
    Quantity("club_speed", "Club speed", "m/s", 1.0, 5, 80, 0.5),
    Quantity("exponent", "Exponent n", "", 1.0, 1, 3, 0.01),
    Quantity("m_club", "Club mass", "g", 1e-3, 100, 400, 1),
    Quantity("m_ball", "Ball mass", "g", 1e-3, 20, 80, 0.1),
    Quantity("ball_speed", "Ball speed before", "m/s", 1.0, -20, 20, 0.5),
    Quantity("restitution_at_rest", "COR at zero speed"),
    Quantity("restitution_slope", "COR slope", "s/m"),
    Quantity("reference_compression", "d_r", "mm", 1e-3),
    Quantity("ball_diameter", "Ball diameter", "mm", 1e-3),
    Quantity("gap", "Gap", "mm", 1e-3),
)


@dataclass(frozen=True)
class Example:
    """A case that is one click away."""

    name: str  #: on its button
    values: Mapping[str, float]  #: inputs and parameters that aren't the FMU's start values
    printed: Mapping[str, str]  #: what is published of it, by metric, as it is shown
    hint: str  #: what to look for, in one sentence
    source: str = "document"  #: where
    beside: Mapping[str, float] | None = None  #: a case that is pinned to be compared with


def _document(
    name: str, values: Mapping[str, float], printed: Mapping[str, document.Printed], hint: str
) -> Example:
    return Example(name, values, {metric: one.text for metric, one in printed.items()}, hint)


EXAMPLES = (
    _document(
        *("Document", {}, document.BASELINE),
        "The document's impact (law 1): contact lasts 0.6 ms, and the ball leaves faster than the "
        "club came.",
    ),
    _document(
        *("Elastic", {"b": 0.0}, document.ELASTIC),
        "Without damping no energy is lost: COR and E are 1, and force over compression is one "
        "line.",
    ),
    _document(
        *("50 m/s", {"club_speed": 50.0}, document.CLUB_SPEED[50.0]),
        "Forces and speeds grow in proportion to club speed; S, COR and contact time stay as they "
        "are.",
    ),
    _document(
        *("Soft", {"k": 0.5e6}, document.COMPRESSION[0.5e6]),
        "Half the stiffness: longer contact, less force. The drag acts longer, so S falls.",
    ),
    _document(
        *("Stiff", {"k": 2e6}, document.COMPRESSION[2e6]),
        "Twice the stiffness: shorter contact, more force, and less energy is lost.",
    ),
    _document(
        *("Old ball", {"k": 0.5e6, "b": 12.0}, document.OLD_BALL[0.5e6, 12.0]),
        "Softer and more damped: S, COR and E all fall.",
    ),
    Example(
        *("Roh & Lee", BALLS["roh-lee"].values),
        {metric: shown(metric, value) for metric, value in ROH_LEE_FIGURES.items()},
        "A finite-element ball (law 2): its stiffness grows with compression (n = 1.62); COR is "
        "0.74, and the loop is wide.",
        "Roh & Lee",
    ),
    Example(
        *("Law 1 | law 2", {"law": 2}, {}),
        "The same k and b: law 1 (pinned) drags both bodies and loses momentum; law 2 conserves "
        "momentum and its force follows a loop.",
        beside={"law": 1},
    ),
)


def facts_of(fmu: ImpactFmu) -> dict[str, Any]:
    """What the page and `Answers` need beside an instance, as JSON takes it."""
    defaults = {
        name: float(one.start)
        for name, one in fmu.variables.items()
        if one.causality in ("input", "parameter")
    }
    facts: dict[str, Any] = {
        **{"defaults": defaults, "speeds": SPEEDS, "contact": CONTACT},
        "opening": dict(BALLS[OPENING].values),
        "quantities": [asdict(one) for one in QUANTITIES],
        # Their values are read-only mappings, which asdict and JSON don't take.
        "balls": [{**vars(one), "values": dict(one.values)} for one in BALLS.values()],
        "examples": [{**vars(one), "values": dict(one.values)} for one in EXAMPLES],
    }
    answers = Answers(fmu, UserError, facts)
    for one in facts["examples"]:
        one["check"] = answers.metrics({**defaults, **one["values"]})
    return facts
