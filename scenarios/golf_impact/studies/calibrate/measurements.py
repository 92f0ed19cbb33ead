"""Measurements of an impact, read and validated. SI units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from golf_impact.data.errors import UserError, refused, unknown_name
from golf_impact.data.units import SYMBOLS, remarks, si_value, si_values, unit_of
from golf_impact.studies.calibrate.records import (
    BALL,
    CLUB,
    COR,
    COR_SIGMA,
    FORCE,
    SIGMA,
    SPEED,
    TIME,
    Column,
    read_table,
)
from golf_impact.studies.calibrate.series import (
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
from golf_impact.studies.intervals import RANGES

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
    given: frozenset[str] = frozenset()  #: conditions that somebody gave

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
        raise refused(name, given, why, f"{what} = {given!r}") from None
    if not low < value < high:
        why = f"it must be {allowed}"
        raise refused(name, value, why, f"{what} = {value:g}")
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
    ends = _window(window)
    if cor_speeds is not None and shots is not None:
        raise UserError("give cor_speeds or shots, not both: each is a line of COR over speed")
    if baseline not in ("", *BASELINES):
        raise UserError(f"baseline = {baseline!r} is refused: choose from {', '.join(BASELINES)}")
    named = [(_named(name), value) for name, value in scalars.items() if value is not None]
    # Arguments of `measured` or `number` by name.
    given = {name: (v, name, "") for name, v in named}
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
        found = found.rows((found.x >= ends[0]) & (found.x <= ends[1]))
        if not len(found.x):
            raise UserError(f"{found.name}: no row is in the window {window}")
        curves[f"curve{suffix}"] = replace(conditioned(found, baseline), suffix=suffix)
    if curves and "club_speed" not in conditions:
        first, *others = (one.impact for one in curves.values())
        if targets and any(other != first for other in others):
            raise UserError("scalars beside curves of several speeds need --club-speed, too")
        impact = dict(first)
    line = None
    if cor_speeds is not None:
        chosen = "" if curves else columns
        line = _read_series(cor_speeds, "cor_speeds", (SPEED, COR, COR_SIGMA), chosen)
        if np.ptp(line.x) == 0.0:
            raise UserError(f"{line.name} is refused: a line needs COR at two speeds or more")
        if len(line.y) == 2 and line.sigma is None:
            why = "two rows leave no residuals; add a column sigma, or rows"
            raise UserError(f"{line.name} is refused: {why}")
    elif shots is not None:
        line = _read_shots(shots, "" if curves else columns, impact)
    known = frozenset(conditions) | ({"club_speed", "m_club"} if curves else set())
    return Measurements(Scalars(targets, impact), curves, line, Priors(prior, impact), known)


def _named(name: str, where: str = "calibrate") -> str:
    """The name in results of a scalar or a condition, also by its FMU output."""
    given = name.strip().lower().lstrip("-").replace("-", "_")
    found = {output: name for name, output in TARGETS.items()}.get(given, given)
    if found not in (*TARGETS, *IMPACT):
        error = unknown_name("target", given, (*TARGETS, *IMPACT))
        raise UserError(f"{where}: {error}", given, reason=error.reason)
    return found


def _window(given: Any) -> tuple[float, float]:
    """First and last instant of a window, s, of a pair or the text "0:2ms"."""
    if given is None or given == "":
        return -math.inf, math.inf
    try:
        low, high = (
            si_values(given.split(":"), "s") if isinstance(given, str) else map(float, given)
        )
    except (TypeError, ValueError) as error:
        why = "write two instants by the clock of the record, --window 0:2ms"
        raise UserError(f"window = {given!r} is refused: {why}") from error
    if not low < high:
        raise UserError(f"window = {given!r} is refused: its end must be after its start")
    return low, high


def _read_shots(path: Any, columns: str, impact: Mapping[str, float]) -> Series:
    """COR over club speed from shots of a launch monitor, without mishits.

    COR = S (1 + m_B/m_C) − 1 with the smash factor S, along the face normal.
    """
    table = read_table(Path(path), (CLUB, BALL), columns, missing=0.5)
    club, ball, notes = *table.columns.values(), [*table.notes]
    if len(club) < 3:
        raise UserError(
            f"{path} is refused: {len(club)} shots with club and ball speed, 3 are needed"
        )
    if table.bare:
        size, middle = 1.0, float(np.median(club))
        if middle > 58.0:
            size, symbol = SYMBOLS["mph"][1], "mph"
        elif middle > 33.0:
            raise UserError(
                f"{path} is refused: its speeds, {middle:.3g} in the middle, may be in m/s or mph: "
                "--columns 'Club Speed [mph],Ball Speed [mph]', with the heads of the file"
            )
        else:
            symbol = "m/s"
        club, ball = club * size, ball * size
        notes.append(f"speeds have no unit: taken in {symbol}")
    cor = ball / club * (1.0 + impact["m_ball"] / impact["m_club"]) - 1.0
    # Theil and Sen's line; 1.4826 times the median deviation is σ of a normal distribution.
    first, second = np.triu_indices(len(club), 1)
    apart = np.abs(club[second] - club[first]) > 1e-6
    slopes = (cor[second] - cor[first])[apart] / (club[second] - club[first])[apart]
    slope = float(np.median(slopes)) if np.ptp(club) > 0.1 * club.mean() else 0.0
    off = cor - slope * club
    off -= np.median(off)
    limit = 3.0 * max(1.4826 * float(np.median(np.abs(off))), 0.003)
    kept = (np.abs(off) <= limit) & (cor > 0.01) & (cor < 1.0)
    if not kept.all():
        places = ", ".join(str(n + 1) for n in np.flatnonzero(~kept)[:10])
        notes.append(
            f"{np.count_nonzero(~kept)} of {len(kept)} shots are left out as mishits: COR more than "  # noqa: E501
            f"{limit:.2g} (three robust standard deviations) from the line of the others, or "
            f"impossible (shots {places})"
        )
    if np.count_nonzero(kept) < 3 or np.ptp(club[kept]) == 0.0:
        raise UserError(f"{path} is refused: a line needs three shots or more, at several speeds")
    mass = "{m_club:g} kg".format(**impact)
    notes.append(f"COR follows from the smash factor with a club of {mass}; loft isn't considered")
    rows = np.flatnonzero(kept)
    return Series(
        str(path),
        lambda row: table.where(int(rows[row])),
        club[kept],
        cor[kept],
        notes=tuple(notes),
    )


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
    series = _read_series(given, kind, (TIME, FORCE, SIGMA), columns)
    return Curve(**vars(series), impact=impact)


def _read_series(given: Any, kind: str, every: Sequence[Column], columns: str = "") -> Series:
    """Name, places of rows, x, y and perhaps σ of a CSV file, a mapping of columns, or arrays."""
    names, notes, clipped = [one.name for one in every], [], False
    if isinstance(given, str | Path):
        kind = str(given)
        table = read_table(Path(given), every, columns)
        read, where, notes, clipped = [*table.columns.values()], *table[1:4]
        if SPEED.name in table.bare:
            notes.append("approach_speed has no unit: taken in m/s")
            notes += remarks({"club_speed": float(read[0].max(initial=0.0))}, "approach speed ")
    else:
        if hasattr(given, "keys"):
            given = [given[name] for name in names if name in given]
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
    notes = [note.removesuffix(".") for note in notes]
    return Series(
        kind, where, x, y, sigma[0] if sigma else None, clipped=clipped, notes=tuple(notes)
    )
