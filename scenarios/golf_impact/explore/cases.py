"""Data of the page (cases.toml): quantities, examples, clubs; its numbers by the FMUs."""

from collections.abc import Mapping
from math import cos, radians
from pathlib import Path
from typing import Any, NamedTuple

from golf_physics.variables import LAWS, VARIABLES

from golf_build.system import COMPANIONS
from golf_impact import document
from golf_impact.ball import BALLS
from golf_impact.explore.evaluator import LOFT, MOMENTA, Evaluator, in_process
from golf_impact.measured import MPH, ROH_LEE_FIGURES, YARD
from golf_impact.quantities import format_value
from golf_impact.runs import METRICS, PATH
from golf_impact.toml import read_toml

#: The ball that an address without parameters opens with: under it every slider has an effect.
OPENING = "roh-lee"

#: The ball with which the lofts of the clubs are fitted.
CLUB_BALL = "penner"

#: Units of speed, each with its m/s.
SPEEDS = {"m/s": 1.0, "mph": MPH, "km/h": 1.0 / 3.6}

_DATA = read_toml(Path(__file__).with_suffix(".toml"))

QUANTITIES = _DATA["quantities"]


class Example(NamedTuple):
    """A case with a button, or a club."""

    name: str  #: on its button
    values: Mapping[str, float]  #: inputs and parameters that aren't the FMU's start values
    printed: Mapping[str, str]  #: published results, by metric, as they are shown
    hint: str  #: what to look for, in one sentence
    source: str = "document"  #: of the published results
    beside: Mapping[str, float] | None = None  #: a case that is pinned for comparison


#: The document's results of the examples.
_PRINTED = {
    "Document": "baseline", "Elastic": "elastic", "50 m/s": "50 m/s", "Soft": "k = 0.5e6",
    "Stiff": "k = 2e6", "Old ball": "old",
}  # fmt: skip

#: The page's names of what it shows before and after the impact.
_AFTER = {"momentum": "momentum_final", "kinetic_energy": "kinetic_energy_final"}


def _example(name: str, ball: str = "", **row: Any) -> Example:
    numbers = document.CASES[_PRINTED[name]].printed if name in _PRINTED else {}
    printed = {_AFTER.get(metric, metric): number.text for metric, number in numbers.items()}
    if ball:
        printed = {metric: format_value(metric, x) for metric, x in ROH_LEE_FIGURES.items()}
        row["values"] = BALLS[ball].values
    return Example(name, printed=printed, **row)


EXAMPLES = [_example(**row) for row in _DATA["examples"]]


def _club(row: tuple[Any, ...], loft: float) -> Example:
    club, mph, attack, _, angle, rpm, yards, mass = row
    # ClubBallImpact has speeds along the face normal.
    speed = mph * MPH * cos(radians(loft - attack))
    head = {"club_speed": speed, "m_club": mass}
    angles = {"dynamic_loft": radians(loft), "attack_angle": radians(attack)}
    printed = {"launch_angle": f"{angle}", "backspin": f"{rpm}", "carry": f"{yards * YARD:.0f}"}
    hint = f"{club}, average of the PGA Tour: {mph} mph; the loft is fitted to the launch angle."
    return Example(club, {**head, **angles}, printed, hint, "TrackMan")


CLUBS = [_club(row, loft) for row, loft in zip(_DATA["clubs"], _DATA["lofts"])]


_TABLES = ("quantities", "readouts", "factors", "equations", "simple", "simple_pictures", "tasks")

#: Variables of Launch and BallFlight.
ROWS = [COMPANIONS[name].tables["rows"] for name in ("Launch", "BallFlight")]


def make_evaluator() -> Evaluator:
    """The evaluator of the page by the physics in this process, with the page's data as facts."""
    rows = [*VARIABLES, *ROWS[0], *ROWS[1]]
    instances = impact, launch, _ = in_process(*ROWS)
    inputs = (row.name for row in VARIABLES if row.causality != "output")
    defaults = {name: impact.default(name) for name in inputs}
    defaults |= {name: launch.default(name) for name in LOFT}
    contact = {name: defaults[name] for name in _DATA["contact"]}
    units = {row.name: row.unit for row in rows if row.unit}
    units |= {f"{part}_energy": "J" for part in ("club", "ball", "spring", "lost")}
    whose = ("momentum_initial", "momentum_final", *MOMENTA)
    units |= dict.fromkeys(whose, units["momentum"])
    facts: dict[str, Any] = {
        "defaults": defaults,
        "metrics": METRICS,
        "path": PATH,
        # Of the columns of CSV files.
        "units": units | {"name": "", "query": "", "time": "s"},
        "speeds": SPEEDS,
        "yard": YARD,
        "opening": dict(BALLS[OPENING].values),
        "laws": [(number, name) for number, (name, _) in LAWS.items()],
        **{name: _DATA[name] for name in _TABLES},
        "balls": [{**vars(one), "values": {**contact, **one.values}} for one in BALLS.values()],
        "examples": [one._asdict() | {"values": {**defaults, **one.values}} for one in EXAMPLES],
        "clubs": [one._asdict() for one in CLUBS],
        "fitted": {"name": CLUB_BALL, "values": {**defaults, **BALLS[CLUB_BALL].values}},
    }
    return Evaluator(instances, facts)


def metrics_by_fmus(path: Path, facts: Mapping[str, Any]) -> list[dict[str, float]]:
    """Metrics of the examples by the FMU in this file and its companions, which are built."""
    # Imported here: the page opens without an FMU.
    from golf_impact.fmu import Fmu, Impact, current_fmu

    launch, flight = current_fmu("Launch"), current_fmu("BallFlight")
    with Impact(path) as first, Fmu(launch) as second, Fmu(flight) as third:
        return Evaluator((first, second, third), facts).example_metrics()
