"""What was measured in impacts on a ball at rest, and models of it. SI units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyfit, polyval
from scipy.interpolate import CubicSpline

from golf_impact.api import run_impact, run_trajectory
from golf_impact.data import units
from golf_impact.data.errors import UserError, refused, unknown_name
from golf_impact.data.runs import reduced_mass
from golf_impact.data.units import SYMBOLS, unit_of
from golf_impact.studies.calibrate import records
from golf_impact.studies.calibrate.records import read_table
from golf_impact.studies.intervals import RANGES

#: Targets that depend on the damping alone, and the FMU's outputs. An impact of two bodies has one
#: COR, so that all of them together are one independent measurement.
RESTITUTION = {
    "ball_speed": "ball_velocity", "club_speed_after": "club_velocity",
    "cor": "coefficient_of_restitution", "smash_factor": "smash_factor",
    "energy_efficiency": "energy_efficiency", "impulse": "impulse",
}  # fmt: skip

#: Outputs of the FMU that may be measured, by the name that results have.
TARGETS = RESTITUTION | {
    name: name for name in ("contact_time", "max_force", "time_of_max_force", "max_compression",
                            "contact_displacement")
}  # fmt: skip

#: The impact of a measurement, if nothing else is given: speed (m/s) and masses (kg).
IMPACT = {"club_speed": 35.0, "m_club": 0.210, "m_ball": 0.04593}

#: Parameters of a curve in a fit, with their units in SI units: the instant of touch since the
#: curve's origin, offset and drift of its baseline. Their scales are alike.
UNITS = {"touch": 1e-6, "offset": 1.0, "drift": 1e3}

#: Baselines of a sensor by the number of their coefficients; rows outside contact that one needs.
BASELINES, _OUTSIDE = ("zero", "constant", "linear"), 10

#: The σ of a scalar without one, as a fraction of its value.
DEFAULT_SIGMA = 0.01

#: Of more rows in contact the force is a cubic spline between so many instants.
_INSTANTS = 1000

#: Ranges of numbers by name, ends excluded, and in words; wide enough for any impact, but not for
#: another unit.
_ABOVE_0 = (0.0, math.inf, "a finite number above 0")
_FINITE = (-math.inf, math.inf, "a finite number")
_SECONDS = (0.0, 0.1, "above 0 and below 0.1, in s (600e-6 for 600 µs)")
_KILOGRAMS = (0.0, 10.0, "above 0 and below 10, in kg (0.21 for 210 g)")
_COR = "above 0.01 and below 1: 1 loses no energy, more gains energy (0.8 for 80 %)"
_ALLOWED = {
    "cor": (0.01, 1.0, _COR),
    "exponent": (0.999999, 12.000001, "between 1 and 12, or the word free"),
    **dict.fromkeys(("b", "restitution_slope"), (-1e-300, math.inf, "0 or more")),
    "restitution_at_rest": (0.0, 1.000001, "above 0, at most 1"),
    "max_force": (20.0, math.inf, "a finite number above 20, in N (6600 for 6.6 kN)"),
    **dict.fromkeys(("club_speed_after", "time", "force"), _FINITE),
    **dict.fromkeys(("contact_time", "time_of_max_force"), _SECONDS),
    **dict.fromkeys(("m_club", "m_ball"), _KILOGRAMS),
}

#: Values by name: those of the law, of an impact, and of curves.
Values = Mapping[str, Any]


def inputs(values: Values, impact: Mapping[str, float]) -> dict[str, Any]:
    """Inputs and parameters of the FMU: of law 2, and of an impact as far as it isn't fitted."""
    fitted = {name: values[name] for name in (*RANGES, *IMPACT) if name in values}
    return {"law": 2, **impact, **fitted}


def compute_scalars(names: Sequence[str], values: Values) -> dict[str, float]:
    """Scalars of these names, by the engine."""
    found = run_impact([TARGETS[name] for name in names], **values)
    if any(map(math.isnan, found.values())):
        raise UserError("the bodies don't separate")
    return dict(zip(names, found.values()))


class Measured(NamedTuple):
    """A number with its standard deviation."""

    value: float
    sigma: float
    stated: bool = True  #: whether σ was given; otherwise it is the default


@dataclass(frozen=True)
class Scalars:
    """Results of one impact, and parameters of it that are known beforehand."""

    measured: Mapping[str, Measured]
    impact: Mapping[str, float]

    @property
    def y(self) -> np.ndarray:
        return np.array([one.value for one in self.measured.values()])

    @property
    def guess(self) -> np.ndarray:
        """Its σ."""
        return np.array([one.sigma for one in self.measured.values()])

    @property
    def targets(self) -> list[str]:
        """Names of the results."""
        return [name for name in self.measured if name in TARGETS]

    def model(self, values: Values) -> np.ndarray:
        found = {**values, **compute_scalars(self.targets, inputs(values, self.impact))}
        return np.array([found[name] for name in self.measured])


@dataclass(frozen=True)
class Series:
    """COR against approach speed, arrays (n,); the parent of curves."""

    name: str  #: the file, or the argument in Python
    x: np.ndarray
    y: np.ndarray
    places: np.ndarray  #: of the rows, for messages: "line 5" of a file, "row 5" of an array
    sigma: np.ndarray | None = None  #: of y; None if it follows from the residuals
    step: float = 0.0  #: the resolution of y
    notes: tuple[str, ...] = ()  #: what was changed, left out or is missing, in sentences
    clipped: bool = False  #: whether rows at a sensor's limit are left out

    @property
    def signal(self) -> np.ndarray:
        """What the law describes of y."""
        return self.y

    @property
    def guess(self) -> np.ndarray:
        """σ; where it isn't given 1 % of the largest value, until residuals determine it."""
        return np.full(len(self.y), 0.01 * self.signal.max()) if self.sigma is None else self.sigma

    def rows(self, chosen: slice | np.ndarray, **changes: Any) -> Any:
        """These rows alone."""
        sigma = self.sigma if self.sigma is None else self.sigma[chosen]
        x, y, places = (of[chosen] for of in (self.x, self.y, self.places))
        return replace(self, x=x, y=y, sigma=sigma, places=places, **changes)

    def error(self, row: int, why: str) -> UserError:
        """The error for a row (from 0)."""
        return UserError(f"{self.name}, {self.places[row]}: {why}")

    def model(self, values: Values) -> np.ndarray:
        """A line, from which law 2 takes its damping."""
        cor = values["restitution_at_rest"] - values["restitution_slope"] * self.x
        if cor.min() <= 0.0:
            raise UserError("COR isn't above 0 at these speeds")
        return cor


@dataclass(frozen=True)
class Curve(Series):
    """Contact force over time, with any zero of time and perhaps a baseline."""

    impact: Mapping[str, float] = field(default_factory=IMPACT.copy)
    suffix: str = ""  #: of its own parameters: touch_2
    origin: float = 0.0  #: the instant of the first row in contact, s
    #: Offset at `origin` (N) and drift (N/s) of the sensor, as far as it has them, by the rows
    #: before and after contact.
    baseline: tuple[float, ...] = ()

    @cached_property
    def signal(self) -> np.ndarray:
        """y without the baseline."""
        return self.y - np.polyval(self.baseline[::-1], self.x - self.origin)

    @cached_property
    def contact(self) -> np.ndarray:
        """Rows with more than a quarter of the largest force."""
        return np.flatnonzero(self.signal > 0.25 * self.signal.max())

    @cached_property
    def spacing(self) -> float:
        """Time between rows, s."""
        return float(np.median(np.diff(self.x)))

    def thinned(self, rows: int) -> Curve:
        """If there are more rows, so many of contact and margins, or an eighth of them."""
        if len(self.x) <= rows:
            return self
        first, last = self.contact[[0, -1]].tolist()
        margin = (last - first) // 2 + 1
        first, last = max(first - margin, 0), last + margin + 1
        return self.rows(slice(first, last, min(8, math.ceil((last - first) / rows))))

    def since_touch(self, values: Values) -> np.ndarray:
        return self.x - self.origin - UNITS["touch"] * values["touch" + self.suffix]

    def model(self, values: Values) -> np.ndarray:
        """Force and baseline."""
        own = [UNITS[of] * values.get(of + self.suffix, 0.0) for of in ("drift", "offset")]
        times, law = self.since_touch(values), inputs(values, self.impact)
        force = np.polyval(own, self.x - self.origin)
        end = compute_scalars(["contact_time"], law)["contact_time"]
        inside = (times > 0.0) & (times < end)
        rows = instants = times[inside]
        if len(rows) > _INSTANTS:  # denser towards touch
            instants = end * np.linspace(1e-3, 1.0 - 1e-9, _INSTANTS) ** 2
        sampled = run_trajectory(0, ["force"], times=instants, **law)["force"]
        if rows is not instants:
            sampled = CubicSpline(np.sqrt(instants), sampled)(np.sqrt(rows))
        force[inside] += sampled
        return force


def number(given: Any, name: str, where: str = "") -> float:
    """A number in its range; otherwise a UserError that names it, and where it is."""
    of = name.removeprefix("sigma_")
    unit = "m/s" if of == "approach_speed" else unit_of(TARGETS.get(of, of))
    what = f"{where}: {name}" if where else name
    value = units.number(what, given, unit)
    low, high, allowed = _ALLOWED.get(name, _ABOVE_0)
    if not low < value < high:
        raise refused(name, value, f"it must be {allowed}", f"{what} = {value:g}")
    return value


def measured(given: Any, name: str, where: str = "") -> Measured:
    """A number and its σ: a pair, or the text "600us±6us" (also with +-), in its unit."""
    parts = given if isinstance(given, tuple) else (given,)
    if isinstance(given, str) and len(texts := re.split(r"±|\+/?-", given)) == 2:
        # A unit of one of them is that of both.
        symbols = [re.sub(r"^\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*", "", text) for text in texts]
        shared = symbols[0] or symbols[1]
        parts = tuple(text if own else text + shared for text, own in zip(texts, symbols))
    value = number(parts[0] if len(parts) == 2 else given, name, where)
    if len(parts) == 2:
        return Measured(value, number(parts[1], f"sigma_{name}", where))
    return Measured(value, DEFAULT_SIGMA * abs(value), False)


@dataclass(frozen=True)
class Measurements:
    """All that a fit has to meet; each part has σ, and a model of what it measures."""

    scalars: Scalars
    curves: Mapping[str, Curve]  #: by name: curve, curve_2, …
    cor_speeds: Series | None
    given: frozenset[str] = frozenset()  #: conditions that somebody gave

    @property
    def impact(self) -> Mapping[str, float]:
        """Of scalars."""
        return self.scalars.impact

    @property
    def series(self) -> dict[str, Series]:
        """Curves and COR over speed, as far as there are any."""
        return {**self.curves, **({"cor_speeds": self.cor_speeds} if self.cor_speeds else {})}

    @property
    def parts(self) -> dict[str, Any]:
        return {**({"targets": self.scalars} if self.scalars.measured else {}), **self.series}

    @property
    def estimated(self) -> list[str]:
        """The series whose σ follows from the residuals."""
        return [name for name, one in self.series.items() if one.sigma is None]

    @property
    def sized(self) -> bool:
        """Whether anything depends on the stiffness."""
        return bool(self.curves) or any(n not in RESTITUTION for n in self.scalars.targets)


def measurements(
    scalars: Mapping[str, Any],
    curve: Any = None,
    cor_speeds: Any = None,
    columns: str = "",
    baseline: str = "",
    priors: Mapping[str, Any] | None = None,
    window: Any = None,
    shots: Any = None,
) -> Measurements:
    """Validated measurements, see `golf_impact.calibrate`.

    UserError: a value is impossible; it is named, or its file and row.
    """
    if cor_speeds is not None and shots is not None:
        raise UserError("give cor_speeds or shots, not both: each is a line of COR over speed")
    if baseline not in ("", *BASELINES):
        raise refused("baseline", baseline, f"choose from {', '.join(BASELINES)}")
    given = {_named(name): value for name, value in scalars.items() if value is not None}
    targets = {name: measured(given[name], name) for name in TARGETS if name in given}
    known = {name: measured(value, name, "prior") for name, value in (priors or {}).items()}
    for name, one in known.items():
        if name not in (*RANGES, *IMPACT):
            raise unknown_name("parameter", name, (*RANGES, *IMPACT))
        if not one.stated:
            raise UserError(f"prior {name} is refused without its σ: --prior {name}=VALUE±SIGMA")
    conditions = {name: number(given[name], name) for name in IMPACT if name in given}
    conditions |= {name: known[name].value for name in IMPACT if name in known}
    impact = {**IMPACT, **conditions}
    several = isinstance(curve, list | tuple) and isinstance([*curve, 0][0], str | Path | Mapping)
    curves = {}
    for n, one in enumerate([] if curve is None else curve if several else [curve], 1):
        suffix = f"_{n}" if n > 1 else ""
        found = _read_curve(one, f"curve{suffix}", conditions, columns, known)
        found = conditioned(_windowed(found, window), baseline)
        curves[f"curve{suffix}"] = replace(found, suffix=suffix)
    if curves and "club_speed" not in conditions:
        first, *others = (one.impact for one in curves.values())
        if targets and any(other != first for other in others):
            raise UserError("scalars beside curves of several speeds need --club-speed, too")
        impact = dict(first)
    line, of_line = None, "" if curves else columns
    if shots is not None:
        line = _read_shots(shots, of_line, impact)
    elif cor_speeds is not None:
        line = _read_series(
            cor_speeds, "cor_speeds", (records.SPEED, records.COR, records.COR_SIGMA), of_line
        )
        if np.ptp(line.x) == 0.0:
            raise UserError(f"{line.name} is refused: a line needs COR at two speeds or more")
        if len(line.y) == 2 and line.sigma is None:
            why = "two rows leave no residuals; add a column sigma, or rows"
            raise UserError(f"{line.name} is refused: {why}")
    given_conditions = frozenset({*conditions, *(("club_speed", "m_club") if curves else ())})
    return Measurements(Scalars({**targets, **known}, impact), curves, line, given_conditions)


def _named(name: str) -> str:
    """The name in results of a scalar or a condition, also by its FMU output."""
    given = name.strip().lower().lstrip("-").replace("-", "_")
    found = {output: name for name, output in TARGETS.items()}.get(given, given)
    if found not in (*TARGETS, *IMPACT):
        raise unknown_name("target", given, (*TARGETS, *IMPACT))
    return found


def _windowed(curve: Curve, window: Any) -> Curve:
    """Its rows between two instants, s, of a pair or the text "0:2ms"."""
    if window is None or window == "":
        return curve
    try:
        text = isinstance(window, str)
        low, high = units.si_values(window.split(":"), "s") if text else map(float, window)
    except (TypeError, ValueError) as error:
        why = "write two instants by the clock of the record, --window 0:2ms"
        raise refused("window", window, why) from error
    inside = (curve.x >= low) & (curve.x <= high)
    if not inside.any():
        ends = f"{curve.x[0]:.4g} to {curve.x[-1]:.4g} s"
        raise refused("window", window, f"{curve.name} has rows from {ends}")
    return curve.rows(inside)


def _read_curve(
    given: Any, kind: str, conditions: Mapping[str, float], columns: str, known: Mapping[str, Any]
) -> Curve:
    """A curve and its conditions; see `golf_impact.calibrate`."""
    own = {}
    if isinstance(given, str | Path) and "@" in str(given) and not Path(given).exists():
        given, _, speed = str(given).rpartition("@")
        own = {"club_speed": number(speed, "club_speed", "curve")}
    elif hasattr(given, "keys"):
        own = {name: number(given[name], name, "curve") for name in IMPACT if name in given}
    if both := [name for name in own if name in known]:
        raise UserError(f"prior {both[0]} is refused beside curves with a {both[0]} of their own")
    if missing := [n for n in ("club_speed", "m_club") if n not in conditions and n not in own]:
        words = "write --club-speed 40 --m-club 0.2, for instance"
        speeds = "for curves of several speeds --curve FILE.csv@SPEED"
        raise UserError(f"a curve needs {' and '.join(missing)}: {words}; {speeds}")
    series = _read_series(given, kind, (records.TIME, records.FORCE, records.SIGMA), columns)
    return Curve(**vars(series), impact={**IMPACT, **conditions, **own})


def _read_series(given: Any, name: str, wanted: Sequence[records.Column], columns: str) -> Series:
    """x, y and perhaps σ of a text file, a mapping of columns, or arrays."""
    names, notes, clipped = [one.name for one in wanted], [], False
    if isinstance(given, str | Path):
        table = read_table(Path(given), wanted, columns)
        read, name, places = [*table.columns.values()], str(given), table.places
        notes, clipped = [*table.notes], table.clipped
        if records.SPEED.name in table.bare:
            notes.append("approach_speed has no unit: taken in m/s")
            fastest = {"club_speed": float(read[0].max(initial=0.0))}
            notes += [one.removesuffix(".") for one in units.remarks(fastest, "approach speed ")]
    else:
        if hasattr(given, "keys"):
            if not {*names[:2]} <= {*given}:
                words = f"it has {', '.join(map(str, given))}, not {' and '.join(names[:2])}"
                raise UserError(f"{name} is refused: {words}")
            given = [given[name] for name in names if name in given]
        try:
            read = [*np.stack([np.asarray(column, float) for column in given])]
            if not 2 <= len(read) <= 3:
                raise ValueError
        except (TypeError, ValueError) as error:
            raise UserError(f"{name} must be arrays of one length: {', '.join(names)}") from error
        places = np.array([f"row {n}" for n in range(1, read[0].size + 1)])
    if not read[0].size:
        raise UserError(f"{name} is refused: it has no rows of {', '.join(names[:2])}")
    for of, column in zip(names, read):
        low, high, _ = _ALLOWED.get(of, _ABOVE_0)
        if (bad := np.flatnonzero(~((column > low) & (column < high)))).size:
            number(column[bad[0]], of, f"{name}, {places[bad[0]]}")
    x, y, *sigma = read
    of_y = sigma[0] if sigma else None
    return Series(name, x, y, places, of_y, notes=tuple(notes), clipped=clipped)


def _read_shots(path: Any, columns: str, impact: Mapping[str, float]) -> Series:
    """COR over club speed from shots of a launch monitor, without mishits.

    COR = S (1 + m_B/m_C) − 1 with the smash factor S, along the face normal.
    """
    from scipy.stats import theilslopes  # takes a second to import

    table = read_table(Path(path), (records.CLUB, records.BALL), columns, missing=0.5)
    club, ball = table.columns.values()
    notes = [*table.notes]
    if table.bare:
        middle = float(np.median(club))
        if 33.0 < middle <= 58.0:
            raise UserError(
                f"{path} is refused: its speeds, {middle:.3g} in the middle, may be in m/s or mph: "
                "--columns 'Club Speed [mph],Ball Speed [mph]', with the heads of the file"
            )
        symbol = "mph" if middle > 58.0 else "m/s"
        club, ball = (
            speeds * (SYMBOLS[symbol][1] if name in table.bare else 1.0)
            for name, speeds in table.columns.items()
        )
        notes.append(f"speeds have no unit: taken in {symbol}")
    cor = ball / club * (1.0 + impact["m_ball"] / impact["m_club"]) - 1.0
    with np.errstate(invalid="ignore"):  # its interval has no number where many rows are equal
        slope = theilslopes(cor, club)[0] if np.ptp(club) > 0.1 * club.mean() else 0.0
    off = cor - slope * club
    # 1.4826 times the median deviation is σ of a normal distribution.
    off -= np.median(off)
    limit = 3.0 * max(1.4826 * float(np.median(np.abs(off))), 0.003)
    kept = (np.abs(off) <= limit) & (cor > 0.01) & (cor < 1.0)
    if left := table.places[~kept].tolist():
        notes.append(
            f"{len(left)} of {len(cor)} shots are left out as mishits: COR more than {limit:.2g} "
            "(three robust standard deviations) from the line of the others, or impossible "
            f"({', '.join(left[:10])})"
        )
    if kept.sum() < 3 or np.ptp(club[kept]) == 0.0:
        raise UserError(f"{path} is refused: a line needs three shots or more, at several speeds")
    mass = f"{impact['m_club']:g} kg"
    notes.append(f"COR follows from the smash factor with a club of {mass}; loft isn't considered")
    return Series(str(path), club, cor, table.places, notes=tuple(notes)).rows(kept)


def conditioned(curve: Curve, baseline: str) -> Curve:
    """The curve with a force above 0, its baseline found, without rows at the sensor's limit.

    UserError: it is not the curve of a contact, or its impulse isn't possible.
    """
    x, y, notes = curve.x, curve.y, [*curve.notes]
    if (backward := np.flatnonzero(np.diff(x) <= 0.0)).size:
        n = int(backward[0]) + 1
        how = "sort the rows by time and remove duplicates"
        if x[n] <= x[0] + 0.01 * abs(x[n - 1] - x[0]):
            how = "a further segment begins there: save one segment as a file"
        raise curve.error(n, f"time = {x[n]:g} s isn't after {x[n - 1]:g} s; {how}")
    few = max(1, min(len(y) // 20, 1000))
    ends = np.array([np.median(y[:few]), np.median(y[-few:])])
    if ends.max() - y.min() > y.max() - ends.min():
        y, ends = -y, -ends
        notes.append("the force is negative; its sign was changed")
    if (cut := _first_pulse(x, y - ends.min())) < len(x):
        # Each pulse has its own approach speed.
        notes.append(f"a second pulse from {x[cut]:.4g} s on is left out")
        curve, x, y = curve.rows(slice(cut)), x[:cut], y[:cut]
    inside = np.flatnonzero(y - ends.min() > 0.25 * (y.max() - ends.min()))
    origin, lasting = (float(x[inside[0]]), float(np.ptp(x[inside]))) if len(inside) else (0.0, 0.0)
    before, after = x < origin - 0.25 * lasting, x > origin + 1.25 * lasting
    since, outside = x - origin, before | after
    # The force of a strongly damped contact ends late; a line doesn't describe it.
    if before.sum() >= _OUTSIDE and _scatter(since, y, after) > 2.0 * _scatter(since, y, before):
        outside = before
    found = _baseline(since[outside], y[outside], baseline)
    curve = replace(curve, y=y, origin=origin, baseline=found)
    force, peak = curve.signal, int(curve.signal.argmax())
    why = ""
    if force[peak] <= -3.0 * force.min():
        why = "is no more than the rest: there is no touch"
    elif lasting > 0.02:
        unit = "ms" if lasting < 20.0 else "µs"
        head = f"time [{unit}] in its header, or --columns 'time [{unit}],force'"
        why = f"is in a contact of {lasting:.3g} s, not of 600e-6: for {unit} write {head}"
    elif len(inside) < 5:
        why = f"is one of only {len(inside)} row{'s' * (len(inside) > 1)} in contact: 5 are needed"
    elif peak == 0:
        why = "is the first: the record was triggered too late"
    if why:
        raise curve.error(peak, f"the largest force, {force[peak]:.4g}, {why}")
    # The smallest difference of two values, but for rounding.
    steps = np.diff(np.unique(y))
    step = float(min(steps[steps > 1e-9 * abs(y).max()], default=0.0))
    # Of a peak that is resolved in steps less than 0.71 times as many rows are at the largest value
    # as within a step of it: it is a parabola, as high above its last step as a step or less.
    top = y == y.max()
    near = np.count_nonzero(y > y.max() - 1.5 * step)
    if top.sum() >= max(4, 0.1 * len(inside)) and top.sum() > 0.8 * near:
        notes.append(f"{top.sum()} rows at the largest force are left out: clipped")
        if (left := len(inside) - top.sum()) < 5:
            raise curve.error(peak, f"only {left} rows in contact are below the sensor's limit")
        curve = curve.rows(~top, clipped=True)
    for at, what in ((slice(3), "begins"), (slice(-3, None), "ends")):
        share = np.median(force[at]) / force[peak]
        if share > 0.1:
            percent = f"{100.0 * share:.0f} % of the largest force"
            notes.append(f"the record {what} in contact, at {percent}")
            curve = replace(curve, clipped=True)
    _check_impulse(curve)
    if lasting < 30.0 * curve.spacing:
        filters = "a filter of 10 kHz takes 10 % of k, 20 kHz is fine"
        notes.append(f"only {len(inside)} rows in contact: {filters}")
    return replace(curve, notes=tuple(notes), step=step)


def _first_pulse(x: np.ndarray, y: np.ndarray) -> int:
    """The row at which a record with a second pulse is cut, or the number of rows.

    UserError: the second one follows without a pause at zero.
    """
    high, low = y > 0.25 * y.max(), y < 0.1 * y.max()
    # A pulse ends below a tenth of the largest force.
    rows = np.append(np.flatnonzero(high | low), len(y))
    edges = rows[np.flatnonzero(np.diff([False, *high[rows[:-1]], False]))]
    starts, stops = edges[::2], edges[1::2]
    lengths = stops - starts
    long = np.flatnonzero(lengths >= max(5, 0.2 * lengths.max(initial=0)))
    if len(long) < 2 or x[-1] - x[0] > 20.0:
        return len(x)
    first, second = long[:2]
    quiet = np.count_nonzero(low[stops[first] : starts[second]])
    if quiet >= max(3, 0.1 * lengths[first]):
        return int(starts[second] - max(1, quiet // 4))
    raise UserError(
        f"two pulses, at {x[starts[first]]:.4g} and {x[starts[second]]:.4g} s, without a pause at "
        "zero between them: cut the record: --window 0:2ms"
    )


def _scatter(x: np.ndarray, y: np.ndarray, rows: np.ndarray) -> float:
    """Standard deviation of rows about a line."""
    if rows.sum() <= 2:
        return 0.0
    return float(np.std(y[rows] - polyval(x[rows], polyfit(x[rows], y[rows], 1))))


def _baseline(x: np.ndarray, y: np.ndarray, kind: str) -> tuple[float, ...]:
    """Coefficients of a baseline of this kind, or of the one with the least AIC.

    Of fewer rows than 10 outside contact it is 0, unless a kind is requested.
    """
    sizes = [BASELINES.index(kind)] if kind else range(3 if len(y) >= _OUTSIDE else 1)
    found = [polyfit(x, y, n - 1) if 0 < n < len(y) else np.zeros(n) for n in sizes]

    def aic(line: np.ndarray) -> float:
        off = y - polyval(x, [*line, 0.0])
        # Residuals below a millionth are rounding.
        return len(y) * math.log(max(off @ off, 1e-12 * (y @ y), 1e-30)) + 2.0 * len(line)

    return tuple(min(found, key=aic).tolist())


def _check_impulse(curve: Curve) -> None:
    """Raise UserError for a curve whose impulse isn't (1 + COR) times reduced mass times speed."""
    speed, m_club, m_ball = curve.impact.values()
    x, (first, last) = curve.x, curve.x[curve.contact[[0, -1]]]
    margin = 0.25 * (last - first)
    inside = (x > first - margin) & (x < last + margin)
    impulse = float(np.trapezoid(curve.signal[inside], x[inside]))
    ratio = impulse / (reduced_mass(curve.impact) * speed)
    # An incomplete record has less.
    if (0.5 if curve.clipped else 0.95) < ratio < 2.05:
        return
    hints = [
        f"{speed:g} looks like {symbol}: write --club-speed {speed:g}{symbol}"
        for symbol in ("mph", "km/h")
        if 1.0 < ratio / SYMBOLS[symbol][1] < 2.0
    ]
    if 1.0 < 1e3 * ratio < 2.0:
        hints.append("force looks like kN: write force [kN] in its header, or --columns")
    fits = f"it fits club speeds of {speed * ratio / 2.0:.3g} to {speed * ratio:.3g} m/s"
    # Club masses by the reduced mass, which is impulse over speed if COR is 0, half of it if 1.
    most, least = impulse / speed, impulse / speed / 2.0
    if ratio < 1.0:
        ends = [reduced * m_ball / (m_ball - reduced) for reduced in (least, most)]
        hints += [fits, "or --m-club from {:.3g} to {:.3g} kg".format(*ends)]
    else:
        hints += ["if there are two pulses, cut the record: --window 0:2ms", fits]
        if least < m_ball:
            hints.append(f"or --m-club of {least * m_ball / (m_ball - least):.3g} kg or more")
    raise UserError(
        f"{curve.name}: its impulse, {impulse:.4g} N·s, is {ratio:.3g} times reduced mass times "
        f"club speed ({speed:g} m/s, club {m_club:g} kg), where 1 to 2, 1 + COR, is possible; "
        f"{', '.join(hints)}"
    )
