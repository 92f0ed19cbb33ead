"""Measurements of an impact: scalars, force curves, COR over speed; read and validated."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from golf_impact.calibration.curves import BASELINES, Series, conditioned
from golf_impact.calibration.intervals import RANGES
from golf_impact.calibration.records import read_cells, read_table
from golf_impact.errors import UserError, unknown_name
from golf_impact.files import read_toml
from golf_impact.units import si_value, unit_of

#: Targets that depend on the damping alone, and the FMU's outputs. An impact of two bodies has one
#: COR, so that all of them together are one independent measurement.
RESTITUTION = {
    "ball_speed": "ball_velocity", "club_speed_after": "club_velocity",
    "cor": "coefficient_of_restitution", "smash_factor": "smash_factor",
    "energy_efficiency": "energy_efficiency", "impulse": "impulse",
}  # fmt: skip

#: Outputs of the FMU that may be measured, by the name that results have.
TARGETS = RESTITUTION | {
    name: name
    for name in (
        "contact_time", "max_force", "time_of_max_force", "max_compression", "contact_displacement"
    )
}  # fmt: skip

#: Columns of the two kinds of series, the last one optional, and their units.
COLUMNS = {
    "curve": (("time", "force", "sigma"), ("s", "N", "N")),
    "cor_speeds": (("approach_speed", "cor", "sigma"), ("m/s", "1", "1")),
}

#: The impact in which curve and scalars are measured, if nothing else is given: speed (m/s),
#: masses (kg) and the force on the club head (N).
IMPACT = {"club_speed": 35.0, "m_club": 0.210, "m_ball": 0.04593, "club_force": 0.0}

#: The σ of a scalar target without one, as a fraction of its value.
DEFAULT_SIGMA = 0.01

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


class Measurements:
    """All that a fit has to meet.

    Attributes:
        targets: scalars.
        curves: force curves by name: curve, curve_2, …
        cor_speeds: COR over speed, or None.
        impact: of scalars, as `IMPACT`.
        priors: values and σ of parameters that are known beforehand, of law or impact.
        series: curves and COR over speed, as far as there are any.
        values, sigma: of scalars, forces, CORs, priors; without a σ 1 % of the largest.
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
        self.sized = bool(curves) or any(name not in RESTITUTION for name in targets)
        parts = {name: (one.y, one.sigma_or_guess) for name, one in self.series.items()}
        parts = {"targets": _columns(targets), **parts, "priors": _columns(self.priors)}
        self.values, self.sigma = (np.concatenate(columns) for columns in zip(*parts.values()))
        ends = np.cumsum([len(values) for values, _ in parts.values()]).tolist()
        self.groups = {name: slice(*ends) for name, ends in zip(parts, pairwise([0, *ends]))}

    def thinned(self, rows: int) -> Measurements:
        """These, with curves of so many rows or an eighth and free heads; if there are any."""
        if not any(len(one.x) > rows or one.impact["club_force"] for one in self.curves.values()):
            return self
        free = {"club_force": 0.0}
        curves = [
            replace(one.thinned(rows), impact={**one.impact, **free})
            for one in self.curves.values()
        ]
        impact = {**self.impact, **free}
        return Measurements(self.targets, curves, self.cor_speeds, impact, self.priors)


def _columns(known: Mapping[str, Measured]) -> tuple[np.ndarray, np.ndarray]:
    """Values and σ."""
    values, sigma = np.array([one[:2] for one in known.values()]).reshape(-1, 2).T
    return values, sigma


def number(given: Any, name: str, where: str = "") -> float:
    """A number in its range; otherwise a UserError that names it, and where it is."""
    what = f"{where}: {name}" if where else name
    low, high, allowed = _ALLOWED.get(name, _ABOVE_0)
    of = name.removeprefix("sigma_")
    unit = "m/s" if of in ("predict", "approach_speed") else unit_of(TARGETS.get(of, of))
    try:
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
            shared = units[0] or units[1]
            given, sigma = (part if own else part + shared for part, own in zip(parts, units))
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
    # Value, σ and place by name.
    given: dict[str, tuple[Any, Any, str]] = dict(_read_scalars(file)) if file else {}
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
    prior = {name: measured(value, name, "prior") for name, value in (priors or {}).items()}
    for name, one in prior.items():
        if name not in (*RANGES, *IMPACT):
            raise unknown_name("parameter", name, (*RANGES, *IMPACT))
        if not one.stated:
            raise UserError(f"prior {name} is refused without its σ: --prior {name}=VALUE±SIGMA")
    conditions = {n: number(given[n][0], n, given[n][2]) for n in IMPACT if n in given}
    conditions |= {name: prior[name].value for name in IMPACT if name in prior}
    impact = {**IMPACT, **conditions}
    curves = [] if curve is None else _curves(curve, conditions, columns, baseline, prior)
    if curves and "club_speed" not in conditions:
        if targets and any(one.impact != curves[0].impact for one in curves):
            raise UserError("scalars beside curves of several speeds need --club-speed, too")
        impact = dict(curves[0].impact)
    line = None if cor_speeds is None else _read_series(cor_speeds, "cor_speeds")
    if line and np.ptp(line.x) == 0.0:
        raise UserError(f"{line.name} is refused: a line needs COR at two speeds or more")
    if line and len(line.y) == 2 and line.sigma is None:
        why = "two rows leave no residuals; add a column sigma, or rows"
        raise UserError(f"{line.name} is refused: {why}")
    return Measurements(targets, curves, line, impact, prior)


def _named(name: str, where: str = "calibrate") -> str:
    """The name in results of a scalar or a condition, also by its FMU output."""
    given = name.strip().lower().lstrip("-").replace("-", "_")
    found = {output: name for name, output in TARGETS.items()}.get(given, given)
    if found not in TARGETS and found not in IMPACT:
        error = unknown_name("target", given, (*TARGETS, *IMPACT))
        raise UserError(f"{where}: {error}", given, reason=error.reason)
    return found


def _read_scalars(path: Path) -> dict[str, tuple[str, str, str]]:
    """Of each row of a file value, σ and place, by name."""
    (_, header), *rows = read_cells(path) or [(1, [""])]
    names = [cell.lower() for cell in header]
    if names not in (["target", "value"], ["target", "value", "sigma"]):
        why = "its first line must be target,value or target,value,sigma"
        raise UserError(f"{path} is refused: {why}, not {','.join(names)!r}")
    found: dict[str, tuple[str, str, str]] = {}
    for n, (line, cells) in enumerate(rows, 1):
        where = f"{path}, row {n} (line {line})"
        if len(cells) > len(names):
            raise UserError(f"{where} is refused: more cells than the first line has")
        text, value, sigma, *_ = *cells, "", ""
        name = _named(text, where)
        if sigma and name in IMPACT:
            raise UserError(f"{where}: {name} takes no sigma: --prior {name}={value}±{sigma}")
        if name in found:
            raise UserError(f"{where}: {name} is given twice")
        found[name] = value, sigma, where
    return found


def _curves(
    given: Any, conditions: Mapping[str, float], columns: str, baseline: str, priors: Iterable[str]
) -> list[Series]:
    """Curves, one or several, with their conditions; see `golf_impact.calibrate`."""
    several = (
        isinstance(given, list | tuple) and given and isinstance(given[0], str | Path | Mapping)
    )
    curves = []
    for one in _entries(given if several else [given]):
        own = {name: number(one[name], name, "curve") for name in IMPACT if name in one}
        if both := [name for name in own if name in priors]:
            why = f"beside curves with a {both[0]} of their own"
            raise UserError(f"prior {both[0]} is refused {why}")
        impact = {**IMPACT, **conditions, **own}
        missing = [n for n in ("club_speed", "m_club") if n not in conditions and n not in own]
        if missing:
            words = "its conditions, e.g. --club-speed 40 --m-club 0.2"
            speeds = "of several ones --curve FILE.csv@SPEED for each"
            raise UserError(f"a curve needs {' and '.join(missing)}: {words}; {speeds}")
        curve = _read_series(one["curve"], "curve", str(one.get("columns", columns)))
        curves.append(conditioned(replace(curve, impact=impact), baseline))
    return curves


def _entries(given: Iterable[Any]) -> Iterator[Mapping[str, Any]]:
    """Curves as `curve`, and perhaps its columns and conditions; those of TOML files, too."""
    for one in given:
        if isinstance(one, Mapping):
            yield {**{name: one[name] for name in IMPACT if name in one}, "curve": one}
        elif not isinstance(one, str | Path) or Path(one).exists() or "@" not in str(one):
            is_list = isinstance(one, str | Path) and Path(one).suffix == ".toml"
            yield from _listed(Path(one)) if is_list else [{"curve": one}]
        else:
            path, _, speed = str(one).rpartition("@")
            yield {"club_speed": speed, "curve": path}


def _listed(path: Path) -> Iterator[Mapping[str, Any]]:
    """Curves of a TOML file."""
    rows, keys = read_toml(path).get("curve"), ("file", "columns", *IMPACT)
    for row in rows if isinstance(rows, list) and rows else [None]:
        if not isinstance(row, dict) or not {"file"} <= {*row} <= {*keys}:
            why = f"write a table [[curve]] for each, of file and {', '.join(keys[1:])}"
            raise UserError(f"{path} lists no curves: {why}")
        yield {**row, "curve": path.parent / str(row["file"])}


def _read_series(given: Any, kind: str, columns: str = "") -> Series:
    """A series from a CSV file, a mapping of columns, two or three arrays, or an array of rows."""
    names, units = COLUMNS[kind]
    if isinstance(given, str | Path):
        kind = str(given)
        read, where = read_table(Path(given), names, units, columns)
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
