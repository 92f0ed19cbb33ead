"""Partial derivatives of an impact's results, by differences."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from golf_impact.api import columns_of, known_names, reason_of, run_impacts
from golf_impact.data.errors import refused
from golf_impact.data.quantities import START
from golf_impact.data.runs import FLAGS, METRICS, MOMENTARY, ImpactArrays, Named, reduced_mass

#: Widths of differences, in units of a variable's scale: the first one, and those that are tried
#: where its error is too large: an output changes faster or hardly at all, or a limit is near.
_WIDTHS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-2)

#: Offsets of the points of a difference, in widths.
_OFFSETS = np.arange(-4, 5)

#: Weights of a derivative in units of 1/width, and of one of lower order, whose difference is the
#: error (Fornberg, Math. Comp. 51, 699-706, 1988).
_CENTRAL = np.array([
    [1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280],
    [0.0, 0.0, 1 / 12, -2 / 3, 0.0, 2 / 3, -1 / 12, 0.0, 0.0],
])  # fmt: skip
_RIGHT = np.array([[-25 / 12, 4.0, -3.0, 4 / 3, -1 / 4], [-11 / 6, 3.0, -3 / 2, 1 / 3, 0.0]])

#: Central differences, and one-sided ones at a limit or beside a kink, by the points of each.
_DIFFERENCES = (
    (slice(0, 9), _CENTRAL), (slice(4, 9), _RIGHT), (slice(0, 5), -_RIGHT[:, ::-1]),
)  # fmt: skip

#: Errors relative to the output's scale over the variable's: small enough; of no derivative.
_SMALL, _NO_SLOPE = 1e-9, 1e-3

#: Rounding of an output, relative to its scale.
_ROUNDING = 1e-15


class Sensitivities(Named[dict[str, np.ndarray]]):
    """Derivatives by output and variable, arrays of the shape of the cases."""

    refused: np.ndarray  #: whether the physics rejects a case, bool
    reason: str = ""  #: why a derivative is NaN in the first case with one, in C order


def sensitivities(
    outputs: Iterable[str] = METRICS,
    wrt: Iterable[str] = ("k", "b", "club_speed"),
    **values: ArrayLike,
) -> Sensitivities:
    """Partial derivatives of an impact's results.

    By central differences of eighth order, or one-sided ones of fourth order where a variable is at
    its limit. Their errors are below 1e-8 of the output's scale over the variable's.

    Args:
        outputs: Real outputs that are results of a contact; not force, compression, mean_force and
            positions, which go on changing after it.
        wrt: inputs and parameters, other than law and club_force.
        values: inputs and parameters by name, in SI units or as text with a unit, single ones or
            arrays that broadcast to one shape; start values for the others.

    Returns:
        By output and variable the derivative, an array of that shape, in the output's unit over the
        variable's (SI). NaN where there is none: a case is rejected, the bodies don't touch, the
        output doesn't exist, or it has no finite slope on either side: over a restitution_at_rest
        of 0, which means that b is used, or a contact time with an exponent over a damping of 0.
        Attributes: `refused`, an array of bools of that shape, marks the rejected cases; `reason`
        is why the first case with a NaN (in C order) has it, or empty.

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
            raise refused(name, None, why, name)
    columns, shape = columns_of(values)
    number = int(np.prod(shape))
    columns = {name: np.broadcast_to(columns.get(name, START[name]), number) for name in START}
    found = run_impacts((*outputs, "touched"), **columns)
    usable = found["touched"] & ~found.refused
    cases = np.flatnonzero(usable)
    found_slopes = [_slopes(outputs, of, columns, found, cases) for of in wrt if outputs]
    slopes = np.array(found_slopes).reshape(len(wrt), len(outputs), number)
    results = Sensitivities(
        (name, {of: slope.reshape(shape) for of, slope in zip(wrt, slopes[:, n])})
        for n, name in enumerate(outputs)
    )
    results.refused = found.refused.reshape(shape)
    missing = np.isnan(slopes)
    if missing.any():
        first = int(missing.any(axis=(0, 1)).argmax())
        of, n = np.argwhere(missing[..., first])[0]
        results.reason = _reason(outputs[n], wrt[of], columns, found, first)
    return results


def _reason(name: str, of: str, columns: Mapping[str, Any], found: ImpactArrays, case: int) -> str:
    """Why a case has no derivative."""
    if found.refused[case]:
        return reason_of(columns, case)
    if not found["touched"][case]:
        return "the bodies don't touch"
    if np.isnan(found[name][case]):
        return f"{name} doesn't exist there: no separation"
    one: dict[str, Any] = {name: column[case : case + 1] for name, column in columns.items()}
    step = _WIDTHS[-2] * _scale(of, one)
    sides = [run_impacts((name,), **one | {of: one[of] + sign * step}) for sign in (1.0, -1.0)]
    refusals = [side.reason for side in sides if side.reason]
    beyond = f" ({refusals[0]})" if len(refusals) == 2 else ""
    return f"{name} has no finite slope over {of} there{beyond}"


def _scale(of: str, v: Mapping[str, Any]) -> Any:
    """The change of a variable over which results change by about themselves."""
    closing = v["club_speed"] - v["ball_speed"]
    if of == "b":
        return np.maximum(v["b"], np.sqrt(v["k"] * reduced_mass(v)))
    if of == "club_speed":
        return np.where(v[of] == 0.0, closing, np.minimum(np.abs(v[of]), 2.0 * closing))
    if of == "ball_speed":
        return closing
    if of == "gap":
        return np.maximum(v["gap"], closing * np.sqrt(reduced_mass(v) / v["k"]))
    if of in ("exponent", "restitution_at_rest"):
        return np.ones_like(closing)
    if of == "restitution_slope":
        return np.maximum(v[of], 1.0 / closing)
    return v[of]


def _slopes(
    outputs: Sequence[str],
    of: str,
    columns: Mapping[str, np.ndarray],
    found: ImpactArrays,
    cases: np.ndarray,
) -> np.ndarray:
    """Derivatives over a variable, of shape (outputs, all cases); NaN but for these cases.

    Of all differences and widths that with the least error: by how much the orders differ, and by
    rounding.
    """
    shape = len(outputs), len(columns[of])
    best, least = np.full(shape, np.nan), np.full(shape, np.inf)
    bound = np.full(shape, np.inf)
    for width in _WIDTHS:
        some: dict[str, Any] = {name: column[cases] for name, column in columns.items()}
        x, scale = some[of], _scale(of, some)
        # An exact difference.
        step = (x + width * scale) - x
        moved: dict[str, Any] = {n: np.tile(column, len(_OFFSETS)) for n, column in some.items()}
        moved[of] = (x + _OFFSETS[:, None] * step).ravel()
        rows = run_impacts(outputs, **moved)
        f = np.array([rows[name].reshape(len(_OFFSETS), len(cases)) for name in outputs])
        f[:, 4] = [found[name][cases] for name in outputs]
        size = np.nanmax(np.abs(f), axis=1, initial=0.0)
        with np.errstate(all="ignore"):
            bound[:, cases] = size / np.where(x == 0.0, scale, np.abs(x))
            for points, weights in _DIFFERENCES:
                slope, lower = np.tensordot(weights, f[:, points], (1, 1)) / step
                rounding = _ROUNDING * np.abs(weights[0]).sum() * size / step
                error = np.abs(slope - lower) + rounding
                better = error < least[:, cases]
                best[:, cases] = np.where(better, slope, best[:, cases])
                least[:, cases] = np.where(better, error, least[:, cases])
        cases = cases[(least[:, cases] > _SMALL * bound[:, cases]).any(axis=0)]
        if not len(cases):
            break
    none = (least > _NO_SLOPE * bound) & (least > 1e-2 * np.abs(best))
    return np.where(none, np.nan, best)
