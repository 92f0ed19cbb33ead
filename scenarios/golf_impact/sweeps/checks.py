"""A check of arrays: some cases of a sweep are computed again by the scalar physics."""

import math
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from golf_impact.arrays.impacts import Outcome, one_by_one
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError
from golf_impact.runs import FLAGS
from golf_impact.scales import TOLERANCE, contact_scales
from golf_impact.sweeps.impacts import PHYSICS, Plan
from golf_impact.sweeps.study import Columns, Study

#: One case in so many, and in any study about so many at least.
_ONE_IN, _LEAST = 1000, 10
#: 2⁶⁴ over the golden ratio: its multiples modulo 2⁶⁴ are spread evenly, with no axis' period.
_SPREAD = np.uint64(0x9E3779B97F4A7C15)
#: What scales need.
_LARGEST = ("touched", "max_force", "max_compression", "impulse", "contact_time")


class Deviation(NamedTuple):
    """The output of a case that differs most from the scalar physics."""

    error: float  # without unit, in `Scales`
    name: str
    value: Any
    exact: Any


class Check:
    """One case in a thousand, chosen by its number, and those of least and greatest outputs.

    Attributes:
        number: cases computed again.
        worst: their largest error, without unit, in `Scales`.
    """

    def __init__(self, study: Study, plan: Plan) -> None:
        self.study, self.plan = study, plan
        self.number, self.worst = 0, 0.0
        share = max(1.0 / _ONE_IN, min(1.0, _LEAST / study.cases))
        self._below = np.uint64(share * (2**64 - 2**11))
        #: Outputs times sign, their greatest so far, its case and all outputs of it.
        self._extremes: dict[tuple[str, int], tuple[float, int, list[Any]]] = {}

    def add(self, begin: int, outcome: Outcome) -> None:
        """Check cases from this number on; UserError if one of them differs."""
        index = np.arange(begin, begin + len(outcome.refused))
        chosen = np.flatnonzero(self._chosen(index))
        columns = {name: column[chosen] for name, column in outcome.columns.items()}
        self._compare(index[chosen], columns, outcome.refused[chosen])
        both = (1, np.fmax), (-1, np.fmin)
        for (name, column), (sign, extreme) in product(outcome.columns.items(), both):
            value = sign * extreme.reduce(column)  # of those that aren't NaN
            if name not in FLAGS and value > self._extremes.get((name, sign), (-math.inf,))[0]:
                n = int(np.argmax(sign * column == value))
                row = [column[n] for column in outcome.columns.values()]
                self._extremes[name, sign] = value, begin + n, row

    def finish(self) -> None:
        """Check the extremes of all outputs, but for those of cases that have been checked."""
        found = [item[1:] for item in self._extremes.values()]
        rows = {case: row for case, row in found if not self._chosen(np.array(case))}
        columns = dict(zip(self.plan.outputs, map(np.array, zip(*rows.values()))))
        self._compare(np.array([*rows], int), columns, np.zeros(len(rows), bool))

    def _chosen(self, cases: np.ndarray) -> np.ndarray:
        return cases.astype(np.uint64) * _SPREAD <= self._below

    def _compare(self, cases: np.ndarray, columns: Columns, refused: np.ndarray) -> None:
        given = self.study.columns(cases)
        for n, worst in enumerate(deviations(self.plan.values(given), columns, refused)):
            self.number += 1
            self.worst = max(self.worst, worst.error)
            if worst.error > TOLERANCE:
                case = ", ".join(f"{name} = {column[n]}" for name, column in given.items())
                raise UserError(
                    f"row {cases[n] + 1:,} ({case}): {worst.name} = {worst.value!r} by arrays, "
                    f"{worst.exact!r} by the scalar physics: the error {worst.error:.2g} is above "
                    f"{TOLERANCE:g}. Nothing was written: use --fmu FILE, and report this error"
                )


def deviations(
    values: Mapping[str, Any], columns: Columns, refused: np.ndarray
) -> Iterator[Deviation]:
    """The largest deviation from the scalar physics in each of these cases.

    `columns` are their outputs by name, `values` inputs and parameters as of `arrays.impacts`.
    """
    runs, number = ScalarImpacts(), len(refused)
    given = {name: np.broadcast_to(value, number) for name, value in values.items()}
    exact = one_by_one(runs, tuple({*columns, *_LARGEST}), given, np.arange(number))
    start = {name: np.broadcast_to(v.start or 0.0, number) for name, v in PHYSICS.items()} | given
    for n in range(number):
        if refused[n] or exact.refused[n]:
            both = bool(refused[n]), bool(exact.refused[n])
            yield Deviation(0.0 if all(both) else math.inf, "refused", *both)
            continue
        end = {name: column[n].item() for name, column in exact.columns.items()}
        scales = contact_scales({name: column[n].item() for name, column in start.items()}, end)
        outputs = []
        for name, column in columns.items():
            value = column[n].item()
            missing = math.isnan(value) + math.isnan(end[name])
            if missing:  # by both, or wrongly by one of them
                error = 0.0 if missing == 2 else math.inf
            else:
                error = scales.error(name, value, end[name])
            outputs.append(Deviation(error, name, value, end[name]))
        yield max(outputs)
