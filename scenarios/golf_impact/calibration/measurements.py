"""Measurements of an impact: scalars, a force curve, COR at several speeds; read and validated."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact import closed_forms
from golf_impact.calibration.records import read_cells, read_table
from golf_impact.errors import UserError, unknown_name
from golf_impact.quantities import format_with_error
from golf_impact.toml import read_toml
from golf_impact.units import SYMBOLS, si_value, unit_of

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

#: Columns of the two kinds of series, the last one optional, and their units.
COLUMNS = {
    "curve": (("time", "force", "sigma"), ("s", "N", "N")),
    "cor_speeds": (("approach_speed", "cor", "sigma"), ("m/s", "1", "1")),
}

#: The impact in which curve and scalars are measured, if nothing else is given: speed (m/s),
#: masses (kg) and the force on the club head (N).
IMPACT = {"club_speed": 35.0, "m_club": 0.210, "m_ball": 0.04593, "club_force": 0.0}

#: Of these, what a curve has without being given.
_OF_CURVE = {name: IMPACT[name] for name in ("m_ball", "club_force")}

#: The σ of a scalar target without one, as a fraction of its value.
DEFAULT_SIGMA = 0.01

#: Ranges of numbers by name, ends excluded, and in words; wide enough for any impact, but not for
#: another unit.
_ABOVE_0 = (0.0, math.inf, "a finite number above 0")
_FINITE = (-math.inf, math.inf, "a finite number")
_SECONDS = (0.0, 0.1, "above 0 and below 0.1, in s (600e-6 for 600 µs)")
_KILOGRAMS = (0.0, 10.0, "above 0 and below 10, in kg (0.21 for 210 g)")
_ALLOWED = {
    "cor": (
        0.01,
        1.0,
        "above 0.01 and below 1: 1 loses no energy, more gains energy (0.8 for 80 %)",
    ),
    "exponent": (0.999999, 12.000001, "between 1 and 12, or the word free"),
    "max_force": (20.0, math.inf, "a finite number above 20, in N (6600 for 6.6 kN)"),
    **dict.fromkeys(("club_speed_after", "club_force", "time", "force"), _FINITE),
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
    where: Callable[[int], str]  #: the place of a row (from 0), for messages
    x: np.ndarray
    y: np.ndarray
    sigma: np.ndarray | None = None  #: of y; None if it follows from the residuals
    impact: Mapping[str, float] = field(default_factory=dict)  #: of a curve, as `IMPACT`
    notes: tuple[str, ...] = ()  #: what was changed or is missing, in sentences
    offset_error: float = 0.0  #: standard error of the offset that was subtracted

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
        return replace(self, x=self.x[every], y=self.y[every], sigma=sigma)


class Measurements:
    """All that a fit has to meet.

    Attributes:
        impact: of scalars, as `IMPACT`.
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


def _unit(name: str) -> str:
    name = name.removeprefix("sigma_")
    speed = name in ("predict", "approach_speed")
    return "m/s" if speed else unit_of(TARGETS.get(name, name))


def number(given: Any, name: str, where: str = "") -> float:
    """A number in its range; otherwise a UserError that names it, and where it is."""
    what = f"{where}: {name}" if where else name
    low, high, allowed = _ALLOWED.get(name, _ABOVE_0)
    try:
        value = si_value(given, _unit(name)) if isinstance(given, str) else float(given)
    except (TypeError, ValueError) as error:
        text = isinstance(given, str) and given
        why = str(error) if text else "it must be a number, e.g. 600e-6"
        raise UserError(f"{what} = {given!r} is refused: {why}", name, given, why) from None
    if not low < value < high:
        why = f"it must be {allowed}"
        raise UserError(f"{what} = {value:g} is refused: {why}", name, value, why)
    return value


def measurements(
    scalars: Mapping[str, float | None],
    file: Path | None = None,
    curve: Any = None,
    cor_speeds: Any = None,
    columns: str = "",
) -> Measurements:
    """Validated measurements, see `golf_impact.calibrate`; scalars given win over the file's.

    UserError: a value is impossible; it is named, or its file and row.
    """
    known = (*TARGETS, *IMPACT)
    given: dict[str, tuple[Any, str]] = {}
    for where, cells in _rows(file) if file else ():
        name = cells["target"].strip().lower().lstrip("-").replace("-", "_")
        if name in given:
            raise UserError(f"{where}: {name} is given twice")
        given[name] = cells["value"], where
        if cells.get("sigma"):
            given[f"sigma_{name}"] = cells["sigma"], where
    given |= {name: (value, "") for name, value in scalars.items() if value is not None}
    for name, (_, where) in given.items():
        if name not in known and name.removeprefix("sigma_") not in TARGETS:
            error = unknown_name("target", name, known)
            raise UserError(f"{where or 'calibrate'}: {error}", name, reason=error.reason)
    values = {name: number(value, name, where) for name, (value, where) in given.items()}
    targets = {}
    for name in TARGETS:
        sigma = values.get(f"sigma_{name}")
        if name in values:
            deviation = sigma or number(DEFAULT_SIGMA * abs(values[name]), f"sigma_{name}")
            targets[name] = Target(values[name], deviation, sigma is not None)
        elif sigma is not None:
            name = f"sigma_{name}"
            raise UserError(f"{name} is refused without {name[6:]}", name, sigma)
    impact = {name: values.get(name, default) for name, default in IMPACT.items()}
    curves = [] if curve is None else _curves(curve, values, columns)
    line = None if cor_speeds is None else _read_series(cor_speeds, "cor_speeds")
    if curves and "club_speed" not in values:
        if targets and any(one.impact != curves[0].impact for one in curves):
            raise UserError("scalars beside curves of several speeds need --club-speed, too")
        impact = dict(curves[0].impact)
    data = Measurements(targets, curves, line, impact)
    if line and np.ptp(line.x) == 0.0:
        raise UserError(f"{line.name} is refused: a line needs COR at two speeds or more")
    if line and len(line.y) == 2 and line.sigma is None:
        why = "two rows leave no residuals; add a column sigma, or rows"
        raise UserError(f"{line.name} is refused: {why}")
    return data


def _rows(path: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """The place of each row, and its cells by column."""
    (_, header), *rows = read_cells(path) or [(1, [""])]
    names = [cell.lower() for cell in header]
    if names not in (["target", "value"], ["target", "value", "sigma"]):
        why = "its first line must be target,value or target,value,sigma"
        raise UserError(f"{path} is refused: {why}, not {','.join(names)!r}")
    for n, (line, cells) in enumerate(rows, 1):
        where = f"{path}, row {n} (line {line})"
        if len(cells) > len(names):
            raise UserError(f"{where} is refused: more cells than the first line has")
        yield where, dict(zip_longest(names, cells, fillvalue=""))


def _curves(given: Any, values: Mapping[str, float], columns: str) -> list[Series]:
    """Curves, one or several, with their conditions; see `golf_impact.calibrate`."""
    several = (
        isinstance(given, list | tuple) and given and isinstance(given[0], str | Path | Mapping)
    )
    curves = []
    for one in _entries(given if several else [given], columns):
        own = {name: number(one[name], name, "curve") for name in IMPACT if name in one}
        impact = {**_OF_CURVE, **values, **own}
        if missing := [name for name in IMPACT if name not in impact]:
            words = "its conditions, e.g. --club-speed 40 --m-club 0.2"
            speeds = "of several ones --curve FILE.csv@SPEED for each"
            raise UserError(f"a curve needs {' and '.join(missing)}: {words}; {speeds}")
        curve = _read_series(one["curve"], "curve", str(one["columns"]))
        curve = replace(curve, impact={name: impact[name] for name in IMPACT})
        curves.append(_conditioned(curve))
        _check_impulse(curves[-1])
    return curves


def _entries(given: Iterable[Any], columns: str) -> Iterator[dict[str, Any]]:
    """Curves as `curve`, its columns, and its own conditions; those of TOML files, too."""
    for one in given:
        if isinstance(one, Mapping):
            yield {"columns": columns, **{n: one[n] for n in IMPACT if n in one}, "curve": one}
        elif not isinstance(one, str | Path):
            yield {"columns": columns, "curve": one}
        elif Path(one).suffix == ".toml":
            rows, keys = read_toml(one).get("curve"), ("file", "columns", *IMPACT)
            for row in rows if isinstance(rows, list) and rows else [None]:
                if not isinstance(row, dict) or not {"file"} <= {*row} <= {*keys}:
                    why = f"write a table [[curve]] for each, of file and {', '.join(keys[1:])}"
                    raise UserError(f"{one} lists no curves: {why}")
                file = Path(one).parent / str(row["file"])
                yield {"columns": columns, **row, "curve": file}
        else:
            path, _, speed = str(one).rpartition("@")
            alone = not path or Path(one).exists()
            of_speed = {} if alone else {"club_speed": speed}
            yield {"columns": columns, **of_speed, "curve": one if alone else path}


def _read_series(given: Any, kind: str, columns: str = "") -> Series:
    """A series from a CSV file, a mapping of columns, two or three arrays, or an array of rows."""
    names, units = COLUMNS[kind]
    if isinstance(given, str | Path):
        table = read_table(Path(given), names, units, columns)
        kind, read, where = str(given), table.columns, table.where
    else:
        if hasattr(given, "keys"):
            given = [given[name] for name in names if name in given]
        elif isinstance(given, np.ndarray) and len(given) > 3:
            given = given.T
        try:
            read = [*np.stack([np.asarray(column, float) for column in given])]
        except (TypeError, ValueError) as error:
            raise UserError(f"{kind} must be arrays of one length: {', '.join(names)}") from error

        def where(row: int) -> str:
            return f"{kind}, row {row + 1}"

    if not 2 <= len(read) <= 3 or not read[0].size:
        raise UserError(f"{kind} is refused: it has no rows of {', '.join(names[:2])}")
    for name, column in zip(names, read):
        low, high, _ = _ALLOWED.get(name, _ABOVE_0)
        if (bad := np.flatnonzero(~((column > low) & (column < high)))).size:
            number(column[bad[0]], name, where(int(bad[0])))
    x, y, *sigma = read
    return Series(kind, where, x, y, sigma[0] if sigma else None)


def _conditioned(curve: Series) -> Series:
    """The curve without an offset, with a force above 0, and without rows at the sensor's limit.

    UserError: it is no curve of a contact.
    """
    x, y, notes = curve.x, curve.y, []
    if (backward := np.flatnonzero(np.diff(x) <= 0.0)).size:
        n = int(backward[0]) + 1
        what = f"time = {x[n]:g} s isn't after {x[n - 1]:g} s"
        raise UserError(f"{curve.where(n)}: {what}; sort the rows by time and remove duplicates")
    few = max(1, min(len(y) // 20, 1000))
    ends = float(np.median(y[:few])), float(np.median(y[-few:]))
    level = min(ends)
    if max(ends) - y.min() > y.max() - min(ends):
        y, level = -y, -max(ends)
        notes.append("the force is negative; its sign was changed")
    peak = int(y.argmax())
    inside = np.flatnonzero(y - level > 0.25 * (y[peak] - level))
    lasting = float(np.ptp(x[inside])) if len(inside) else 0.0
    before = y[: inside[0]][x[: inside[0]] < x[inside[0]] - 0.25 * lasting] if len(inside) else y
    offset = error = 0.0
    if len(before) >= 10:
        offset, error = float(before.mean()), float(before.std()) / math.sqrt(len(before))
    if abs(offset) > 5.0 * error:
        rows = f"the mean of {len(before)} rows before contact, was subtracted"
        notes.append(f"an offset of {format_with_error(offset, error)} N, {rows}")
        y = y - offset
    else:
        error = 0.0
    why = ""
    if y[peak] <= -3.0 * y.min():
        why = "is no more than the rest: there is no touch"
    elif lasting > 0.02:
        unit = "ms" if lasting < 20.0 else "µs"
        head = f"time [{unit}] in its header, or --columns 'time [{unit}],force'"
        why = f"is in a contact of {lasting:.3g} s, not of 600e-6: for {unit} write {head}"
    elif len(inside) < 5:
        rows = "1 row" if len(inside) == 1 else f"{len(inside)} rows"
        why = f"is one of only {rows} in contact: 5 are needed"
    elif peak == 0 or inside[-1] == 0:
        why = "is the first: the record was triggered too late"
    if why:
        raise UserError(f"{curve.where(peak)}: the largest force, {y[peak]:.4g}, {why}")
    clipped = y == y[peak]
    if max(4, 0.1 * len(inside)) <= np.count_nonzero(clipped):
        notes.append(f"{np.count_nonzero(clipped)} rows at the largest force are left out: clipped")
    else:
        clipped[:] = False
    for at, what in ((slice(3), "begins"), (slice(-3, None), "ends")):
        if np.median(y[at]) > 0.1 * y[peak]:
            share = 100.0 * np.median(y[at]) / y[peak]
            notes.append(f"the record {what} in contact, at {share:.0f} % of the largest force")
    kept, sigma = ~clipped, curve.sigma
    sigma = sigma if sigma is None else sigma[kept]
    return replace(curve, x=x[kept], y=y[kept], sigma=sigma, notes=tuple(notes), offset_error=error)


def _check_impulse(curve: Series) -> None:
    """Raise UserError for a curve whose impulse isn't (1 + COR) times reduced mass times speed.

    A force on the head adds its own impulse times reduced mass over the head's.
    """
    (speed, m_club, m_ball, pushed), x = (curve.impact[name] for name in IMPACT), curve.x
    first, last = x[curve.contact[[0, -1]]]
    margin = 0.25 * (last - first)
    inside = (x > first - margin) & (x < last + margin)
    impulse = float(np.trapezoid(curve.y[inside], x[inside]))
    reduced = closed_forms.reduced_mass(m_club, m_ball)
    impulse -= pushed * (last - first) * reduced / m_club
    ratio = impulse / (reduced * speed)
    # An incomplete record has less.
    if (0.5 if curve.notes else 0.95) < ratio < 2.05:
        return
    hints = []
    for symbol in ("mph", "km/h"):
        if 1.0 < ratio / SYMBOLS[symbol][1] < 2.0:
            hints.append(f"{speed:g} looks like {symbol}: write --club-speed {speed:g}{symbol}")
    if 1.0 < 1e3 * ratio < 2.0:
        hints.append("force looks like kN: write force [kN] in its header, or --columns")
    hints.append(f"it fits club speeds of {speed * ratio / 2.0:.3g} to {speed * ratio:.3g} m/s")
    masses = [impulse / (speed * part) for part in (2.0, 1.0)]
    if masses[0] < m_ball:
        least, most = (m * m_ball / (m_ball - m) if m < m_ball else math.inf for m in masses)
        hints.append(f"or --m-club from {least:.3g} to {most:.3g} kg")
    raise UserError(
        f"{curve.name}: its impulse, {impulse:.4g} N·s, is {ratio:.3g} times reduced mass times "
        f"club speed ({speed:g} m/s, club {m_club:g} kg), where 1 to 2, 1 + COR, is possible; "
        f"{', '.join(hints)}"
    )
