"""Measurements of an impact: scalars, a force curve, COR at several speeds; read and validated."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.errors import UserError
from golf_impact.facts import closed_forms
from golf_impact.files import read_text

#: Scalar targets by name: the outputs of the FMU.
TARGETS = {
    "ball_speed": "ball_velocity",
    "club_speed_after": "club_velocity",
    "cor": "coefficient_of_restitution",
    "contact_time": "contact_time",
    "max_force": "max_force",
    "time_of_max_force": "time_of_max_force",
}

#: Targets that depend on the damping alone. A law of two bodies has one COR, so that all of them
#: together are one independent measurement.
RESTITUTION = ("ball_speed", "club_speed_after", "cor")

#: Columns of the two kinds of series; a column `sigma` is optional.
COLUMNS = {"curve": ("time", "force"), "cor_speeds": ("approach_speed", "cor")}

#: The σ of a scalar target without one, as a fraction of its value.
DEFAULT_SIGMA = 0.01

#: Ranges of numbers by name, ends excluded, and in words; wide enough for any impact, but not for
#: another unit.
_ABOVE_0 = (0.0, math.inf, "a finite number above 0")
_FINITE = (-math.inf, math.inf, "a finite number")
_SECONDS = (0.0, 0.1, "above 0 and below 0.1, in s (600e-6 for 600 µs)")
_KILOGRAMS = (0.0, 10.0, "above 0 and below 10, in kg (0.21 for 210 g)")
_ALLOWED = {
    "cor": (0.0, 1.0, "above 0 and below 1: 1 loses no energy, more gains energy (0.8 for 80 %)"),
    "exponent": (0.999999, 12.000001, "between 1 and 12, or the word free"),
    "max_force": (20.0, math.inf, "a finite number above 20, in N (6600 for 6.6 kN)"),
    **dict.fromkeys(("club_speed_after", "time", "force"), _FINITE),
    **dict.fromkeys(("contact_time", "time_of_max_force"), _SECONDS),
    **dict.fromkeys(("m_club", "m_ball"), _KILOGRAMS),
}


@dataclass(frozen=True)
class Conditions:
    """The impact in which curve and scalars were measured: speed (m/s), masses (kg)."""

    club_speed: float = 35.0
    m_club: float = 0.210
    m_ball: float = 0.04593

    @property
    def reduced_mass(self) -> float:
        """μ = m_C m_B / (m_C + m_B), kg."""
        return closed_forms.reduced_mass(self.m_club, self.m_ball)

    def __str__(self) -> str:
        return f"{self.club_speed:g} m/s, club {self.m_club:g} kg, ball {self.m_ball:g} kg"


@dataclass(frozen=True)
class Target:
    """A measured scalar with its standard deviation, SI units."""

    value: float
    sigma: float
    stated: bool = True  #: whether σ was given; otherwise it is the default


@dataclass(frozen=True)
class Series:
    """A measured series in the order of COLUMNS, SI units: arrays of one shape (n,)."""

    name: str  #: the file, or the argument in Python
    rows: Sequence[str]  #: where each row is, for messages
    x: np.ndarray
    y: np.ndarray
    sigma: np.ndarray | None = None  #: of y; None if it follows from the residuals

    @property
    def contact(self) -> np.ndarray:
        """Rows of a curve with more than a quarter of the largest force."""
        return np.flatnonzero(self.y > 0.25 * self.y.max())


@dataclass(frozen=True)
class Measurements:
    """All that a fit has to meet."""

    conditions: Conditions = Conditions()
    targets: Mapping[str, Target] = field(default_factory=dict)
    curve: Series | None = None
    cor_speeds: Series | None = None

    @property
    def series(self) -> dict[str, Series]:
        """Those of the series that there are."""
        series = {"curve": self.curve, "cor_speeds": self.cor_speeds}
        return {name: one for name, one in series.items() if one}

    @property
    def values(self) -> np.ndarray:
        """All measured values: scalars, forces, CORs."""
        scalars = [target.value for target in self.targets.values()]
        return np.concatenate([scalars, *(one.y for one in self.series.values())])

    @property
    def groups(self) -> dict[str, slice]:
        """Where scalars, forces and CORs are in `values`."""
        lengths = {"targets": len(self.targets)} | {n: len(s.y) for n, s in self.series.items()}
        ends = zip(lengths.items(), np.cumsum(list(lengths.values())).tolist())
        return {name: slice(end - length, end) for (name, length), end in ends if length}

    @property
    def sized(self) -> bool:
        """Whether anything depends on the stiffness."""
        return self.curve is not None or any(name not in RESTITUTION for name in self.targets)


def option(name: str) -> str:
    return "--" + name.replace("_", "-")


def number(given: Any, name: str, where: str = "") -> float:
    """A number in its range; otherwise a UserError that names the option, or where it is."""
    what = f"{where}: {name} = " if where else f"{option(name)} "
    low, high, allowed = _ALLOWED.get(name, _ABOVE_0)
    try:
        value = float(given)
    except (TypeError, ValueError):
        raise UserError(f"{what}{given!r} is refused: it must be a number, e.g. 600e-6") from None
    if not low < value < high:
        raise UserError(f"{what}{value:g} is refused: it must be {allowed}")
    return value


def measurements(
    scalars: Mapping[str, float | None],
    file: Path | None = None,
    curve: Any = None,
    cor_speeds: Any = None,
) -> Measurements:
    """Validated measurements, see `golf_impact.calibrate`; scalars given win over the file's.

    UserError: a value is impossible; it is named, or its file and row.
    """
    known = (*TARGETS, *vars(Conditions()))
    in_file: dict[str, tuple[Any, str]] = {}
    for where, cells in _rows(file, ("target", "value")) if file else ():
        name = cells["target"].strip().lower().lstrip("-").replace("-", "_")
        if name in in_file:
            raise UserError(f"{where}: {name} is given twice")
        in_file[name] = cells["value"], where
        if cells.get("sigma"):
            in_file[f"sigma_{name}"] = cells["sigma"], where
    given = in_file | {name: (value, "") for name, value in scalars.items() if value is not None}
    values = {}
    for name, (value, where) in given.items():
        if name not in known and name.removeprefix("sigma_") not in TARGETS:
            place, choice = where or "calibrate", ", ".join(known)
            raise UserError(f"{place}: there is no target {name!r}: choose from {choice}")
        values[name] = number(value, name, where)
    targets = {}
    for name in TARGETS:
        sigma = values.get(f"sigma_{name}")
        if name in values:
            default = DEFAULT_SIGMA * abs(values[name])
            deviation = sigma or number(default, f"sigma_{name}")
            targets[name] = Target(values[name], deviation, sigma is not None)
        elif sigma is not None:
            raise UserError(f"{option(f'sigma_{name}')} is refused without {option(name)}")
    impact = Conditions(**{n: values[n] for n in vars(Conditions()) if n in values})
    force = None if curve is None else _read_series(curve, "curve")
    line = None if cor_speeds is None else _read_series(cor_speeds, "cor_speeds")
    if force:
        _check_curve(force, impact.reduced_mass * impact.club_speed)
    if line and len(set(line.x.tolist())) < 2:
        raise UserError(f"{line.name} is refused: a line needs COR at two speeds or more")
    if line and len(line.y) == 2 and line.sigma is None:
        why = "two rows leave no residuals; add a column sigma, or rows"
        raise UserError(f"{line.name} is refused: {why}")
    return Measurements(impact, targets, force, line)


def _rows(path: Path, columns: Sequence[str]) -> list[tuple[str, dict[str, str]]]:
    """Where each row is, and its cells by column; rows without any are skipped."""
    try:
        reader = csv.DictReader(read_text(path).splitlines(), restval="")
        reader.fieldnames = header = [cell.strip().lower() for cell in reader.fieldnames or ()]
        table = [(reader.line_num, cells) for cells in reader if any(cells.values())]
    except csv.Error as error:
        raise UserError(f"{path} can't be read as CSV: {error}") from error
    if header not in ([*columns], [*columns, "sigma"]):
        names = ",".join(columns)
        why = f"its first line must be {names} or {names},sigma, not {','.join(header)!r}"
        raise UserError(f"{path} is refused: {why}")
    rows = [(f"{path}, row {n} (line {line})", cells) for n, (line, cells) in enumerate(table, 1)]
    for where, cells in rows:
        if len(cells) > len(header):
            raise UserError(f"{where} is refused: more cells than the first line has")
    return rows


def _read_series(given: Any, kind: str) -> Series:
    """A series from a CSV file, a mapping of columns, two or three arrays, or an array of rows."""
    names = (*COLUMNS[kind], "sigma")
    if isinstance(given, str | Path):
        read = _rows(Path(given), COLUMNS[kind])
        kind, where = str(given), [place for place, _ in read]
        rows: list[Any] = [tuple(cells.values()) for _, cells in read]
    else:
        if hasattr(given, "keys"):
            given = [given[name] for name in names if name in given]
        elif isinstance(given, np.ndarray) and len(given) > 3:
            given = given.T
        try:
            rows = list(zip(*given, strict=True))
        except (TypeError, ValueError) as error:
            raise UserError(f"{kind} must be arrays of one length: {', '.join(names)}") from error
        where = [f"{kind}, row {n + 1}" for n in range(len(rows))]
    if not rows or not 2 <= len(rows[0]) <= 3:
        raise UserError(f"{kind} is refused: it has no rows of {', '.join(names[:2])}")
    table = [
        [number(cell, name, place) for cell, name in zip(row, names)]
        for place, row in zip(where, rows)
    ]
    return Series(kind, where, *np.array(table).T)


def _check_curve(curve: Series, momentum: float) -> None:
    """Raise UserError for a curve that is no force in s and N; `momentum` is μ v, kg·m/s."""
    time, force = curve.x, curve.y
    if (backward := np.flatnonzero(np.diff(time) <= 0.0)).size:
        n = int(backward[0]) + 1
        raise UserError(
            f"{curve.rows[n]}: time = {time[n]:g} s isn't after {time[n - 1]:g} s; sort the rows "
            "by time and remove duplicates"
        )
    peak = int(force.argmax())
    where, newton = f"{curve.rows[peak]}: the largest force", f"{force[peak]:.4g}"
    if force[peak] <= -3.0 * force.min():
        raise UserError(
            f"{where} is {newton} N, no more than the rest: there is no touch in this curve (the "
            "force on the ball counts as positive)"
        )
    if (lasting := float(np.ptp(time[curve.contact]))) > 0.02:
        raise UserError(
            f"{where} belongs to a contact of about {lasting:.3g} s, where an impact lasts about "
            "600e-6: time must be in s, not ms or µs"
        )
    if (rows := len(curve.contact)) < 5:
        raise UserError(f"{where} is one of only {rows} rows in contact: 5 are needed")
    # 1 + COR, if momentum is conserved.
    ratio = float(np.trapezoid(force[curve.contact], time[curve.contact])) / momentum
    if not 0.5 < ratio < 3.0:
        raise UserError(
            f"{where} is {newton}, and the impulse {ratio:.2g} of reduced mass times club speed, "
            "where 1 to 2 is possible: force must be in N, not kN, and --club-speed in m/s"
        )
