"""The public functions of `golf_impact`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from golf_physics.variables import BY_NAME
from numpy.typing import ArrayLike

from golf_impact import engine
from golf_impact.data.errors import UnavailableError, UserError, refused, unknown_name
from golf_impact.data.quantities import START, undefined_results
from golf_impact.data.runs import FLAGS, METRICS, PATH, ImpactArrays, Named, instants_of
from golf_impact.data.units import number

if TYPE_CHECKING:
    from golf_impact.data.balls import Ball

_OUTPUTS = tuple(row.name for row in BY_NAME.values() if row.causality == "output")
_REALS = tuple(name for name in _OUTPUTS if name not in FLAGS)

#: The latest instant of a trajectory, s.
_LATEST = 1e100


def balls() -> dict[str, Ball]:
    """The preset balls by name, each with its source; `ball.values` are inputs and parameters.

    Example:
        >>> run_impact(["smash_factor"], **balls()["tour"].values)["smash_factor"] > 1.47
        True
    """
    from golf_impact.data.balls import BALLS

    return Named(BALLS)


def run_impact(outputs: Iterable[str] = METRICS, **values: float | str) -> dict[str, float]:
    """Compute an impact, without an FMU: the FMU's numbers within 1e-13 of their scales.

    The equations are in fmu_src/README.md.

    Args:
        outputs: the Real outputs to read after it; no others are computed.
        values: inputs and parameters by name, in SI units or as text with a unit ("800 N/mm");
            start values for the others.

    Returns:
        The outputs by name (SI units). Results of a completed impact are NaN where there is none:
        smash_factor, coefficient_of_restitution, energy_efficiency, contact_time and
        contact_displacement without a separation; without a contact also touch_time and
        time_of_max_force. Momentary outputs, such as velocities, are those at the end of the
        simulated time (1 s or more); with a club_force at separation.

    Raises:
        UserError: the physics rejects a value, or has no variable of a name.

    Example:
        >>> round(run_impact(["ball_velocity"], law=2, k="800 N/mm")["ball_velocity"], 2)
        55.23
    """
    outputs, numbers = known_names(outputs, "Real output"), _numbers(values)
    found, (end,) = engine.run_rows(outputs, numbers, 1, threads=1)
    if end == engine.REFUSED:
        engine.check_impact(numbers)
    results: Named[float] = Named(zip(outputs, found[:, 0].tolist()))
    undefined = _undefined(end)
    results.update((name, undefined[name]) for name in undefined.keys() & results.keys())
    return results


def run_impact_anywhere(**values: Any) -> Mapping[str, float]:
    """As `run_impact`; through the FMU where the engine can't be used."""
    try:
        return run_impact(**values)
    except UnavailableError:
        from golf_impact.fmu import Impact

        with Impact() as impact:
            return impact(**values)


def run_impacts(
    outputs: Iterable[str] = METRICS, *, threads: int | None = None, **values: ArrayLike
) -> ImpactArrays:
    """Compute many impacts at once, by the same code as `run_impact`.

    Args:
        outputs: the Real or Boolean outputs to read; no others are computed.
        threads: the most processors to use; by default the environment variable
            GOLF_IMPACT_THREADS, or all. Results have the same bits for any number.
        values: inputs and parameters by name, in SI units or as text with a unit, single ones or
            arrays that broadcast to one shape; start values for the others.

    Returns:
        The outputs by name (SI units): arrays of that shape, of floats, or of bools for Booleans.
        They are NaN, or False, where a case is rejected; and NaN where a result doesn't exist, as
        in `run_impact`. Attributes: `refused`, an array of bools of that shape, marks the rejected
        cases; `reason` is why the first of these (in C order) is, or empty. `run_impact` with the
        values of any other raises a UserError that says why.

    Raises:
        UserError: there is no variable of a name, a value isn't numeric, or shapes don't broadcast.

    Example:
        >>> impacts = run_impacts(["smash_factor"], law=2, k=[1e6, 5e5], b=[[9.0], [-9.0]])
        >>> impacts["smash_factor"].round(4)
        array([[1.5842, 1.5623],
               [   nan,    nan]])
        >>> impacts.refused
        array([[False, False],
               [ True,  True]])
        >>> impacts.reason
        'b = -9 N.s/m is refused: it must be between 0 and 1e+09'
    """
    outputs, (columns, shape) = known_names(outputs), columns_of(values)
    found, ends = engine.run_rows(outputs, columns, prod(shape), threads)
    for end in (engine.NOT_TOUCHED, engine.TOUCHED):
        undefined = [name in _undefined(end) for name in outputs]
        found[np.ix_(undefined, ends == end)] = np.nan
    refused = ends == engine.REFUSED
    results = {
        name: ((column == 1.0) if name in FLAGS else column).reshape(shape)
        for name, column in zip(outputs, found)
    }
    reason = reason_of(columns, int(refused.argmax())) if refused.any() else ""
    return ImpactArrays(results, refused.reshape(shape), reason)


def reason_of(columns: Mapping[str, Any], case: int) -> str:
    """Why a case of these columns is refused."""
    values = {
        name: float(value[case] if np.ndim(value) else value) for name, value in columns.items()
    }
    try:
        engine.check_impact(values)
    except UserError as error:
        return str(error)
    return ""


def _undefined(end: int) -> Mapping[str, float]:
    """The outputs without a value where a row ends so."""
    return undefined_results(end >= engine.TOUCHED, end in (engine.SEPARATED, engine.REFUSED))


def run_trajectory(
    points: int = 301,
    outputs: Iterable[str] = PATH,
    *,
    times: ArrayLike | None = None,
    **values: float | str,
) -> dict[str, np.ndarray]:
    """Sample an impact over the contact and a tenth of it before and after, or at given instants.

    Args:
        points: number of samples, at least 2, unless times are given.
        outputs: the Real outputs to record.
        times: instants since the start of the run, s or text with a unit, at least 0, of any shape
            and in any order.
        values: inputs and parameters by name, as of `run_impact`.

    Returns:
        `time` (s) and the outputs (SI units) by name, arrays of shape (points,) or that of `times`.

    Raises:
        UserError: the physics rejects a value or a time, or has no variable of a name; with times
            also for mean_force, which is that of a communication step.

    Example:
        >>> run_trajectory(outputs=["force"], times=[1e-4, 3e-4], law=2)["force"].round()
        array([3575., 6556.])
    """
    outputs, numbers = known_names(outputs, "Real output"), _numbers(values)
    if times is None:
        touch, contact = run_impact(("touch_time", "contact_time"), **numbers).values()
        instants = instants_of(numbers, touch, contact, points)
    else:
        instants = np.asarray(_array("times", times, "s"))
        accepted = (instants >= 0.0) & (instants <= _LATEST)
        if not accepted.all():
            given = instants[~accepted][0].item()
            why = f"each must be a number of 0 to {_LATEST:g} s"
            raise refused("times", given, why)
        if "mean_force" in outputs:
            why = "it is that of a communication step; use points"
            raise refused("mean_force", None, why, "mean_force with times")
    rising, places = np.unique(instants, return_inverse=True)
    samples = engine.run_instants(outputs, numbers, rising)[:, places.ravel()]
    paths = {name: row.reshape(instants.shape) for name, row in zip(outputs, samples)}
    return Named({"time": instants, **paths})


def known_names(names: Iterable[str], kind: str = "output") -> tuple[str, ...]:
    """The names, of several variables or a single one, each once.

    UserError: one of them is none of an "output", a "Real output" or an "input or parameter".
    """
    names = tuple(names) if isinstance(names, Iterable) and not isinstance(names, str) else (names,)
    known = {"output": _OUTPUTS, "Real output": _REALS}.get(kind, tuple(START))
    for name in names:
        if name not in known:
            also = "; those of a ball: **golf_impact.balls()[NAME].values" if name == "ball" else ""
            raise unknown_name(kind, name, known, also)
    return tuple(dict.fromkeys(names))


def _array(name: str, value: Any, unit: str | None = None) -> Any:
    """A value as an array of floats (SI units); UserError if it isn't numeric.

    `unit` is the SI unit, by default that of the variable.
    """
    try:
        # What is masked is missing: NaN, which is rejected.
        array: Any = np.ma.asarray(value)
        # Text, or objects that may be numbers: large integers, or those of `decimal`.
        if array.dtype.kind in "OU":
            return np.vectorize(lambda one: number(name, one, unit), otypes=[float])(
                np.asarray(value, object)
            )
        return np.asarray(np.ma.filled(array.astype(float, casting="same_kind"), np.nan))
    except (TypeError, ValueError, OverflowError):
        why = "it must be a number or an array of them"
        raise refused(name, value, why, name) from None


def columns_of(values: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[int, ...]]:
    """Values as numbers and arrays of shape (cases,), and the shape to which they broadcast."""
    known_names(values, "input or parameter")
    arrays = {name: _array(name, value) for name, value in values.items()}
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items() if array.ndim)
        raise UserError(f"these shapes don't broadcast to one: {shapes}") from None
    return {
        name: array.item() if array.size == 1 else np.broadcast_to(array, shape).ravel()
        for name, array in arrays.items()
    }, shape


def _numbers(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values (SI units) if each is a single one of an input or parameter; else a UserError."""
    known_names(values, "input or parameter")
    return {name: number(name, value) for name, value in values.items()}
