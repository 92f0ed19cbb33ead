"""Measurements of an impact: scalars, a force curve, COR at several speeds; read and validated."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.errors import UserError
from golf_impact.facts import closed_forms

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

#: The impact in which curve and scalars are measured, if nothing else is given: speed (m/s) and
#: masses (kg).
IMPACT = {"club_speed": 35.0, "m_club": 0.210, "m_ball": 0.04593}

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
    impact: Mapping[str, float] = field(default_factory=dict)  #: of a curve, as `IMPACT`

    @property
    def contact(self) -> np.ndarray:
        """Rows of a curve with more than a quarter of the largest force."""
        return np.flatnonzero(self.y > 0.25 * self.y.max())

    @cached_property
    def spacing(self) -> float:
        """Time between rows, s."""
        return float(np.median(np.diff(self.x)))

    def around_contact(self, rows: int) -> Series:
        """A curve of more than so many: an eighth of them or so many, of contact and margins."""
        first, last = self.contact[[0, -1]].tolist()
        margin = (last - first) // 2 + 1
        first, last = max(first - margin, 0), last + margin + 1
        every = slice(first, last, min(8, -((first - last) // rows)))
        if len(self.x) <= rows:
            return self
        sigma = self.sigma if self.sigma is None else self.sigma[every]
        return replace(self, rows=(), x=self.x[every], y=self.y[every], sigma=sigma)


class Measurements:
    """All that a fit has to meet.

    Attributes:
        impact: of scalars, speed (m/s) and masses (kg).
        curves: force curves by name: curve, curve 2, …
        series: curves and COR over speed, as far as there are any.
        values: all measured values: scalars, forces, CORs.
        groups: where each of these are in `values`.
        sized: whether anything depends on the stiffness.
    """

    def __init__(
        self,
        targets: Mapping[str, Target],
        curves: Sequence[Series] = (),
        cor_speeds: Series | None = None,
        impact: Mapping[str, float] = IMPACT,
    ) -> None:
        self.targets, self.cor_speeds, self.impact = targets, cor_speeds, impact
        self.reduced_mass = closed_forms.reduced_mass(impact["m_club"], impact["m_ball"])
        self.curves = {f"curve {n + 1}" if n else "curve": one for n, one in enumerate(curves)}
        self.series = self.curves | ({"cor_speeds": cor_speeds} if cor_speeds else {})
        parts = {"targets": np.array([target.value for target in targets.values()])}
        parts |= {name: one.y for name, one in self.series.items()}
        self.values = np.concatenate([*parts.values()])
        ends = np.cumsum([len(part) for part in parts.values()]).tolist()
        pairs = zip(parts.items(), ends)
        self.groups = {name: slice(end - len(p), end) for (name, p), end in pairs if len(p)}
        self.sized = bool(curves) or any(name not in RESTITUTION for name in targets)


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
    known = (*TARGETS, *IMPACT)
    given: dict[str, tuple[Any, str]] = {}
    for where, cells in _rows(file, ("target", "value")).items() if file else ():
        name = cells["target"].strip().lower().lstrip("-").replace("-", "_")
        if name in given:
            raise UserError(f"{where}: {name} is given twice")
        given[name] = cells["value"], where
        if cells.get("sigma"):
            given[f"sigma_{name}"] = cells["sigma"], where
    given |= {name: (value, "") for name, value in scalars.items() if value is not None}
    for name, (_, where) in given.items():
        if name not in known and name.removeprefix("sigma_") not in TARGETS:
            words = f"there is no target {name!r}: choose from {', '.join(known)}"
            raise UserError(f"{where or 'calibrate'}: {words}")
    values = {name: number(value, name, where) for name, (value, where) in given.items()}
    targets = {}
    for name in TARGETS:
        sigma = values.get(f"sigma_{name}")
        if name in values:
            deviation = sigma or number(DEFAULT_SIGMA * abs(values[name]), f"sigma_{name}")
            targets[name] = Target(values[name], deviation, sigma is not None)
        elif sigma is not None:
            raise UserError(f"{option(f'sigma_{name}')} is refused without {option(name)}")
    impact = {name: values.get(name, default) for name, default in IMPACT.items()}
    curves = [] if curve is None else [replace(_read_series(curve, "curve"), impact=impact)]
    line = None if cor_speeds is None else _read_series(cor_speeds, "cor_speeds")
    data = Measurements(targets, curves, line, impact)
    for force in curves:
        _check_curve(force, data.reduced_mass * impact["club_speed"])
    if line and np.ptp(line.x) == 0.0:
        raise UserError(f"{line.name} is refused: a line needs COR at two speeds or more")
    if line and len(line.y) == 2 and line.sigma is None:
        why = "two rows leave no residuals; add a column sigma, or rows"
        raise UserError(f"{line.name} is refused: {why}")
    return data


def _rows(path: Path, columns: Sequence[str]) -> dict[str, dict[str, str]]:
    """The cells of each row by column, by the row's place; rows without any are skipped."""
    rows: dict[str, dict[str, str]] = {}
    try:
        reader = csv.DictReader(path.read_text("utf-8-sig").splitlines(), restval="")
        reader.fieldnames = header = [cell.strip().lower() for cell in reader.fieldnames or ()]
        for cells in reader:
            if any(cells.values()):
                rows[f"{path}, row {len(rows) + 1} (line {reader.line_num})"] = cells
    except OSError as error:
        raise UserError(f"can't read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise UserError(f"{path} is no text in UTF-8: save it as UTF-8") from error
    except csv.Error as error:
        raise UserError(f"{path} can't be read as CSV: {error}") from error
    names = ",".join(columns)
    if ",".join(header) not in (names, f"{names},sigma"):
        why = f"its first line must be {names} or {names},sigma, not {','.join(header)!r}"
        raise UserError(f"{path} is refused: {why}")
    for where, cells in rows.items():
        if len(cells) > len(header):
            raise UserError(f"{where} is refused: more cells than the first line has")
    return rows


def _read_series(given: Any, kind: str) -> Series:
    """A series from a CSV file, a mapping of columns, two or three arrays, or an array of rows."""
    names = (*COLUMNS[kind], "sigma")
    if isinstance(given, str | Path):
        kind, read = str(given), _rows(Path(given), COLUMNS[kind])
        rows: dict[str, Any] = {where: tuple(cells.values()) for where, cells in read.items()}
    else:
        if hasattr(given, "keys"):
            given = [given[name] for name in names if name in given]
        elif isinstance(given, np.ndarray) and len(given) > 3:
            given = given.T
        try:
            rows = {f"{kind}, row {n}": row for n, row in enumerate(zip(*given, strict=True), 1)}
        except (TypeError, ValueError) as error:
            raise UserError(f"{kind} must be arrays of one length: {', '.join(names)}") from error
    if not rows or not 2 <= len(next(iter(rows.values()))) <= 3:
        raise UserError(f"{kind} is refused: it has no rows of {', '.join(names[:2])}")
    table = [
        [number(cell, name, where) for cell, name in zip(row, names)] for where, row in rows.items()
    ]
    return Series(kind, [*rows], *np.array(table).T)


def _check_curve(curve: Series, momentum: float) -> None:
    """Raise UserError for a curve that is no force in s and N; `momentum` is μ v, kg·m/s."""
    time, force = curve.x, curve.y
    if (backward := np.flatnonzero(np.diff(time) <= 0.0)).size:
        n = int(backward[0]) + 1
        what = f"time = {time[n]:g} s isn't after {time[n - 1]:g} s"
        raise UserError(f"{curve.rows[n]}: {what}; sort the rows by time and remove duplicates")
    peak, inside = int(force.argmax()), curve.contact
    lasting = float(np.diff(time[inside]).sum())
    # 1 + COR, if momentum is conserved.
    ratio = float(np.trapezoid(force[inside], time[inside])) / momentum
    why = ""
    if force[peak] <= -3.0 * force.min():
        why = "is no more than the rest: there is no touch (force on the ball counts as positive)"
    elif lasting > 0.02:
        why = f"is in a contact of {lasting:.3g} s, not of 600e-6: time must be in s, not ms or µs"
    elif len(inside) < 5:
        why = f"is one of only {len(inside)} rows in contact: 5 are needed"
    elif not 0.5 < ratio < 3.0:
        impulse = f"an impulse of {ratio:.2g} times reduced mass times club speed"
        units = "force must be in N, not kN, and --club-speed in m/s"
        why = f"belongs to {impulse}, where 1 to 2 is possible: {units}"
    if why:
        raise UserError(f"{curve.rows[peak]}: the largest force, {force[peak]:.4g}, {why}")
