"""Many impacts at once: by arrays where a contact is a closed form, else by the scalar physics."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from math import isnan, nan, prod
from typing import Any, NamedTuple

import numpy as np
from golf_physics.variables import VARIABLES

from golf_impact.arrays.absolute import ABSOLUTE
from golf_impact.arrays.contacts import Contacts
from golf_impact.arrays.elementwise import LANES
from golf_impact.arrays.power_law import POWER_LAW
from golf_impact.arrays.relative import RELATIVE
from golf_impact.arrays.scalar import ScalarImpacts
from golf_impact.errors import UserError, unknown_name
from golf_impact.quantities import undefined_results
from golf_impact.runs import FLAGS, ImpactRuns, Named

#: Cases at a time, so that arrays stay in a processor's cache; a multiple of `LANES`.
BLOCK = 4096

#: Values for which arrays are used: far inside all that the physics accepts, so that it alone
#: states why it rejects others. So are approach and club speed (m/s) and touch time (s).
_RANGES = {
    "k": (1.0, 1e12), "b": (0.0, 1e6), "club_speed": (-1e4, 1e4), "ball_speed": (-1e4, 1e4),
    "m_club": (1e-4, 1e4), "m_ball": (1e-4, 1e4), "ball_diameter": (1e-6, 1e6), "gap": (0.0, 1e3),
    "exponent": (1.0, 12.0), "reference_compression": (1e-6, 10.0),
    "restitution_at_rest": (0.0, 1.0), "restitution_slope": (0.0, 1e6), "club_force": (0.0, 0.0),
}  # fmt: skip
_LEAST_SPEED, _LATEST_TOUCH = 1e-3, 10.0

#: Outputs that depend on the size of the communication step.
MOMENTARY = ("club_position", "ball_position", "compression", "mean_force")

#: Inputs and parameters: numbers, or arrays of shape (cases,).
Columns = dict[str, Any]

DEFAULTS: Columns = {
    row.name: np.float64(row.start) for row in VARIABLES if row.causality in ("input", "parameter")
}
_OUTPUTS = tuple(row.name for row in VARIABLES if row.causality == "output")


class Outcome(NamedTuple):
    """Outputs of many impacts; every array has the shape of the cases."""

    #: Outputs by name (SI units), each of them floats, or bools if it is a Boolean. A refused case
    #: and a result that doesn't exist (`undefined_results`) are NaN, or False.
    columns: dict[str, np.ndarray]
    refused: np.ndarray  #: whether the physics rejects a case, bool
    reason: str  #: why it rejects the first of these, in C order; empty if there is none
    scalar: np.ndarray  #: whether a case isn't in closed form: the scalar physics computed it, bool


class ImpactArrays(Named[np.ndarray]):
    """Outputs of many impacts by name; `refused` and `reason` are those of an `Outcome`."""

    refused: np.ndarray
    reason: str


@np.errstate(all="ignore")
def impacts(outputs: Sequence[str], values: Mapping[str, Any], shape: tuple[int, ...]) -> Outcome:
    """Compute impacts, each in one communication step, as `golf_impact.run_impact` does.

    Each result depends on the values of its case alone, to the last bit.

    Args:
        outputs: names of Real or Boolean outputs.
        values: inputs and parameters by name (SI units), numbers or arrays of floats that broadcast
            to `shape`; defaults for the others.
        shape: that of the cases.

    Raises:
        UserError: there is no output, input or parameter of a name.
    """
    check_names(outputs, values)
    columns, number = columns_of(values, shape), prod(shape)
    results = _empty(outputs, number)
    scalar, refused = np.ones(number, bool), np.zeros(number, bool)
    for places, contacts in closed_contacts(columns, number, set(MOMENTARY).intersection(outputs)):
        count = len(scalar[places])
        for name, column in results.items():
            column[places] = first(getattr(contacts, name), count)
        scalar[places] = ~first(contacts.closed, count)
    reason, others = "", np.flatnonzero(scalar)
    if len(others):
        given = {name: columns[name] for name in values}
        alone = one_by_one(ScalarImpacts(), outputs, given, others)
        refused[others], reason = alone.refused, alone.reason
        for name, column in results.items():
            column[others] = alone.columns[name]
    shaped = {name: column.reshape(shape) for name, column in results.items()}
    return Outcome(shaped, refused.reshape(shape), reason, scalar.reshape(shape))


def _empty(outputs: Iterable[str], number: int) -> dict[str, np.ndarray]:
    return {name: np.empty(number, bool if name in FLAGS else float) for name in outputs}


def check_names(
    outputs: Iterable[str],
    values: Iterable[str],
    of_outputs: Collection[str] = _OUTPUTS,
    settable: Collection[str] = DEFAULTS,
) -> None:
    """Raise a UserError for a name that no output, or no input or parameter has."""
    both = ("output", outputs, of_outputs), ("input or parameter", values, settable)
    for kind, names, known in both:
        for name in names:
            if name not in known:
                raise unknown_name(kind, name, known)


def as_arrays(values: Mapping[str, Any]) -> tuple[dict[str, np.ndarray], tuple[int, ...]]:
    """Values as arrays of floats, and the shape to which they broadcast."""
    arrays = {}
    for name, value in values.items():
        try:
            # What is masked is missing: NaN, which is rejected.
            array: Any = np.ma.asarray(value)
            # Objects may be numbers, too: large integers, or those of `decimal`.
            if array.dtype.kind == "O":
                array = array.astype(float)
            array = array.astype(float, casting="same_kind")
            arrays[name] = np.asarray(np.ma.filled(array, np.nan))
        except (TypeError, ValueError, OverflowError):
            why = "it must be a number or an array of them"
            raise UserError(f"{name} is refused: {why}", name, value, why) from None
    try:
        return arrays, np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items() if array.ndim)
        raise UserError(f"these shapes don't broadcast to one: {shapes}") from None


def columns_of(values: Mapping[str, Any], shape: tuple[int, ...]) -> Columns:
    """All inputs and parameters of these cases."""
    columns = dict(DEFAULTS)
    for name, value in values.items():
        value = np.asarray(value, float)
        same = value.size == 1
        columns[name] = value.reshape(())[()] if same else np.broadcast_to(value, shape).ravel()
    return columns


def closed_contacts(
    columns: Columns, number: int, momentary: object = ()
) -> Iterator[tuple[Any, Contacts]]:
    """Contacts that may be `closed`, and their places: a slice, or an array of indices.

    They have a `horizon` if there are `momentary` outputs.
    """
    for begin in range(0, number, BLOCK):
        part = slice(begin, min(begin + BLOCK, number))
        block = {name: value[part] if np.ndim(value) else value for name, value in columns.items()}
        count, law, linear = part.stop - begin, block["law"], block["exponent"] == 1.0
        ordinary = _ordinary(block)
        for formulas, chosen in (
            (ABSOLUTE, (law == 1.0) & linear & (block["restitution_at_rest"] == 0.0)),
            (RELATIVE, (law == 2.0) & linear),
            (POWER_LAW, (law == 2.0) & np.logical_not(linear)),
        ):
            inside = np.broadcast_to(ordinary & chosen, count)
            found = int(np.count_nonzero(inside))
            if found:
                places = part if found == count else begin + np.flatnonzero(inside)
                values = padded(columns, places, found)
                if momentary:
                    values["horizon"] = ScalarImpacts().horizon(values)
                yield places, Contacts(formulas, values)


def _ordinary(block: Columns) -> Any:
    closing = block["club_speed"] - block["ball_speed"]
    inside: Any = (closing >= _LEAST_SPEED) & (np.abs(block["club_speed"]) >= _LEAST_SPEED)
    inside = inside & (block["gap"] <= _LATEST_TOUCH * closing)
    for name, (low, high) in _RANGES.items():
        inside = inside & (block[name] >= low) & (block[name] <= high)
    return inside


def padded(columns: Columns, places: Any, count: int) -> Columns:
    """The values at so many places, the last one repeated up to a multiple of `LANES`."""
    columns = {name: value[places] if np.ndim(value) else value for name, value in columns.items()}
    if not count % LANES:
        return columns
    repeats = (0, -count % LANES)
    return {
        name: np.pad(value, repeats, "edge") if np.ndim(value) else value
        for name, value in columns.items()
    }


def first(value: Any, count: int) -> Any:
    """A number, or the first elements of an array."""
    return value[:count] if np.ndim(value) else value


def one_by_one(
    runs: ImpactRuns, outputs: Sequence[str], columns: Columns, places: np.ndarray
) -> Outcome:
    """The cases at these places, shape (n,), by the runs of one instance; see `impacts`."""
    number, values, reason = len(places), padded(columns, places, len(places)), ""
    results, refused = _empty(outputs, number), np.zeros(number, bool)
    steps, *rows = (
        np.broadcast_to(first(column, number), number).tolist()
        for column in (runs.horizon(values), *values.values())
    )
    reals = [name for name in results if name not in FLAGS]
    for n, (step, *row) in enumerate(zip(steps, *rows)):
        try:
            runs.run_to_end(step, dict(zip(values, row)))
            found = dict(runs.read(reals))
            if missing := [name for name, value in found.items() if isnan(value)]:
                raise UserError(f"{missing[0]} leaves the range of a double")
        except UserError as error:
            refused[n], reason = True, reason or str(error)
            found = dict.fromkeys(reals, nan) | dict.fromkeys(FLAGS, False)
        else:
            flags = {name: runs.read_flag(name) for name in FLAGS}
            found |= flags | undefined_results(flags["touched"], flags["separated"])
        for name, column in results.items():
            column[n] = found[name]
    return Outcome(results, refused, reason, ~refused)
