"""The public functions of `golf_impact`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import prod
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np
from golf_physics.variables import VARIABLES
from numpy.typing import ArrayLike

from golf_impact.arrays.contacts import Contacts, Values
from golf_impact.arrays.impacts import DEFAULTS, MOMENTARY, ScalarImpacts, closed_contacts
from golf_impact.arrays.relative import POWER_LAW
from golf_impact.errors import UserError, unknown_name
from golf_impact.runs import FLAGS, METRICS, PATH, ImpactArrays, Named, number

if TYPE_CHECKING:
    from golf_impact.ball import Ball

_OUTPUTS = tuple(row.name for row in VARIABLES if row.causality == "output")

#: The largest communication step of the FMU, s.
_LONGEST = 1e100

#: The complex step; relative, or absolute (SI) of a variable below `_TINY`, where it would
#: underflow. Its square is far below rounding.
_STEP, _TINY = 1e-30, 1e-200

_NOT_CLOSED = (
    "its contact must be a closed form: underdamped, without a club_force, with a COR that isn't "
    "far below golf's"
)


def balls() -> dict[str, Ball]:
    """The preset balls by name, each with its source; `ball.values` are inputs and parameters.

    Example:
        >>> run_impact(["smash_factor"], **balls()["tour"].values)["smash_factor"] > 1.47
        True
    """
    from golf_impact.ball import BALLS

    return Named(BALLS)


def run_impact(outputs: Iterable[str] = METRICS, **values: float) -> dict[str, float]:
    """Compute an impact, in this process: the numbers of the FMU to the last bit.

    The equations are in fmu_src/README.md.

    Args:
        outputs: the Real outputs to read after it.
        values: inputs and parameters by name (SI units); defaults for the others.

    Returns:
        The outputs by name (SI units). Results of a completed impact are NaN where there is none:
        smash_factor, coefficient_of_restitution, energy_efficiency, contact_time and
        contact_displacement without a separation; without a contact also touch_time and
        time_of_max_force. Momentary outputs, such as velocities, are those at the end of the
        simulated time (1 s or more); with a club_force at separation.

    Raises:
        UserError: the physics rejects a value, or has no variable of a name.

    Example:
        >>> round(run_impact(["ball_velocity"], law=2, k=8e5)["ball_velocity"], 2)
        55.23
    """
    return ScalarImpacts().impact(known_names(outputs), **_numbers(values))


def run_impacts(outputs: Iterable[str] = METRICS, **values: ArrayLike) -> ImpactArrays:
    """Compute many impacts at once.

    Contacts in closed form (underdamped, as in golf) are computed by arrays, millions per second;
    the others one by one. Results differ from those of `run_impact` by rounding.

    Args:
        outputs: Real or Boolean outputs.
        values: inputs and parameters by name (SI units), numbers or arrays that broadcast to one
            shape; defaults for the others.

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
        'b = -9.0 N.s/m is refused: it must be a finite number >= 0'
    """
    outputs, (columns, shape) = known_names(outputs), _columns(values)
    results = ImpactArrays(outputs, prod(shape))
    if not MOMENTARY.intersection(outputs):
        for places, contacts in closed_contacts(columns, prod(shape)):
            results.closed[places] = contacts.closed
            for name, column in results.items():
                column[places] = getattr(contacts, name)
    results.run(ScalarImpacts(), np.flatnonzero(~results.closed), columns)
    return results.reshaped(shape)


def run_trajectory(
    points: int = 301,
    outputs: Iterable[str] = PATH,
    *,
    times: ArrayLike | None = None,
    **values: float,
) -> dict[str, np.ndarray]:
    """Sample an impact over the contact and a tenth of it before and after, or at given instants.

    Args:
        points: number of samples, at least 2, unless times are given.
        outputs: the Real outputs to record.
        times: instants since the start of the run, s, at least 0, of any shape and in any order.
        values: inputs and parameters by name (SI units); defaults for the others.

    Returns:
        `time` (s) and the outputs (SI units) by name, arrays of shape (points,) or that of `times`.

    Raises:
        UserError: the physics rejects a value or a time, or has no variable of a name; with times
            also for mean_force, which is that of a communication step.

    Example:
        >>> run_trajectory(outputs=["force"], times=[1e-4, 3e-4], law=2)["force"].round()
        array([3575., 6556.])
    """
    outputs, values = known_names(outputs), _numbers(values)
    if times is not None:
        return _samples(outputs, times, values)
    if not isinstance(points, Integral) or points < 2:
        why = "it must be a whole number of at least 2"
        raise UserError(f"points = {points!r} is refused: {why}", "points", points, why)
    return ScalarImpacts().trajectory(int(points), outputs, **values)


def _samples(
    outputs: Sequence[str], times: ArrayLike, values: Mapping[str, float]
) -> dict[str, np.ndarray]:
    """See `run_trajectory` with times."""
    instants = np.asarray(_array("times", times))
    accepted = (instants >= 0.0) & (instants <= _LONGEST)
    if not accepted.all():
        given, why = instants[~accepted][0].item(), f"each must be a number of 0 to {_LONGEST:g} s"
        raise UserError(f"times with {given!r} are refused: {why}", "times", given, why)
    if "mean_force" in outputs:
        why = "it is that of a communication step; use points"
        raise UserError(f"mean_force is refused with times: {why}", "mean_force", reason=why)
    runs = ScalarImpacts()
    runs.start(**values)
    rising, places = np.unique(np.append(0.0, instants), return_inverse=True)
    samples = runs.sample(rising, outputs)
    places = places[1:].reshape(instants.shape)
    return Named({"time": instants, **{name: row[places] for name, row in samples.items()}})


def known_names(names: Iterable[str], kind: str = "output") -> tuple[str, ...]:
    """The names, of several variables or a single one.

    UserError: one of them is none of an output, or of an "input or parameter".
    """
    names = tuple(names) if isinstance(names, Iterable) and not isinstance(names, str) else (names,)
    known = _OUTPUTS if kind == "output" else tuple(DEFAULTS)
    for name in names:
        if name not in known:
            raise unknown_name(kind, name, known)
    return names


def _array(name: str, value: Any) -> np.ndarray:
    """A value as an array of floats; UserError if it isn't numeric."""
    try:
        # What is masked is missing: NaN, which is rejected.
        array: Any = np.ma.asarray(value)
        # Objects may be numbers, too: large integers, or those of `decimal`.
        if array.dtype.kind == "O":
            array = array.astype(float)
        return np.asarray(np.ma.filled(array.astype(float, casting="same_kind"), np.nan))
    except (TypeError, ValueError, OverflowError):
        why = "it must be a number or an array of them"
        raise UserError(f"{name} is refused: {why}", name, value, why) from None


def _columns(values: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[int, ...]]:
    """Values as numbers and arrays of shape (cases,), and the shape to which they broadcast."""
    known_names(values, "input or parameter")
    arrays = {name: _array(name, value) for name, value in values.items()}
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items() if array.ndim)
        raise UserError(f"these shapes don't broadcast to one: {shapes}") from None
    return {
        name: np.float64(array.item()) if array.size == 1 else np.broadcast_to(array, shape).ravel()
        for name, array in arrays.items()
    }, shape


def _numbers(values: Mapping[str, Any]) -> dict[str, float]:
    """The values if each is a single number of an input or parameter; otherwise a UserError."""
    known_names(values, "input or parameter")
    return {name: number(name, value) for name, value in values.items()}


class Sensitivities(Named[dict[str, np.ndarray]]):
    """Derivatives by output and variable, arrays of the shape of the cases."""

    refused: np.ndarray  #: whether the physics rejects a case, bool
    reason: str = ""  #: why a derivative is NaN in the first case with one, in C order


def sensitivities(
    outputs: Iterable[str] = METRICS,
    wrt: Iterable[str] = ("k", "b", "club_speed"),
    **values: ArrayLike,
) -> Sensitivities:
    """Partial derivatives of an impact's results, exact to rounding.

    By a complex step (Squire & Trapp, SIAM Rev. 40, 110-112, 1998).

    Args:
        outputs: Real outputs that are results of a contact; not force, compression, mean_force and
            positions, which go on changing after it.
        wrt: inputs and parameters, other than law and club_force.
        values: inputs and parameters by name (SI units), numbers or arrays that broadcast to one
            shape; defaults for the others.

    Returns:
        By output and variable the derivative, an array of that shape, in the output's unit over the
        variable's (SI). NaN where there is none: a case is rejected, or the bodies don't touch; the
        contact isn't in closed form (COR below 0.14, with an exponent below 0.22; under law 1 ζ
        above 0.5, or less where drag moves both bodies; a club_force); over exponent or
        restitution_at_rest where that is at its start value; a contact time with an exponent over a
        damping of 0. Attributes: `refused`, an array of bools of that shape, marks the rejected
        cases; `reason` is why the first case with a NaN (in C order) has it, or empty.

    Raises:
        UserError: there is no variable of a name, or it has no derivatives; a value isn't numeric,
            or shapes don't broadcast.

    Example:
        >>> slopes = sensitivities(["ball_velocity"], wrt=["club_speed", "m_club"], law=2)
        >>> {name: round(slope.item(), 4) for name, slope in slopes["ball_velocity"].items()}
        {'club_speed': 1.5842, 'm_club': 48.1936}
    """
    outputs, wrt = known_names(outputs), known_names(wrt, "input or parameter")
    for name in (*outputs, *wrt):
        if name in (*FLAGS, *MOMENTARY, "law", "club_force"):
            why = (
                "sensitivities are those of a contact's results, not of flags or of values that "
                "change after it, over numbers other than law and club_force"
            )
            raise UserError(f"{name} is refused: {why}", name, reason=why)
    found, (columns, shape) = run_impacts(("touched",), **values), _columns(values)
    slopes = {name: {of: np.full(shape, np.nan) for of in wrt} for name in outputs}
    for places, contacts in closed_contacts(columns, prod(shape)):
        for of in wrt:
            for name, slope in _slopes(contacts, outputs, of).items():
                slopes[name][of].flat[places] = np.where(contacts.closed, slope, np.nan)
    results = Sensitivities(slopes)
    results.refused = found.refused
    missing = {
        (n, of): np.isnan(slope).ravel() for n, row in slopes.items() for of, slope in row.items()
    }
    if np.any([*missing.values()]):
        first = int(np.argmax(np.any([*missing.values()], axis=0)))
        name, of = next(pair for pair, nan in missing.items() if nan[first])
        if found.refused.flat[first]:
            results.reason = found.reason
        elif not found["touched"].flat[first]:
            results.reason = "the bodies don't touch"
        elif not found.closed.flat[first]:
            results.reason = _NOT_CLOSED
        else:
            results.reason = f"{name} has no finite slope over {of} there"
    return results


def _slopes(contacts: Contacts, outputs: Sequence[str], of: str) -> dict[str, Values]:
    """Derivatives by one variable; NaN where there is none."""
    values = {name: getattr(contacts, name) for name in DEFAULTS}
    size = np.abs(values[of])
    step = _STEP * np.where(size < _TINY, 1.0, size)[()]
    stepped = Contacts(contacts.formulas, values | {of: values[of] + 1j * step})
    power_law = contacts.formulas is POWER_LAW
    none: Any = of == "exponent" and not power_law
    if of == "restitution_at_rest":
        none = contacts.restitution_at_rest == 0.0
    slopes = {}
    for name in outputs:
        no_slope = none
        if power_law and name in ("contact_time", "contact_displacement"):
            # Time passes as a power of x: without damping its slope over the damping is infinite.
            no_slope = no_slope | ((contacts.zeta == 0.0) & (np.imag(stepped.zeta) != 0.0))
        slope = np.imag(getattr(stepped, name)) / step
        slopes[name] = np.where(no_slope | ~np.isfinite(slope), np.nan, slope)
    return slopes
