"""Balls: presets (balls.toml), each with its source, and TOML files of users."""

import json
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from golf_impact.data.errors import UserError, unknown_name
from golf_impact.data.files import read_toml
from golf_impact.data.units import si_value, unit_of

#: What a ball may set, and what of it may have a covariance.
_UNCERTAIN = ("k", "b", "exponent", "restitution_at_rest", "restitution_slope")
_SETTABLE = ("law", *_UNCERTAIN, "reference_compression", "m_ball", "ball_diameter")
_CONDITIONS = ("club_speed", "m_club", "club_force")
_OTHERS = ("title", "source", "speeds", "limits", "undetermined", "conditions", "uncertainty")

#: What doesn't depend on a stiffness that is undetermined.
_WITHOUT_K = (
    "club_velocity", "ball_velocity", "smash_factor", "coefficient_of_restitution",
    "energy_efficiency", "impulse", "momentum", "kinetic_energy", "touch_time",
)  # fmt: skip


@dataclass(frozen=True)
class Ball:
    """A ball: values of inputs and parameters of the FMU; the others keep their start values."""

    name: str  #: as in `--ball NAME`; of a file, its path
    title: str  #: a description in one line
    values: Mapping[str, Any]  #: by name (SI units)
    source: str  #: where they come from
    uncertain: tuple[str, ...] = ()  #: names of the values that have a covariance, (p,)
    covariance: tuple[tuple[float, ...], ...] = ()  #: theirs, rows of (p, p), SI units
    #: Of the impact in which it was measured: club speed, mass, force, by name (SI units).
    conditions: Mapping[str, float] = field(default_factory=dict)
    speeds: tuple[float, ...] = ()  #: least and largest approach speed for which it holds, m/s
    limits: str = ""  #: how precise its source is, and what it isn't for
    #: Names of values that its measurements don't determine: k, if COR alone was measured.
    undetermined: tuple[str, ...] = ()

    def unknown(self, outputs: Iterable[str], given: Container[str] = ()) -> list[str]:
        """Those of these outputs that depend on what is undetermined and isn't given otherwise."""
        if all(name in given for name in self.undetermined):
            return []
        return [name for name in outputs if name not in _WITHOUT_K]


def rating_stiffness(rating: float) -> float:
    """Contact stiffness k of a ball with this compression rating, N/m; indicative only.

    The PGA rating is 160 minus the deflection in mil under 200 lbf between two plates; half of the
    deflection is on each side. The compression is slow, its force a fifth of an impact's or less,
    and there is no industry standard.
    """
    load, mil = 200.0 * 4.4482216152605, 25.4e-6  # N, m
    return 2.0 * load / ((160.0 - rating) * mil)


def ball(name: str) -> Ball:
    """The preset ball of this name, or the ball of a TOML file; UserError if there is none."""
    if name.lower().endswith(".toml"):
        return read_ball(name)
    if name not in BALLS:
        raise unknown_name("ball", name, BALLS, ", or give a file .toml")
    return BALLS[name]


def read_ball(path: Path | str) -> Ball:
    """The ball of a TOML file: variables of the FMU by name (SI units, or as text with a unit).

    A file without k has it in `undetermined`: force, contact time and compression don't follow.

    Optional are `title`, `source`, `speeds` (the least and largest approach speed for which it
    holds, m/s), `limits` (a text on what it isn't for), a table `conditions` (club_speed, m_club
    and club_force of the measured impact), and a table `uncertainty` with `parameters`, p names,
    and `covariance`, p rows of p numbers (SI units), which gives predictions their intervals.

    Raises:
        UserError: the file can't be read, or something in it isn't a ball's.
    """
    return _ball(str(path), read_toml(path))


def _ball(name: str, table: dict[str, Any]) -> Ball:
    stem = Path(name).stem
    title, source = str(table.pop("title", f"of {stem}")), str(table.pop("source", stem))
    speeds, limits = table.pop("speeds", []), str(table.pop("limits", ""))
    pair = isinstance(speeds, list) and len(speeds) == 2 and all(map(_is_number, speeds))
    if speeds != [] and not (pair and speeds[0] <= speeds[1]):
        why = "write the least and the largest in m/s, such as [30, 50]"
        raise UserError(f"{name}: speeds = {speeds!r} is refused: {why}")
    undetermined = table.pop("undetermined", [] if "k" in table else ["k"])
    if not isinstance(undetermined, list) or not {*map(str, undetermined)} <= {*_UNCERTAIN} - {
        *table
    }:
        why = f"it takes names of {', '.join(_UNCERTAIN)} that have no value in the file"
        raise UserError(f"{name}: undetermined = {undetermined!r} is refused: {why}")
    uncertainty = table.pop("uncertainty", {"parameters": [], "covariance": []})
    conditions = table.pop("conditions", {})
    if not isinstance(conditions, dict) or not {*conditions} <= {*_CONDITIONS}:
        raise UserError(f"{name}: conditions takes {', '.join(_CONDITIONS)} alone")
    if other := [key for key in table if key not in _SETTABLE]:
        if isinstance(table[other[0]], dict):
            why = "a file has one ball, without a heading"
            raise UserError(f"{name}: [{other[0]}] is refused: {why}")
        allowed = ", ".join((*_SETTABLE, *_OTHERS))
        raise UserError(f"{name}: a ball has no {other[0]}: choose from {allowed}")
    table, conditions = (
        {key: _number(name, key, value) for key, value in values.items()}
        for values in (table, conditions)
    )
    if not table:
        raise UserError(f"{name} is not a ball: give it lines such as law = 2, k = 8e5, b = 30")
    try:
        names = tuple(uncertainty["parameters"])
        rows = tuple(map(tuple, uncertainty["covariance"]))
        square = [len(row) for row in rows] == [len(names)] * len(names)
        known = all(one in _UNCERTAIN and one in table for one in names)
        numbers = all(_is_number(cell) for row in rows for cell in row)
        right = square and known and numbers and all(row[n] >= 0.0 for n, row in enumerate(rows))
    except (KeyError, TypeError):
        right = False
    if not right:
        raise UserError(
            f"{name}: uncertainty is refused: it needs parameters, p names of values above it, and "
            "covariance, p rows of p finite numbers with none on its diagonal below 0"
        )
    rest = conditions, tuple(speeds), limits, tuple(undetermined)
    return Ball(name, title, table, source, names, rows, *rest)


def _number(name: str, key: str, value: Any) -> Any:
    """A value in SI units; as text it may have another one, "770 N/mm"."""
    why, number = "it must be a finite number", value
    if isinstance(value, str):
        try:
            number = si_value(value, unit_of(key))
        except ValueError as error:
            why, number = str(error), None
    if not _is_number(number):
        raise UserError(f"{name}: {key} = {value!r} is refused: {why}")
    return number


def conditions_of(balls: Iterable[Ball], given: Container[str]) -> dict[str, float]:
    """Conditions of the first ball that has any, for all; those given otherwise are left out.

    UserError: another ball has other ones.
    """
    found: dict[str, tuple[float, str]] = {}
    for one in balls:
        for name, value in one.conditions.items():
            first, whose = found.setdefault(name, (value, one.name))
            if first != value and name not in given:
                values = f"{name} = {first:g} and {value:g}"
                raise UserError(
                    f"{whose} and {one.name} were measured with {values}: give --set {name}=…"
                )
    return {name: value for name, (value, _) in found.items() if name not in given}


def range_remarks(balls: Iterable[Ball], speed: float) -> list[str]:
    """Sentences about balls that don't hold for an approach speed (m/s)."""
    return [
        f"{one.name} holds for {one.speeds[0]:g} to {one.speeds[1]:g} m/s, not for {speed:g}."
        if one.speeds[0] < one.speeds[1]
        else f"{one.name} was measured at {one.speeds[0]:g} m/s, not at {speed:g}: measured balls "
        "lose 0.0029 of COR per m/s."
        for one in balls
        if one.speeds and not one.speeds[0] <= speed <= one.speeds[1]
    ]


def _is_number(value: Any) -> bool:
    # Not isinstance: a Boolean is an integer to Python. TOML has integers of 64 bits.
    return type(value) in (int, float) and abs(value) < 2.0**63


def ball_toml(ball: Ball) -> str:
    """A ball as the text of a TOML file."""
    # A JSON text is a TOML text.
    title, source = (json.dumps(text, ensure_ascii=False) for text in (ball.title, ball.source))
    lines = [f"title = {title}", f"source = {source}"]
    lines += [f"speeds = {[*ball.speeds]}"] if ball.speeds else []
    lines += [f"undetermined = {json.dumps([*ball.undetermined])}"] if ball.undetermined else []
    lines += [f"limits = {json.dumps(ball.limits, ensure_ascii=False)}"] if ball.limits else []
    lines.append("")
    errors = {name: ball.covariance[n][n] ** 0.5 for n, name in enumerate(ball.uncertain)}
    for name, value in ball.values.items():
        error = f"  # standard error {errors[name]:.2g}" if name in errors else ""
        lines.append(f"{name} = {value!r}{error}")
    if ball.conditions:
        lines += ["", "[conditions]", *(f"{n} = {value!r}" for n, value in ball.conditions.items())]
    if ball.uncertain:
        rows = ",\n".join(f"    {list(row)!r}" for row in ball.covariance)
        names = json.dumps(list(ball.uncertain))
        lines += ["", "[uncertainty]", f"parameters = {names}", f"covariance = [\n{rows},\n]"]
    return "\n".join(lines) + "\n"


#: The presets by name.
BALLS = {
    name: _ball(name, table)
    for name, table in read_toml(Path(__file__).with_name("balls.toml")).items()
}
