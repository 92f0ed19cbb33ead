"""Many impacts at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError
from golf_impact.facts.quantities import undefined_results
from golf_impact.runs import FLAGS


class Outcome(NamedTuple):
    """Outputs of many impacts; every array has the shape of the cases."""

    #: Outputs by name (SI units), each of them floats, or bools if it is a Boolean. A refused case
    #: and a result that doesn't exist (`undefined_results`) are NaN, or False.
    columns: dict[str, np.ndarray]
    refused: np.ndarray  #: whether the physics rejects a case, bool
    reason: str  #: why it rejects the first of these, in C order; empty if there is none
    scalar: np.ndarray  #: whether a case isn't in closed form: the scalar physics computed it, bool


def impacts(outputs: Sequence[str], values: Mapping[str, Any], shape: tuple[int, ...]) -> Outcome:
    """Compute impacts, each in one communication step, as `golf_impact.run_impact` does.

    Args:
        outputs: names of Real or Boolean outputs.
        values: inputs and parameters by name (SI units), numbers or arrays of floats that broadcast
            to `shape`; defaults for the others.
        shape: that of the cases.

    Raises:
        UserError: there is no output, input or parameter of a name.
    """
    runs = ScalarImpacts()
    values = {name: np.asarray(value, float) for name, value in values.items()}
    columns = {name: np.broadcast_to(value, shape).ravel() for name, value in values.items()}
    number = int(np.prod(shape))
    results = {name: np.full(number, name not in FLAGS and np.nan) for name in outputs}
    refused, reason = np.zeros(number, bool), ""
    steps = np.broadcast_to(runs.horizon(values), shape).ravel()
    reals, names = [name for name in outputs if name not in FLAGS], list(columns)
    for n, (step, *row) in enumerate(zip(steps, *columns.values(), strict=True)):
        try:
            runs.start(**dict(zip(names, row, strict=True)))
            runs.step(0.0, float(step))
            case: dict[str, float] = dict(runs.read(reals))
        except UserError as error:
            refused[n], reason = True, reason or str(error)
            continue
        flags = {name: runs.read_flag(name) for name in FLAGS}
        case |= flags | undefined_results(flags["touched"], flags["separated"])
        for name, column in results.items():
            column[n] = case[name]
    results = {name: column.reshape(shape) for name, column in results.items()}
    return Outcome(results, refused.reshape(shape), reason, np.ones(shape, bool))
