"""Measurements of an impact: scalars, a force curve, COR at several speeds; read and validated."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

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

#: A force that lasts longer than this isn't in seconds, s: halfway (in logarithms) between the
#: 0.6 ms of an impact and the 0.6 that they are in milliseconds.
_LONGEST_CONTACT = 0.02

#: Impulse of a curve over μ v: between 1 (COR 0) and 2 (COR 1), doubted if well outside and refused
#: if the force must be in another unit (kN give 0.001 to 0.002).
_DOUBTED, _IMPOSSIBLE = (0.8, 2.2), (0.03, 60.0)

#: A peak below this multiple of the curve's noise is noise.
_ABOVE_NOISE = 6.0

#: Measurements that contradict a conservation law by more than this many σ are refused.
_CONTRADICTION = 3.0


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
            if not (math.isfinite(number) and number > 0.0):
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
    """A measured series, SI units: arrays of one shape (n,).

    Attributes:
        columns: the names of x and y, CURVE or COR_SPEEDS.
        name: the file, or the argument in Python.
        sigma: standard deviations of y, or None if they follow from the residuals.
        lines: the line of each row in the file; empty for arrays.
    """

    columns: tuple[str, str]
    name: str
    x: np.ndarray
    y: np.ndarray
    sigma: np.ndarray | None = None
    lines: tuple[int, ...] = ()

    def row(self, n: int) -> str:
        """Where the n-th row (from 0) is, for messages."""
        line = f" (line {self.lines[n]})" if self.lines else ""
        return f"{self.name}, row {n + 1}{line}"

    def every(self, stride: int) -> Series:
        """Every so many rows."""
        sigma = None if self.sigma is None else self.sigma[::stride]
        return Series(self.columns, self.name, self.x[::stride], self.y[::stride], sigma)


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
        """Where scalars, curve and CORs are in `values`."""
        groups, at = {}, len(self.targets)
        if at:
            groups["targets"] = slice(0, at)
        for name, one in self.series.items():
            groups[name] = slice(at, at := at + len(one.y))
        return groups

    @property
    def sized(self) -> bool:
        """Whether anything depends on the stiffness."""
        return self.curve is not None or any(name not in RESTITUTION for name in self.targets)


def option(name: str) -> str:
    return "--" + name.replace("_", "-")


def target(name: str, value: float, sigma: float | None = None) -> Target:
    """A scalar target, validated.

    Raises:
        UserError: the value or its σ is impossible.
    """
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
    if sigma is None:
        if value == 0.0:
            raise UserError(f"{option(name)} 0 needs {deviation}: the default σ is 1 % of 0")
        return Target(name, value, DEFAULT_SIGMA * abs(value), False)
    if not (math.isfinite(sigma) and sigma > 0.0):
        raise UserError(
            f"{deviation} {sigma!r} is refused: a standard deviation must be a finite number above "
            f"0 {unit}".rstrip()
        )
    return Target(name, value, sigma)


def _why_no_cor(value: float) -> str | None:
    if 0.0 < value < 1.0:
        return None
    why = "leaves the ball on the club" if value <= 0.0 else "gains energy"
    why = "loses no energy (set b = 0 for that)" if value == 1.0 else why
    percent = f"; write {value / 100.0:g} for {value:g} %" if 1.0 < value < 100.0 else ""
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
        UserError: a value is impossible, naming it, or its file and row.
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
            raise UserError(
                f"{option('sigma_' + name)} {sigma!r} is refused without {option(name)}, whose "
                "standard deviation it is"
            )
    impact = Conditions(**{**also, **stated})
    forces = None if curve is None else series(curve, CURVE)
    speeds = None if cor_speeds is None else series(cor_speeds, COR_SPEEDS)
    if forces is not None:
        _check_curve(forces, impact)
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
        if name not in TARGETS and name not in exact:
            raise UserError(
                f"{where}: there is no target {cells['target']!r}: choose from "
                f"{', '.join(TARGETS)}, or {', '.join(exact)}"
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
    if not set(columns) <= set(header) <= {*columns, "sigma"}:
        raise UserError(
            f"{path} is refused: its first line must be {','.join(columns)} or "
            f"{','.join(columns)},sigma, not {','.join(header)!r}"
        )
    if len(set(header)) < len(header):
        raise UserError(f"{path} is refused: its first line names a column twice: {header}")
    for line, row in enumerate(rows[1:], 2):
        cells = [cell.strip() for cell in row]
        if len(cells) > len(header):
            raise UserError(f"{path}, line {line} is refused: more cells than the first line has")
        if any(cells):
            yield line, dict(zip(header, cells))


def _number(text: str, where: str) -> float | None:
    if not text:
        return None
    try:
        return float(text)
    except ValueError:
        raise UserError(f"{where}: {text!r} is no number (e.g. 600e-6)") from None


def series(given: Any, columns: tuple[str, str]) -> Series:
    """A series from a CSV file, a mapping of columns, or a sequence of two or three arrays.

    Raises:
        UserError: it has no rows, unequal lengths, numbers missing, NaN or infinity, or σ ≤ 0.
    """
    names = (*columns, "sigma")
    lines: list[int] = []
    rows: list[list[float | None]] = []
    if isinstance(given, str | Path):
        name = str(given)
        for line, cells in _rows(Path(given), columns):
            where = f"{name}, row {len(rows) + 1} (line {line})"
            row = [_number(cells[one], where) for one in names if one in cells]
            if None in row or len(row) < (len(rows[0]) if rows else 2):
                raise UserError(f"{where}: a number is missing")
            rows.append(row)
            lines.append(line)
        arrays = [np.array(column, float) for column in zip(*rows)]
    else:
        name = "curve" if columns == CURVE else "cor_speeds"
        if hasattr(given, "keys"):
            given = [given[one] for one in names if one in given.keys()]  # noqa: SIM118
        try:
            arrays = [np.array(column, float) for column in given if column is not None]
        except (TypeError, ValueError) as error:
            raise UserError(f"{name} must be arrays of numbers ({error})") from error
        if not 2 <= len(arrays) <= 3 or any(a.shape != arrays[0].shape[:1] for a in arrays):
            raise UserError(f"{name} must be two or three arrays of one length: {', '.join(names)}")
    if not arrays or not arrays[0].size:
        raise UserError(f"{name} is refused: it has no rows of {', '.join(columns)}")
    made = Series(columns, name, arrays[0], arrays[1], *arrays[2:], lines=tuple(lines))
    for column, values in zip(names, arrays):
        bad = ~np.isfinite(values) | ((values <= 0.0) & (column == "sigma"))
        if bad.any():
            n = int(bad.argmax())
            what = "a finite number" + " above 0" * (column == "sigma")
            raise UserError(f"{made.row(n)}: {column} = {values[n]:g} must be {what}")
    return made


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
        raise UserError(
            f"{speeds.name} is refused: two rows leave no residuals; add a column sigma, or rows"
        )


def _check_curve(curve: Series, conditions: Conditions) -> None:
    """Raises UserError for a curve that is no contact force in s and N over the whole contact."""
    time, force = curve.x, curve.y
    backward = np.flatnonzero(np.diff(time) <= 0.0)
    if backward.size:
        n = int(backward[0]) + 1
        raise UserError(
            f"{curve.row(n)}: time = {time[n]:g} s isn't after {time[n - 1]:g} s; sort the rows by "
            "time and remove duplicates"
        )
    peak = int(force.argmax())
    where = f"{curve.row(peak)}: the largest force"
    if force[peak] <= _ABOVE_NOISE * noise(force) or force[peak] <= -force.min():
        sign = " (the force on the ball counts as positive)" if force[peak] <= -force.min() else ""
        raise UserError(
            f"{where} is {force[peak]:.4g} N, no more than the rest: there is no touch in this "
            f"curve{sign}"
        )
    inside = contact_rows(force)
    first, last = int(inside[0]), int(inside[-1])
    for n, what, remedy in (
        (0, "begins", "let it begin before touch"),
        (len(force) - 1, "ends", "let it end after separation"),
    ):
        if force[n] > 0.5 * force[peak]:
            raise UserError(
                f"{curve.row(n)}: the record {what} at {force[n]:.4g} N, more than half of the "
                f"largest force, so there is no touch or no separation in it; {remedy}"
            )
    lasting = float(time[last] - time[first])
    if lasting > _LONGEST_CONTACT:
        raise UserError(
            f"{where} belongs to a contact of about {lasting:.3g} s, where an impact lasts about "
            "600e-6: time must be in s, not ms or µs"
        )
    if len(inside) < 5:
        raise UserError(
            f"{where} is one of only {len(inside)} rows in contact: at least 5 are needed"
        )
    ratio = impulse_ratio(curve, conditions)
    if not _IMPOSSIBLE[0] < ratio < _IMPOSSIBLE[1]:
        unit = "not kN" if ratio < 1.0 else "not mN"
        raise UserError(
            f"{where} is {force[peak]:.4g}, and the impulse {ratio:.2g} of reduced mass times club "
            f"speed, where 1 to 2 is possible: force must be in N, {unit}, and --club-speed in m/s"
        )


def noise(force: np.ndarray) -> float:
    """The standard deviation of a curve's noise from its third differences, N; robust."""
    if len(force) < 8:
        return 0.0
    differences = np.abs(np.diff(force, 3))
    # A median of half-normal values over √20, the norm of (1, -3, 3, -1).
    return float(np.median(differences)) / (0.6745 * math.sqrt(20.0))


def contact_rows(force: np.ndarray) -> np.ndarray:
    """Rows around the peak with a force above a tenth of it, and above three times the noise."""
    peak = int(force.argmax())
    below = np.flatnonzero(force < max(0.1 * force[peak], 3.0 * noise(force)))
    before, after = below[below < peak], below[below > peak]
    begin = int(before[-1]) + 1 if before.size else 0
    end = int(after[0]) if after.size else len(force)
    return np.arange(begin, end)


def impulse_ratio(curve: Series, conditions: Conditions) -> float:
    """The impulse in contact over μ v: 1 + COR, where momentum is conserved."""
    rows = contact_rows(curve.y)
    rows = np.arange(max(rows[0] - 1, 0), min(rows[-1] + 2, len(curve.y)))
    impulse = float(np.trapezoid(curve.y[rows], curve.x[rows]))
    return impulse / (conditions.reduced_mass * conditions.club_speed)


def doubts(data: Measurements) -> list[str]:
    """Sentences on values that may be in another unit; they are taken as they are."""
    words = [
        f"{option(name)} {data.targets[name].value:g} is taken in s: write e.g. 600e-6 for 600 µs."
        for name in ("contact_time", "time_of_max_force")
        if name in data.targets and data.targets[name].value > _LONG
    ]
    force = data.targets.get("max_force")
    if force and force.value < _SOFT:
        words.append(f"--max-force {force.value:g} is taken in N: write e.g. 6600 for 6.6 kN.")
    if data.curve is not None:
        ratio = impulse_ratio(data.curve, data.conditions)
        if not _DOUBTED[0] < ratio < _DOUBTED[1]:
            words.append(
                f"The impulse of {data.curve.name} is {ratio:.2f} of reduced mass times club speed "
                f"({data.conditions.club_speed:g} m/s), which should be 1 + COR, between 1 and 2: "
                "check --club-speed, --m-club, --m-ball and the unit of force."
            )
    masses = {f"{option(n)} ": getattr(data.conditions, n) for n in ("m_club", "m_ball")}
    return [*words, *doubts_of_mass(masses)]


def check_together(data: Measurements, law: int) -> None:
    """Raise UserError for scalars that no contact at all has together; law 2 conserves momentum."""
    targets = data.targets
    time, peak = targets.get("contact_time"), targets.get("time_of_max_force")
    if time and peak and peak.value >= time.value:
        raise UserError(
            f"--time-of-max-force {peak.value!r} is refused: the largest force can't come after "
            f"the contact's end, --contact-time {time.value!r}"
        )
    u = data.conditions.club_speed
    ball, club, cor = (targets.get(name) for name in RESTITUTION)
    speed = ball or club
    if ball and club:
        names = f"--ball-speed {ball.value!r} with --club-speed-after {club.value!r}"
        implied, sigma = (ball.value - club.value) / u, math.hypot(ball.sigma, club.sigma) / u
        if law == 2:
            _check_momentum(ball, club, data.conditions)
        deviation = abs(implied - cor.value) / math.hypot(sigma, cor.sigma) if cor else 0.0
        if cor and deviation > _CONTRADICTION:
            raise UserError(
                f"--cor {cor.value!r} is refused beside these speeds: (ball - club) / club speed "
                f"= {implied:.6g}, a deviation of {deviation:.1f} σ (at most {_CONTRADICTION:g})"
            )
    elif speed and law == 2:
        names = f"{option(speed.name)} {speed.value!r}"
        implied, sigma = restitution(speed, data.conditions)
    else:
        return
    if implied - sigma >= 1.0 or implied + sigma <= 0.0:
        why = "more energy than there was" if implied > 0.0 else "a ball that doesn't leave"
        raise UserError(
            f"{names} at a club speed of {u:g} m/s would be a COR of {implied:.4g}, {why}; it "
            "must be above 0 and below 1"
        )


def _check_momentum(ball: Target, club: Target, conditions: Conditions) -> None:
    m_club, m_ball = conditions.m_club, conditions.m_ball
    start = m_club * conditions.club_speed
    end = m_club * club.value + m_ball * ball.value
    sigma = math.hypot(m_club * club.sigma, m_ball * ball.sigma)
    if abs(end - start) > _CONTRADICTION * sigma:
        raise UserError(
            f"these speeds don't conserve momentum (law 2 does): {start:.6g} N.s before, {end:.6g} "
            f"N.s after, a deviation of {abs(end - start) / sigma:.1f} σ (at most "
            f"{_CONTRADICTION:g}; σ = {sigma:.2g} N.s); correct speeds or masses, or give larger "
            "--sigma-… values"
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
