"""A measured force pulse: its noise, rows in contact and impulse, and whether it is one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from golf_impact.errors import UserError

if TYPE_CHECKING:
    from golf_impact.calibration.measurements import Series

#: A force that lasts longer than this (s) isn't in seconds; a peak below this multiple of the
#: curve's noise is noise.
_LONGEST_CONTACT, _ABOVE_NOISE = 0.02, 6.0

#: Impulse over μ v, which is 1 + COR; beyond these the club's speed is another one, or the unit.
_IMPOSSIBLE = (0.5, 3.0)


def noise(force: np.ndarray) -> float:
    """The standard deviation of a curve's noise, N, from its third differences; robust."""
    if len(force) < 8:
        return 0.0
    # The median of half-normal values; √20 is the norm of the coefficients (1, -3, 3, -1).
    return float(np.median(np.abs(np.diff(force, 3)))) / (0.6745 * math.sqrt(20.0))


def contact_rows(force: np.ndarray) -> np.ndarray:
    """Rows around the peak with a force above a tenth of it, and above three times the noise."""
    peak = int(force.argmax())
    below = np.flatnonzero(force < max(0.1 * force[peak], 3.0 * noise(force)))
    before, after = below[below < peak], below[below > peak]
    return np.arange(
        int(before[-1]) + 1 if before.size else 0, int(after[0]) if after.size else len(force)
    )


def impulse_ratio(curve: Series, momentum: float) -> float:
    """The impulse in contact over μ v (kg·m/s): 1 + COR, where momentum is conserved."""
    rows = contact_rows(curve.y)
    rows = np.arange(max(rows[0] - 1, 0), min(rows[-1] + 2, len(curve.y)))
    return float(np.trapezoid(curve.y[rows], curve.x[rows])) / momentum


def check_curve(curve: Series, momentum: float) -> None:
    """Raise UserError for a curve that is no contact force in s and N over the whole contact.

    `momentum` is reduced mass times club speed, kg·m/s.
    """
    time, force = curve.x, curve.y
    if (backward := np.flatnonzero(np.diff(time) <= 0.0)).size:
        n = int(backward[0]) + 1
        raise UserError(
            f"{curve.rows[n]}: time = {time[n]:g} s isn't after {time[n - 1]:g} s; sort the rows "
            "by time and remove duplicates"
        )
    peak = int(force.argmax())
    where, newton = f"{curve.rows[peak]}: the largest force", f"{force[peak]:.4g}"
    if force[peak] <= max(_ABOVE_NOISE * noise(force), -force.min()):
        raise UserError(
            f"{where} is {newton} N, no more than the rest: there is no touch in this curve (the "
            "force on the ball counts as positive)"
        )
    for n, what in ((0, "begins"), (len(force) - 1, "ends")):
        if force[n] > 0.5 * force[peak]:
            raise UserError(
                f"{curve.rows[n]}: the record {what} at {force[n]:.4g} N, more than half of the "
                "largest force: it must begin before touch and end after separation"
            )
    rows = contact_rows(force)
    if (lasting := float(np.ptp(time[rows]))) > _LONGEST_CONTACT:
        raise UserError(
            f"{where} belongs to a contact of about {lasting:.3g} s, where an impact lasts about "
            "600e-6: time must be in s, not ms or µs"
        )
    if len(rows) < 5:
        raise UserError(f"{where} is one of only {len(rows)} rows in contact: 5 are needed")
    if not _IMPOSSIBLE[0] < (ratio := impulse_ratio(curve, momentum)) < _IMPOSSIBLE[1]:
        raise UserError(
            f"{where} is {newton}, and the impulse {ratio:.2g} of reduced mass times club speed, "
            "where 1 to 2 is possible: force must be in N, not kN, and --club-speed in m/s"
        )
