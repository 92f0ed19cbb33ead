"""A check of arrays: some cases of a sweep are computed again by the scalar physics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from golf_impact.arrays.impacts import Outcome
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError
from golf_impact.facts.scales import TOLERANCE, Scales
from golf_impact.runs import FLAGS
from golf_impact.sweeps.impacts import Plan, read_impact
from golf_impact.sweeps.study import Study

#: One case in so many, and in any study about so many at least.
_ONE_IN, _LEAST = 1000, 10
#: 2⁶⁴ over the golden ratio: its multiples modulo 2⁶⁴ are spread evenly, with no axis' period.
_SPREAD = np.uint64(0x9E3779B97F4A7C15)
_LARGEST = ("touched", "max_force", "max_compression", "impulse", "contact_time")


class Check:
    """One case in a thousand, chosen by its number, and those of least and greatest outputs.

    Attributes:
        number: cases computed again.
        worst: their largest error, without unit, in `Scales`.
    """

    def __init__(self, study: Study, plan: Plan) -> None:
        self.study, self.plan = study, plan
        self.number, self.worst = 0, 0.0
        self._runs = ScalarImpacts()
        self._below = np.uint64(min(1.0, max(1 / _ONE_IN, _LEAST / study.cases)) * (2**64 - 2**11))
        #: Signed outputs, the greatest so far, and their cases by output and sign.
        self._extremes: dict[tuple[str, int], tuple[float, int, dict[str, Any] | None]] = {}

    def add(self, begin: int, outcome: Outcome) -> None:
        """Check cases from this number on; UserError if one of them differs."""
        index = np.arange(begin, begin + len(outcome.refused))
        chosen = np.flatnonzero(index.astype(np.uint64) * _SPREAD <= self._below)
        self._compare({begin + n: _row(outcome, n) for n in chosen.tolist()})
        for name, column in outcome.columns.items():
            if name in FLAGS or np.isnan(column).all():
                continue
            for sign, n in ((1, np.nanargmax(column)), (-1, np.nanargmin(column))):
                value = sign * column[n].item()
                if value > self._extremes.get((name, sign), (-math.inf,))[0]:
                    self._extremes[name, sign] = value, begin + int(n), _row(outcome, int(n))

    def finish(self) -> None:
        """Check the extremes of all outputs."""
        self._compare({case: row for _, case, row in self._extremes.values()})

    def _compare(self, rows: Mapping[int, dict[str, Any] | None]) -> None:
        columns = self.study.columns(np.array([*rows], int))
        values = self.plan.values(columns)
        for n, (case, row) in enumerate(rows.items()):
            of_case = {name: v if np.ndim(v) == 0 else v[n].item() for name, v in values.items()}
            error, name, exact = deviation(self._runs, of_case, row)
            self.number += 1
            self.worst = max(self.worst, error)
            if error > TOLERANCE:
                given = ", ".join(f"{name} = {column[n]}" for name, column in columns.items())
                ours = "refused" if row is None else repr(row[name])
                raise UserError(
                    f"row {case + 1:,} ({given}): {name} is {ours} by arrays, and {exact} by the "
                    f"scalar physics: error {error:.2g}, at most {TOLERANCE:g} is allowed; nothing "
                    "was written. Use --fmu FILE, and report this error"
                )


def _row(outcome: Outcome, n: int) -> dict[str, Any] | None:
    """The outputs of a case, None if it is refused."""
    if outcome.refused[n]:
        return None
    return {name: column[n].item() for name, column in outcome.columns.items()}


def deviation(
    runs: ScalarImpacts, values: Mapping[str, float], row: Mapping[str, Any] | None
) -> tuple[float, str, str]:
    """The largest error of an impact's outputs (None if it was refused) in `Scales`.

    Returns it, the output's name, and its value by the scalar physics in words.
    """
    outputs = tuple(row or ())
    try:
        exact = read_impact(runs, (*outputs, *_LARGEST), values)
    except UserError as why:
        return (0.0 if row is None else math.inf), next(iter(outputs), ""), f"refused ({why})"
    if row is None:
        return math.inf, "the case", "accepted"
    errors = {}
    for name, value in row.items():
        if value == exact[name] or (math.isnan(value) and math.isnan(exact[name])):
            errors[name] = 0.0
        elif exact["touched"]:
            errors[name] = _scales(runs, values, exact).error(name, value, exact[name])
        else:
            # Without a contact there are no scales of one.
            errors[name] = abs(value - exact[name]) / (abs(exact[name]) or 5e-324)
    worst = max(errors, key=lambda name: math.inf if math.isnan(errors[name]) else errors[name])
    error = errors[worst]
    return (math.inf if math.isnan(error) else error), worst, repr(exact[worst])


def _scales(runs: ScalarImpacts, values: Mapping[str, float], exact: Mapping[str, float]) -> Scales:
    """Those of an impact with a contact."""
    names = (
        "m_club", "m_ball", "club_speed", "ball_speed", "gap", "k", "b", "exponent",
        "reference_compression",
    )  # fmt: skip
    start = {name: values.get(name, runs.default(name)) for name in names}
    mu = 1.0 / (1.0 / start["m_club"] + 1.0 / start["m_ball"])
    closing, span = start["club_speed"] - start["ball_speed"], runs.horizon(values).item()
    n = start["exponent"]
    stiffening = n * (exact["max_compression"] / start["reference_compression"]) ** (n - 1.0)
    fastest = max(math.sqrt(start["k"] * max(1.0, stiffening) / mu), start["b"] / mu)
    time = exact["contact_time"]
    largest = {**exact, "contact_time": span if math.isnan(time) else time}
    return Scales(start, largest, start["gap"] / closing, span, fastest)
