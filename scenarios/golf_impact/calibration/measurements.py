"""Measurements of an impact: scalars, a force curve, COR at several speeds; read and validated."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.calibration.pulse import check_curve, impulse_ratio
from golf_impact.errors import UserError
from golf_impact.facts import closed_forms
from golf_impact.facts.quantities import doubts_of_mass
from golf_impact.files import read_text

#: Scalar targets by name: the FMU's output, the quantity in words, its unit in options and files.
TARGETS = {
    "ball_speed": ("ball_velocity", "ball speed after", "m/s"),
    "club_speed_after": ("club_velocity", "club speed after", "m/s"),
    "cor": ("coefficient_of_restitution", "COR", ""),
    "contact_time": ("contact_time", "contact time", "s"),
    "max_force": ("max_force", "max force", "N"),
    "time_of_max_force": ("time_of_max_force", "time of max force", "s"),
}

#: Targets that depend on the damping alone. A law of two bodies has one COR, so that all of them
#: together are one independent measurement.
RESTITUTION = ("ball_speed", "club_speed_after", "cor")

#: Columns of the two kinds of series; a column `sigma` is optional.
CURVE, COR_SPEEDS = ("time", "force"), ("approach_speed", "cor")

#: The σ of a scalar target without one, as a fraction of its value.
DEFAULT_SIGMA = 0.01

#: A scalar target beyond these (s, N) is probably in another unit.
_LONG, _SOFT = 0.1, 20.0

#: 1 + COR is between 1 and 2; the impulse of a measured curve is doubted if it is well outside.
_DOUBTED = (0.8, 2.2)


@dataclass(frozen=True)
class Conditions:
    """The impact in which curve and scalars were measured: speed (m/s), masses (kg), ball at rest.

    Raises:
        UserError: a value isn't a finite number above 0.
    """

    club_speed: float = 35.0
    m_club: float = 0.210
    m_ball: float = 0.04593

    def __post_init__(self) -> None:
        for name, number in vars(self).items():
            if not 0.0 < number < math.inf:
                raise UserError(
                    f"{option(name)} {number!r} is refused: it must be a finite number above 0"
                )

    @property
    def reduced_mass(self) -> float:
        """μ = m_C m_B / (m_C + m_B), kg."""
        return closed_forms.reduced_mass(self.m_club, self.m_ball)


@dataclass(frozen=True)
class Target:
    """A measured scalar with its standard deviation, SI units."""

    name: str  #: a key of TARGETS
    value: float
    sigma: float
    stated: bool = True  #: whether σ was given; otherwise it is the default


@dataclass(frozen=True)
class Series:
    """A measured series, SI units: arrays of one shape (n,)."""

    name: str  #: the file, or the argument in Python
    x: np.ndarray  #: the first of CURVE or COR_SPEEDS
    y: np.ndarray  #: the second
    sigma: np.ndarray | None = None  #: of y; None if it follows from the residuals
    lines: Sequence[int] = ()  #: of the rows in the file

    def row(self, n: int) -> str:
        """Where the n-th row (from 0) is, for messages."""
        line = f" (line {self.lines[n]})" if self.lines else ""
        return f"{self.name}, row {n + 1}{line}"


@dataclass(frozen=True)
class Measurements:
    """All that a fit has to meet."""

    conditions: Conditions = Conditions()
    targets: Mapping[str, Target] = field(default_factory=dict)
    curve: Series | None = None
    cor_speeds: Series | None = None

    @property
    def series(self) -> dict[str, Series]:
        named = {"curve": self.curve, "cor_speeds": self.cor_speeds}
        return {name: one for name, one in named.items() if one is not None}

    @property
    def values(self) -> np.ndarray:
        """All measured values: scalars, forces, CORs."""
        scalars = [target.value for target in self.targets.values()]
        return np.concatenate([scalars, *(one.y for one in self.series.values())])

    @property
    def groups(self) -> dict[str, slice]:
        """Where scalars, forces and CORs are in `values`."""
        lengths = {"targets": len(self.targets)} | {n: len(s.y) for n, s in self.series.items()}
        groups, at = {}, 0
        for name, length in lengths.items():
            if length:
                groups[name] = slice(at, at := at + length)
        return groups

    @property
    def sized(self) -> bool:
        """Whether anything depends on the stiffness."""
        return self.curve is not None or any(name not in RESTITUTION for name in self.targets)


def option(name: str) -> str:
    return "--" + name.replace("_", "-")


def target(name: str, value: float, sigma: float | None = None) -> Target:
    """A scalar target; UserError if the value or its σ is impossible."""
    _, label, unit = TARGETS[name]
    why = None
    if not math.isfinite(value):
        why = f"{label} must be a finite number, in {unit or 'no unit'}"
    elif name == "cor":
        why = _why_no_cor(value)
    elif name in ("contact_time", "max_force", "ball_speed") and value <= 0.0:
        why = f"{label} must be above 0 {unit}"
    elif name == "time_of_max_force" and value < 0.0:
        why = f"{label} must be at least 0 s; it counts from first touch"
    if why:
        raise UserError(f"{option(name)} {value!r} is refused: {why}")
    deviation = option(f"sigma_{name}")
    if sigma is None and value == 0.0:
        raise UserError(f"{option(name)} 0 needs {deviation}: the default σ is 1 % of 0")
    if sigma is not None and not 0.0 < sigma < math.inf:
        why = f"a standard deviation must be a finite number above 0 {unit}".rstrip()
        raise UserError(f"{deviation} {sigma!r} is refused: {why}")
    if sigma is None:
        return Target(name, value, DEFAULT_SIGMA * abs(value), False)
    return Target(name, value, sigma)


def _why_no_cor(value: float) -> str | None:
    if 0.0 < value < 1.0:
        return None
    why = "leaves the ball on the club" if value <= 0.0 else "gains energy"
    why = "loses no energy (set b = 0 for that)" if value == 1.0 else why
    percent = f"; write {value / 100.0:g} for {value:g} %" if 5.0 < value < 100.0 else ""
    return f"a COR of {value:g} {why}; it must be above 0 and below 1{percent}"


def measurements(
    scalars: Mapping[str, tuple[float | None, float | None]],
    conditions: Mapping[str, float | None],
    file: Path | None = None,
    curve: Any = None,
    cor_speeds: Any = None,
) -> Measurements:
    """Validated measurements from options or arguments and, where these are silent, from a file.

    Args:
        scalars: (value, sigma) of targets by name, None where not given.
        conditions: values of the impact by name, None where not given.
        file: a CSV file of scalars, see `read_csv`.
        curve: a CSV file `time,force[,sigma]`, or arrays in this order or by these names.
        cor_speeds: the same with `approach_speed,cor[,sigma]`.

    Raises:
        UserError: a value is impossible; it is named, or its file and row.
    """
    listed, also = read_csv(file) if file else ({}, {})
    stated = {name: value for name, value in conditions.items() if value is not None}
    targets = {}
    for name in TARGETS:
        value, sigma = scalars.get(name, (None, None))
        if value is None and name in listed:
            value, listed_sigma = listed[name]
            sigma = listed_sigma if sigma is None else sigma
        if value is not None:
            targets[name] = target(name, value, sigma)
        elif sigma is not None:
            why = f"without {option(name)}, whose standard deviation it is"
            raise UserError(f"{option('sigma_' + name)} {sigma!r} is refused {why}")
    impact = Conditions(**{**also, **stated})
    forces = None if curve is None else read_series(curve, "curve", CURVE)
    speeds = None if cor_speeds is None else read_series(cor_speeds, "cor_speeds", COR_SPEEDS)
    if forces is not None:
        check_curve(forces, impact.reduced_mass * impact.club_speed)
    if speeds is not None:
        _check_cor_speeds(speeds)
    return Measurements(impact, targets, forces, speeds)


# Files


def read_csv(path: Path) -> tuple[dict[str, tuple[float, float | None]], dict[str, float]]:
    """Scalars and the impact from a CSV file with the columns target, value and sigma.

    Names are those of the options, with - or _; club_speed, m_club and m_ball may be given too.
    The column sigma, or a cell of it, may be left out.

    Returns:
        Targets as (value, sigma or None) by name, and values of the impact by name.

    Raises:
        UserError: the file can't be read, or a row is wrong.
    """
    targets: dict[str, tuple[float, float | None]] = {}
    impact: dict[str, float] = {}
    exact = list(Conditions.__dataclass_fields__)
    for line, cells in _rows(path, ("target", "value")):
        where = f"{path}, line {line}"
        name = cells["target"].lower().lstrip("-").replace("-", "_")
        value, sigma = (_number(cells.get(column, ""), where) for column in ("value", "sigma"))
        if name not in (*TARGETS, *exact):
            choice = ", ".join((*TARGETS, *exact))
            raise UserError(
                f"{where}: there is no target {cells['target']!r}: choose from {choice}"
            )
        if value is None:
            raise UserError(f"{where}: {name} has no value")
        if name in targets or name in impact:
            raise UserError(f"{where}: {name} is given twice")
        if name in TARGETS:
            targets[name] = (value, sigma)
        elif sigma is not None:
            raise UserError(f"{where}: {name} is taken as exact, leave its sigma empty")
        else:
            impact[name] = value
    return targets, impact


def _rows(path: Path, columns: Sequence[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """Line number and cells by column of each row; blank lines are skipped."""
    try:
        rows = list(csv.reader(read_text(path).splitlines()))
    except csv.Error as error:
        raise UserError(f"{path} can't be read as CSV: {error}") from error
    header = [cell.strip().lower() for cell in (rows[0] if rows else [])]
    names = ",".join(columns)
    if not set(columns) <= set(header) <= {*columns, "sigma"}:
        why = f"its first line must be {names} or {names},sigma, not {','.join(header)!r}"
        raise UserError(f"{path} is refused: {why}")
    if len(set(header)) < len(header):
        raise UserError(f"{path} is refused: its first line names a column twice: {header}")
    for line, row in enumerate(rows[1:], 2):
        cells = [cell.strip() for cell in row]
        if len(cells) > len(header):
            raise UserError(f"{path}, line {line} is refused: more cells than the first line has")
        if any(cells):
            yield line, dict(zip(header, cells))


def _number(text: str, where: str) -> float | None:
    try:
        return float(text) if text else None
    except ValueError:
        raise UserError(f"{where}: {text!r} is no number (e.g. 600e-6)") from None


def read_series(given: Any, name: str, columns: tuple[str, str]) -> Series:
    """A series from a CSV file, a mapping of columns, two or three arrays, or a table of rows.

    Raises:
        UserError: it has no rows, unequal lengths, numbers missing, NaN or infinity, or σ ≤ 0.
    """
    names, lines, table = (*columns, "sigma"), list[int](), list[list[float | None]]()
    if isinstance(given, str | Path):
        name = str(given)
        for line, cells in _rows(Path(given), columns):
            where = f"{name}, row {len(lines) + 1} (line {line})"
            row = [_number(cells.get(one, ""), where) for one in names]
            if None in row[: 3 if table and table[0][2] is not None else 2]:
                raise UserError(f"{where}: a number is missing")
            table.append(row)
            lines.append(line)
        given = [column for column in zip(*table) if column[0] is not None]
    elif hasattr(given, "keys"):
        given = [given[one] for one in names if one in given]
    elif getattr(given, "ndim", 0) == 2 and len(given) > 3:
        given = given.T
    try:
        arrays = [np.array(column, float) for column in given if column is not None]
    except (TypeError, ValueError) as error:
        raise UserError(f"{name} must be arrays of numbers ({error})") from error
    if any(array.ndim != 1 or len(array) != len(arrays[0]) for array in arrays):
        raise UserError(f"{name} must be arrays of one length: {', '.join(names)}")
    if not 2 <= len(arrays) <= 3 or not len(arrays[0]):
        raise UserError(f"{name} is refused: it has no rows of {', '.join(columns)}")
    series = Series(name, arrays[0], arrays[1], arrays[2] if arrays[2:] else None, lines)
    for column, values in zip(names, arrays):
        bad = ~np.isfinite(values) | ((values <= 0.0) & (column == "sigma"))
        if bad.any():
            n, what = int(bad.argmax()), "a finite number" + " above 0" * (column == "sigma")
            raise UserError(f"{series.row(n)}: {column} = {values[n]:g} must be {what}")
    return series


# What can't be


def _check_cor_speeds(speeds: Series) -> None:
    for n, (speed, cor) in enumerate(zip(speeds.x.tolist(), speeds.y.tolist())):
        if speed <= 0.0:
            raise UserError(f"{speeds.row(n)}: approach_speed = {speed:g} must be above 0 m/s")
        if why := _why_no_cor(cor):
            raise UserError(f"{speeds.row(n)}: {why}")
    if len(set(speeds.x.tolist())) < 2:
        raise UserError(f"{speeds.name} is refused: a line needs COR at two speeds or more")
    if len(speeds.y) == 2 and speeds.sigma is None:
        why = "two rows leave no residuals; add a column sigma, or rows"
        raise UserError(f"{speeds.name} is refused: {why}")


def doubts(data: Measurements) -> list[str]:
    """Sentences on values that may be in another unit; they are taken as they are."""
    words = [
        f"{option(name)} {data.targets[name].value:g} is taken in s: write e.g. 600e-6 for 600 µs."
        for name in ("contact_time", "time_of_max_force")
        if name in data.targets and data.targets[name].value > _LONG
    ]
    force, impact = data.targets.get("max_force"), data.conditions
    if force and force.value < _SOFT:
        words.append(f"--max-force {force.value:g} is taken in N: write e.g. 6600 for 6.6 kN.")
    if data.curve is not None:
        ratio = impulse_ratio(data.curve, impact.reduced_mass * impact.club_speed)
        if not _DOUBTED[0] < ratio < _DOUBTED[1]:
            words.append(
                f"The impulse of {data.curve.name} is {ratio:.2f} of reduced mass times club speed "
                f"({impact.club_speed:g} m/s), which should be 1 + COR, between 1 and 2: check "
                "--club-speed, --m-club, --m-ball and the unit of force."
            )
    masses = {f"{option(n)} ": getattr(impact, n) for n in ("m_club", "m_ball")}
    return [*words, *doubts_of_mass(masses)]


def check_together(data: Measurements, law: int) -> None:
    """Raise UserError for scalars that no contact at all has together; law 2 conserves momentum."""
    targets, u = data.targets, data.conditions.club_speed
    time, peak = targets.get("contact_time"), targets.get("time_of_max_force")
    if time and peak and peak.value >= time.value:
        raise UserError(
            f"--time-of-max-force {peak.value!r} is refused: the largest force can't come after "
            f"the contact's end, --contact-time {time.value!r}"
        )
    ball, club, cor = (targets.get(name) for name in RESTITUTION)
    # The COR that follows from each target, with its σ.
    implied = [restitution(one, data.conditions) for one in (ball, club) if one and law == 2]
    if ball and club:
        implied.append(((ball.value - club.value) / u, math.hypot(ball.sigma, club.sigma) / u))
    implied += [(cor.value, cor.sigma)] if cor else []
    for value, sigma in implied:
        if value - sigma >= 1.0 or value + sigma <= 0.0:
            why = "more energy than there was" if value > 0.0 else "a ball that doesn't leave"
            raise UserError(
                f"these speeds at a club speed of {u:g} m/s are a COR of {value:.4g}, {why}; it "
                "must be above 0 and below 1"
            )


def restitution(target: Target, conditions: Conditions) -> tuple[float, float]:
    """The COR that follows from a speed or a COR where momentum is conserved, and its σ."""
    total, u = conditions.m_club + conditions.m_ball, conditions.club_speed
    if target.name == "ball_speed":
        factor = total / (conditions.m_club * u)
        return factor * target.value - 1.0, factor * target.sigma
    if target.name == "club_speed_after":
        factor = total / (conditions.m_ball * u)
        return factor * (u - target.value) - 1.0, factor * target.sigma
    return target.value, target.sigma
