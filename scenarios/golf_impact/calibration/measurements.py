"""Measurements of an impact: scalars, force curves, COR over speed; read and validated."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from golf_impact.calibration.records import read_cells, read_table
from golf_impact.errors import UserError, unknown_name
from golf_impact.toml import read_toml
from golf_impact.units import SYMBOLS, si_value, unit_of

#: Outputs of the FMU that may be measured, by the name that results have.
TARGETS = {
    "ball_speed": "ball_velocity",
    "club_speed_after": "club_velocity",
    "cor": "coefficient_of_restitution",
    **{
        name: name
        for name in (
            "contact_time", "max_force", "time_of_max_force", "smash_factor", "energy_efficiency",
            "impulse", "max_compression", "contact_displacement",
        )
    },
}  # fmt: skip

#: Targets that depend on the damping alone. An impact of two bodies has one COR, so that all of
#: them together are one independent measurement.
RESTITUTION = (
    "ball_speed", "club_speed_after", "cor", "smash_factor", "energy_efficiency", "impulse"
)  # fmt: skip

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

#: What may be fixed, or have a prior, by name.
LAW_PARAMETERS = ("k", "b", "exponent", "restitution_at_rest", "restitution_slope")

#: The σ of a scalar target without one, as a fraction of its value.
DEFAULT_SIGMA = 0.01

#: Baselines of a sensor by the number of their coefficients.
BASELINES = ("zero", "constant", "linear")

#: Rows before and after contact that a baseline needs.
_OUTSIDE = 10

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
    **dict.fromkeys(("club_speed_after", "club_force", "time", "force"), _FINITE),
    **dict.fromkeys(("contact_time", "time_of_max_force"), _SECONDS),
    **dict.fromkeys(("m_club", "m_ball"), _KILOGRAMS),
}


class Measured(NamedTuple):
    """A number with its standard deviation, SI units."""

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
    # Of a curve:
    step: float = 0.0  #: the resolution of y, N
    impact: Mapping[str, float] = field(default_factory=dict)  #: as `IMPACT`
    notes: tuple[str, ...] = ()  #: what was changed or is missing, in sentences
    origin: float = 0.0  #: the instant of the first row in contact, s
    #: Offset at `origin` (N) and drift (N/s) of the sensor, as far as it has them, by the rows
    #: before and after contact.
    baseline: tuple[float, ...] = ()

    @cached_property
    def force(self) -> np.ndarray:
        """y without the baseline."""
        return self.y - np.polyval(self.baseline[::-1], self.x - self.origin)

    @cached_property
    def contact(self) -> np.ndarray:
        """Rows of a curve with more than a quarter of the largest force."""
        return np.flatnonzero(self.force > 0.25 * self.force.max())

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
        targets: scalars.
        curves: force curves by name: curve, curve_2, …
        cor_speeds: COR over speed, or None.
        impact: of scalars, as `IMPACT`.
        priors: values and σ of parameters that are known beforehand, of law or impact.
        series: curves and COR over speed, as far as there are any.
        values: all measured values: scalars, forces, CORs, priors.
        groups: where each of these are in `values`.
        sized: whether anything depends on the stiffness.
    """

    def __init__(
        self,
        targets: Mapping[str, Measured],
        curves: Sequence[Series] = (),
        cor_speeds: Series | None = None,
        impact: Mapping[str, float] = IMPACT,
        priors: Mapping[str, Measured] | None = None,
    ) -> None:
        self.targets, self.cor_speeds, self.impact = targets, cor_speeds, impact
        self.priors = priors or {}
        self.curves = {f"curve_{n + 1}" if n else "curve": one for n, one in enumerate(curves)}
        self.series = self.curves | ({"cor_speeds": cor_speeds} if cor_speeds else {})
        parts = {"targets": np.array([target.value for target in targets.values()])}
        parts |= {name: one.y for name, one in self.series.items()}
        parts["priors"] = np.array([prior.value for prior in self.priors.values()])
        self.values = np.concatenate([*parts.values()])
        ends = np.cumsum([len(part) for part in parts.values()]).tolist()
        self.groups = {
            name: slice(end - len(part), end) for (name, part), end in zip(parts.items(), ends)
        }
        known = [one.sigma for one in (*targets.values(), *self.priors.values())]
        self.sigma = np.concatenate(
            [
                known[: len(targets)],
                *(
                    np.full(len(one.y), 0.01 * one.force.max()) if one.sigma is None else one.sigma
                    for one in self.series.values()
                ),
                known[len(targets) :],
            ]
        )
        self.sized = bool(curves) or any(name not in RESTITUTION for name in targets)

    def thinned(self, rows: int) -> Measurements:
        """These, with curves of so many rows or an eighth and free heads; if there are any."""
        if not any(len(one.x) > rows or one.impact["club_force"] for one in self.curves.values()):
            return self
        curves = [
            replace(one.around_contact(rows), impact={**one.impact, "club_force": 0.0})
            for one in self.curves.values()
        ]
        impact = {**self.impact, "club_force": 0.0}
        return Measurements(self.targets, curves, self.cor_speeds, impact, self.priors)


def reduced_mass(impact: Mapping[str, float]) -> float:
    """Of club and ball, kg."""
    return 1.0 / (1.0 / impact["m_club"] + 1.0 / impact["m_ball"])


def _unit(name: str) -> str:
    speed = name in ("predict", "approach_speed")
    return "m/s" if speed else unit_of(TARGETS.get(name, name))


def number(given: Any, name: str, where: str = "") -> float:
    """A number in its range; otherwise a UserError that names it, and where it is."""
    what = f"{where}: {name}" if where else name
    low, high, allowed = _ALLOWED.get(name, _ABOVE_0)
    try:
        unit = _unit(name.removeprefix("sigma_"))
        value = si_value(given, unit) if isinstance(given, str) else float(given)
    except (TypeError, ValueError) as error:
        text = isinstance(given, str) and given
        why = str(error) if text else "it must be a number, e.g. 600e-6"
        raise UserError(f"{what} = {given!r} is refused: {why}", name, given, why) from None
    if not low < value < high:
        why = f"it must be {allowed}"
        raise UserError(f"{what} = {value:g} is refused: {why}", name, value, why)
    return value


def measured(given: Any, name: str, where: str = "", sigma: Any = None) -> Measured:
    """A number and its σ: apart, a pair, or the text "600us±6us" (also with +-), in its unit."""
    if isinstance(given, str):
        parts = [part.strip() for part in re.split(r"±|\+/?-", given)]
        if len(parts) == 2:
            # A unit of one of them is that of both.
            units = [re.sub(r"^[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*", "", part) for part in parts]
            shared = next(filter(None, units), "")
            given, sigma = (part if u else part + shared for part, u in zip(parts, units))
    elif isinstance(given, tuple) and len(given) == 2:
        given, sigma = given
    value = number(given, name, where)
    if sigma is None or sigma == "":
        return Measured(value, number(DEFAULT_SIGMA * abs(value), f"sigma_{name}"), False)
    return Measured(value, number(sigma, f"sigma_{name}", where))


def measurements(
    scalars: Mapping[str, Any],
    file: Path | None = None,
    curve: Any = None,
    cor_speeds: Any = None,
    columns: str = "",
    baseline: str = "",
    priors: Mapping[str, Any] | None = None,
) -> Measurements:
    """Validated measurements, see `golf_impact.calibrate`; scalars given win over the file's.

    UserError: a value is impossible; it is named, or its file and row.
    """
    if baseline not in ("", *BASELINES):
        raise UserError(f"baseline = {baseline!r} is refused: choose from {', '.join(BASELINES)}")
    given: dict[str, tuple[Any, Any, str]] = {}
    for where, name, value, sigma in _rows(file) if file else ():
        name = _named(name, where)
        if name in given:
            raise UserError(f"{where}: {name} is given twice")
        given[name] = value, sigma, where
    for name, value in scalars.items():
        if value is not None and not name.startswith("sigma_"):
            given[_named(name)] = value, scalars.get(f"sigma_{name}"), ""
    for name, value in scalars.items():
        of = name.removeprefix("sigma_")
        if of != name and value is not None and _named(of) not in given:
            raise UserError(f"{name} is refused without {of}", name, value)
    targets = {
        name: measured(given[name][0], name, given[name][2], given[name][1])
        for name in TARGETS
        if name in given
    }
    known = {name: measured(value, name, "prior") for name, value in (priors or {}).items()}
    for name, prior in known.items():
        if name not in (*LAW_PARAMETERS, *IMPACT):
            raise unknown_name("parameter", name, (*LAW_PARAMETERS, *IMPACT))
        if not prior.stated:
            raise UserError(f"prior {name} is refused without its σ: --prior {name}=VALUE±SIGMA")
    conditions = {
        name: number(given[name][0], name, given[name][2]) for name in IMPACT if name in given
    }
    conditions |= {name: known[name].value for name in IMPACT if name in known}
    impact = {**IMPACT, **conditions}
    curves = [] if curve is None else _curves(curve, conditions, columns, baseline, known)
    line = None if cor_speeds is None else _read_series(cor_speeds, "cor_speeds")
    if curves and "club_speed" not in conditions:
        if targets and any(one.impact != curves[0].impact for one in curves):
            raise UserError("scalars beside curves of several speeds need --club-speed, too")
        impact = dict(curves[0].impact)
    if line and np.ptp(line.x) == 0.0:
        raise UserError(f"{line.name} is refused: a line needs COR at two speeds or more")
    if line and len(line.y) == 2 and line.sigma is None:
        why = "two rows leave no residuals; add a column sigma, or rows"
        raise UserError(f"{line.name} is refused: {why}")
    return Measurements(targets, curves, line, impact, known)


def _named(name: str, where: str = "") -> str:
    """The name in results of a scalar or a condition, also by its FMU output."""
    given = name.strip().lower().lstrip("-").replace("-", "_")
    found = {output: name for name, output in TARGETS.items()}.get(given, given)
    if found not in TARGETS and found not in IMPACT:
        error = unknown_name("target", given, (*TARGETS, *IMPACT))
        raise UserError(f"{where or 'calibrate'}: {error}", given, reason=error.reason)
    return found


def _rows(path: Path) -> Iterator[tuple[str, str, str, str]]:
    """Of each row its place, target, value and σ."""
    (_, header), *rows = read_cells(path) or [(1, [""])]
    names = [cell.lower() for cell in header]
    if names not in (["target", "value"], ["target", "value", "sigma"]):
        why = "its first line must be target,value or target,value,sigma"
        raise UserError(f"{path} is refused: {why}, not {','.join(names)!r}")
    for n, (line, cells) in enumerate(rows, 1):
        where = f"{path}, row {n} (line {line})"
        if len(cells) > len(names):
            raise UserError(f"{where} is refused: more cells than the first line has")
        name, value, sigma, *_ = *cells, "", ""
        if sigma and name in IMPACT:
            raise UserError(f"{where}: {name} takes no sigma: --prior {name}={value}±{sigma}")
        yield where, name, value, sigma


def _curves(
    given: Any, conditions: Mapping[str, float], columns: str, baseline: str, priors: Iterable[str]
) -> list[Series]:
    """Curves, one or several, with their conditions; see `golf_impact.calibrate`."""
    several = (
        isinstance(given, list | tuple) and given and isinstance(given[0], str | Path | Mapping)
    )
    curves = []
    for one in _entries(given if several else [given], columns):
        own = {name: number(one[name], name, "curve") for name in IMPACT if name in one}
        if both := [name for name in own if name in priors]:
            raise UserError(
                f"prior {both[0]} is refused beside curves with a {both[0]} of their own"
            )
        impact = {**_OF_CURVE, **conditions, **own}
        if missing := [name for name in IMPACT if name not in impact]:
            words = "its conditions, e.g. --club-speed 40 --m-club 0.2"
            speeds = "of several ones --curve FILE.csv@SPEED for each"
            raise UserError(f"a curve needs {' and '.join(missing)}: {words}; {speeds}")
        curve = _read_series(one["curve"], "curve", str(one["columns"]))
        curve = replace(curve, impact={name: impact[name] for name in IMPACT})
        curves.append(_conditioned(curve, baseline))
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
                yield {"columns": columns, **row, "curve": Path(one).parent / str(row["file"])}
        else:
            path, _, speed = str(one).rpartition("@")
            alone = not path or Path(one).exists()
            of_speed = {} if alone else {"club_speed": speed}
            yield {"columns": columns, **of_speed, "curve": one if alone else path}


def _read_series(given: Any, kind: str, columns: str = "") -> Series:
    """A series from a CSV file, a mapping of columns, two or three arrays, or an array of rows."""
    names, units = COLUMNS[kind]
    if isinstance(given, str | Path):
        read, where = read_table(Path(given), names, units, columns)
        kind = str(given)
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


def _conditioned(curve: Series, baseline: str) -> Series:
    """The curve with a force above 0, its baseline found, without rows at the sensor's limit.

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
    inside = np.flatnonzero(y - level > 0.25 * (y.max() - level))
    origin, lasting = 0.0, 0.0
    outside = np.zeros(len(x), bool)
    if len(inside):
        origin, lasting = float(x[inside[0]]), float(np.ptp(x[inside]))
        before, after = x < origin - 0.25 * lasting, x > origin + 1.25 * lasting
        outside = before | after
        # The force of a strongly damped contact ends late; a line doesn't describe it.
        if before.sum() >= _OUTSIDE and _scatter(x[after], y[after]) > 2.0 * _scatter(
            x[before], y[before]
        ):
            outside = before
    chosen = _baseline(x[outside] - origin, y[outside], baseline)
    curve = replace(curve, y=y, origin=origin, baseline=chosen)
    force, peak = curve.force, int(curve.force.argmax())
    why = ""
    if force[peak] <= -3.0 * force.min():
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
        raise UserError(f"{curve.where(peak)}: the largest force, {force[peak]:.4g}, {why}")
    step = _step(y)
    clipped = _clipped(y, len(inside), step)
    if clipped.any():
        notes.append(f"{clipped.sum()} rows at the largest force are left out: clipped")
    for at, what in ((slice(3), "begins"), (slice(-3, None), "ends")):
        if np.median(force[at]) > 0.1 * force[peak]:
            share = 100.0 * np.median(force[at]) / force[peak]
            notes.append(f"the record {what} in contact, at {share:.0f} % of the largest force")
    kept, sigma = ~clipped, curve.sigma
    sigma = sigma if sigma is None else sigma[kept]
    return replace(curve, x=x[kept], y=y[kept], sigma=sigma, notes=tuple(notes), step=step)


def _scatter(x: np.ndarray, y: np.ndarray) -> float:
    """Standard deviation of rows about a line."""
    if len(x) < 3:
        return 0.0
    return float(np.std(y - np.polynomial.Polynomial.fit(x, y, 1)(x)))


def _baseline(x: np.ndarray, y: np.ndarray, kind: str) -> tuple[float, ...]:
    """Coefficients of a baseline of this kind, or of the one with the least AIC.

    Of fewer rows than 10 outside contact it is 0, unless a kind is requested.
    """
    if not kind and len(y) < _OUTSIDE:
        return ()
    best: tuple[float, ...] = ()
    least = math.inf
    for degree, name in enumerate(BASELINES):
        if kind not in ("", name):
            continue
        powers = np.vander(x, degree, increasing=True)
        found = np.linalg.lstsq(powers, y, rcond=None)[0] if len(y) > degree else np.zeros(degree)
        # Residuals below a millionth are rounding.
        noise = max(float(np.mean((y - powers @ found) ** 2)), 1e-12 * float(np.mean(y**2)))
        aic = len(y) * math.log(max(noise, 1e-30)) + 2.0 * degree
        if aic < least:
            best, least = tuple(found.tolist()), aic
    return best


def _clipped(y: np.ndarray, inside: int, step: float) -> np.ndarray:
    """Rows at the sensor's limit: those at the largest value, if they are many.

    Of a peak that is resolved in steps less than 0.71 times as many rows are at the largest value
    as within a step of it: it is a parabola, as high above its last step as a step or less.
    """
    top = y == y.max()
    near = np.count_nonzero(y > y.max() - 1.5 * step)
    many = max(4, 0.1 * inside) <= np.count_nonzero(top)
    return top if many and np.count_nonzero(top) > 0.8 * near else np.zeros(len(y), bool)


def _step(y: np.ndarray) -> float:
    """The smallest difference of two values: the resolution of a record; 0 if all are equal."""
    steps = np.diff(np.unique(y))
    return float(min(steps[steps > 1e-9 * abs(y).max()], default=0.0))


def _check_impulse(curve: Series) -> None:
    """Raise UserError for a curve whose impulse isn't (1 + COR) times reduced mass times speed.

    A force on the head adds its own impulse times reduced mass over the head's.
    """
    (speed, m_club, m_ball, pushed), x = (curve.impact[name] for name in IMPACT), curve.x
    first, last = x[curve.contact[[0, -1]]]
    margin = 0.25 * (last - first)
    inside = (x > first - margin) & (x < last + margin)
    impulse = float(np.trapezoid(curve.force[inside], x[inside]))
    reduced = reduced_mass(curve.impact)
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
        ends = f"from {least:.3g} to {most:.3g} kg" if most < 10.0 else f"of {least:.3g} kg or more"
        hints.append(f"or --m-club {ends}")
    raise UserError(
        f"{curve.name}: its impulse, {impulse:.4g} N·s, is {ratio:.3g} times reduced mass times "
        f"club speed ({speed:g} m/s, club {m_club:g} kg), where 1 to 2, 1 + COR, is possible; "
        f"{', '.join(hints)}"
    )
