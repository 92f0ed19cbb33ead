"""Measurements of an impact, read and validated. SI units."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.calibration.records import read_cells, read_table
from golf_impact.calibration.series import (
    BASELINES,
    IMPACT,
    RESTITUTION,
    TARGETS,
    Curve,
    Measured,
    Priors,
    Scalars,
    Series,
    conditioned,
)
from golf_impact.errors import UserError, unknown_name
from golf_impact.intervals import RANGES
from golf_impact.units import si_value, unit_of

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


@dataclass(frozen=True)
class Measurements:
    """All that a fit has to meet; its parts have σ, and models of what they measure."""

    targets: Scalars
    curves: Mapping[str, Curve]  #: by name: curve, curve_2, …
    cor_speeds: Series | None
    priors: Priors

    @property
    def impact(self) -> Mapping[str, float]:
        """Of scalars."""
        return self.targets.impact

    @property
    def series(self) -> dict[str, Series]:
        """Curves and COR over speed, as far as there are any."""
        return {**self.curves, **({"cor_speeds": self.cor_speeds} if self.cor_speeds else {})}

    @property
    def parts(self) -> dict[str, Any]:
        found: dict[str, Any] = {"targets": self.targets, **self.series, "priors": self.priors}
        return {name: part for name, part in found.items() if len(part.y)}

    @property
    def sized(self) -> bool:
        """Whether anything depends on the stiffness."""
        return bool(self.curves) or any(name not in RESTITUTION for name in self.targets.measured)

    def thinned(self, rows: int) -> Measurements:
        """These, with curves of so many rows or an eighth and free heads; if there are any."""
        if not any(len(one.x) > rows or one.impact["club_force"] for one in self.curves.values()):
            return self
        targets = Scalars(self.targets.measured, {**self.impact, "club_force": 0.0})
        curves = {name: one.thinned(rows) for name, one in self.curves.items()}
        return replace(self, targets=targets, curves=curves)


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


def measured(given: Any, name: str, where: str = "") -> Measured:
    """A number and its σ: a pair, or the text "600us±6us" (also with +-), in its unit."""
    sigma = None
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
    named = [(_named(name), value) for name, value in scalars.items() if value is not None]
    # Arguments of `measured` or `number` by name.
    given = (_read_scalars(file) if file else {}) | {name: (v, name, "") for name, v in named}
    targets = {name: measured(*given[name]) for name in TARGETS if name in given}
    prior = {name: measured(value, name, "prior") for name, value in (priors or {}).items()}
    for name, one in prior.items():
        if name not in (*RANGES, *IMPACT):
            raise unknown_name("parameter", name, (*RANGES, *IMPACT))
        if not one.stated:
            raise UserError(f"prior {name} is refused without its σ: --prior {name}=VALUE±SIGMA")
    conditions = {name: number(*given[name]) for name in IMPACT if name in given}
    conditions |= {name: prior[name].value for name in IMPACT if name in prior}
    impact = {**IMPACT, **conditions}
    several = (
        isinstance(curve, list | tuple) and curve and isinstance(curve[0], str | Path | Mapping)
    )
    curves = {}
    for n, one in enumerate([] if curve is None else curve if several else [curve], 1):
        suffix = f"_{n}" if n > 1 else ""
        found = _read_curve(one, f"curve{suffix}", conditions, columns, prior)
        curves[f"curve{suffix}"] = replace(conditioned(found, baseline), suffix=suffix)
    if curves and "club_speed" not in conditions:
        first, *others = (one.impact for one in curves.values())
        if targets and any(other != first for other in others):
            raise UserError("scalars beside curves of several speeds need --club-speed, too")
        impact = dict(first)
    line = None
    if cor_speeds is not None:
        columns_of_line = ("approach_speed", "cor"), ("m/s", "1")
        line = Series(*_read_series(cor_speeds, "cor_speeds", *columns_of_line))
        if np.ptp(line.x) == 0.0:
            raise UserError(f"{line.name} is refused: a line needs COR at two speeds or more")
        if len(line.y) == 2 and line.sigma is None:
            why = "two rows leave no residuals; add a column sigma, or rows"
            raise UserError(f"{line.name} is refused: {why}")
    return Measurements(Scalars(targets, impact), curves, line, Priors(prior, impact))


def _named(name: str, where: str = "calibrate") -> str:
    """The name in results of a scalar or a condition, also by its FMU output."""
    given = name.strip().lower().lstrip("-").replace("-", "_")
    found = {output: name for name, output in TARGETS.items()}.get(given, given)
    if found not in (*TARGETS, *IMPACT):
        error = unknown_name("target", given, (*TARGETS, *IMPACT))
        raise UserError(f"{where}: {error}", given, reason=error.reason)
    return found


def _read_scalars(path: Path) -> dict[str, tuple[Any, str, str]]:
    """Of each row of a file value, perhaps with σ, name and place, by name."""
    (_, header), *rows = read_cells(path) or [(1, [""])]
    names = [cell.lower() for cell in header]
    if names not in (["target", "value"], ["target", "value", "sigma"]):
        why = "its first line must be target,value or target,value,sigma"
        raise UserError(f"{path} is refused: {why}, not {','.join(names)!r}")
    found: dict[str, tuple[Any, str, str]] = {}
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
        found[name] = (value, sigma) if sigma else value, name, where
    return found


def _read_curve(
    given: Any, kind: str, conditions: Mapping[str, float], columns: str, priors: Mapping[str, Any]
) -> Curve:
    """A curve and its conditions; see `golf_impact.calibrate`."""
    own = {}
    if isinstance(given, str | Path) and "@" in str(given) and not Path(given).exists():
        given, _, speed = str(given).rpartition("@")
        own = {"club_speed": number(speed, "club_speed", "curve")}
    elif hasattr(given, "keys"):
        own = {name: number(given[name], name, "curve") for name in IMPACT if name in given}
    if both := [name for name in own if name in priors]:
        raise UserError(f"prior {both[0]} is refused beside curves with a {both[0]} of their own")
    impact = {**IMPACT, **conditions, **own}
    if missing := [n for n in ("club_speed", "m_club") if n not in conditions and n not in own]:
        words = "its conditions, e.g. --club-speed 40 --m-club 0.2"
        speeds = "of several ones --curve FILE.csv@SPEED for each"
        raise UserError(f"a curve needs {' and '.join(missing)}: {words}; {speeds}")
    return Curve(*_read_series(given, kind, ("time", "force"), ("s", "N"), columns), impact=impact)


def _read_series(
    given: Any, kind: str, names: tuple[str, str], units: tuple[str, str], columns: str = ""
) -> tuple[str, Callable[[int], str], np.ndarray, np.ndarray, np.ndarray | None]:
    """Name, places of rows, x, y and perhaps σ of a CSV file, a mapping of columns, or arrays."""
    every = (*names, "sigma")
    if isinstance(given, str | Path):
        kind = str(given)
        read, where = read_table(Path(given), every, (*units, units[1]), columns)
    else:
        if hasattr(given, "keys"):
            given = [given[name] for name in every if name in given]
        try:
            read = [*np.stack([np.asarray(column, float) for column in given])]
        except (TypeError, ValueError) as error:
            raise UserError(f"{kind} must be arrays of one length: {', '.join(every)}") from error

        def where(row: int) -> str:
            return f"{kind}, row {row + 1}"

    if not 2 <= len(read) <= 3 or not read[0].size:
        raise UserError(f"{kind} is refused: it has no rows of {', '.join(names)}")
    for name, column in zip(every, read):
        low, high, _ = _ALLOWED.get(name, _ABOVE_0)
        if (bad := np.flatnonzero(~((column > low) & (column < high)))).size:
            number(column[bad[0]], name, where(int(bad[0])))
    x, y, *sigma = read
    return kind, where, x, y, sigma[0] if sigma else None
