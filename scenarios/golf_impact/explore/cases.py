"""Quantities with their sliders, balls, and example cases of the page."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import cos, pi, radians
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from golf_build import LAWS
from golf_impact.errors import UserError
from golf_impact.explore.evaluator import LOFT, Evaluator
from golf_impact.facts import document
from golf_impact.facts.balls import BALLS
from golf_impact.facts.measured import MPH, ROH_LEE_FIGURES, TOUR
from golf_impact.facts.quantities import format_value
from golf_impact.fmu.impact_fmu import METRICS, PATH, ImpactFmu
from golf_impact.fmu.loaded import LoadedFmu
from golf_impact.fmu.system import build_system

#: The case that an address without parameters opens with: a ball that has been measured.
OPENING = "penner"

#: Units of speed, each with its m/s.
SPEEDS = {"m/s": 1.0, "mph": MPH, "km/h": 1.0 / 3.6}

#: The variables that define a ball; masses and speeds aren't among them.
CONTACT = (
    "law", "k", "b", "exponent", "reference_compression", "restitution_at_rest",
    "restitution_slope",
)  # fmt: skip


class Quantity(NamedTuple):
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
    Quantity("dynamic_loft", "Dynamic loft", "°", pi / 180.0, 0, 60, 0.5),
    Quantity("attack_angle", "Attack angle", "°", pi / 180.0, -10, 10, 0.1),
    Quantity("friction", "Friction", "", 1.0, 0, 1, 0.01),
    Quantity("restitution_at_rest", "COR at zero speed"),
    Quantity("restitution_slope", "COR slope", "s/m"),
    Quantity("reference_compression", "d_r", "mm", 1e-3),
    Quantity("ball_diameter", "Ball diameter", "mm", 1e-3),
    Quantity("gap", "Gap", "mm", 1e-3),
)


class Example(NamedTuple):
    """A case with a button, or a club."""

    name: str  #: on its button
    values: Mapping[str, float]  #: inputs and parameters that aren't the FMU's start values
    printed: Mapping[str, str]  #: published results, by metric, as they are shown
    hint: str  #: what to look for, in one sentence
    source: str = "document"  #: of the published results
    beside: Mapping[str, float] | None = None  #: a case that is pinned for comparison


_HINTS = {
    "Document": "The document's impact (law 1): contact lasts 0.6 ms, and the ball leaves faster "
    "than the club came.",
    "Elastic": "Without damping no energy is lost: COR and E are 1, and force over compression is "
    "one line.",
    "50 m/s": "Forces and speeds grow in proportion to club speed; S, COR and contact time stay "
    "as they are.",
    "Soft": "Half the stiffness: longer contact, less force. The drag acts longer, so S falls.",
    "Stiff": "Twice the stiffness: shorter contact, more force, and less energy is lost.",
    "Old ball": "Softer and more damped: S, COR and E all fall.",
    "Roh & Lee": "A finite-element ball (law 2): its stiffness grows with compression (n = 1.62); "
    "COR is 0.74, and the loop is wide.",
    "Law 1 | law 2": "The same k and b: law 1 (pinned) drags both bodies and loses momentum; "
    "law 2 conserves momentum and its force follows a loop.",
}


def _example(name: str, values: Mapping[str, float], printed: Mapping[str, Any]) -> Example:
    texts = {metric: number.text for metric, number in printed.items()}
    return Example(name, values, texts, _HINTS[name])


_ROH_LEE = {metric: format_value(metric, value) for metric, value in ROH_LEE_FIGURES.items()}
EXAMPLES = (
    _example("Document", {}, document.BASELINE),
    _example("Elastic", {"b": 0.0}, document.ELASTIC),
    _example("50 m/s", {"club_speed": 50.0}, document.CLUB_SPEED[50.0]),
    _example("Soft", {"k": 0.5e6}, document.COMPRESSION[0.5e6]),
    _example("Stiff", {"k": 2e6}, document.COMPRESSION[2e6]),
    _example("Old ball", {"k": 0.5e6, "b": 12.0}, document.OLD_BALL[0.5e6, 12.0]),
    Example("Roh & Lee", BALLS["roh-lee"].values, _ROH_LEE, _HINTS["Roh & Lee"], "Roh & Lee"),
    Example("Law 1 | law 2", {"law": 2}, {}, _HINTS["Law 1 | law 2"], beside={"law": 1}),
)

#: Dynamic loft, degrees, with which the model has the launch angle of the club of `TOUR`: fitted by
#: the scenario loft.
_LOFTS = (
    15.079, 13.254, 13.644, 14.731, 14.823, 15.739,
    17.366, 20.358, 23.641, 26.428, 30.333, 37.730,
)  # fmt: skip


def _club(row: tuple[Any, ...], loft: float) -> Example:
    club, mph, attack, _, angle, rpm, yards, mass = row
    # ClubBallImpact has speeds along the face normal.
    speed = mph * MPH * cos(radians(loft - attack))
    head = {"club_speed": speed, "m_club": mass}
    angles = {"dynamic_loft": radians(loft), "attack_angle": radians(attack)}
    printed = {"launch_angle": f"{angle}", "backspin": f"{rpm}", "carry": f"{yards * 0.9144:.0f}"}
    hint = f"{club}, average of the PGA Tour: {mph} mph; the loft is fitted to the launch angle."
    return Example(club, {**BALLS[OPENING].values, **head, **angles}, printed, hint, "TrackMan")


CLUBS = tuple(map(_club, TOUR, _LOFTS))


@contextmanager
def companions(fmu: ImpactFmu) -> Iterator[tuple[LoadedFmu, ...]]:
    """ClubBallImpact, Launch and BallFlight in use."""
    with TemporaryDirectory(prefix="golf-impact-") as folder:
        _, *files, _ = build_system(Path(folder))
        with LoadedFmu(files[0]) as launch, LoadedFmu(files[1]) as flight:
            yield fmu, launch, flight


def facts_of(fmus: tuple[LoadedFmu, ...]) -> dict[str, Any]:
    """Data of the page and of `Evaluator` beside the instances, for JSON."""
    impact, launch, _ = fmus
    inputs = (v for v in impact.variables.values() if v.causality in ("input", "parameter"))
    defaults = {v.name: float(v.start) for v in inputs}
    defaults |= {name: launch.default(name) for name in LOFT}
    facts: dict[str, Any] = {
        "defaults": defaults,
        "metrics": METRICS,
        "path": PATH,
        "units": {v.name: v.unit for fmu in fmus for v in fmu.variables.values() if v.unit},
        "speeds": SPEEDS,
        "contact": CONTACT,
        "opening": dict(BALLS[OPENING].values),
        "laws": [(number, name) for number, (name, _) in LAWS.items()],
        "quantities": [quantity._asdict() for quantity in QUANTITIES],
        # JSON takes no read-only mappings.
        "balls": [{**vars(ball), "values": dict(ball.values)} for ball in BALLS.values()],
        "examples": [one._replace(values=dict(one.values))._asdict() for one in EXAMPLES],
        "clubs": [club._asdict() for club in CLUBS],
    }
    evaluator = Evaluator(fmus, UserError, facts)
    for example in facts["examples"]:
        example["check"] = evaluator({"values": example["values"]})["metrics"]
    return facts
